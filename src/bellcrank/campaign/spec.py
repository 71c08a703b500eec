"""The spec of a campaign: a short TOML file, and its resolved form.

::

    name = "first"
    segment = 4000            # steps in one file of the store; optional

    [[tasks]]
    problem = "crane"         # a bundled problem, or a file relative to this one
    search = "paper"          # and any other setting of the search
    steps = 25_000
    seeds = 30                # 0 to 29; or [first, last]
    name = "as-published"     # optional; the default is crane-paper

A run is one chain of one task with one seed.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from pydantic import ConfigDict, Field

from bellcrank.errors import (
    BellcrankError,
    InvalidFile,
    InvalidProblem,
    InvalidSettings,
    UnknownName,
)
from bellcrank.model import find_problem, problem_to_dict
from bellcrank.model.builtin import builtin
from bellcrank.model.parsing import Table, parse, read_toml
from bellcrank.storage.description import content_hash, first_difference, plain

if TYPE_CHECKING:
    import os
    from collections.abc import Iterator

SEGMENT = 4000
"""Default number of steps in a file of the store; a kill loses at most these."""
SEGMENT_UNIT = 250
"""Steps of a block of a search; segments end between two blocks."""
MAX_SEED = 2**62
MAX_RUNS = 10**7
RESERVED = {"seed": "seeds", "chains": "seeds"}
"""Settings of a search that a campaign sets for each run, and the key of the spec for them."""


class TaskTable(Table):
    """One entry of ``tasks``; all other keys are settings of the search."""

    model_config = ConfigDict(extra="allow")

    problem: str = Field(min_length=1)
    seeds: int | list[int]
    name: str | None = Field(default=None, min_length=1, max_length=100)


class SpecTable(Table):
    """A whole spec."""

    schema_: Literal["bellcrank/campaign/1"] = Field("bellcrank/campaign/1", alias="schema")
    name: str = Field(min_length=1, max_length=100)
    segment: int = Field(default=SEGMENT, ge=SEGMENT_UNIT, multiple_of=SEGMENT_UNIT)
    tasks: list[TaskTable] = Field(min_length=1)


@dataclass(frozen=True, slots=True)
class Task:
    """One problem and one search with many seeds.

    Parameters
    ----------
    name
        Name, unique in its campaign.
    problem
        Plain data of schema ``bellcrank/problem/1``.
    settings
        Settings of the search, as plain data, without seed and number of chains.
    first_seed, last_seed
        First and last seed, both included.
    """

    name: str
    problem: dict[str, Any]
    settings: dict[str, Any]
    first_seed: int
    last_seed: int

    @property
    def hash(self) -> str:
        """Hash of problem and settings."""
        return content_hash({"problem": self.problem, "settings": self.settings})

    @property
    def run_count(self) -> int:
        """Number of seeds."""
        return self.last_seed - self.first_seed + 1

    @property
    def mask_bytes(self) -> int:
        """Bytes of a packed mask over the problem's beams."""
        return (len(self.problem["beams"]) + 7) // 8

    def to_dict(self) -> dict[str, Any]:
        """Return the task as plain data, as ``campaign.json`` keeps it."""
        return {
            "name": self.name,
            "seeds": [self.first_seed, self.last_seed],
            "settings": self.settings,
            "problem": self.problem,
        }

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Task:
        """Rebuild a task from plain data."""
        first, last = data["seeds"]
        return cls(data["name"], data["problem"], data["settings"], first, last)


@dataclass(frozen=True, slots=True)
class Run:
    """One chain of a task.

    Parameters
    ----------
    number
        Number in its campaign, from 0.
    id
        Name: the start of the hash of the task, and the seed.
    task, seed
        Task and seed.
    """

    number: int
    id: str
    task: Task
    seed: int

    @property
    def settings(self) -> dict[str, Any]:
        """Settings of this chain, as plain data."""
        return {**self.task.settings, "seed": self.seed, "chains": 1}


@dataclass(frozen=True, slots=True)
class Spec:
    """A resolved spec, which refers to no other file.

    Parameters
    ----------
    name
        Name of the campaign.
    segment
        Number of steps in a segment.
    tasks
        Tasks in order; their runs are numbered consecutively.

    Examples
    --------
    >>> task = Task("t", {"beams": [[0, 1]]}, {"steps": 10}, 5, 7)
    >>> spec = Spec("small", 4000, (task,))
    >>> [(run.number, run.seed) for run in spec.runs()]
    [(0, 5), (1, 6), (2, 7)]
    >>> spec.run(2) == list(spec.runs())[2]
    True
    """

    name: str
    segment: int
    tasks: tuple[Task, ...]
    hash: str = field(init=False, compare=False)
    _stems: tuple[str, ...] = field(init=False, compare=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "hash", content_hash(self.to_dict()))
        object.__setattr__(self, "_stems", tuple(task.hash[:12] for task in self.tasks))

    @property
    def run_count(self) -> int:
        """Number of runs of all tasks."""
        return sum(task.run_count for task in self.tasks)

    @property
    def mask_bytes(self) -> int:
        """Bytes of a mask in the store: those of the largest problem."""
        return max(task.mask_bytes for task in self.tasks)

    def task(self, name: str) -> Task:
        """Return the task of that name.

        Raises
        ------
        InvalidSettings
            If there is none.
        """
        for task in self.tasks:
            if task.name == name:
                return task
        known = ", ".join(task.name for task in self.tasks)
        raise InvalidSettings(f"no task {name!r} in this campaign; it has: {known}")

    def run(self, number: int) -> Run:
        """Return the run of that number.

        Raises
        ------
        InvalidFile
            If there is none.
        """
        rest = number
        for stem, task in zip(self._stems, self.tasks, strict=True):
            if 0 <= rest < task.run_count:
                seed = task.first_seed + rest
                return Run(number, f"{stem}-{seed}", task, seed)
            rest -= task.run_count
        raise InvalidFile(f"campaign {self.name!r}: no run {number}; it has {self.run_count}")

    def runs(self) -> Iterator[Run]:
        """Yield all runs in order."""
        return map(self.run, range(self.run_count))

    def to_dict(self) -> dict[str, Any]:
        """Return the spec as plain data."""
        tasks = [task.to_dict() for task in self.tasks]
        return {"name": self.name, "segment": self.segment, "tasks": tasks}

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Spec:
        """Rebuild a spec from plain data."""
        tasks = tuple(Task.from_dict(task) for task in data["tasks"])
        return cls(data["name"], data["segment"], tasks)


def read_spec(path: str | os.PathLike[str]) -> Spec:
    r"""Read a spec and the problems that it names.

    Raises
    ------
    InvalidFile
        If it is invalid; the message names the file and the first offending entry.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder) / "spec.toml"
    ...     _ = path.write_text('name = "a"\n[[tasks]]\nproblem = "scaling-8"\nseeds = 3')
    ...     spec = read_spec(path)
    >>> spec.run_count, spec.tasks[0].first_seed, spec.segment
    (3, 0, 4000)
    """
    table = parse(SpecTable, read_toml(path), str(path))
    tasks = []
    for index, entry in enumerate(table.tasks):
        where = f"{path}: tasks[{index}]"
        try:
            tasks.append(_resolve(entry, where, Path(path).parent))
        except (InvalidFile, InvalidProblem) as error:  # their messages name the file
            raise InvalidFile(str(error) if where in str(error) else f"{where}: {error}") from None
        except BellcrankError as error:
            raise InvalidFile(f"{where}: {error}") from None
    _require_distinct(tasks, str(path))
    return Spec(table.name, table.segment, tuple(tasks))


def _resolve(entry: TaskTable, where: str, folder: Path) -> Task:
    """Load the problem of a task and complete its settings."""
    from bellcrank.search import read_settings

    given = dict(entry.model_extra or {})
    for key, instead in RESERVED.items():
        if key in given:
            raise InvalidFile(f"{where}: {key}: is set for each run; use {instead} instead")
    first, last = _seeds(entry.seeds, where)
    is_name = entry.problem in builtin
    try:
        problem = find_problem(entry.problem if is_name else folder / entry.problem)
    except UnknownName:
        raise InvalidFile(
            f"{where}: problem: unknown problem {entry.problem!r}; known: {', '.join(builtin)}; "
            f"and {folder} has no such file"
        ) from None
    completed = read_settings(given).to_dict()
    of_runs = {key: value for key, value in completed.items() if key not in RESERVED}
    settings = plain("settings", of_runs)
    name = entry.name or f"{problem.name}-{settings['search']}"
    return Task(name, plain("problem", problem_to_dict(problem)), settings, first, last)


def _seeds(seeds: int | list[int], where: str) -> tuple[int, int]:
    """Return the first and the last seed."""
    bounds = [0, seeds - 1] if isinstance(seeds, int) else seeds
    ordered = len(bounds) == 2 and 0 <= bounds[0] <= bounds[1] <= MAX_SEED
    if not ordered or bounds[1] - bounds[0] >= MAX_RUNS:
        raise InvalidFile(
            f"{where}: seeds: expected a count from 1 to {MAX_RUNS} or [first, last] with "
            f"0 <= first <= last, got {seeds!r}"
        )
    return bounds[0], bounds[1]


def _require_distinct(tasks: list[Task], source: str) -> None:
    """Check that no two tasks have the same name or share a run."""
    names: dict[str, int] = {}
    for index, task in enumerate(tasks):
        if (other := names.setdefault(task.name, index)) != index:
            raise InvalidFile(
                f"{source}: tasks[{index}]: name {task.name!r} is also that of tasks[{other}]; "
                f"rename one of them"
            )
        for before in tasks[:index]:
            apart = task.first_seed > before.last_seed or task.last_seed < before.first_seed
            if not apart and task.hash == before.hash:
                raise InvalidFile(
                    f"{source}: tasks {before.name!r} and {task.name!r} are equal and share seed "
                    f"{max(task.first_seed, before.first_seed)}; remove one of them"
                )


def spec_difference(old: Spec, new: Spec) -> str | None:
    """Return the first difference between two specs in words, or None.

    Examples
    --------
    >>> task = Task("t", {"beams": [[0, 1]]}, {"steps": 10}, 0, 4)
    >>> old = Spec("a", 4000, (task,))
    >>> spec_difference(old, Spec("a", 4000, (Task("t", task.problem, {"steps": 20}, 0, 4),)))
    "task 't': settings: steps is 10 there and 20 here"
    >>> spec_difference(old, Spec("a", 4000, (task, Task("u", task.problem, {}, 0, 4))))
    "task 'u' is missing there"
    """
    if old.hash == new.hash:
        return None
    own = ({"name": spec.name, "segment": spec.segment} for spec in (old, new))
    if difference := first_difference(*own):
        return difference
    before = {task.name: task.to_dict() for task in old.tasks}
    after = {task.name: task.to_dict() for task in new.tasks}
    for name, task in after.items():
        if name not in before:
            return f"task {name!r} is missing there"
        for key in ("settings", "problem"):
            if difference := first_difference(before[name][key], task[key]):
                return f"task {name!r}: {key}: {difference}"
        if difference := first_difference(before[name], task):
            return f"task {name!r}: {difference}"
    missing = [name for name in before if name not in after]
    return f"task {missing[0]!r} is missing here" if missing else "the tasks have another order"
