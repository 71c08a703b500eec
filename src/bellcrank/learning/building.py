"""Datasets from campaigns: many short runs of a search, both ways, and all that they proposed."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.campaign import EngineOptions, Spec, Store, Task, complete
from bellcrank.errors import CorruptRun, InvalidDataset, InvalidSettings
from bellcrank.mechanics import Status
from bellcrank.model import problem_to_dict
from bellcrank.model.storage import check_folder
from bellcrank.provenance import provenance
from bellcrank.runs.description import plain
from bellcrank.runs.shards import arrays_of, parquet_file
from bellcrank.search import read_settings
from bellcrank.surrogate.dataset import DATASET_FILE, Dataset

if TYPE_CHECKING:
    import os
    import threading
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

    from bellcrank.campaign import Status as CampaignStatus
    from bellcrank.model import Problem

CAMPAIGN = "campaign"
"""Folder of the campaign, beside the dataset."""
PAPER_RUNS = 2000
PAPER_STEPS = 582
"""Of a run: 2000 of them make the paper's 1,163,733 configurations, within a few hundred."""
COLUMNS = ("seed", "step", "mask", "efficiency", "accepted", "status")


@dataclass(frozen=True, slots=True, kw_only=True)
class DatasetSpec:
    """What a dataset is made of; the defaults are the paper's.

    Parameters
    ----------
    problem
        What the designs are for.
    runs
        Number of runs; every second one searches for the most negative efficiency.
    steps
        Proposals of a run.
    seed
        Of the first run; each run has the next.
    search
        Settings of the search, where they differ from those of ``paper``.

    Raises
    ------
    InvalidSettings
    """

    problem: Problem
    runs: int = PAPER_RUNS
    steps: int = PAPER_STEPS
    seed: int = 0
    search: dict[str, Any] | None = None

    def __post_init__(self) -> None:
        for name, least in (("runs", 1), ("steps", 1), ("seed", 0)):
            if getattr(self, name) < least:
                raise InvalidSettings(
                    f"{name}: expected at least {least}, got {getattr(self, name)}"
                )

    def campaign(self) -> Spec:
        """Return the campaign: one task forward, one for the reversed output."""
        given = {"search": "paper", **(self.search or {}), "steps": self.steps}
        settings = read_settings(given).to_dict()
        settings = {key: settings[key] for key in settings if key not in ("seed", "chains")}
        half = (self.runs + 1) // 2
        tasks = [_task(self.problem, "forward", settings, self.seed, half)]
        if self.runs > 1:
            backward = reverse(self.problem)
            tasks.append(_task(backward, "backward", settings, self.seed + half, self.runs - half))
        return Spec(f"{self.problem.name}-dataset", _segment(self.steps), tuple(tasks))


def reverse(problem: Problem) -> Problem:
    """Return a problem that asks for the opposite motion: its efficiencies have the other sign.

    Examples
    --------
    >>> from bellcrank.mechanics import Evaluator
    >>> from bellcrank.model import find_problem
    >>> crane = find_problem("crane")
    >>> there = Evaluator(crane).respond(crane.initial).efficiency
    >>> back = Evaluator(reverse(crane)).respond(crane.initial).efficiency
    >>> there == -back
    True
    """
    output = replace(problem.output, direction=-problem.output.direction)
    return replace(problem, name=f"{problem.name}-reversed", output=output)


def build_dataset(
    spec: DatasetSpec,
    folder: str | os.PathLike[str],
    *,
    workers: int | None = None,
    tell: Callable[[CampaignStatus], None] = lambda _status: None,
    stop: threading.Event | None = None,
) -> Dataset | None:
    """Run the campaign, or what is left of it, and gather what it found.

    Called again after a stop or a kill, it goes on where it was.

    Parameters
    ----------
    folder
        Gets ``dataset.parquet``, and the campaign in a folder of its own.
    workers
        Processes; all cores by default.
    tell
        Called now and then with how the campaign stands.
    stop
        Set it to end soon; what is done is kept.

    Returns
    -------
    Dataset or None
        None if it was stopped.

    Raises
    ------
    InvalidSettings
        If another dataset lies there.
    StorageError, CorruptRun
    """
    place = Path(folder)
    place.mkdir(parents=True, exist_ok=True) if place.parent.exists() else None
    check_folder(place / DATASET_FILE)
    store = Store.create(place / CAMPAIGN, spec.campaign())
    if not complete(store, options=EngineOptions(workers=workers), tell=tell, stop=stop):
        return None
    data = gather(store, spec.problem)
    data.write(place / DATASET_FILE, overwrite=True)
    return data


def gather(store: Store, problem: Problem) -> Dataset:
    """Return all designs that a campaign has proposed and that have a unique, stable response.

    Parameters
    ----------
    store
        Of runs forward and backward.
    problem
        The one that runs forward.

    Raises
    ------
    CorruptRun
        If a file is damaged.
    InvalidDataset
        If there is nothing in it.
    """
    forward = store.spec.tasks[0]
    parts: list[dict[str, NDArray[Any]]] = []
    for part in _tables(store):
        kept = part["status"] == int(Status.CONVERGED)
        parts.append({**{name: part[name][kept] for name in COLUMNS}, "left": ~kept})
    if not parts:
        raise InvalidDataset(f"{store.path}: nothing is stored yet")
    found = {name: np.concatenate([part[name] for part in parts]) for name in (*COLUMNS, "left")}
    backwards = found["seed"] > forward.last_seed
    origin = {
        "runs": store.spec.run_count,
        "forward": forward.run_count,
        "first_seed": forward.first_seed,
        "left_out": int(found["left"].sum()),
        "settings": forward.settings,
        "provenance": provenance(),
    }
    return Dataset(
        problem,
        found["mask"][:, : forward.mask_bytes],
        np.where(backwards, -found["efficiency"], found["efficiency"]),
        found["seed"] - forward.first_seed,
        found["step"],
        found["accepted"],
        origin,
    )


def _tables(store: Store) -> Iterator[dict[str, NDArray[Any]]]:
    for path in store.files():
        with parquet_file(path, "resume the campaign that it belongs to") as (file, _):
            if missing := [name for name in COLUMNS if name not in file.schema_arrow.names]:
                raise CorruptRun(f"{path}: has no column {missing[0]!r}")
            yield arrays_of(file.read(columns=list(COLUMNS)), COLUMNS)


def _task(problem: Problem, name: str, settings: dict[str, Any], first: int, count: int) -> Task:
    told = plain("problem", problem_to_dict(problem))
    return Task(name, told, plain("settings", settings), first, first + count - 1)


def _segment(steps: int) -> int:
    """Return a size of segments that holds a whole run where that is not much."""
    return min(-(-steps // 250) * 250, 4000)
