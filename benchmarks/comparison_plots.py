"""Figures of the comparison of searches: ``python -m benchmarks.comparison_plots``.

Read the records of `benchmarks.search_comparison` in ``docs/comparison`` and draw, for each
problem, the best efficiency so far against the number of responses and against processor time:
the median over the seeds, and the band from the tenth to the ninetieth percentile.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.plots import style
from benchmarks.search_comparison import FOLDER, PLAIN, RESPONSES

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

IMAGES = FOLDER.parent / "images"
COLOURS = (style.BEST, style.INPUT)
POINTS = 200


def best_so_far(
    runs: list[dict[str, Any]], budget: str, grid: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the best efficiency (runs, points) of each run within each budget of a grid."""
    curves = np.zeros((len(runs), len(grid)))
    for row, run in enumerate(runs):
        for responses, seconds, efficiency in run["curve"]:
            after = grid >= (responses if budget == "responses" else seconds)
            curves[row, after] = np.maximum(curves[row, after], efficiency)
    return curves


def draw(axes: Axes, result: dict[str, Any], budget: str) -> None:
    """Draw the curves of both searches for one problem."""
    end = result["responses"] if budget == "responses" else result["seconds"]
    grid = np.linspace(0.0, end, POINTS)
    for (name, runs), colour in zip(result["runs"].items(), COLOURS, strict=True):
        low, middle, high = np.quantile(best_so_far(runs, budget, grid), [0.1, 0.5, 0.9], axis=0)
        axes.fill_between(grid, low, high, color=colour, alpha=0.18, linewidth=0)
        label = "plain Metropolis" if name == PLAIN else name
        axes.plot(grid, middle, color=colour, linewidth=1.8, label=label)
    axes.set_xlim(0.0, end)
    axes.set_ylim(0.0, None)
    label = "responses" if budget == "responses" else "processor time, s"
    axes.set_xlabel(label, size=style.SMALL_SIZE, color=style.INK)
    axes.set_title(result["problem"], size=style.LABEL_SIZE, loc="left", color=style.INK)
    axes.tick_params(labelsize=style.SMALL_SIZE - 1.0, colors=style.NOTE)
    axes.grid(axis="y", color=style.IDLE_REST, linewidth=0.8)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def draw_all(unloaded_beams: str) -> None:
    """Draw the records of all problems with one treatment of unloaded beams."""
    paths = [
        FOLDER / f"{name}-{unloaded_beams}.json"
        for name in RESPONSES
        if not name.startswith("discs-")
    ]
    results = [json.loads(path.read_text()) for path in paths if path.exists()]
    if not results:
        return
    figure = style.new_figure(3.0 * len(results), 6.4)
    grid = figure.subplots(2, len(results), squeeze=False)
    for column, result in enumerate(results):
        for row, budget in enumerate(("responses", "seconds")):
            draw(grid[row, column], result, budget)
    grid[0, 0].legend(frameon=False, fontsize=style.SMALL_SIZE, loc="lower right")
    for row in grid:
        row[0].set_ylabel("best efficiency so far", size=style.SMALL_SIZE, color=style.INK)
    figure.tight_layout()
    figure.savefig(IMAGES / f"comparison-{unloaded_beams}.png", dpi=110)


if __name__ == "__main__":
    for treatment in ("prune_all", "prune_dead_ends", "keep"):
        draw_all(treatment)
