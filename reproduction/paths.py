"""Efficiency of the crane along chains of the paper's search from several seeds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.model import find_problem, human_design
from bellcrank.plots import style
from reproduction import published
from reproduction.formatting import count, number, span
from reproduction.pictures.charts import Chart, Level, Series
from reproduction.pictures.sheets import Sheet, draw_sheet
from reproduction.registry import Claim, Figures, Study, register
from reproduction.searching import quantiles, respond, run_chains

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from reproduction.result_store import ResultStore

MARKS = ("0.5", "1.0", "2.0")


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """Number and length of the chains."""

    problem: str = "crane"
    steps: int = 20_000
    chains: int = 30
    seed: int = 0


def run(settings: Settings, store: ResultStore) -> Figures:
    """Run the chains."""
    problem = find_problem(settings.problem)
    search = {"search": "paper", "steps": settings.steps, "seed": settings.seed}
    chains = run_chains(store, "chain", problem, search, settings.chains)
    human = human_design(settings.problem)
    by_hand = respond(human).efficiency if human else None
    ends = [chain["last"] for chain in chains]
    best = [chain["best"] for chain in chains]
    return {
        "problem": settings.problem,
        "chains": settings.chains,
        "steps": settings.steps,
        "human": by_hand,
        "end": quantiles(ends),
        "best": quantiles(best),
        "above_human": sum(value > by_hand for value in best) if by_hand else None,
        "accepted": quantiles([chain["accepted"] / chain["steps"] for chain in chains]),
        "reached": {mark: reached([chain["reached"][mark] for chain in chains]) for mark in MARKS},
        "seconds_per_proposal": float(np.median([c["seconds"] / c["steps"] for c in chains])),
        "ends": sorted(ends),
        "paths": [chain["path"] for chain in chains],
    }


def reached(steps: Sequence[int | None]) -> dict[str, float | int | None]:
    """Return the number of chains that reach a value, and their median number of proposals."""
    there = [step for step in steps if step is not None]
    return {"chains": len(there), "proposals": float(np.median(there)) if there else None}


def draw(figures: Mapping[str, Any], path: Path) -> None:
    """Draw the efficiency along the chains, and the distribution of the final values."""
    order = np.argsort([each["efficiency"][-1] for each in figures["paths"]])
    total = len(order)
    series = []
    for index, k in enumerate(order):
        best = index == total - 1
        series.append(
            Series(
                np.array(figures["paths"][k]["accepted"], dtype=float),
                np.array(figures["paths"][k]["efficiency"], dtype=float),
                colour=style.BEST if best else _grey(index / max(total - 1, 1)),
                width=1.7 if best else 0.8,
                level=3.0 if best else 2.0,
                name="largest final value" if best else "other seeds" * (index == 0),
            )
        )
    levels = [Level(figures["human"], "human design")] if figures["human"] else []
    levels.append(Level(published.ANNEALING, "end of annealing", style.IDLE, vertical=True))
    ends = np.array(figures["ends"])
    top = float(np.ceil(2.0 * max(ends.max(), figures["best"]["largest"])) / 2.0)
    spread = Series(np.linspace(0.0, top, 15), ends, kind="histogram", name="final values")
    charts = [
        Chart(
            "Efficiency along the chains", "accepted changes", "efficiency", series, levels,
            log_x=True, legend="upper left",
        ),
        Chart(
            "Distribution of the final values", "final efficiency", "chains, %", [spread],
            [Level(figures["end"]["median"], f"median {figures['end']['median']:.2f}",
                   style.BUILT, vertical=True)],
            legend="upper left",
        ),
    ]  # fmt: skip
    sheet = Sheet(
        title=f"{figures['problem']}: efficiency along {figures['chains']} chains",
        note=f"{count(figures['steps'], 'proposal')} each of the paper's search; discrete model",
        charts=charts,
        height=3.3,
    )
    draw_sheet(sheet, path, overwrite=True)


def _grey(fraction: float) -> str:
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    return to_hex(colormaps["bone"](0.42 + 0.4 * (1.0 - fraction)))


def claims(figures: Mapping[str, Any]) -> list[Claim]:
    """Compare with the paper."""
    one = figures["reached"]["1.0"]
    rows = [
        Claim(
            "temperature, linear in the accepted steps",
            f"{published.HOT:g} to {published.COLD:g} over {published.ANNEALING} steps",
            "the same values",
            "`--search paper`",
        ),
        Claim(
            "final efficiency of chains from several seeds",
            "",
            f"{span(figures['end']['least'], figures['end']['largest'])}, median "
            f"{number(figures['end']['median'])}, of {count(figures['chains'], 'chain')} after "
            f"{count(figures['steps'], 'proposal')}",
            "discrete model, before the removal of unloaded beams",
        ),
        Claim(
            "proposals until efficiency 1",
            "",
            f"{one['proposals']:.0f} (median of {one['chains']} of "
            f"{count(figures['chains'], 'chain')})" if one["proposals"] else "not reached",
        ),
    ]  # fmt: skip
    if figures["above_human"] is not None:
        rows.append(
            Claim(
                "chains that exceed the human design",
                "",
                f"{figures['above_human']} of {figures['chains']}, human design "
                f"{number(figures['human'])}",
                "our human design, not the paper's",
            )
        )
    return rows


STUDY = register(
    Study(
        name="paths",
        title="Efficiency along the chains of the paper's search",
        after="figure 2",
        full=Settings(),
        quick=Settings(steps=2000, chains=8),
        run=run,
        draw=draw,
        claims=claims,
        runs=lambda figures: (
            f"{count(figures['chains'], 'chain')} of {count(figures['steps'], 'proposal')}"
        ),
        deviations=(
            (
                "Equilibria are computed by Newton's method instead of conjugate gradients. The "
                "responses are the same; all are those reached from rest."
            ),
            "Designs that snap along the stroke are rejected: their efficiency is not unique.",
        ),
    )
)
