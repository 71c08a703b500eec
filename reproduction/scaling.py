"""Computing time and efficiency as functions of the lattice size."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.model import find_problem
from bellcrank.plots import style
from bellcrank.search import read_settings
from reproduction import published
from reproduction.formatting import count, number
from reproduction.pictures.charts import Chart, Series
from reproduction.pictures.sheets import Sheet, draw_sheet
from reproduction.registry import Claim, Figures, Study, register
from reproduction.searching import run_chain

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from pathlib import Path

    from reproduction.result_store import ResultStore

MARK = "1.0"


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """Sizes, number of runs, and their length.

    Parameters
    ----------
    sizes
        Sizes N of the bundled problems ``scaling-N``.
    runs
        Number of runs of each size; smaller for the largest lattices.
    proposals_per_beam
        Length of a run divided by the number of designable beams.
    """

    sizes: tuple[int, ...] = (8, 10, 12, 14, 16, 18, 20)
    runs: tuple[int, ...] = (100, 100, 100, 100, 50, 30, 20)
    proposals_per_beam: int = 15
    seed: int = 0


def run(settings: Settings, store: ResultStore) -> Figures:
    """Run and time the chains of each size."""
    rows = []
    for size, runs in zip(settings.sizes, settings.runs, strict=True):
        problem = find_problem(f"scaling-{size}")
        beams = len(problem.designable)
        values = {
            "search": "paper",
            "steps": settings.proposals_per_beam * beams,
            "chains": runs,
            "seed": settings.seed,
        }
        search = read_settings(values)
        work = {str(k): partial(run_chain, problem, search, k) for k in range(runs)}
        chains = list(store.compute_all(f"size-{size}", work).values())
        rows.append({"size": size, "beams": beams, "runs": runs, **_summary(chains)})
    return {
        "runs": list(settings.runs),
        "proposals_per_beam": settings.proposals_per_beam,
        "sizes": rows,
        "exponents": exponents(rows),
    }


def _summary(chains: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    seconds = np.array([chain["seconds"] for chain in chains])
    steps = np.array([chain["steps"] for chain in chains])
    best = np.array([chain["best"] for chain in chains])
    reached = [
        chain["seconds"] * chain["reached"][MARK] / chain["steps"]
        for chain in chains
        if chain["reached"][MARK] is not None
    ]
    return {
        "steps": int(steps[0]),
        "seconds": np.quantile(seconds, [0.1, 0.5, 0.9]).tolist(),
        "best": np.quantile(best, [0.1, 0.5, 0.9]).tolist(),
        "per_proposal": float(np.median(seconds / steps)),
        "reached": len(reached),
        "seconds_to_one": float(np.median(reached)) if reached else None,
    }


MEASURES: dict[str, tuple[str, Callable[[Mapping[str, Any]], float | None]]] = {
    "run": ("run", lambda row: row["seconds"][1]),
    "proposal": ("proposal", lambda row: row["per_proposal"]),
    "to_one": ("to efficiency 1", lambda row: row["seconds_to_one"]),
}


def exponents(rows: Sequence[Mapping[str, Any]]) -> dict[str, float | None]:
    """Return the exponents of times as powers of the number of designable beams."""
    return {name: slope(rows, of) for name, (_, of) in MEASURES.items()}


def slope(
    rows: Sequence[Mapping[str, Any]], of: Callable[[Mapping[str, Any]], float | None]
) -> float | None:
    """Return the slope of the least-squares line through the logarithms."""
    points = [(row["beams"], value) for row in rows if (value := of(row)) is not None and value > 0]
    if len(points) < 2:
        return None
    x, y = np.log(np.array(points)).T
    return float(np.polyfit(x, y, 1)[0])


def draw(figures: Mapping[str, Any], path: Path) -> None:
    """Draw times and efficiencies against the number of designable beams."""
    rows = figures["sizes"]
    beams = np.array([row["beams"] for row in rows], dtype=float)
    series = []
    colours = (style.BEST, style.BUILT, style.WANTED)
    for (name, (what, of)), colour in zip(MEASURES.items(), colours, strict=True):
        values = np.array([np.nan if of(row) is None else of(row) for row in rows], dtype=float)
        power = figures["exponents"][name]
        if power is not None:
            label = f"{what}: exponent {power:.2f}"
            series.append(Series(beams, values, name=label, kind="both", colour=colour))
    runs = np.array([row["seconds"][1] for row in rows])
    reference = runs[0] * (beams / beams[0]) ** published.EXPONENT
    series.append(
        Series(
            beams, reference, name=f"the paper: exponent {published.EXPONENT:g}",
            colour=style.IDLE, dashed=True, level=1.5,
        )
    )  # fmt: skip
    low, middle, high = np.array([row["best"] for row in rows]).T
    best = Series(
        beams, middle, name="median, 10 % to 90 %", kind="both", low=low, high=high,
        colour=style.BEST,
    )  # fmt: skip
    charts = [
        Chart(
            "Processor time, one core", "designable beams", "seconds", series,
            log_x=True, log_y=True, legend="upper left",
            limits_y=(None, 100.0 * float(np.nanmax(runs))),
        ),
        Chart(
            "Best efficiency of a run", "designable beams", "best efficiency", [best],
            log_x=True, legend="lower right", limits_y=(0.0, None),
        ),
    ]  # fmt: skip
    sheet = Sheet(
        title="Computing time and efficiency of larger lattices",
        note=f"{_run_count(figures['runs'])} of the paper's search, "
        f"{figures['proposals_per_beam']} proposals per designable beam; discrete model",
        charts=charts,
        height=3.6,
    )
    draw_sheet(sheet, path, overwrite=True)


def _run_count(runs: Sequence[int]) -> str:
    """Return the number of runs of each size as text.

    Examples
    --------
    >>> _run_count([2, 2]), _run_count([100, 100, 30])
    ('2 runs of each size', '100 to 30 runs of each size')
    """
    most, fewest = max(runs), min(runs)
    return f"{count(most, 'run') if most == fewest else f'{most} to {fewest} runs'} of each size"


def claims(figures: Mapping[str, Any]) -> list[Claim]:
    """Compare with the paper."""
    powers, rows = figures["exponents"], figures["sizes"]
    first, last = rows[0], rows[-1]
    return [
        Claim(
            "exponent of the computing time as a power of the number of beams",
            number(published.EXPONENT),
            f"{number(powers['run'])}; per proposal {number(powers['proposal'])}, to "
            f"efficiency 1 {number(powers['to_one'])}",
            f"{first['beams']} to {last['beams']} designable beams; the "
            "definition of the paper's time is not known",
        ),
        Claim(
            "best efficiency of a run",
            "",
            f"median {number(first['best'][1])} with {first['beams']} designable beams, "
            f"{number(last['best'][1])} with {last['beams']}",
            f"{figures['proposals_per_beam']} proposals per beam",
        ),
    ]


STUDY = register(
    Study(
        name="scaling",
        title="Computing time and efficiency against the number of beams",
        after="scaling with size",
        full=Settings(),
        quick=Settings(sizes=(8, 10, 12), runs=(2, 2, 2), proposals_per_beam=6),
        run=run,
        draw=draw,
        claims=claims,
        runs=lambda figures: (
            f"{_run_count(figures['runs'])} (of {count(len(figures['sizes']), 'size')})"
        ),
        deviations=(
            ("The paper averages over 100 runs of each size; the largest sizes have fewer here."),
            "The length of a run is proportional to the number of designable beams.",
        ),
    )
)
