"""Designs to open, from several sources.

A source lists entries and gives the design of each. A further one, such as a library, is a class
with two methods and a line in `app.py`.
"""

from __future__ import annotations

import json
import re
import secrets
import threading
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Protocol, get_args

import numpy as np

from bellcrank.errors import BellcrankError, UnknownName
from bellcrank.model import (
    Design,
    builtin,
    gallery_design,
    problem_to_dict,
    read_design,
    write_design,
)
from bellcrank.model.gallery import Kind
from bellcrank.web.solving import finite

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator
    from pathlib import Path

    from bellcrank.web.jobs import Jobs

NAME = re.compile(r"[a-z0-9]{12}")
AT_HAND = 200
"""Designs of runs that are not read again for every look at the gallery."""


@dataclass(frozen=True, slots=True, eq=False)
class Entry:
    """A design in the gallery.

    Parameters
    ----------
    key
        Its name within the source.
    title, note
        What to call it, and a few words more.
    design
        With efficiency and provenance, as far as they are known.
    facets
        By which it can be picked from among many, such as ``{"Size": "9 wide"}``.
    """

    key: str
    title: str
    note: str
    design: Design
    facets: dict[str, str] = field(default_factory=dict)


class Source(Protocol):
    """Where designs come from."""

    @property
    def name(self) -> str:
        """For addresses: small letters."""

    @property
    def title(self) -> str:
        """For people."""

    def entries(self) -> Iterable[Entry]:
        """Return all designs, the most interesting first."""

    def find(self, key: str) -> Entry | None:
        """Return the entry of that name, if there is one."""


class Once:
    """Entries that are read when somebody first looks, once, whoever looks at the same time.

    Parameters
    ----------
    read
        That reads them.
    """

    def __init__(self, read: Callable[[], Iterable[Entry]]) -> None:
        self._read = read
        self._lock = threading.Lock()
        self._entries: dict[str, Entry] | None = None

    def __call__(self) -> dict[str, Entry]:
        """Return all, by their keys."""
        with self._lock:
            if self._entries is None:
                self._entries = {entry.key: entry for entry in self._read()}
        return self._entries


class BuiltIn:
    """Designs that come with the package."""

    name = "builtin"
    title = "Comes with bellcrank"

    def __init__(self) -> None:
        self._known = Once(_built_in)

    def entries(self) -> Iterable[Entry]:
        """Return those of all built-in problems."""
        return self._known().values()

    def find(self, key: str) -> Entry | None:
        """Return the one of that name."""
        return self._known().get(key)


def _built_in() -> Iterator[Entry]:
    for problem in builtin:
        for kind in get_args(Kind):
            design = gallery_design(kind, problem)
            if design is not None:
                note = "drawn by hand" if kind == "human" else "found by a search"
                yield Entry(f"{kind}-{problem}", problem, note, design)


class OwnRuns:
    """What own searches have found."""

    name = "runs"
    title = "Your searches"

    def __init__(self, jobs: Jobs) -> None:
        self._jobs = jobs
        self._read: dict[str, tuple[float, Entry]] = {}

    def entries(self) -> Iterable[Entry]:
        """Return the design of every search that has one, the latest first."""
        for job in self._jobs:
            entry = self.find(job.name)
            if entry is not None:
                yield entry

    def find(self, key: str) -> Entry | None:
        """Return the design of a job."""
        try:
            job = self._jobs[key]
            made = (job.path / "run" / "design.json").stat().st_mtime
            at_hand = self._read.get(key)
            if at_hand is not None and at_hand[0] == made:
                return at_hand[1]
            design = job.design()
        except (BellcrankError, OSError):
            return None
        if design is None:
            return None
        entry = Entry(key, job.record.title, job.record.settings["search"], design)
        if len(self._read) >= AT_HAND:
            self._read.clear()
        self._read[key] = (made, entry)
        return entry


class Kept:
    """Designs that were drawn by hand or put together here.

    Parameters
    ----------
    folder
        Of their files.
    """

    name = "kept"
    title = "Kept designs"

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        folder.mkdir(parents=True, exist_ok=True)

    def entries(self) -> Iterable[Entry]:
        """Return all, the latest first."""
        paths = sorted(self._folder.glob("*.json"), key=lambda path: -path.stat().st_mtime)
        for path in paths:
            entry = self.find(path.stem)
            if entry is not None:
                yield entry

    def find(self, key: str) -> Entry | None:
        """Return the one of that name."""
        path = self._folder / f"{key}.json"
        if not NAME.fullmatch(key) or not path.is_file():
            return None
        try:
            design = read_design(path)
        except BellcrankError:
            return None
        kind = {"drawn": "drawn by hand", "assembled": "a machine"}
        return Entry(
            key, design.problem.name, kind.get(str(design.provenance.get("kind")), "kept"), design
        )

    def add(self, design: Design, title: str) -> str:
        """Keep a design under a new name, and return that."""
        key = secrets.token_hex(6)
        named = replace(design, problem=replace(design.problem, name=title))
        write_design(named, self._folder / f"{key}.json")
        return key


class Gallery:
    """All sources together.

    Parameters
    ----------
    sources
        In the order in which they are shown.
    """

    def __init__(self, *sources: Source) -> None:
        self.sources = sources

    def find(self, source: str, key: str) -> Entry:
        """Return an entry.

        Raises
        ------
        UnknownName
            If there is none.
        """
        for each in self.sources:
            if each.name == source:
                entry = each.find(key)
                if entry is not None:
                    return entry
        raise UnknownName(f"there is no design {source}/{key} in the gallery")

    def listing(self) -> list[dict[str, Any]]:
        """Return all entries with what a small picture of each needs."""
        return [
            {
                "source": source.name,
                "title": source.title,
                "entries": [small(source.name, entry) for entry in source.entries()],
            }
            for source in self.sources
        ]


def small(source: str, entry: Entry) -> dict[str, Any]:
    """Return an entry with a small picture: where present beams lie."""
    design = entry.design
    problem, lattice = design.problem, design.problem.lattice
    ends = lattice.positions[lattice.beams[design.mask]]
    marks = (
        ("supports", problem.supports.nodes),
        ("input", problem.input.nodes),
        ("output", problem.output.nodes),
    )
    return {
        "source": source,
        "key": entry.key,
        "title": entry.title,
        "note": entry.note,
        "facets": entry.facets,
        "problem": problem.name,
        "efficiency": None if design.efficiency is None else finite(design.efficiency),
        "beams": design.beam_count,
        "picture": {
            "lines": ends.round(2).ravel().tolist(),
            **{name: lattice.positions[nodes].round(2).ravel().tolist() for name, nodes in marks},
            "box": np.concatenate([lattice.positions.min(axis=0), lattice.positions.max(axis=0)])
            .round(2)
            .tolist(),
        },
    }


def whole(entry: Entry) -> dict[str, Any]:
    """Return all of a design, ready for JSON."""
    design = entry.design
    return {
        "title": entry.title,
        "note": entry.note,
        "problem": problem_to_dict(design.problem),
        "mask": design.mask_hex,
        "efficiency": None if design.efficiency is None else finite(design.efficiency),
        "provenance": json.loads(json.dumps(dict(design.provenance), default=str)),
    }


def entry_named(gallery: Gallery, name: str) -> Entry:
    """Return the entry ``source/key``.

    Raises
    ------
    UnknownName
    """
    source, slash, key = name.partition("/")
    if not slash:
        raise UnknownName(f"there is no design {name!r} in the gallery")
    return gallery.find(source, key)
