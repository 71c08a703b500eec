"""Registries: named functions, settings and file formats.

A registry replaces if-chains over names. An objective, a schedule, a lattice or a file format is
added by writing one function and registering it with ``@registry.register("name")``. The contract
tests include every registered entry.

Examples
--------
>>> shapes = Registry("shape")
>>> @shapes.register("square")
... def square(side: float) -> float:
...     return side * side
>>> shapes["square"](3.0)
9.0
>>> shapes.names()
['square']
>>> shapes["circle"]
Traceback (most recent call last):
    ...
bellcrank.errors.UnknownName: unknown shape 'circle'; known: square
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, TypeVar

from bellcrank.errors import UnknownName

if TYPE_CHECKING:
    import os

T = TypeVar("T")
U = TypeVar("U")


class Registry(Mapping[str, T]):
    """A mapping from names to entries of one kind.

    Parameters
    ----------
    kind
        Noun for an entry, in the singular, for error messages.
    """

    def __init__(self, kind: str) -> None:
        self.kind = kind
        self._entries: dict[str, T] = {}

    def register(self, name: str) -> Callable[[U], U]:
        """Return a decorator that registers its target under `name`.

        Raises
        ------
        ValueError
            If the name is registered already.
        """

        def add_entry(entry: U) -> U:
            if name in self._entries:
                raise ValueError(f"{self.kind} {name!r} is registered twice")
            self._entries[name] = entry  # type: ignore[assignment]
            return entry

        return add_entry

    def names(self) -> list[str]:
        """Return all names, in the order of registration."""
        return list(self._entries)

    def __getitem__(self, name: str) -> T:
        try:
            return self._entries[name]
        except (KeyError, TypeError):  # TypeError: not hashable
            known = ", ".join(self._entries)
            raise UnknownName(f"unknown {self.kind} {name!r}; known: {known}") from None

    def __iter__(self) -> Iterator[str]:
        return iter(self._entries)

    def __len__(self) -> int:
        return len(self._entries)


class FileFormat(Protocol):
    """An entry with the suffixes of its files, the usual one first."""

    @property
    def suffixes(self) -> tuple[str, ...]:
        """Suffixes with a leading dot, in lower case."""


F = TypeVar("F", bound=FileFormat)


class FormatRegistry(Registry[F]):
    """A registry of file formats, which are selected by the suffix of a path."""

    def for_path(self, path: str | os.PathLike[str]) -> F:
        """Return the format of the longest known suffix of `path`; upper and lower case are equal.

        Raises
        ------
        UnknownName
            If no format has that suffix; lists the known ones.
        """
        suffixes = [each.lower() for each in Path(path).suffixes]
        for first in range(len(suffixes)):
            for entry in self.values():
                if "".join(suffixes[first:]) in entry.suffixes:
                    return entry
        suffix = suffixes[-1] if suffixes else ""
        known = ", ".join(suffix for entry in self.values() for suffix in entry.suffixes)
        raise UnknownName(f"{path}: unknown {self.kind} {suffix!r}; known suffixes: {known}")
