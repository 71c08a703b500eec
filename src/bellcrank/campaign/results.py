"""The best designs of a campaign: ranked proposals, and one finished design for each task."""

from __future__ import annotations

import heapq
import re
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.campaign.store import SEGMENT_ADVICE
from bellcrank.errors import InvalidSettings
from bellcrank.model import problem_from_dict, write_design
from bellcrank.model.storage import already_exists
from bellcrank.provenance import provenance
from bellcrank.search import Verdict
from bellcrank.storage.files import make_folder
from bellcrank.storage.parquet import arrays_of, parquet_file

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from pathlib import Path

    from numpy.typing import NDArray

    from bellcrank.campaign.spec import Task
    from bellcrank.campaign.store import Store
    from bellcrank.model import Design
    from bellcrank.search import Candidate

COLUMNS = ["seed", "step", "mask", "efficiency"]
CONVERGED = int(Verdict.CONVERGED)
"""Status of a proposal whose efficiency is that of a stable equilibrium."""
PER_RUN = 10
"""Number of candidates of each run."""
PER_TASK = 120
"""Number of candidates of each task, which are cleaned and compared."""


@dataclass(frozen=True, slots=True)
class RankedDesign:
    """A proposed design with the place where it was proposed first.

    Parameters
    ----------
    efficiency
        Efficiency of the design.
    task, run, seed, step
        Proposal that it comes from.
    mask
        Packed mask of its beams, in hexadecimal.
    """

    efficiency: float
    task: str
    run: str
    seed: int
    step: int
    mask: str

    @property
    def order(self) -> tuple[float, str, str, int]:
        """Sort key: the best designs first, equal ones by task, run and step."""
        return (-self.efficiency, self.task, self.run, self.step)


def best_designs(store: Store, count: int, task: str | None = None) -> list[RankedDesign]:
    """Return the most efficient distinct designs of all proposals that converged.

    Row groups whose statistics exclude them are not read.

    Parameters
    ----------
    store
        Store of the campaign.
    count
        Maximum number of designs.
    task
        Name of a task; by default all tasks.

    Raises
    ------
    InvalidSettings
        If there is no such task, or `count` is less than 1.
    CorruptRun
        If a file that has to be read is damaged.
    """
    widths = {known.name: known.mask_bytes for known in store.spec.tasks}
    if task is not None:
        store.spec.task(task)  # raises if it does not exist
    if count < 1:
        raise InvalidSettings(f"n: expected at least 1, got {count}")
    groups = sorted(
        (group for path in store.files() for group in _row_groups(path, task)),
        key=lambda group: -group.best,
    )
    found: dict[tuple[str, str], RankedDesign] = {}
    minimum = -np.inf
    for group in groups:
        if group.best < minimum:
            break
        for design in _designs(group, widths, task, minimum):
            key = (design.task, design.mask)
            if key not in found or design.order < found[key].order:
                found[key] = design
        if len(found) >= count:
            best = sorted(found.items(), key=lambda item: item[1].order)[:count]
            found, minimum = dict(best), best[-1][1].efficiency
    return sorted(found.values(), key=lambda design: design.order)


@dataclass(frozen=True, slots=True)
class _RowGroup:
    """A row group of a file, and the highest efficiency in it."""

    path: Path
    number: int
    best: float


def _row_groups(path: Path, task: str | None) -> Iterator[_RowGroup]:
    """Yield the row groups of a file that may hold rows of a task, or all."""
    with parquet_file(path, SEGMENT_ADVICE) as (file, _):
        names = file.schema_arrow.names
        for number in range(file.metadata.num_row_groups):
            group = file.metadata.row_group(number)
            tasks = group.column(names.index("task")).statistics
            if task is not None and not tasks.min <= task <= tasks.max:
                continue
            efficiency = group.column(names.index("efficiency")).statistics
            known = efficiency is not None and efficiency.has_min_max
            yield _RowGroup(path, number, efficiency.max if known else -np.inf)


def _designs(
    group: _RowGroup, widths: dict[str, int], task: str | None, minimum: float
) -> Iterator[RankedDesign]:
    """Yield the designs of a row group whose efficiency is at least `minimum`."""
    with parquet_file(group.path, SEGMENT_ADVICE) as (file, _):
        first = file.read_row_group(group.number, columns=["efficiency", "status"])
        efficiency = first.column("efficiency").to_numpy()
        converged = first.column("status").to_numpy() == CONVERGED
        rows = np.flatnonzero(converged & (efficiency >= minimum))
        if not len(rows):
            return
        columns = ["task", "run", "seed", "step", "mask", "efficiency"]
        table: Any = file.read_row_group(group.number, columns=columns).take(rows)
    for row in table.to_pylist():
        if task in (None, row["task"]):
            mask = row.pop("mask")[: widths[row["task"]]].hex()
            yield RankedDesign(mask=mask, **row)


@dataclass(frozen=True, slots=True, eq=False)
class TaskResult:
    """The best design of a task.

    Parameters
    ----------
    task
        Name of the task.
    design
        Design without unloaded beams, with its efficiency and provenance.
    seed, step
        Proposal that it was made from.
    path
        File that holds it.
    """

    task: str
    design: Design
    seed: int
    step: int
    path: Path


def write_results(
    store: Store, out: Path, task: str | None = None, *, overwrite: bool = False
) -> list[TaskResult]:
    """Write the best design of each task to a file, as far as its runs have advanced.

    The best proposals of all runs are cleaned and evaluated from rest in small increments; the
    best one that stays in one stable piece is the result. Those of a frame are verified with
    several elements in each beam as in `bellcrank design`, their strain excepted.

    Parameters
    ----------
    store
        Store of the campaign.
    out
        Folder for the designs; created if it does not exist.
    task
        Name of one task; by default all tasks.
    overwrite
        Whether to replace existing files.

    Raises
    ------
    InvalidSettings
        If there is no such task, or no design of a task qualifies.
    OutputExists
        If a file exists.
    StorageError
        If the folder cannot be written.
    CorruptRun
        If a file that has to be read is damaged.
    """
    tasks = store.spec.tasks if task is None else (store.spec.task(task),)
    paths = [out / f"{name}.json" for name in file_names(task.name for task in tasks)]
    for path in paths:
        if path.exists() and not overwrite:
            raise already_exists(path)
    make_folder(out)
    written = []
    for chosen, path in zip(tasks, paths, strict=True):
        design, found = best_design(store, chosen)
        write_design(design, path, overwrite=overwrite)
        written.append(TaskResult(chosen.name, design, found.chain, found.step, path))
    return written


def file_names(names: Iterable[str]) -> list[str]:
    """Return distinct file names for arbitrary names.

    Examples
    --------
    >>> file_names(["crane-paper", "a/b", "a b"])
    ['crane-paper', 'a-b', 'a-b-2']
    """
    found: list[str] = []
    for name in names:
        plain = re.sub(r"[^\w.+-]+", "-", name).strip(".-") or "design"
        number = 1
        while (unique := plain if number == 1 else f"{plain}-{number}") in found:
            number += 1
        found.append(unique)
    return found


def best_design(store: Store, task: Task) -> tuple[Design, Candidate]:
    """Return the best design of a task and the candidate that it was made from.

    The chain of the candidate is its seed.

    Raises
    ------
    InvalidSettings
        If no design qualifies, or none is stored yet.
    CorruptRun
        If a file that has to be read is damaged.
    """
    from bellcrank.search import candidates_of, read_settings, searches
    from bellcrank.search.choice import select_design

    settings = read_settings(task.settings)
    problem = problem_from_dict(task.problem, f"task {task.name!r}")
    rule = searches[settings.name].candidate_rule
    candidates = [
        candidate
        for seed, rows in _accepted(store, task)
        for candidate in candidates_of(
            seed, rows["step"], rows["mask"][:, : task.mask_bytes], rows["efficiency"], rule,
            PER_RUN,
        )
    ]  # fmt: skip
    chosen = heapq.nlargest(PER_TASK, candidates, key=lambda candidate: candidate.score)
    if not chosen:
        raise InvalidSettings(f"task {task.name!r}: no accepted design is stored yet")
    selection = select_design(problem, chosen, settings)
    found = selection.found
    origin = provenance(
        kind="machine",
        campaign=store.spec.name,
        campaign_hash=store.spec.hash,
        task=task.name,
        settings={**task.settings, "seed": found.chain},
        step=found.step,
        efficiency_before_cleaning=selection.efficiency_before,
        status=selection.response.status.label,
    )
    design = replace(selection.design, efficiency=selection.efficiency_after, provenance=origin)
    return design, found


def _accepted(store: Store, task: Task) -> Iterator[tuple[int, dict[str, NDArray[Any]]]]:
    """Yield seed and accepted, converged rows of each run of a task."""
    import pyarrow as pa
    import pyarrow.compute as pc

    columns = [*COLUMNS, "task", "accepted", "status"]
    tables = []
    for path in store.files():
        for group in _row_groups(path, task.name):
            with parquet_file(path, SEGMENT_ADVICE) as (file, _):
                table = file.read_row_group(group.number, columns=columns, use_threads=False)
            converged = pc.equal(table["status"], CONVERGED)
            of_task = pc.equal(table["task"], task.name)
            tables.append(table.filter(pc.and_(pc.and_(table["accepted"], converged), of_task)))
    if tables:
        rows = arrays_of(pa.concat_tables(tables), COLUMNS)
        seeds, starts = np.unique(rows["seed"], return_index=True)
        for seed, first, last in zip(seeds, starts, [*starts[1:], len(rows["seed"])], strict=True):
            yield int(seed), {name: column[first:last] for name, column in rows.items()}
