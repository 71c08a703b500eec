"""Searches stored as folders, which a restarted server reads again.

Each folder has ``job.json`` (request and status), ``problem.json`` and, once the search has
started, the folder ``run`` of `bellcrank.workflows.start_design`.
"""

from __future__ import annotations

import json
import re
import secrets
import shutil
import time
from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING, Any

from bellcrank.errors import BellcrankError, InvalidFile, UnknownName
from bellcrank.model import read_design, read_problem, write_problem
from bellcrank.model.storage import read_text, write_text
from bellcrank.web.curves import Curves

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from bellcrank.model import Design, Problem

SCHEMA = "bellcrank/job/1"
NAME = re.compile(r"[a-z0-9]{12}")
UNFINISHED = ("queued", "running")
"""Statuses of the jobs that a starting server resumes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Record:
    """Stored data of a job.

    Parameters
    ----------
    title
        Name given by the user.
    session
        Browser session that started the job; the scheduler alternates between sessions.
    settings
        Settings of the search, as plain data.
    part
        Dimensions and material of the part, if given.
    task
        Table of the task, if it was started from one.
    reference
        Mask of a design drawn by hand, for comparison.
    refine
        Whether the initial design is refined, without a search.
    created
        Seconds since 1970.
    status
        ``queued``, ``running``, ``paused``, ``stopped``, ``finished`` or ``failed``.
    message
        Reason of a failure.
    efficiency
        Efficiency of the result, or of the best design so far.
    objective
        Name and value of what was maximised or minimised, if that is not the efficiency.
    met
        Whether the result meets all items by frames; None without a result or a specification.
    done
        Proposals of all chains when the search last ended.
    """

    title: str
    session: str
    settings: dict[str, Any]
    part: dict[str, Any] | None = None
    task: dict[str, Any] | None = None
    reference: str | None = None
    refine: bool = False
    created: float = 0.0
    status: str = "queued"
    message: str = ""
    efficiency: float | None = None
    objective: str = ""
    met: bool | None = None
    done: int = 0


@dataclass(slots=True, eq=False)
class Job:
    """A search: its record and, while it runs, its latest progress.

    Attributes
    ----------
    progress
        Latest progress message of the process.
    changed
        Number of changes, by which clients detect that there is a new state.
    """

    name: str
    path: Path
    record: Record
    curves: Curves = field(default_factory=Curves)
    progress: dict[str, Any] = field(default_factory=dict)
    moved: dict[str, Any] | None = None
    changed: int = 0
    curves_loaded: bool = False

    def update(self, **changes: Any) -> None:
        """Change the record and store it."""
        self.record = replace(self.record, **changes)
        self.changed += 1
        data = {"schema": SCHEMA, **asdict(self.record)}
        write_text(self.path / "job.json", json.dumps(data), overwrite=True)

    def receive(self, message: dict[str, Any]) -> None:
        """Store a progress message of the process."""
        for chain, points in message.pop("points").items():
            self.curves.add(chain, points)
        self.moved = message.pop("moved", self.moved)
        self.progress = message
        self.changed += 1

    def best(self) -> float | None:
        """Return the best efficiency that any process of the job has reported so far."""
        reported = [each["best"] for each in self.progress.get("chains", {}).values()]
        known = [value for value in (*reported, self.record.efficiency) if value is not None]
        return max(known, default=None)

    def summary(self) -> dict[str, Any]:
        """Return the entry of a job in the list of jobs."""
        record = self.record
        best = self.best()
        settings = record.settings
        return {
            "id": self.name,
            "title": record.title,
            "created": record.created,
            "status": record.status,
            "message": record.message,
            "efficiency": best
            if best is not None and record.status in UNFINISHED
            else record.efficiency,
            "objective": record.objective,
            "met": record.met,
            "method": settings["search"],
            "settings": settings,
            "part": record.part,
            "reference": record.reference,
            "refine": record.refine,
            "done": self.progress.get("done", record.done),
            "total": settings["steps"] * settings["chains"],
            "has_design": (self.path / "run" / "design.json").exists(),
        }

    def problem(self) -> Problem:
        """Read the task."""
        started = self.path / "run" / "run.json"
        if started.exists():
            from bellcrank.storage import RunFolder

            return RunFolder.open(started.parent).problem
        return read_problem(self.path / "problem.json")

    def design(self) -> Design | None:
        """Read the resulting design, if there is one."""
        path = self.path / "run" / "design.json"
        return read_design(path) if path.exists() else None


class Jobs:
    """All jobs in a folder.

    Parameters
    ----------
    folder
        Folder of the jobs; created if missing.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)
        self._jobs: dict[str, Job] = {}
        for path in sorted(folder.iterdir()):
            if NAME.fullmatch(path.name) and (path / "job.json").is_file():
                try:
                    self._jobs[path.name] = _read(path)
                except BellcrankError:
                    continue  # a damaged folder is left in place

    def __iter__(self) -> Iterator[Job]:
        return iter(sorted(self._jobs.values(), key=lambda job: -job.record.created))

    def __len__(self) -> int:
        return len(self._jobs)

    def __getitem__(self, name: str) -> Job:
        if name not in self._jobs:
            raise UnknownName(f"there is no run {name!r}")
        return self._jobs[name]

    def add(self, problem: Problem, record: Record) -> Job:
        """Store a new job."""
        name = secrets.token_hex(6)
        path = self.folder / name
        path.mkdir()
        write_problem(problem, path / "problem.json")
        job = Job(name, path, replace(record, created=time.time()), curves_loaded=True)
        job.update()
        self._jobs[name] = job
        return job

    def remove(self, name: str) -> None:
        """Delete a job with all its files."""
        job = self[name]
        shutil.rmtree(job.path, ignore_errors=True)
        del self._jobs[name]


def _read(path: Path) -> Job:
    try:
        data = json.loads(read_text(path / "job.json"))
        if data.pop("schema", None) != SCHEMA:
            raise InvalidFile(f"{path}: not a job")
        return Job(path.name, path, Record(**data))
    except (TypeError, ValueError, AttributeError) as error:
        raise InvalidFile(f"{path}: not a job ({error})") from None
