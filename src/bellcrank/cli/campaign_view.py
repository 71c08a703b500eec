"""How a campaign looks in a terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.table import Table

from bellcrank.cli.console import plain
from bellcrank.cli.live import Live

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bellcrank.campaign import Harvest, Ranked, Status


def status_table(status: Status) -> Table:
    """Return one row for each task, and one for all."""
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


def ranking_table(designs: Sequence[Ranked]) -> Table:
    """Return one row for each design; masks, too long for a line, are in the JSON only."""
    table = Table(box=None, padding=(0, 2, 0, 0))
    table.add_column("efficiency", justify="right")
    table.add_column("task")
    table.add_column("seed", justify="right")
    table.add_column("step", justify="right")
    for design in designs:
        efficiency = f"{design.efficiency:.6f}"
        table.add_row(efficiency, plain(design.task), str(design.seed), str(design.step))
    return table


def harvest_table(harvests: Sequence[Harvest]) -> Table:
    """Return one row for each design, with the file that it was written to."""
    table = Table(box=None, padding=(0, 2, 0, 0))
    table.add_column("task")
    for name in ("efficiency", "beams", "seed", "step"):
        table.add_column(name, justify="right")
    table.add_column("file", overflow="fold")
    for found in harvests:
        table.add_row(
            plain(found.task),
            f"{found.design.efficiency:.4f}",
            str(found.design.beam_count),
            str(found.seed),
            str(found.step),
            plain(found.path.name),
        )
    return table


def one_line(status: Status) -> str:
    """Return how a campaign stands in one line."""
    best = max((task.best for task in status.tasks if task.best is not None), default=None)
    told = "" if best is None else f"  best {best:.3f}"
    return f"runs {status.runs_done} / {status.runs}  steps {status.steps_done}{told}"


class CampaignProgress(Live):
    """Shows how a campaign goes."""

    def __init__(self) -> None:
        super().__init__("campaign", None)

    def __call__(self, status: Status) -> None:
        """Take in how the campaign stands."""
        line = one_line(status)
        self._show(status.steps_done, status.steps, line, plain(line))
