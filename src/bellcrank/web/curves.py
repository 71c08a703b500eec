"""Scores against step, one curve for each chain, reduced for drawing."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.search import BLOCK, read_settings, searches
from bellcrank.search.scores import LEAST_MET, SCORE_COLUMNS, recorded_scores

if TYPE_CHECKING:
    from pathlib import Path

    from bellcrank.storage import RunFolder

Point = tuple[int, float | None, float | None, float]
"""Step; score of the current and of the best design, None where items are missed; temperature."""

MAX_POINTS = 600
"""Largest number of points of a chain; beyond, every other point is dropped."""


class Curves:
    """Growing curves that are thinned out beyond a number of points.

    Attributes
    ----------
    epoch
        Increases when earlier points change, so that clients reload the curves.
    """

    def __init__(self) -> None:
        self.chains: dict[int, list[Point]] = {}
        self.epoch = 0

    def add(self, chain: int, points: list[Point]) -> None:
        """Append points to the curve of a chain."""
        curve = self.chains.setdefault(chain, [])
        curve += points
        if len(curve) > MAX_POINTS:
            self.chains[chain] = [*curve[:-1:2], curve[-1]]
            self.epoch += 1

    def since(self, seen: dict[int, int]) -> dict[int, list[Point]]:
        """Return the points after the number in `seen` for each chain, and update `seen`."""
        fresh = {chain: curve[seen.get(chain, 0) :] for chain, curve in self.chains.items()}
        for chain, curve in self.chains.items():
            seen[chain] = len(curve)
        return {chain: points for chain, points in fresh.items() if points}


def rounded(value: float) -> float | None:
    """Return a number rounded for drawing; None for NaN and infinities."""
    return round(float(value), 5) if np.isfinite(value) else None


def read_curves(folder: RunFolder) -> dict[int, list[Point]]:
    """Return the curves of a run from its records."""
    settings = read_settings(folder.settings)
    running_best = searches[settings.name].plot_running_best
    curves: dict[int, list[Point]] = {}
    for chain in folder.chains:
        rows = folder.read(chain, ["step", "temperature", *SCORE_COLUMNS])
        count = len(rows["step"])
        if not count:
            continue
        scores = recorded_scores(rows, settings, folder.problem)
        scores[~(scores > LEAST_MET)] = np.nan
        best = np.fmax.accumulate(scores)
        last = np.maximum.accumulate(np.where(np.isnan(scores), -1, np.arange(count)))
        current = np.where(last >= 0, scores[last], np.nan)
        stride = max(BLOCK, -(-count // (MAX_POINTS // 2)))
        rows_shown = np.append(np.arange(stride - 1, count, stride), [0, count - 1])
        if settings.name == "paper":  # annealing ends within a few hundred steps
            rows_shown = np.append(rows_shown, np.arange(0, min(count, 2 * BLOCK), 10))
        shown = best if running_best else current
        curves[chain] = [
            (k + 1, rounded(shown[k]), rounded(best[k]), round(float(rows["temperature"][k]), 6))
            for k in np.unique(rows_shown).tolist()
        ]
    return curves


def read_run_curves(path: Path) -> dict[str, Any]:
    """Return the curves of the run in a folder; none if it has not started."""
    from bellcrank.storage import RunFolder

    return {"curves": read_curves(RunFolder.open(path)) if (path / "run.json").exists() else {}}


def copy_history(path: Path, target: Path) -> None:
    """Write all proposals of a run so far into another folder."""
    from bellcrank.storage import RunFolder

    RunFolder.open(path).copy_history(target)
