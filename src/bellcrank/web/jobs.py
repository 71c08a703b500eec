"""Searches as folders on disk, found again by every server that looks there.

Each has ``job.json`` (what was asked for, and how it stands), ``problem.json`` and, once it has
begun, the folder ``run`` of `bellcrank.workflows.start_design`.
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
from bellcrank.web.tracing import Trace

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from bellcrank.model import Design, Problem

SCHEMA = "bellcrank/job/1"
NAME = re.compile(r"[a-z0-9]{12}")
ALIVE = ("queued", "running")
"""What a server that starts takes up again."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Record:
    """What is kept of a job.

    Parameters
    ----------
    title
        As a person called it.
    session
        Of whom; searches of different sessions take turns.
    settings
        Of the search, as plain data.
    part
        What the design will be made as, if that was said.
    reference
        Mask of a design drawn by hand, to compare with.
    created
        Seconds since 1970.
    status
        ``queued``, ``running``, ``paused``, ``stopped``, ``finished`` or ``failed``.
    message
        Why it failed.
    efficiency
        Of the design that came out, or of the best so far.
    done
        Proposals made, by all chains, when it last ended.
    """

    title: str
    session: str
    settings: dict[str, Any]
    part: dict[str, Any] | None = None
    reference: str | None = None
    created: float = 0.0
    status: str = "queued"
    message: str = ""
    efficiency: float | None = None
    done: int = 0


@dataclass(slots=True, eq=False)
class Job:
    """A search: its record, and while it runs what it last told.

    Attributes
    ----------
    told
        The last progress.
    changed
        Counts what has happened, so that followers see when there is news.
    """

    name: str
    path: Path
    record: Record
    trace: Trace = field(default_factory=Trace)
    told: dict[str, Any] = field(default_factory=dict)
    moved: dict[str, Any] | None = None
    changed: int = 0
    known_trace: bool = False

    def update(self, **changes: Any) -> None:
        """Change the record, and keep it."""
        self.record = replace(self.record, **changes)
        self.changed += 1
        data = {"schema": SCHEMA, **asdict(self.record)}
        write_text(self.path / "job.json", json.dumps(data), overwrite=True)

    def hear(self, message: dict[str, Any]) -> None:
        """Take in the progress of its process."""
        for chain, points in message.pop("points").items():
            self.trace.add(chain, points)
        self.moved = message.pop("moved", self.moved)
        self.told = message
        self.changed += 1

    def best(self) -> float | None:
        """Return the best efficiency that its process has told of."""
        told = [each["best"] for each in self.told.get("chains", {}).values()]
        return max((value for value in told if value is not None), default=None)

    def summary(self) -> dict[str, Any]:
        """Return what a list of jobs shows."""
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
            if best is not None and record.status in ALIVE
            else record.efficiency,
            "method": settings["search"],
            "settings": settings,
            "part": record.part,
            "reference": record.reference,
            "done": self.told.get("done", record.done),
            "total": settings["steps"] * settings["chains"],
            "has_design": (self.path / "run" / "design.json").exists(),
        }

    def problem(self) -> Problem:
        """Read its task; with the stiffness of struts where it is for a part."""
        begun = self.path / "run" / "run.json"
        if begun.exists():
            from bellcrank.storage import RunFolder

            return RunFolder.open(begun.parent).problem
        return read_problem(self.path / "problem.json")

    def design(self) -> Design | None:
        """Read the design that came out, if there is one."""
        path = self.path / "run" / "design.json"
        return read_design(path) if path.exists() else None


class Jobs:
    """All jobs in a folder.

    Parameters
    ----------
    folder
        Where they are kept; made if need be.
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
                    continue  # what is damaged is left for a person to look at

    def __iter__(self) -> Iterator[Job]:
        return iter(sorted(self._jobs.values(), key=lambda job: -job.record.created))

    def __len__(self) -> int:
        return len(self._jobs)

    def __getitem__(self, name: str) -> Job:
        if name not in self._jobs:
            raise UnknownName(f"there is no run {name!r}")
        return self._jobs[name]

    def add(self, problem: Problem, record: Record) -> Job:
        """Keep a new job."""
        name = secrets.token_hex(6)
        path = self.folder / name
        path.mkdir()
        write_problem(problem, path / "problem.json")
        job = Job(name, path, replace(record, created=time.time()), known_trace=True)
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
