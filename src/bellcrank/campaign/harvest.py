"""From a campaign to designs that can be built: one for each task.

What its runs accepted goes the way of any search: the best are cleaned, judged from rest in
small increments, and the best of those that stay in one stable piece is the design.
"""

from __future__ import annotations

import heapq
import re
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.campaign.segments import CONVERGED, WHAT_TO_DO
from bellcrank.errors import InvalidSettings
from bellcrank.model import problem_from_dict, write_design
from bellcrank.model.storage import already_exists
from bellcrank.provenance import provenance
from bellcrank.storage.files import make_folder
from bellcrank.storage.shards import arrays_of, parquet_file

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from pathlib import Path

    from numpy.typing import NDArray

    from bellcrank.campaign.spec import Task
    from bellcrank.campaign.store import Store
    from bellcrank.model import Design
    from bellcrank.search import Candidate, SearchSettings

KEPT = ["seed", "step", "mask", "efficiency"]
PER_RUN = 10
"""Candidates of each run."""
PER_TASK = 120
"""Candidates of each task, cleaned and compared."""


@dataclass(frozen=True, slots=True, eq=False)
class Harvest:
    """The design that a task has led to.

    Parameters
    ----------
    task
        Its name.
    design
        Cleaned and judged, with its efficiency and where it comes from.
    seed, step
        Of the proposal that it was cleaned from.
    path
        File that holds it.
    """

    task: str
    design: Design
    seed: int
    step: int
    path: Path


def write_harvest(
    store: Store, out: Path, task: str | None = None, *, overwrite: bool = False
) -> list[Harvest]:
    """Write the best design of each task to a file of its own, as far as its runs have come.

    Parameters
    ----------
    out
        Folder for the designs; made if it is not there.
    task
        Name of one task; by default all.
    overwrite
        Replace files that are there.

    Raises
    ------
    InvalidSettings
        If there is no such task, or no design of one qualifies.
    OutputExists
        If there is such a file.
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
        written.append(Harvest(chosen.name, design, found.chain, found.step, path))
    return written


def file_names(names: Iterable[str]) -> list[str]:
    """Return names that files can have, all different.

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
    """Choose the best design of a task; return it and what it was cleaned from.

    The chain of the candidate is its seed.

    Raises
    ------
    InvalidSettings
        If no design qualifies, or none is stored yet.
    CorruptRun
        If a file that has to be read is damaged.
    """
    from bellcrank.search import read_settings, select
    from bellcrank.workflows.design import verification_evaluator

    settings = read_settings(task.settings)
    problem = problem_from_dict(task.problem, f"task {task.name!r}")
    offered = _candidates(store, task, settings)
    chosen = heapq.nlargest(PER_TASK, offered, key=lambda candidate: candidate.efficiency)
    if not chosen:
        raise InvalidSettings(f"task {task.name!r}: no accepted design is stored yet")
    selection = select(
        problem, chosen, settings.objective, verification_evaluator(problem, settings)
    )
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
    return replace(
        selection.design, efficiency=selection.efficiency_after, provenance=origin
    ), found


def _candidates(store: Store, task: Task, settings: SearchSettings) -> Iterator[Candidate]:
    """Yield what the runs of a task offer, called by their seeds."""
    from bellcrank.search import candidates_of, searches

    offers = searches[settings.name].candidate_rule
    for seed, rows in _accepted(store, task):
        masks = rows["mask"][:, : task.mask_bytes]
        yield from candidates_of(seed, rows["step"], masks, rows["efficiency"], offers, PER_RUN)


def _accepted(store: Store, task: Task) -> Iterator[tuple[int, dict[str, NDArray[Any]]]]:
    """Yield seed and accepted, converged rows of each run of a task, one run at a time."""
    seed = -1
    parts: list[dict[str, NDArray[Any]]] = []
    for part in _row_groups(store, task):
        seeds = part["seed"]
        bounds = [0, *(np.flatnonzero(np.diff(seeds)) + 1).tolist(), len(seeds)]
        for first, last in pairwise(bounds):
            if first == last:
                continue
            if parts and seeds[first] != seed:
                yield seed, _joined(parts)
                parts = []
            seed = int(seeds[first])
            parts.append({name: column[first:last] for name, column in part.items()})
    if parts:
        yield seed, _joined(parts)


def _joined(parts: list[dict[str, NDArray[Any]]]) -> dict[str, NDArray[Any]]:
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def _row_groups(store: Store, task: Task) -> Iterator[dict[str, NDArray[Any]]]:
    """Yield the accepted, converged rows of a task, in the order of runs and steps."""
    import pyarrow.compute as pc

    for path in store.files():
        with parquet_file(path, WHAT_TO_DO) as (file, _):
            names = file.schema_arrow.names
            for number in range(file.metadata.num_row_groups):
                tasks = file.metadata.row_group(number).column(names.index("task")).statistics
                if not tasks.min <= task.name <= tasks.max:
                    continue
                columns = [*KEPT, "task", "accepted", "status"]
                table = file.read_row_group(number, columns=columns, use_threads=False)
                kept = pc.and_(
                    pc.and_(table["accepted"], pc.equal(table["status"], CONVERGED)),
                    pc.equal(table["task"], task.name),
                )
                yield arrays_of(table.filter(kept), KEPT)
