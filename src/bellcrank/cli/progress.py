"""Progress of a search on standard error."""

from __future__ import annotations

import threading
import time
from typing import TYPE_CHECKING

from rich.progress import TextColumn, TimeRemainingColumn

from bellcrank.cli.live import Live
from bellcrank.search import Progress as Step
from bellcrank.search import SearchSettings
from bellcrank.search.scores import LEAST_MET

if TYPE_CHECKING:
    from bellcrank.model import Problem
    from bellcrank.refine.reached import Reached
    from bellcrank.refine.refinement import Progress as RefinementStep
    from bellcrank.workflows.refiners import GeometryCount


class SearchProgress(Live):
    """Progress of the chains of a search, reported from their threads.

    Parameters
    ----------
    settings, problem
        Settings of the search, and its problem.
    """

    def __init__(self, settings: SearchSettings, problem: Problem) -> None:
        self._chains, self._problem = settings.chains, problem
        self._total = settings.chains * settings.steps
        self._lock = threading.Lock()
        self._best = float("-inf")
        self._done: dict[int, int] = {}
        self._made = self._accepted = 0
        self._temperature = 0.0
        self._geometries: GeometryCount | None = None
        self._reached: Reached
        self._start = time.monotonic()
        super().__init__("searching", self._total, TextColumn("left"), TimeRemainingColumn())

    def __call__(self, step: Step) -> None:
        """Update the progress of one chain."""
        with self._lock:
            self._done[step.chain] = step.state.step
            self._made += step.steps
            self._accepted += step.accepted
            self._best = max(self._best, step.state.best)
            self._temperature = step.temperature
            figures = self._figures()
            done = sum(self._done.values())
            share = 100.0 * done / self._total
            line = f"searching {share:3.0f} %  {figures}  left {self._time_left():.0f} s"
            self._show(done, self._total, figures, line)

    def verifying(self, done: int, total: int) -> None:
        """Show the number of candidates that have been verified, and the largest number."""
        self._bar.update(self._task, description="verifying")
        count = f"at most {total} candidates"
        figures = f"verified {done} of {count}" if done else count
        self._show(done, total, figures, figures)

    def refining(self, number: int, step: RefinementStep) -> None:
        """Show how many geometries are refined, and the best objective that meets all items."""
        from bellcrank.refine.reached import Reached
        from bellcrank.workflows.refiners import GeometryCount

        with self._lock:
            if self._geometries is None:
                self._reached = Reached()
                self._geometries = GeometryCount(self._chains, self._problem)
                self._bar.update(self._task, description="refining ")
            self._geometries.add(number, step.evaluations)
            self._reached.add(number, step)
            done, most = self._geometries.done, max(self._geometries.done, self._geometries.most)
            figures = self._reached_text()
            if step.sheets:
                is_flat = self._problem.lattice.dimension == 2
                model = "in the sheet" if is_flat else "with imperfections"
                figures += f", design {number + 1} computed {model}"
            line = f"refining: {done} of at most {most} geometries, {figures}"
            self._show(done, most, figures, line)

    def _reached_text(self) -> str:
        """Return the objective of the best refined design, and the prints that meet all items."""
        if not self._reached.met:
            return "no design meets all items yet"
        best = self._reached.met[0]
        prints = "" if best.share is None else f", {best.share:.0%} of random prints"
        if not best.has_objective:
            return f"all items met{prints}"
        return f"best objective {best.rows.objective:.3f}{prints}"

    def _figures(self) -> str:
        speed = self._made / max(time.monotonic() - self._start, 1e-9)
        temperature = f"T {self._temperature:.4f}  " if self._temperature > 0.0 else ""
        best = f"best {self._best:6.3f}" if self._best > LEAST_MET else "goals not satisfied yet"
        return (
            f"{best}  {temperature}"
            f"accepted {100.0 * self._accepted / self._made:2.0f} %  {speed:6.0f} steps/s"
        )

    def _time_left(self) -> float:
        elapsed = time.monotonic() - self._start
        return elapsed / self._made * (self._total - sum(self._done.values()))
