"""Efficiency against step, one curve for each chain, as short as a picture needs it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.mechanics import Status
from bellcrank.search import BLOCK, read_settings, searches

if TYPE_CHECKING:
    from pathlib import Path

    from bellcrank.storage import RunFolder

Point = tuple[int, float | None, float | None, float]
"""Step; efficiency of the current and of the best design; temperature."""

MOST = 600
"""Points of a chain; beyond, every other one is dropped."""


class Trace:
    """Curves that grow, and are thinned out when they get long.

    Attributes
    ----------
    epoch
        Changes when earlier points do, so that who follows the curves starts again.
    """

    def __init__(self) -> None:
        self.chains: dict[int, list[Point]] = {}
        self.epoch = 0

    def add(self, chain: int, points: list[Point]) -> None:
        """Append points to the curve of a chain."""
        curve = self.chains.setdefault(chain, [])
        curve += points
        if len(curve) > MOST:
            self.chains[chain] = [*curve[:-1:2], curve[-1]]
            self.epoch += 1

    def since(self, seen: dict[int, int]) -> dict[int, list[Point]]:
        """Return what was added after so many points of each chain, and note it as seen."""
        fresh = {chain: curve[seen.get(chain, 0) :] for chain, curve in self.chains.items()}
        for chain, curve in self.chains.items():
            seen[chain] = len(curve)
        return {chain: points for chain, points in fresh.items() if points}


def tidy(value: float) -> float | None:
    """Return a number as precise as a picture needs it; None for none."""
    return round(float(value), 5) if np.isfinite(value) else None


def read_curves(folder: RunFolder) -> dict[int, list[Point]]:
    """Make the curves of a run from its records."""
    settings = read_settings(folder.settings)
    running_best = searches[settings.name].plot_running_best
    curves: dict[int, list[Point]] = {}
    for chain in folder.chains:
        rows = folder.read(chain, ["step", "efficiency", "temperature", "accepted", "status"])
        count = len(rows["step"])
        if not count:
            continue
        taken = rows["accepted"] & (rows["status"] == Status.CONVERGED)
        best = np.fmax.accumulate(np.where(taken, rows["efficiency"], np.nan))
        last = np.maximum.accumulate(np.where(taken, np.arange(count), -1))
        current = np.where(last >= 0, rows["efficiency"][last], np.nan)
        stride = max(BLOCK, -(-count // (MOST // 2)))
        places = np.append(np.arange(stride - 1, count, stride), [0, count - 1])
        if settings.name == "paper":  # the annealing is over within a few hundred steps
            places = np.append(places, np.arange(0, min(count, 2 * BLOCK), 10))
        shown = best if running_best else current
        curves[chain] = [
            (k + 1, tidy(shown[k]), tidy(best[k]), round(float(rows["temperature"][k]), 6))
            for k in np.unique(places).tolist()
        ]
    return curves


def read_run_curves(path: Path) -> dict[str, Any]:
    """Read the curves of the run in a folder; none if it has not begun."""
    from bellcrank.storage import RunFolder

    return {"curves": read_curves(RunFolder.open(path)) if (path / "run.json").exists() else {}}


def copy_history(path: Path, target: Path) -> None:
    """Write what the run in a folder has proposed so far into another folder."""
    from bellcrank.storage import RunFolder

    RunFolder.open(path).copy_history(target)
