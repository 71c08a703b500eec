"""Datasets from campaigns of searches, half of them with the reversed output."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.campaign import EngineOptions, Spec, Store, Task, complete
from bellcrank.errors import CorruptRun, InvalidDataset, InvalidSettings, OutputExists
from bellcrank.mechanics import Status, objective_of
from bellcrank.model import problem_to_dict
from bellcrank.model.storage import check_folder
from bellcrank.search import read_settings
from bellcrank.storage.description import plain
from bellcrank.storage.files import make_folder
from bellcrank.storage.parquet import arrays_of, parquet_file
from bellcrank.surrogate.dataset import DATASET_FILE, Dataset

if TYPE_CHECKING:
    import os
    import threading
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

    from bellcrank.campaign import Status as CampaignStatus
    from bellcrank.model import Problem

CAMPAIGN = "campaign"
"""Folder of the campaign in the folder of the dataset."""
PAPER_RUNS = 2000
PAPER_STEPS = 582
"""Proposals of a run: 2000 runs give the paper's 1,163,733 configurations within a few hundred."""
ODD_EXPONENT = 2.0
"""Exponent n for which f_n(gamma) = 2 cos(gamma/2)^n - 1 changes its sign with the motion."""
OWN = ("steps", "seed", "chains")
"""Settings of a search that the dataset sets; the campaign sets the last two."""
LABELS: dict[str, Any] = {"objective": None, "unloaded_beams": "keep", "strokes": [1.0]}
"""Settings of a search that define the efficiency, with the values of `bellcrank evaluate`."""
COLUMNS = ("seed", "step", "mask", "efficiency", "accepted", "status")


@dataclass(frozen=True, slots=True, kw_only=True)
class DatasetSpec:
    """Specification of a dataset; the defaults are the paper's.

    Parameters
    ----------
    problem
        The problem.
    runs
        Number of runs; the second half of them searches for the most negative efficiency.
    steps
        Proposals of a run.
    seed
        Seed of the first run; each further run has the next.
    every
        Store every n-th proposal of a run only. Consecutive proposals of a long run are similar;
        the campaign keeps all of them.
    search
        Settings that differ from those of the search ``paper``.

    Raises
    ------
    InvalidSettings
        If a number is too small, a setting changes the definition of the efficiency, or the
        efficiency of the reversed motion is not the negative efficiency, so that runs with the
        reversed output do not apply to the problem.
    """

    problem: Problem
    runs: int = PAPER_RUNS
    steps: int = PAPER_STEPS
    seed: int = 0
    every: int = 1
    search: dict[str, Any] | None = None

    def __post_init__(self) -> None:
        for name, least in (("runs", 1), ("steps", 1), ("seed", 0), ("every", 1)):
            if getattr(self, name) < least:
                raise InvalidSettings(
                    f"{name}: expected at least {least}, got {getattr(self, name)}"
                )
        exponent = objective_of(self.problem).exponent
        if self.runs > 1 and exponent != ODD_EXPONENT:
            raise InvalidSettings(
                f"{self.problem.name!r}: with the exponent {exponent:g} of its objective, the "
                f"efficiencies of a motion and its reverse are not opposite; use the objective "
                f"'displacement', or a single run"
            )
        if taken := [key for key in OWN if key in (self.search or {})]:
            raise InvalidSettings(f"{taken[0]}: set by the dataset for each run; leave it out")
        settings = self._settings()
        for key, value in LABELS.items():
            if settings[key] != value:
                raise InvalidSettings(
                    f"{key}: {settings[key]!r} changes the efficiencies of "
                    f"{self.problem.name!r}; expected {value!r}"
                )

    def _settings(self) -> dict[str, Any]:
        given = {"search": "paper", **(self.search or {}), "steps": self.steps}
        return plain("settings", read_settings(given).to_dict())

    def campaign(self) -> Spec:
        """Return the campaign: one task with the output as given, one with the reversed output."""
        settings = {key: value for key, value in self._settings().items() if key not in OWN[1:]}
        half = (self.runs + 1) // 2
        tasks = [_task(self.problem, "forward", settings, self.seed, half)]
        if self.runs > 1:
            backward = reverse(self.problem)
            tasks.append(_task(backward, "backward", settings, self.seed + half, self.runs - half))
        return Spec(f"{self.problem.name}-dataset", _segment(self.steps), tuple(tasks))


def reverse(problem: Problem) -> Problem:
    """Return the problem with the reversed output: its efficiencies have the opposite sign.

    Examples
    --------
    >>> from bellcrank.mechanics import SpringEvaluator
    >>> from bellcrank.model import find_problem
    >>> crane = find_problem("crane")
    >>> there = SpringEvaluator(crane).evaluate(crane.initial).efficiency
    >>> back = SpringEvaluator(reverse(crane)).evaluate(crane.initial).efficiency
    >>> there == -back
    True
    """
    output = replace(problem.output, direction=-problem.output.direction)
    return replace(problem, name=f"{problem.name}-reversed", output=output)


def build_dataset(
    spec: DatasetSpec,
    folder: str | os.PathLike[str],
    *,
    engine: str = "processes",
    workers: int | None = None,
    report: Callable[[CampaignStatus], None] = lambda _status: None,
    stop: threading.Event | None = None,
) -> Dataset | None:
    """Run the campaign, or the rest of it, and write its proposals as a dataset.

    Call it again to resume after a stop or a kill. A call after the end writes the same bytes, or
    with another `every` another sample of the same runs.

    Parameters
    ----------
    folder
        Folder for ``dataset.parquet`` and the folder of the campaign.
    engine
        Engine of the campaign; by default local processes.
    workers
        Number of processes; all cores by default.
    report
        Called now and then with how the campaign stands.
    stop
        Stops the campaign when set; finished work is kept.

    Returns
    -------
    Dataset or None
        None if stopped.

    Raises
    ------
    InvalidSettings
        If the folder contains another campaign, or the number of workers is less than 1.
    OutputExists
        If the folder contains a dataset without its campaign.
    StorageError, CorruptRun
    """
    options = EngineOptions(workers=workers)
    root = Path(folder)
    make_folder(root)
    check_folder(root / DATASET_FILE)
    if (root / DATASET_FILE).exists() and not (root / CAMPAIGN).exists():
        raise OutputExists(
            f"{root / DATASET_FILE}: exists already, without its campaign; choose another folder "
            f"(--out)"
        )
    store = Store.create(root / CAMPAIGN, spec.campaign())
    if not complete(store, engine, options, report=report, stop=stop):
        return None
    data = gather(store, spec.problem, spec.every)
    data.write(root / DATASET_FILE, overwrite=True)
    return data


def gather(store: Store, problem: Problem, every: int = 1) -> Dataset:
    """Return the proposals of a campaign that have a unique, stable response.

    Parameters
    ----------
    store
        Store of the campaign.
    problem
        The problem with the output as given.
    every
        Return those whose step is a multiple of it.

    Raises
    ------
    CorruptRun
        If a file is damaged.
    InvalidDataset
        If it is empty.
    """
    forward = store.spec.tasks[0]
    parts: list[dict[str, NDArray[Any]]] = []
    for part in _tables(store):
        sampled = part["step"] % every == 0
        stored = sampled & (part["status"] == int(Status.CONVERGED))
        parts.append({**{name: part[name][stored] for name in COLUMNS}, "left": sampled & ~stored})
    if not parts:
        raise InvalidDataset(f"{store.path}: the campaign has no results yet")
    found = {name: np.concatenate([part[name] for part in parts]) for name in (*COLUMNS, "left")}
    backwards = found["seed"] > forward.last_seed
    origin = {
        "runs": store.spec.run_count,
        "forward": forward.run_count,
        "first_seed": forward.first_seed,
        "left_out": int(found["left"].sum()),
        "every": every,
        "settings": forward.settings,
        "provenance": store.provenance,
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
    data = plain("problem", problem_to_dict(problem))
    return Task(name, data, settings, first, first + count - 1)


def _segment(steps: int) -> int:
    """Return the size of a segment: a whole run, up to a limit."""
    return min(-(-steps // 250) * 250, 4000)
