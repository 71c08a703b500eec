"""The best designs of a campaign, found without reading most of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.campaign.segments import CONVERGED, WHAT_TO_DO
from bellcrank.errors import InvalidSettings
from bellcrank.storage.shards import parquet_file

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from bellcrank.campaign.store import Store


@dataclass(frozen=True, slots=True)
class Ranked:
    """A design, and where it was proposed first.

    Parameters
    ----------
    efficiency
        Of the design.
    task, run, seed, step
        Where it comes from.
    mask
        Its beams, in hexadecimal.
    """

    efficiency: float
    task: str
    run: str
    seed: int
    step: int
    mask: str

    @property
    def order(self) -> tuple[float, str, str, int]:
        """By which designs are sorted: the best ones first, ties by where they come from."""
        return (-self.efficiency, self.task, self.run, self.step)


@dataclass(frozen=True, slots=True)
class _Group:
    """A row group, and the highest efficiency that it may hold."""

    best: float
    path: Path
    number: int


def best_designs(store: Store, count: int, task: str | None = None) -> list[Ranked]:
    """Return the most efficient distinct designs of all that were proposed and converged.

    Parameters
    ----------
    count
        How many, at most.
    task
        Name of the task to look at; by default all.

    Raises
    ------
    InvalidSettings
        If there is no such task.
    CorruptRun
        If a file that has to be read is damaged.
    """
    widths = {known.name: known.mask_bytes for known in store.spec.tasks}
    if task is not None:
        store.spec.task(task)  # an unknown name explains itself
    if count < 1:
        raise InvalidSettings(f"n: expected at least 1, got {count}")
    groups = sorted(
        (group for path in store.files() for group in _groups(path, task)),
        key=lambda group: -group.best,
    )
    found: dict[tuple[str, str], Ranked] = {}
    least = -np.inf
    for group in groups:
        if group.best < least:
            break
        for design in _designs(group, widths, task, least):
            key = (design.task, design.mask)
            if key not in found or design.order < found[key].order:
                found[key] = design
        if len(found) >= count:
            kept = sorted(found.items(), key=lambda item: item[1].order)[:count]
            found, least = dict(kept), kept[-1][1].efficiency
    return sorted(found.values(), key=lambda design: design.order)


def _groups(path: Path, task: str | None) -> Iterator[_Group]:
    with parquet_file(path, WHAT_TO_DO) as (file, _):
        names = file.schema_arrow.names
        for number in range(file.metadata.num_row_groups):
            group = file.metadata.row_group(number)
            tasks = group.column(names.index("task")).statistics
            if task is not None and not tasks.min <= task <= tasks.max:
                continue
            efficiency = group.column(names.index("efficiency")).statistics
            if efficiency is not None and efficiency.has_min_max:
                yield _Group(efficiency.max, path, number)


def _designs(
    group: _Group, widths: dict[str, int], task: str | None, least: float
) -> Iterator[Ranked]:
    """Yield the designs of a row group that are no worse than `least`."""
    with parquet_file(group.path, WHAT_TO_DO) as (file, _):
        asked = file.read_row_group(group.number, columns=["efficiency", "status"])
        efficiency = asked.column("efficiency").to_numpy()
        converged = asked.column("status").to_numpy() == CONVERGED
        rows = np.flatnonzero(converged & (efficiency >= least))
        if not len(rows):
            return
        columns = ["task", "run", "seed", "step", "mask", "efficiency"]
        table: Any = file.read_row_group(group.number, columns=columns).take(rows)
    for row in table.to_pylist():
        if task in (None, row["task"]):
            mask = row.pop("mask")[: widths[row["task"]]].hex()
            yield Ranked(mask=mask, **row)
