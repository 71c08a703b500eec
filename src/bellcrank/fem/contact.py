"""Struts that touch or cross each other in the moved state, which no level resists."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


PLACES = 9
"""Along the centre line of each strut where contact is looked for."""
CLEAR = 1.5
"""Distance of centre lines in widths beyond which a place is clear of a joint and its fillets."""


@dataclass(frozen=True, slots=True, eq=False)
class Contacts:
    """Pairs of struts that touch.

    Parameters
    ----------
    pairs : (p, 2) int64
        Beams of the lattice.
    overlap : (p,)
        How deep they go into each other, mm: strut width less distance of the centre lines.
    """

    pairs: NDArray[np.int64]
    overlap: NDArray[np.float64]

    @property
    def message(self) -> str:
        """What touches, as a sentence."""
        first, second = self.pairs[np.argmax(self.overlap)]
        count = "a pair" if len(self.pairs) == 1 else f"{len(self.pairs)} pairs"
        return (
            f"{count} of struts touch or cross in the moved state, deepest those "
            f"of beams {first} and {second}, by {self.overlap.max():.2g} mm"
        )

    def to_list(self) -> list[dict[str, Any]]:
        """Return the pairs as plain data."""
        return [
            {"beams": [int(one), int(other)], "overlap_mm": float(depth)}
            for (one, other), depth in zip(self.pairs, self.overlap, strict=True)
        ]


def centre_lines(ends: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (s, k, 2) points along straight struts from (s, 2, 2) their ends."""
    along = np.linspace(0.0, 1.0, PLACES)[None, :, None]
    lines: NDArray[np.float64] = ends[:, :1] * (1.0 - along) + ends[:, 1:] * along
    return lines


def find_contacts(
    struts: NDArray[np.int64],
    rest: NDArray[np.float64],
    moved: NDArray[np.float64],
    width: float,
) -> Contacts:
    """Find the struts whose bodies meet when they move.

    Struts that share a joint overlap there by design: what counts are places on the centre line
    of one that were well over a width away from the centre line of the other at rest, and now are
    less than a width away.

    Parameters
    ----------
    struts : (s,) int64
        Their beams in the lattice.
    rest, moved : (s, k, 2)
        Points along their centre lines, mm, at rest and moved.
    width
        Of the struts, mm.

    Examples
    --------
    >>> lines = np.array([[[0.0, 0.0], [5.0, 0.0], [10.0, 0.0]]] * 2)
    >>> lines[1] += [0.0, 4.0]
    >>> closer = lines.copy()
    >>> closer[1] -= [0.0, 2.5]
    >>> find_contacts(np.array([7, 9]), lines, closer, 2.0).to_list()
    [{'beams': [7, 9], 'overlap_mm': 0.5}]
    """
    import shapely

    lines, before = shapely.linestrings(moved), shapely.linestrings(rest)
    one, other = shapely.STRtree(lines).query(lines, predicate="dwithin", distance=width)
    one, other = one[one != other], other[one != other]
    points = shapely.points(moved[one])
    near = shapely.distance(points, lines[other][:, None])
    apart = shapely.distance(shapely.points(rest[one]), before[other][:, None])
    counts = (near < width) & (apart >= CLEAR * width)
    depth = np.where(counts, width - near, -np.inf).max(axis=1, initial=-np.inf)
    crossing = shapely.crosses(lines[one], lines[other]) & ~shapely.intersects(
        before[one], before[other]
    )
    depth[crossing] = width
    touching = depth > 0.0
    pairs = np.sort(np.stack([one[touching], other[touching]], axis=1), axis=1)
    pairs, which = np.unique(pairs, axis=0, return_inverse=True)
    overlap = np.zeros(len(pairs))
    np.maximum.at(overlap, which.ravel(), depth[touching])
    return Contacts(struts[pairs].reshape(-1, 2), overlap)
