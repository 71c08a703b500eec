"""Levels of fidelity: a registry, and the settings that they share."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from bellcrank.errors import InvalidSettings
from bellcrank.registry import Registry

if TYPE_CHECKING:
    from collections.abc import Callable

    from bellcrank.fem.results import Analysis


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


levels: Registry[Callable[..., Analysis]] = Registry("level")
"""From a part, settings and a function told the load that is reached, to an analysis."""
