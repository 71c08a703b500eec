"""All entries that are at hand: those that come with the package, and the user's own."""

from __future__ import annotations

import difflib
import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from bellcrank.errors import BellcrankError, InvalidSettings, UnknownName
from bellcrank.machines.elementary import DIRECTIONS
from bellcrank.machines.library.entry import DIGITS, MIXED, check_direction, check_kind
from bellcrank.machines.library.files import read_entry
from bellcrank.machines.library.summary import Summary, entry_files, read_index, read_summary

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from bellcrank.machines.library.entry import Entry
    from bellcrank.model import Design

VARIABLE = "BELLCRANK_LIBRARY"
"""Of the environment: the user's folder."""
LEAST_DIGITS = 4
"""Of a hash that stands for a name by itself."""

SORTS: dict[str, Callable[[Summary, float], float]] = {
    "efficiency": lambda each, spring: -each.two_port.efficiency_against(spring),
    "stiffness": lambda each, _spring: each.input_stiffness,
    "output-stiffness": lambda each, _spring: -1.0 / each.output_compliance,
    "work": lambda each, _spring: -each.two_port.best_work_share,
    "gain": lambda each, _spring: -(each.efficiency - each.lever_efficiency),
    "size": lambda each, _spring: float(each.beams),
}
"""What a search may be sorted by, the best first."""


def shipped_folder() -> Path:
    """Return the folder of the entries that come with the package."""
    from importlib.resources import files

    return Path(str(files("bellcrank.machines.library") / "entries"))


def user_folder() -> Path:
    """Return the user's folder: what the environment says, else where programs keep their data."""
    if told := os.environ.get(VARIABLE):
        return Path(told)
    data = os.environ.get("XDG_DATA_HOME")
    return (Path(data) if data else Path.home() / ".local" / "share") / "bellcrank" / "library"


@dataclass(frozen=True, slots=True, eq=False)
class Library:
    """Folders of entries. Nothing is read before it is asked for.

    Parameters
    ----------
    folders
        Of two entries of the same name, the one in the first folder is meant.

    Examples
    --------
    >>> library = Library((shipped_folder(),))
    >>> len(library) >= 60
    True
    """

    folders: tuple[Path, ...]
    _listed: dict[Path, tuple[list[Summary], list[str]]] = field(default_factory=dict, repr=False)

    def _contents(self, folder: Path) -> tuple[list[Summary], list[str]]:
        if folder not in self._listed:
            self._listed[folder] = _listing(folder)
        return self._listed[folder]

    def __len__(self) -> int:
        return len(self.summaries)

    @property
    def summaries(self) -> list[Summary]:
        """Of all entries that can be read, each once, by name."""
        found: dict[str, Summary] = {}
        for folder in self.folders:
            for each in self._contents(folder)[0]:
                found.setdefault(each.name, each)
        return [found[name] for name in sorted(found)]

    @property
    def damaged(self) -> list[str]:
        """What is wrong with files that cannot be read, in sentences."""
        return [line for folder in self.folders for line in self._contents(folder)[1]]

    def readable(self) -> list[str]:
        """Names of the entries that can be read, in order."""
        return [each.name for each in self.summaries]

    def names(self) -> list[str]:
        """Of all files, readable or not."""
        return sorted({path.stem for folder in self.folders for path in entry_files(folder)})

    def resolve(self, text: str) -> str:
        """Return the name that is meant: whole, its beginning if only one has it, or a hash.

        Raises
        ------
        UnknownName
            If there is none, or more than one.
        """
        names = self.names()
        if text in names:
            return text
        found = [name for name in names if text and name.startswith(text)]
        if not found and LEAST_DIGITS <= len(text) <= DIGITS:
            found = [name for name in names if name.rpartition("-")[2].startswith(text)]
        if len(found) == 1:
            return found[0]
        if found:
            some = ", ".join(found[:4]) + (", ..." if len(found) > 4 else "")
            raise UnknownName(f"{text!r} is the beginning of {len(found)} entries: {some}")
        near = difflib.get_close_matches(text, names, n=3, cutoff=0.5)
        hint = f"; near: {', '.join(near)}" if near else ""
        raise UnknownName(f"no entry {text!r} in the library{hint}; see bellcrank library list")

    def path(self, text: str) -> Path:
        """Return the file of an entry.

        Raises
        ------
        UnknownName
        """
        name = self.resolve(text)
        for folder in self.folders:
            if (path := folder / f"{name}.json").is_file():
                return path
        raise UnknownName(f"no entry {name!r} in the library any more")

    def find(self, text: str) -> Entry:
        """Read an entry, by its name, the beginning of it, or its hash.

        Raises
        ------
        UnknownName, InvalidFile, InvalidProblem
        """
        return read_entry(self.path(text))

    def design(self, text: str) -> Design | None:
        """Return the design of an entry; None for what is not even like the name of one.

        Raises
        ------
        UnknownName
            If it is like one, but there is none, or more than one.
        InvalidFile, InvalidProblem
            If the file is damaged.
        """
        try:
            return self.find(text).design
        except UnknownName:
            if text.startswith(tuple(f"{word}-" for word in (*DIRECTIONS, MIXED))):
                raise
            return None

    def search(
        self,
        *,
        direction: str | None = None,
        columns: int | None = None,
        kind: str | None = None,
        spring: float = 0.0,
        efficiency: float | None = None,
        stiffness: float | None = None,
        output_stiffness: float | None = None,
        better: bool = False,
        clear: bool = False,
        sort: str = "efficiency",
    ) -> list[Summary]:
        """Return the entries that are as asked for, the best first.

        Parameters
        ----------
        direction, columns, kind
            Of the entry.
        spring
            At the mean output: efficiencies are those against it, from the two-port at rest.
        efficiency
            At least.
        stiffness
            Of the input, output free, at most.
        output_stiffness
            Input held, at least.
        better
            Whether only what beats the plain lever is wanted.
        clear
            Whether only what there is nothing to be warned of is wanted: no struts that touch.
        sort
            A key of `SORTS`.

        Raises
        ------
        InvalidSettings, UnknownName
            If there is no such direction or kind, or nothing to sort by that.
        """
        if direction is not None:
            check_direction(direction)
        if kind is not None:
            check_kind(kind)
        if sort not in SORTS:
            raise InvalidSettings(f"sort: expected one of {', '.join(SORTS)}, got {sort!r}")
        if not spring >= 0.0:
            raise InvalidSettings(f"spring: expected a stiffness of at least 0, got {spring!r}")

        def fits(each: Summary) -> bool:
            return (
                direction in (None, each.direction)
                and columns in (None, each.columns)
                and kind in (None, each.kind)
                and (efficiency is None or each.two_port.efficiency_against(spring) >= efficiency)
                and (stiffness is None or each.input_stiffness <= stiffness)
                and (output_stiffness is None or output_stiffness * each.output_compliance <= 1.0)
                and (each.better or not better)
                and (each.clear or not clear)
            )

        key = SORTS[sort]
        return sorted(filter(fits, self.summaries), key=lambda each: key(each, spring))


def _listing(folder: Path) -> tuple[list[Summary], list[str]]:
    """Return the summaries of a folder, and what is wrong with the files that have none."""
    if (indexed := read_index(folder)) is not None:
        return indexed, []
    return read_all(entry_files(folder))


def read_all(paths: Iterable[Path]) -> tuple[list[Summary], list[str]]:
    """Return the summaries of files, and what is wrong with those that have none."""
    found, damaged = [], []
    for path in paths:
        try:
            found.append(read_summary(path))
        except BellcrankError as error:
            damaged.append(str(error))
    return found, damaged


def library() -> Library:
    """Return the library: the user's folder, and the entries that come with the package."""
    return Library((user_folder(), shipped_folder()))


def find_entry(text: str) -> Entry:
    """Read an entry of the library, by its name, the beginning of it, or its hash.

    Raises
    ------
    UnknownName, InvalidFile, InvalidProblem

    Examples
    --------
    >>> find_entry("up-9-fre-")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    bellcrank.errors.UnknownName: no entry 'up-9-fre-' in the library...; see bellcrank library list
    """
    return library().find(text)
