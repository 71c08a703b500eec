"""What a campaign is asked to do: a short TOML file, and what it resolves to.

::

    name = "first"
    segment = 4000            # steps in one file of the store; optional

    [[tasks]]
    problem = "crane"         # a built-in name, or a file beside this one
    search = "paper"          # any search, with any of its settings
    steps = 20_000
    seeds = 30                # 0 to 29; or [first, last]
    name = "as-published"     # optional; the default is crane-paper

A run is one chain of one task with one seed.
"""

from __future__ import annotations

import hashlib
import json
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
from bellcrank.storage.description import plain, spec_hash

if TYPE_CHECKING:
    import os
    from collections.abc import Iterator

SEGMENT = 4000
"""Steps in one file of the store: what a kill can cost in time."""
SEGMENT_UNIT = 250
"""A chain can be stopped between two blocks of so many steps."""
MOST_SEED = 2**62
MOST_RUNS = 10**7
RESERVED = {"seed": "seeds", "chains": "seeds"}
"""Settings of a search that a campaign sets for each run, and what says so in its spec."""


class TaskTable(Table):
    """One entry of ``tasks``; keys not named here are settings of the search."""

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
    """One problem, one search, many seeds.

    Parameters
    ----------
    name
        Unique in its campaign.
    problem
        Schema ``bellcrank/problem/1``.
    settings
        Of the search, as plain data, without seed and number of chains.
    first_seed, last_seed
        Both included.
    """

    name: str
    problem: dict[str, Any]
    settings: dict[str, Any]
    first_seed: int
    last_seed: int

    @property
    def hash(self) -> str:
        """Identity of problem and settings."""
        return spec_hash(self.problem, self.settings)

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
    """One chain.

    Parameters
    ----------
    number
        In its campaign, from 0.
    id
        Named by content: what the task is, and the seed.
    task, seed
        What to run.
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
    """A spec with everything resolved: no file beside it is needed any more.

    Parameters
    ----------
    name
        Of the campaign.
    segment
        Steps after which a chain's rows are stored.
    tasks
        In order; their runs are numbered through.

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
        text = json.dumps(self.to_dict(), sort_keys=True, separators=(",", ":"))
        object.__setattr__(self, "hash", hashlib.sha256(text.encode()).hexdigest())
        object.__setattr__(self, "_stems", tuple(task.hash[:12] for task in self.tasks))

    @property
    def run_count(self) -> int:
        """Number of runs of all tasks."""
        return sum(task.run_count for task in self.tasks)

    @property
    def mask_bytes(self) -> int:
        """Bytes of a mask in the store: those of the problem with the most beams."""
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
    r"""Read a spec, with the problems that it names.

    Raises
    ------
    InvalidFile
        Naming the file and the first thing in it that is wrong.

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
        except (InvalidFile, InvalidProblem) as error:  # which name the file themselves
            raise InvalidFile(str(error) if where in str(error) else f"{where}: {error}") from None
        except BellcrankError as error:
            raise InvalidFile(f"{where}: {error}") from None
    _require_distinct(tasks, str(path))
    return Spec(table.name, table.segment, tuple(tasks))


def _resolve(entry: TaskTable, where: str, folder: Path) -> Task:
    """Find the problem of a task and complete its settings."""
    from bellcrank.search import read_settings

    given = dict(entry.model_extra or {})
    for key, instead in RESERVED.items():
        if key in given:
            raise InvalidFile(f"{where}: {key}: is set for each run; say {instead} instead")
    first, last = _seeds(entry.seeds, where)
    is_name = entry.problem in builtin
    try:
        problem = find_problem(entry.problem if is_name else folder / entry.problem)
    except UnknownName:
        raise InvalidFile(
            f"{where}: problem: unknown problem {entry.problem!r}; known: {', '.join(builtin)}; "
            f"and there is no such file beside the spec"
        ) from None
    completed = read_settings(given).to_dict()
    of_runs = {key: value for key, value in completed.items() if key not in RESERVED}
    settings = plain("settings", of_runs)
    name = entry.name or f"{problem.name}-{settings['search']}"
    return Task(name, plain("problem", problem_to_dict(problem)), settings, first, last)


def _seeds(seeds: int | list[int], where: str) -> tuple[int, int]:
    """Return the first and the last seed."""
    bounds = [0, seeds - 1] if isinstance(seeds, int) else seeds
    ordered = len(bounds) == 2 and 0 <= bounds[0] <= bounds[1] <= MOST_SEED
    if not ordered or bounds[1] - bounds[0] >= MOST_RUNS:
        raise InvalidFile(
            f"{where}: seeds: expected a count from 1 to {MOST_RUNS} or [first, last] with "
            f"0 <= first <= last, got {seeds!r}"
        )
    return bounds[0], bounds[1]


def _require_distinct(tasks: list[Task], source: str) -> None:
    """Refuse two tasks of one name, and two that would make the same run."""
    names: dict[str, int] = {}
    for index, task in enumerate(tasks):
        if (other := names.setdefault(task.name, index)) != index:
            raise InvalidFile(
                f"{source}: tasks[{index}]: name {task.name!r} is that of tasks[{other}] already; "
                f"give one of them another"
            )
        for before in tasks[:index]:
            apart = task.first_seed > before.last_seed or task.last_seed < before.first_seed
            if not apart and task.hash == before.hash:
                raise InvalidFile(
                    f"{source}: tasks {before.name!r} and {task.name!r} are the same and share "
                    f"seed {max(task.first_seed, before.first_seed)}; keep one of them"
                )
