"""Success plots of a competition: ``python -m benchmarks.success``.

Reads what `benchmarks.competition` left in ``docs/competition`` and draws, for each problem,
the best efficiency so far against responses and against processor time: median over the
seeds, and the band from the tenth to the ninetieth percentile.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.plots import style
from benchmarks.competition import FOLDER, PLAIN, RESPONSES

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

TARGET = FOLDER.parent / "images"
COLOURS = (style.BEST, style.INPUT)
POINTS = 200


def best_so_far(
    games: list[dict[str, Any]], measure: str, grid: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(games, points) best efficiency of each game when so much had been spent."""
    curves = np.zeros((len(games), len(grid)))
    for row, game in enumerate(games):
        for responses, seconds, efficiency in game["curve"]:
            after = grid >= (responses if measure == "responses" else seconds)
            curves[row, after] = np.maximum(curves[row, after], efficiency)
    return curves


def draw(axes: Axes, result: dict[str, Any], measure: str) -> None:
    """Draw both searches on one problem."""
    end = result["responses"] if measure == "responses" else result["seconds"]
    grid = np.linspace(0.0, end, POINTS)
    for (name, games), colour in zip(result["games"].items(), COLOURS, strict=True):
        low, middle, high = np.quantile(best_so_far(games, measure, grid), [0.1, 0.5, 0.9], axis=0)
        axes.fill_between(grid, low, high, color=colour, alpha=0.18, linewidth=0)
        label = "plain Metropolis" if name == PLAIN else name
        axes.plot(grid, middle, color=colour, linewidth=1.8, label=label)
    axes.set_xlim(0.0, end)
    axes.set_ylim(0.0, None)
    units = "responses" if measure == "responses" else "seconds on one core"
    axes.set_xlabel(units, size=style.SMALL_SIZE, color=style.INK)
    axes.set_title(result["problem"], size=style.LABEL_SIZE, loc="left", color=style.INK)
    axes.tick_params(labelsize=style.SMALL_SIZE - 1.0, colors=style.NOTE)
    axes.grid(axis="y", color=style.IDLE_REST, linewidth=0.8)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def draw_all(unloaded_beams: str) -> None:
    """Draw all problems that were played with one kind of response."""
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
        for row, measure in enumerate(("responses", "seconds")):
            draw(grid[row, column], result, measure)
    grid[0, 0].legend(frameon=False, fontsize=style.SMALL_SIZE, loc="lower right")
    for row in grid:
        row[0].set_ylabel("best efficiency so far", size=style.SMALL_SIZE, color=style.INK)
    figure.tight_layout()
    figure.savefig(TARGET / f"competition-{unloaded_beams}.png", dpi=110)


if __name__ == "__main__":
    for kind in ("prune_all", "prune_dead_ends", "keep"):
        draw_all(kind)
