"""Rows of the page ``docs/accuracy.md``, from the records that it summarises.

``python -m benchmarks.accuracy`` prints them. A test compares them with the page.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Any

from benchmarks.measure import statistics
from reproduction.frame_benchmarks.study import KINDS

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

DOCS = Path(__file__).parents[1] / "docs"
FRAMES, SHEET = "frames, 8 elements", "sheet"
FILM_ERROR = 0.02
"""Largest relative error of an efficiency from a film that is counted."""
SETS = ("main", "supplement")
"""The two measurements of the lattice."""


def read(name: str) -> Any:
    """Return a record of the documentation."""
    return json.loads((DOCS / f"{name}.json").read_text(encoding="utf-8"))


def percent(value: float, digits: int = 0) -> str:
    """Return a ratio in percent."""
    return f"{100.0 * value:.{digits}f} %"


def pairs(quantity: str) -> list[tuple[float, float]]:
    """Return a quantity of refined parts by frames and in the sheet, for all recorded runs."""
    found = []
    for run in read("tasks/runs")["runs"]:
        for item in run.get("items", ()):
            values = [item["reached"].get(model, {}).get("value") for model in (FRAMES, SHEET)]
            if item["quantity"] == quantity and run["met"] and None not in values:
                found.append((values[0], values[1]))
    return found


def quantile(values: Iterable[float], share: float) -> float:
    """Return the value below which a share of others is."""
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, math.ceil(share * len(ordered)) - 1)]


def rows() -> Iterator[tuple[str, str, str, str]]:
    """Yield what is compared, with what, the result, and the page with its record."""
    yield from _models()
    yield from _parts()
    yield from _measurements()


def _models() -> Iterator[tuple[str, str, str, str]]:
    found = read("studies/benchmarks")["figures"]["benchmarks"].values()
    errors = [
        abs(error)
        for each in found
        for kind in KINDS
        for error in each[kind]["errors"][-1]
        if error is not None
    ]
    yield (
        "Equations of frames, large displacements",
        "exact solutions of published benchmarks, in the plane and in space",
        f"largest difference of {len(errors)} values {percent(max(errors), 2)}",
        "[benchmarks](benchmarks.md)",
    )
    levels = [each for name, each in read("validation/levels").items() if ":" in name]
    nonlinear = [
        abs(
            each["plane, neo-hookean"]["efficiency"] / each["frame, euler-bernoulli"]["efficiency"]
            - 1.0
        )
        for each in levels
    ]
    yield (
        "Frames, efficiency of bundled designs without a specification",
        "finite elements of the printed outline (sheet)",
        (
            f"median difference of {len(nonlinear)} designs {percent(median(nonlinear))}, "
            f"largest {percent(max(nonlinear))}"
        ),
        "[validation](validation.md)",
    )


def _parts() -> Iterator[tuple[str, str, str, str]]:
    gains = [abs(sheet / frames - 1.0) for frames, sheet in pairs("gain")]
    yield (
        "Frames, gain of refined parts",
        "sheet",
        (
            f"median difference of {len(gains)} outputs {percent(median(gains), 1)}, "
            f"nine of ten within {percent(quantile(gains, 0.9))}"
        ),
        "[tasks](tasks.md)",
    )
    off_axis = [abs(sheet - frames) for frames, sheet in pairs("off_axis")]
    yield (
        "Frames, off-axis motion of refined parts",
        "sheet",
        (
            f"median difference of {len(off_axis)} outputs {percent(median(off_axis), 1)} of the "
            f"travel, nine of ten within {percent(quantile(off_axis, 0.9))}"
        ),
        "[tasks](tasks.md)",
    )
    runs = [run for run in read("tasks/runs")["runs"] if ":" not in run["task"]]
    met, both = (
        sum(bool(run["met"]) for run in runs),
        sum(bool(run["met"] and run["met_in_sheet"]) for run in runs),
    )
    yield (
        "Searches with a specification",
        "all items of the bundled tasks in the plane",
        f"{met} of {len(runs)} met by frames, {both} by frames and in the sheet",
        "[tasks](tasks.md)",
    )
    yields = read("tolerance")["runs"]
    drawn = [each["yield"] for name, each in yields.items() if ":" not in name]
    refined = [each["yield"] for name, each in yields.items() if name.endswith(":refined")]
    yield (
        "Random prints that meet all items (yield), not designed for tolerance",
        "200 prints of each part, by frames",
        (
            f"median of {len(drawn)} tasks {percent(median(drawn))}, from {percent(min(drawn))} to "
            f"{percent(max(drawn))}"
        ),
        "[tolerance](tolerance.md)",
    )
    yield (
        "The same, refined for tolerance",
        "200 other prints of each part",
        (
            f"median of {len(refined)} tasks {percent(median(refined))}, from "
            f"{percent(min(refined))} to {percent(max(refined))}"
        ),
        "[tolerance](tolerance.md)",
    )


def _measurements() -> Iterator[tuple[str, str, str, str]]:
    models = read("studies/measured")["figures"]["models"]
    own, bars = models["frame-clamped-linear"], models["bars"]
    outputs = ", ".join(f"{each:+.2f}" for each in own["nominal"]["deviation"])
    yield (
        "Linear frames, output of a triangular lattice",
        "a printed lattice that others measured twice",
        f"{outputs} times the uncertainty",
        "[a measured lattice](measured.md)",
    )
    ratios = [own["nominal"][each]["rms"] / bars["nominal"][each]["rms"] for each in SETS]
    yield (
        "Linear frames, effect of each strut on the output",
        "the same lattice; error over that of hinged bars",
        ", ".join(f"{each:.2f}" for each in ratios),
        "[a measured lattice](measured.md)",
    )
    found = statistics(list(read("benchmarks/measure")["markers"].values()), FILM_ERROR)
    yield (
        "Measurement from films, efficiency",
        "rendered films of known motion",
        (
            f"{percent(found['within'])} of {found['films']} within {percent(FILM_ERROR)}; "
            f"95 % intervals contain the truth in {percent(found['covered'])}"
        ),
        "[measuring a print](measure.md)",
    )


def table() -> Iterator[str]:
    """Yield the rows of the table."""
    for cells in rows():
        yield f"| {' | '.join(cells)} |"


if __name__ == "__main__":
    print("\n".join(table()))
