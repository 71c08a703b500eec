"""Gallery of designs from several sources.

A source is a class with `entries` and `find`; `app.py` lists the sources.
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
from bellcrank.fem.results import finite
from bellcrank.model import (
    Design,
    builtin,
    gallery_design,
    problem_to_dict,
    read_design,
    write_design,
)
from bellcrank.model.gallery import Kind

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping
    from pathlib import Path

    from numpy.typing import NDArray

    from bellcrank.model import Problem
    from bellcrank.web.jobs import Jobs

NAME = re.compile(r"[a-z0-9]{12}")
AZIMUTH, ELEVATION = 24.0, 22.0
"""Direction from which parts in space are drawn, degrees: from the front, turned to the left, and
from above."""
CACHED = 200
"""Number of designs of runs that are cached."""


@dataclass(frozen=True, slots=True, eq=False)
class Entry:
    """A design in the gallery.

    Parameters
    ----------
    key
        Name within the source.
    title, note
        Title and a short description.
    design
        Design, with efficiency and provenance if known.
    facets
        Properties for filtering, such as ``{"Size": "9 wide"}``.
    """

    key: str
    title: str
    note: str
    design: Design
    facets: dict[str, str] = field(default_factory=dict)


class Source(Protocol):
    """A source of designs."""

    @property
    def name(self) -> str:
        """Name in addresses, in lower case."""

    @property
    def title(self) -> str:
        """Title on the page."""

    def entries(self) -> Iterable[Entry]:
        """Return all entries in the order of display."""

    def find(self, key: str) -> Entry | None:
        """Return the entry with a key, or None."""


class LazyEntries:
    """Entries that are read once, at the first access; safe for threads.

    Parameters
    ----------
    read
        Function that reads the entries.
    """

    def __init__(self, read: Callable[[], Iterable[Entry]]) -> None:
        self._read = read
        self._lock = threading.Lock()
        self._entries: dict[str, Entry] | None = None

    def __call__(self) -> dict[str, Entry]:
        """Return all entries by key."""
        with self._lock:
            if self._entries is None:
                self._entries = {entry.key: entry for entry in self._read()}
        return self._entries


class BundledDesigns:
    """Bundled designs."""

    name = "builtin"
    title = "Bundled designs"

    def __init__(self) -> None:
        self._known = LazyEntries(_built_in)

    def entries(self) -> Iterable[Entry]:
        """Return the designs of all bundled problems."""
        return self._known().values()

    def find(self, key: str) -> Entry | None:
        """Return the entry with a key, or None."""
        return self._known().get(key)


def _built_in() -> Iterator[Entry]:
    for problem in builtin:
        for kind in get_args(Kind):
            design = gallery_design(kind, problem)
            if design is not None:
                note = "drawn by hand" if kind == "human" else "found by a search"
                yield Entry(f"{kind}-{problem}", problem, note, design)


class RunDesigns:
    """Results of the user's searches."""

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
            modified = (job.path / "run" / "design.json").stat().st_mtime
            cached = self._read.get(key)
            if cached is not None and cached[0] == modified:
                return cached[1]
            design = job.design()
        except (BellcrankError, OSError):
            return None
        if design is None:
            return None
        entry = Entry(key, job.record.title, job.record.settings["search"], design)
        if len(self._read) >= CACHED:
            self._read.clear()
        self._read[key] = (modified, entry)
        return entry


class SavedDesigns:
    """Designs that were drawn by hand or assembled on the page.

    Parameters
    ----------
    folder
        Folder of the files.
    """

    name = "kept"
    title = "Saved designs"

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        folder.mkdir(parents=True, exist_ok=True)

    def entries(self) -> Iterable[Entry]:
        """Return all designs, the latest first."""
        paths = sorted(self._folder.glob("*.json"), key=lambda path: -path.stat().st_mtime)
        for path in paths:
            entry = self.find(path.stem)
            if entry is not None:
                yield entry

    def find(self, key: str) -> Entry | None:
        """Return the entry with a key, or None."""
        path = self._folder / f"{key}.json"
        if not NAME.fullmatch(key) or not path.is_file():
            return None
        try:
            design = read_design(path)
        except BellcrankError:
            return None
        kind = {"drawn": "drawn by hand", "assembled": "a machine"}
        return Entry(
            key, design.problem.name, kind.get(str(design.provenance.get("kind")), "saved"), design
        )

    def add(self, design: Design, title: str) -> str:
        """Store a design and return its key."""
        key = secrets.token_hex(6)
        titled = replace(design, problem=replace(design.problem, name=title))
        write_design(titled, self._folder / f"{key}.json")
        return key


class Gallery:
    """All sources.

    Parameters
    ----------
    sources
        Sources in the order of display.
    """

    def __init__(self, *sources: Source) -> None:
        self.sources = sources

    def find(self, source: str, key: str) -> Entry:
        """Return an entry.

        Raises
        ------
        UnknownName
            If there is no such entry.
        """
        for each in self.sources:
            if each.name == source:
                entry = each.find(key)
                if entry is not None:
                    return entry
        raise UnknownName(f"there is no design {source}/{key} in the gallery")

    def listing(self) -> list[dict[str, Any]]:
        """Return all entries with the data of a small picture of each."""
        return [
            {
                "source": source.name,
                "title": source.title,
                "entries": [thumbnail_data(source.name, entry) for entry in source.entries()],
            }
            for source in self.sources
        ]


def thumbnail_data(source: str, entry: Entry) -> dict[str, Any]:
    """Return an entry with the coordinates of its present beams."""
    design = entry.design
    problem = design.problem
    marks = {
        "supports": problem.supports.nodes,
        "input": problem.input.nodes,
        "output": problem.output.nodes,
    }
    return {
        "source": source,
        "key": entry.key,
        "title": entry.title,
        "note": entry.note,
        "facets": entry.facets,
        "problem": problem.name,
        "efficiency": None if design.efficiency is None else finite(design.efficiency),
        "beams": design.beam_count,
        "picture": picture_of(problem, design.mask, marks),
    }


def picture_of(
    problem: Problem, mask: NDArray[np.bool_], marks: Mapping[str, NDArray[np.int64]]
) -> dict[str, list[float]]:
    """Return the coordinates of the beams of a design, of marked nodes, and of their box."""
    drawn = projected(problem.lattice.positions)
    ends = drawn[problem.lattice.beams[mask]]
    return {
        "lines": ends.round(2).ravel().tolist(),
        **{name: drawn[nodes].round(2).ravel().tolist() for name, nodes in marks.items()},
        "box": np.concatenate([drawn.min(axis=0), drawn.max(axis=0)]).round(2).tolist(),
    }


def projected(positions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return positions (N, d) as they are drawn, (N, 2): those in space in oblique view.

    Examples
    --------
    >>> projected(np.array([[0.0, 0.0, 1.0]])).round(2)
    array([[0.  , 0.93]])
    """
    if positions.shape[1] == 2:
        return positions
    x, y, z = positions.T
    turn, tilt = np.deg2rad(AZIMUTH), np.deg2rad(ELEVATION)
    depth = -x * np.sin(turn) + y * np.cos(turn)
    across, up = x * np.cos(turn) + y * np.sin(turn), z * np.cos(tilt) + depth * np.sin(tilt)
    return np.column_stack([across, up])


def design_data(entry: Entry) -> dict[str, Any]:
    """Return a design as plain data."""
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
