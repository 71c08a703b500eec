"""Progress of long jobs: a live line on a terminal, occasional lines elsewhere."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Self

from rich.progress import BarColumn, Progress, ProgressColumn, TextColumn, TimeElapsedColumn

from bellcrank.cli.console import notes

if TYPE_CHECKING:
    from types import TracebackType

QUIET_INTERVAL = 10.0
"""Seconds between lines where there is no terminal."""


class Live:
    """Progress of a job on standard error.

    Parameters
    ----------
    title
        Name of the job.
    total
        Total amount of work; None if it is not known yet.
    columns
        Columns after the elapsed time.
    """

    def __init__(self, title: str, total: int | None, *columns: ProgressColumn) -> None:
        self._last_line = time.monotonic()
        self._bar = Progress(
            TextColumn("[bold]{task.description}"),
            BarColumn(bar_width=24),
            TextColumn("{task.percentage:3.0f} %"),
            TextColumn("{task.fields[figures]}"),
            TimeElapsedColumn(),
            *columns,
            console=notes,
            disable=not notes.is_terminal,
        )
        self._task = self._bar.add_task(title, total=total, figures="")

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

    def _show(self, done: int, total: int, figures: str, line: str) -> None:
        """Show the amount of work done, with figures; `line` is printed without a terminal."""
        self._bar.update(self._task, completed=done, total=total, figures=figures)
        now = time.monotonic()
        if not notes.is_terminal and now - self._last_line > QUIET_INTERVAL:
            self._last_line = now
            notes.print(line)
