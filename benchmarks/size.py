"""Speed of a search as a function of the size of the lattice: ``python -m benchmarks.size``.

The default search runs on the problems ``scaling`` (`bellcrank.model.builtin.scaling`) of several
sizes, with springs and with frames, each in a process of its own. The first hundred designs are
left out. Designs a second, the processor time of a design, the memory of the process and the best
efficiency so far are written to ``docs/size.json``; the figure is ``docs/images/size.png``. The
exponent is the slope of a straight line through the logarithms of time and number of beams.
"""

from __future__ import annotations

import argparse
import json
import resource
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.model.builtin.scaling import scaling
from bellcrank.part import PartSpec, frame_problem
from bellcrank.plots import style
from bellcrank.provenance import provenance
from bellcrank.search import HoppingSettings, advance_chain, make_evaluator, start_chain

if TYPE_CHECKING:
    from collections.abc import Iterator

DOCS = Path(__file__).parents[1] / "docs"
RECORD = DOCS / "size.json"
SIZES = (10, 14, 20, 28, 40, 60, 100)
MODELS = ("springs", "frames")
SECONDS = 60.0
"""Processor time of each measurement."""
LEFT_OUT = 100
"""Designs before the measurement begins, rounded up to a block."""


def measure(model: str, size: int, seconds: float) -> dict[str, Any]:
    """Search for a processor time; return what was measured."""
    problem = scaling(size)
    if model == "frames":
        problem = frame_problem(problem, PartSpec())
    settings = HoppingSettings(steps=10**9, seed=0, unloaded_beams="prune_all")
    evaluator = make_evaluator(problem, settings)
    state = start_chain(evaluator, settings, 0)
    while state.step < LEFT_OUT:
        state, _ = advance_chain(evaluator, settings, 0, state)
    first, start = state.step, time.process_time()
    while time.process_time() - start < seconds:
        state, _ = advance_chain(evaluator, settings, 0, state)
    elapsed = time.process_time() - start
    return {
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


def table(rows: list[dict[str, Any]]) -> Iterator[str]:
    """Yield the rows of the table in Markdown."""
    for row in rows:
        yield (
            f"| {row['size']} x {row['size']} | {row['beams']:,} | {row['model']} "
            f"| {row['designs a second']:g} | {row['ms']:g} | {row['MB']} |"
        )


def draw(rows: list[dict[str, Any]], path: Path) -> None:
    """Draw the time of a design against the number of beams."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(6.0, 4.0), dpi=150)
    for model, colour in zip(MODELS, (style.BEST, style.INPUT), strict=True):
        found = [row for row in rows if row["model"] == model]
        if len(found) > 1:
            label = f"{model}, exponent {exponent_of(found):.2f}"
            beams, times = [row["beams"] for row in found], [row["ms"] for row in found]
            axes.loglog(beams, times, "o-", color=colour, label=label)
    ticks = sorted({row["beams"] for row in rows})
    axes.minorticks_off()
    axes.set_xticks(ticks, [f"{beams:,}" for beams in ticks])
    axes.set_xlabel("beams", color=style.INK)
    axes.set_ylabel("processor time of a design, ms", color=style.INK)
    axes.legend(frameon=False)
    axes.grid(color=style.IDLE_REST, linewidth=0.8)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    figure.tight_layout()
    figure.savefig(path)


def main() -> None:
    """Measure, write the record, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sizes", type=int, nargs="*", default=SIZES)
    parser.add_argument("--models", nargs="*", default=MODELS, choices=MODELS)
    parser.add_argument("--seconds", type=float, default=SECONDS)
    parser.add_argument("--out", type=Path, default=RECORD)
    options = parser.parse_args()
    rows = []
    for model in options.models:
        for size in options.sizes:
            with ProcessPoolExecutor(1) as pool:  # a process of its own, for its memory
                rows.append(pool.submit(measure, model, size, options.seconds).result())
            print(*table(rows[-1:]), flush=True)
            content = {"provenance": provenance(), "seconds": options.seconds, "rows": rows}
            options.out.write_text(json.dumps(content, indent=1), encoding="utf-8")
    draw(rows, DOCS / "images" / "size.png")


if __name__ == "__main__":
    main()
