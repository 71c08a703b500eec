"""Levels of analysis: their registry and the settings that they share."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from bellcrank.errors import InvalidSettings
from bellcrank.registry import Registry

if TYPE_CHECKING:
    from collections.abc import Callable

    from bellcrank.fem.results import Analysis
    from bellcrank.part import Part


@dataclass(frozen=True, slots=True, kw_only=True)
class FemSettings:
    """Settings of an analysis.

    Parameters
    ----------
    theory
        Beam theory of frames: a name in the registry of theories.
    law
        Material law of continua: a name in the registry of laws.
    linear
        Whether displacements are assumed to be small.
    elements
        Number of beam elements of each strut.
    size
        Largest edge of triangles and tetrahedra, mm; chosen from the strut width if None.

    Raises
    ------
    InvalidSettings
        If the number of elements or the size is not positive.
    """

    theory: str = "euler-bernoulli"
    law: str = "neo-hookean"
    linear: bool = False
    elements: int = 8
    size: float | None = None

    def __post_init__(self) -> None:
        if self.elements < 1:
            raise InvalidSettings(
                f"elements: expected at least 1 in each strut, got {self.elements}"
            )
        if self.size is not None and not 0.0 < self.size < float("inf"):
            raise InvalidSettings(f"size: expected a length above 0 mm, got {self.size!r}")


@dataclass(frozen=True, slots=True)
class Level:
    """One level of analysis.

    Parameters
    ----------
    analyse
        Function of a part, settings and a callback that is called with each load reached.
    check
        Function that raises an error for a part and settings that cannot be analysed.
    missing
        Function that returns which optional library is missing and how to install it, or None.
    title, duration
        Display name, and the usual duration of an analysis in words.
    in_space
        Whether it analyses parts in space.
    """

    analyse: Callable[..., Analysis]
    check: Callable[[Part, FemSettings], None]
    missing: Callable[[], str | None] = lambda: None
    title: str = ""
    duration: str = ""
    in_space: bool = True

    def __call__(
        self,
        part: Part,
        settings: FemSettings,
        report: Callable[[float], None] = lambda _load: None,
    ) -> Analysis:
        """Check and analyse a part."""
        self.check(part, settings)
        return self.analyse(part, settings, report)


levels: Registry[Level] = Registry("level")
"""Levels by name, in order of increasing detail."""
