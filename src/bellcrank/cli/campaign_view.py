"""Tables and progress of a campaign in a terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.table import Table

from bellcrank.cli.console import plain
from bellcrank.cli.live import Live

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bellcrank.campaign import RankedDesign, Status, TaskResult


def status_table(status: Status) -> Table:
    """Return a table with one row for each task, and one for all."""
    table = Table(box=None, padding=(0, 2, 0, 0))
    table.add_column("task")
    for name in ("runs done", "steps", "median", "best", "seed"):
        table.add_column(name, justify="right")
    for task in status.tasks:
        table.add_row(
            plain(task.name),
            f"{task.runs_done} / {task.runs}",
            f"{task.steps_done} / {task.steps}",
            "" if task.median is None else f"{task.median:.4f}",
            "" if task.best is None else f"{task.best:.4f}",
            "" if task.best_seed is None else str(task.best_seed),
        )
    table.add_row(
        "all",
        f"{status.runs_done} / {status.runs}",
        f"{status.steps_done} / {status.steps}",
        style="bold",
    )
    return table


def ranking_table(designs: Sequence[RankedDesign]) -> Table:
    """Return a table of designs, without the masks, which are too long for a line."""
    table = Table(box=None, padding=(0, 2, 0, 0))
    table.add_column("efficiency", justify="right")
    table.add_column("task")
    table.add_column("seed", justify="right")
    table.add_column("step", justify="right")
    for design in designs:
        efficiency = f"{design.efficiency:.6f}"
        table.add_row(efficiency, plain(design.task), str(design.seed), str(design.step))
    return table


def results_table(found: Sequence[TaskResult]) -> Table:
    """Return a table of the designs of the tasks, with their files."""
    table = Table(box=None, padding=(0, 2, 0, 0))
    table.add_column("task")
    for name in ("efficiency", "beams", "seed", "step"):
        table.add_column(name, justify="right")
    table.add_column("file", overflow="fold")
    for result in found:
        table.add_row(
            plain(result.task),
            f"{result.design.efficiency:.4f}",
            str(result.design.beam_count),
            str(result.seed),
            str(result.step),
            plain(result.path.name),
        )
    return table


def one_line(status: Status) -> str:
    """Return the status of a campaign in one line."""
    best = max((task.best for task in status.tasks if task.best is not None), default=None)
    efficiency = "" if best is None else f"  best {best:.3f}"
    return f"runs {status.runs_done} / {status.runs}  steps {status.steps_done}{efficiency}"


class CampaignProgress(Live):
    """Progress of a campaign."""

    def __init__(self) -> None:
        super().__init__("campaign", None)

    def __call__(self, status: Status) -> None:
        """Show the status."""
        line = one_line(status)
        self._show(status.steps_done, status.steps, line, plain(line))
