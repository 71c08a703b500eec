"""Named choices: one small dictionary that explains itself when asked wrongly.

A registry replaces if-chains over names. Adding an objective, a schedule, a lattice
or a file format means writing one function and putting
``@registry.register("name")`` over it; the contract tests pick it up by itself.

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
from typing import TypeVar

from bellcrank.errors import UnknownName

T = TypeVar("T")
U = TypeVar("U")


class Registry(Mapping[str, T]):
    """A mapping from names to entries of one kind.

    Parameters
    ----------
    kind
        What the entries are, in the singular; used in error messages.
    """

    def __init__(self, kind: str) -> None:
        self.kind = kind
        self._entries: dict[str, T] = {}

    def register(self, name: str) -> Callable[[U], U]:
        """Return a decorator that files its target under `name`.

        Raises
        ------
        ValueError
            If the name is taken: two entries never compete silently.
        """

        def file_under_name(entry: U) -> U:
            if name in self._entries:
                raise ValueError(f"{self.kind} {name!r} is registered twice")
            self._entries[name] = entry  # type: ignore[assignment]
            return entry

        return file_under_name

    def names(self) -> list[str]:
        """All names, in the order of registration."""
        return list(self._entries)

    def __getitem__(self, name: str) -> T:
        try:
            return self._entries[name]
        except (KeyError, TypeError):  # what cannot be hashed is no name either
            known = ", ".join(self._entries)
            raise UnknownName(f"unknown {self.kind} {name!r}; known: {known}") from None

    def __iter__(self) -> Iterator[str]:
        return iter(self._entries)

    def __len__(self) -> int:
        return len(self._entries)
