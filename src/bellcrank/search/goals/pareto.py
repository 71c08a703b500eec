"""Designs that no other beats in all respects at once."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Self

from bellcrank.errors import InvalidSettings, UnknownName

if TYPE_CHECKING:
    from collections.abc import Mapping

MEASURES = {"efficiency": 1.0, "stiffness": 1.0, "mass": -1.0}
"""What can be traded for each other, and whether more or less of it is better."""


@dataclass(slots=True)
class ParetoArchive:
    """Keeps of all designs shown to it those that no other beats.

    One design beats another if it is at least as good in every measure and better in one.

    Parameters
    ----------
    measures
        Two or three of `MEASURES`.

    Raises
    ------
    UnknownName, InvalidSettings

    Examples
    --------
    >>> archive = ParetoArchive(("efficiency", "mass"))
    >>> archive.add("a1", {"efficiency": 2.0, "mass": 0.6})
    True
    >>> archive.add("b2", {"efficiency": 1.0, "mass": 0.7})
    False
    >>> archive.add("c3", {"efficiency": 1.0, "mass": 0.3}), archive.front()
    (True, [('a1', {'efficiency': 2.0, 'mass': 0.6}), ('c3', {'efficiency': 1.0, 'mass': 0.3})])
    """

    measures: tuple[str, ...]
    _kept: dict[str, tuple[float, ...]] = field(default_factory=dict, repr=False)
    """By design, each measure so that more is better."""

    def __post_init__(self) -> None:
        for name in self.measures:
            if name not in MEASURES:
                raise UnknownName(f"unknown measure {name!r}; known: {', '.join(MEASURES)}")
        if not 2 <= len(self.measures) <= 3 or len(set(self.measures)) < len(self.measures):
            raise InvalidSettings(
                f"measures: expected two or three different ones, got {', '.join(self.measures)}"
            )

    def __len__(self) -> int:
        return len(self._kept)

    def would_keep(self, values: Mapping[str, float]) -> bool:
        """Whether no kept design is at least as good in every measure."""
        point = self._point(values)
        return not any(
            all(own >= new for own, new in zip(kept, point, strict=True))
            for kept in self._kept.values()
        )

    def add(self, design: str, values: Mapping[str, float]) -> bool:
        """Show a design; return whether it is kept. Of equal ones the first stays.

        Parameters
        ----------
        design
            Its name or mask.
        values
            Of each measure.

        Raises
        ------
        InvalidSettings
            If a value is missing or no finite number.
        """
        if not self.would_keep(values):
            return False
        point = self._point(values)
        self._kept = {
            name: kept
            for name, kept in self._kept.items()
            if name != design and not all(n >= k for n, k in zip(point, kept, strict=True))
        }
        self._kept[design] = point
        return True

    def _point(self, values: Mapping[str, float]) -> tuple[float, ...]:
        point = tuple(MEASURES[name] * values.get(name, math.nan) for name in self.measures)
        if not all(map(math.isfinite, point)):
            raise InvalidSettings(
                f"expected a number for each of {', '.join(self.measures)}, got {dict(values)}"
            )
        return point

    def front(self) -> list[tuple[str, dict[str, float]]]:
        """Return the kept designs and their measures, the best in the first measure first."""
        ranked = sorted(self._kept.items(), key=lambda pair: (*(-v for v in pair[1]), pair[0]))
        return [
            (
                design,
                {n: MEASURES[n] * v for n, v in zip(self.measures, point, strict=True)},
            )
            for design, point in ranked
        ]

    def to_dict(self) -> dict[str, Any]:
        """Return the archive as plain data."""
        front = [{"mask": design, **values} for design, values in self.front()]
        return {"measures": list(self.measures), "results": front}

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Self:
        """Rebuild an archive from plain data."""
        archive = cls(tuple(data["measures"]))
        for entry in data["results"]:
            archive.add(str(entry["mask"]), {name: entry[name] for name in archive.measures})
        return archive
