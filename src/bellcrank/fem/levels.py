"""Levels of fidelity: a registry, and the settings that they share."""

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
    """How a part is analysed.

    Parameters
    ----------
    theory
        Of beams: a name in the registry of theories.
    law
        Of the material: a name in the registry of laws.
    linear
        Small motions only, whatever the law.
    elements
        In each strut of a frame.
    size
        Largest edge of triangles or tetrahedra, mm; by the strut width if it is None.
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
    """One level of fidelity.

    Parameters
    ----------
    analyse
        From a part, settings and a function told the load that is reached, to an analysis.
    check
        Refuses a part and settings that cannot be analysed, before anything is computed.
    """

    analyse: Callable[..., Analysis]
    check: Callable[[Part, FemSettings], None]

    def __call__(
        self,
        part: Part,
        settings: FemSettings,
        tell: Callable[[float], None] = lambda _load: None,
    ) -> Analysis:
        """Analyse a part."""
        self.check(part, settings)
        return self.analyse(part, settings, tell)


levels: Registry[Level] = Registry("level")
"""Levels by name, the coarsest first."""
