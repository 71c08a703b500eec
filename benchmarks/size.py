"""Speed of a search as a function of the size of the lattice: ``python -m benchmarks.size``.

The default search runs on the problems ``scaling`` (`bellcrank.model.builtin.scaling`) of several
sizes, with springs, with springs and single flips (``largest_batch=1``), and with frames, each in
a process of its own. The first hundred designs are left out. Designs a second, the processor time
of a design, the memory of the process and the best efficiency at the end are added to
``docs/size.json``; the figure is ``docs/images/size.png``. The exponent is the slope of a straight
line through the logarithms of time and number of beams. ``--only "springs 40"`` makes the runs with
that name.
"""

from __future__ import annotations

import argparse
import resource
import time
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.model.builtin.scaling import scaling
from bellcrank.part import PartSpec, frame_problem
from bellcrank.plots import style
from bellcrank.provenance import provenance
from bellcrank.search import HoppingSettings, advance_chain, make_evaluator, start_chain
from benchmarks.record import add_runs

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

DOCS = Path(__file__).parents[1] / "docs"
RECORD = DOCS / "size.json"
SIZES = {
    "springs": (10, 14, 20, 28, 40, 60),
    "springs, single flips": (20, 40),
    "frames": (10, 14, 20, 28, 40),
}
"""Sizes of the lattices with each model."""
SECONDS = 20.0
"""Processor time of each measurement."""
LEFT_OUT = 100
"""Designs before the measurement begins, rounded up to a block."""


def measure(model: str, size: int, seconds: float) -> dict[str, Any]:
    """Search for a processor time; return what was measured."""
    problem = scaling(size)
    if model == "frames":
        problem = frame_problem(problem, PartSpec())
    batch = 1 if model.endswith("single flips") else None
    settings = HoppingSettings(steps=10**9, seed=0, unloaded_beams="prune_all", largest_batch=batch)
    evaluator = make_evaluator(problem, settings)
    state = start_chain(evaluator, settings, 0)
    while state.step < LEFT_OUT:
        state, _ = advance_chain(evaluator, settings, 0, state)
    first, start = state.step, time.process_time()
    while time.process_time() - start < seconds:
        state, _ = advance_chain(evaluator, settings, 0, state)
    elapsed = time.process_time() - start
    return {
        "commit": provenance()["commit"],
        "model": model,
        "size": size,
        "beams": problem.lattice.beam_count,
        "designs": state.step,
        "designs a second": float(f"{(state.step - first) / elapsed:.3g}"),
        "ms": float(f"{1e3 * elapsed / (state.step - first):.3g}"),
        "MB": round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024),
        "best": float(f"{state.best:.4g}"),
    }


def exponent_of(rows: list[dict[str, Any]]) -> float:
    """Return the exponent of the time of a design in the number of beams."""
    beams, times = np.log([[row["beams"], row["ms"]] for row in rows]).T
    return float(np.polyfit(beams, times, 1)[0])


def by_model(rows: Iterable[dict[str, Any]]) -> dict[str, list[dict[str, Any]]]:
    """Return the runs with each model, in the order of size."""
    ordered = sorted(rows, key=lambda row: row["size"])
    return {model: [row for row in ordered if row["model"] == model] for model in SIZES}


def table(rows: Iterable[dict[str, Any]]) -> Iterator[str]:
    """Yield the rows of the table in Markdown, and for each model one with its exponent."""
    for model, found in by_model(rows).items():
        for row in found:
            yield (
                f"| {row['size']} x {row['size']} | {row['beams']:,} | {model} "
                f"| {row['designs a second']:g} | {row['ms']:g} | {row['MB']} | {row['best']:.2f} |"
            )
        if len(found) > 2:
            yield f"| exponent | | {model} | | {exponent_of(found):.2f} | | |"


def draw(rows: Iterable[dict[str, Any]], path: Path) -> None:
    """Draw the time of a design against the number of beams."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(6.0, 4.0), dpi=150)
    ticks: set[int] = set()
    colours = (style.BEST, style.IDLE, style.INPUT)
    for (model, found), colour in zip(by_model(rows).items(), colours, strict=True):
        beams, times = [row["beams"] for row in found], [row["ms"] for row in found]
        axes.loglog(beams, times, "o-", color=colour, label=model)
        ticks.update(beams)
    axes.minorticks_off()
    axes.set_xticks(sorted(ticks), [f"{beams:,}" for beams in sorted(ticks)])
    axes.set_xlabel("beams", color=style.INK)
    axes.set_ylabel("processor time of a design, ms", color=style.INK)
    axes.legend(frameon=False)
    axes.grid(color=style.IDLE_REST, linewidth=0.8)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    figure.tight_layout()
    figure.savefig(path)


def in_own_process(model: str, size: int) -> dict[str, Any]:
    """Measure in a process of its own, for its memory."""
    with ProcessPoolExecutor(1) as pool:
        return pool.submit(measure, model, size, SECONDS).result()


def main() -> None:
    """Make the missing measurements, print the table and draw the figure."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", default="", help="names of runs, separated by commas")
    jobs = {
        f"{model} {size}": partial(in_own_process, model, size)
        for model, sizes in SIZES.items()
        for size in sizes
    }
    rows = add_runs(RECORD, jobs, parser.parse_args().only).values()
    print("\n".join(table(rows)))
    draw(rows, DOCS / "images" / "size.png")


if __name__ == "__main__":
    main()
