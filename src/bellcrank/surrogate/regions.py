"""Functional regions: which beams a design lives by, and which could as well be others.

Examples
--------
>>> regions_of(np.array([-0.9, -0.2, 0.001, 0.3, np.nan]), efficiency=1.0).tolist()
[0, 1, 2, 3, 4]
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings

if TYPE_CHECKING:
    from numpy.typing import NDArray


class Region(IntEnum):
    """What flipping a beam does to the function of a design."""

    VITAL = 0
    USEFUL = 1
    NEUTRAL = 2
    ADVERSE = 3
    UNSTABLE = 4

    @property
    def label(self) -> str:
        """The region as it is written in files."""
        return self.name.lower()


@dataclass(frozen=True, slots=True)
class Thresholds:
    """Where regions end, as fractions of the design's efficiency.

    Parameters
    ----------
    vital
        A flip that costs this much or more destroys the function.
    neutral
        One that changes less than this does not matter.
    least
        Efficiency that a design is taken to have at least, so that fractions of nothing do not
        decide.

    Raises
    ------
    InvalidSettings
    """

    vital: float = 0.5
    neutral: float = 0.05
    least: float = 0.05

    def __post_init__(self) -> None:
        if not 0.0 < self.neutral < self.vital:
            raise InvalidSettings(
                f"thresholds: expected 0 < neutral < vital, got neutral {self.neutral:g} and "
                f"vital {self.vital:g}"
            )
        if not self.least > 0.0:
            raise InvalidSettings(f"least: expected more than 0, got {self.least:g}")


def regions_of(
    change: NDArray[np.float64], efficiency: float, thresholds: Thresholds | None = None
) -> NDArray[np.int64]:
    """Return the `Region` of each beam.

    What counts is the function that the design has: where its efficiency is negative, a flip
    that raises it costs.

    Parameters
    ----------
    change : (n,)
        Of the efficiency by flipping each beam; nan for a flipped design without a unique
        response, which is `Region.UNSTABLE`.
    efficiency
        Of the design.
    thresholds
        Where regions end.

    Returns
    -------
    (n,) int64
    """
    limits = thresholds or Thresholds()
    size = float(np.copysign(max(abs(efficiency), limits.least), efficiency))
    part = change / size
    region = np.full(len(change), Region.NEUTRAL, np.int64)
    region[part >= limits.neutral] = Region.ADVERSE
    region[part <= -limits.neutral] = Region.USEFUL
    region[part <= -limits.vital] = Region.VITAL
    region[~np.isfinite(change)] = Region.UNSTABLE
    return region


def overlap_of_regions(
    first: NDArray[np.int64], second: NDArray[np.int64]
) -> dict[str, float | None]:
    """Return, for each region, beams in both over beams in either; None where it is empty.

    Examples
    --------
    >>> overlap_of_regions(np.array([0, 0, 2]), np.array([0, 2, 2]))["vital"]
    0.5
    """
    told: dict[str, float | None] = {}
    for region in Region:
        here, there = first == region, second == region
        either = int((here | there).sum())
        told[region.label] = int((here & there).sum()) / either if either else None
    return told
