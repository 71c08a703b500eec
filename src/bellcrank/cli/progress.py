"""Progress of a search on standard error: a live line on a terminal, a few lines elsewhere."""

from __future__ import annotations

import threading
import time
from types import TracebackType
from typing import Self

from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from bellcrank.cli.console import notes
from bellcrank.search import Progress as Step
from bellcrank.search import SearchSettings

NOT_KEPT = -50.0
"""Below it a score is that of a design that breaks goals."""
QUIET_INTERVAL = 10.0
"""Seconds between lines where there is no terminal."""


class SearchProgress:
    """Collects what the chains tell, from their threads, and shows it.

    Parameters
    ----------
    settings
        Of the search, for how much there is to do.
    """

    def __init__(self, settings: SearchSettings) -> None:
        self._chains = settings.chains
        self._total = settings.chains * settings.steps
        self._lock = threading.Lock()
        self._best = float("-inf")
        self._done: dict[int, int] = {}
        self._made = self._accepted = 0
        self._temperature = 0.0
        self._start = self._last_line = time.monotonic()
        self._bar = Progress(
            TextColumn("[bold]searching"),
            BarColumn(bar_width=24),
            TextColumn("{task.percentage:3.0f} %"),
            TextColumn("{task.fields[figures]}"),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeRemainingColumn(),
            console=notes,
            disable=not notes.is_terminal,
        )
        self._task = self._bar.add_task("", total=self._total, figures="")

    def __enter__(self) -> Self:
        self._bar.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._bar.stop()

    def __call__(self, step: Step) -> None:
        """Take in the news of one chain."""
        with self._lock:
            self._done[step.chain] = step.state.step
            self._made += step.steps
            self._accepted += step.accepted
            self._best = max(self._best, step.state.best)
            self._temperature = step.temperature
            figures = self._figures()
            self._bar.update(self._task, completed=sum(self._done.values()), figures=figures)
            now = time.monotonic()
            if not notes.is_terminal and now - self._last_line > QUIET_INTERVAL:
                self._last_line = now
                share = 100.0 * sum(self._done.values()) / self._total
                notes.print(f"searching {share:3.0f} %  {figures}  left {self._time_left():.0f} s")

    def _figures(self) -> str:
        speed = self._made / max(time.monotonic() - self._start, 1e-9)
        temperature = f"T {self._temperature:.4f}  " if self._temperature > 0.0 else ""
        best = f"best {self._best:6.3f}" if self._best > NOT_KEPT else "goals not kept yet"
        return (
            f"{best}  {temperature}"
            f"accepted {100.0 * self._accepted / self._made:2.0f} %  {speed:6.0f} steps/s"
        )

    def _time_left(self) -> float:
        elapsed = time.monotonic() - self._start
        return elapsed / self._made * (self._total - sum(self._done.values()))
