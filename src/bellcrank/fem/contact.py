"""Contact between struts in the deformed states of a part.

No level of analysis resists contact; it is only detected and reported.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.model.geometry import distances_to_segments, inner_distances

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import ArrayLike, NDArray

SAMPLES = 9
"""Points on the centre line of each strut at which contact is checked."""
CLEARANCE = 1.5
"""Distance of centre lines at rest, in strut widths, beyond which a point is clear of a joint and
its fillets."""


@dataclass(frozen=True, slots=True, eq=False)
class Contacts:
    """Pairs of struts that touch or cross somewhere along the stroke.

    Parameters
    ----------
    pairs : (p, 2) int64
        Beams of the lattice.
    overlap : (p,) float64
        Largest penetration along the stroke, mm: strut width minus distance of the centre lines.
    onset : (p,) float64
        Fraction of the stroke at the first checked state in which the pair touches.
    meets : (p,) bool
        Whether the pair meets in a node. The clearance of a specification is without such pairs.

    Examples
    --------
    >>> one = np.array([[7, 9]]), np.array([0.5]), np.array([0.25])
    >>> contacts = Contacts(*one, meets=np.array([True]))
    >>> contacts.first, contacts.message
    (0.25, 'a pair of struts that meet in a node touches or crosses, beams 7 and 9 from 25% of \
the stroke on, by up to 0.5 mm')
    """

    pairs: NDArray[np.int64]
    overlap: NDArray[np.float64]
    onset: NDArray[np.float64]
    meets: NDArray[np.bool_]

    @property
    def first(self) -> float | None:
        """Fraction of the stroke at which contact first occurs; None without contact."""
        return float(self.onset.min()) if len(self.onset) else None

    @property
    def message(self) -> str:
        """Description of the contacts in one sentence."""
        count = len(self.pairs)
        earliest = np.argmin(self.onset)
        one, other = self.pairs[earliest]
        which = f"beams {one} and {other} from {self.onset[earliest]:.0%} of the stroke on"
        if count == 1:
            pair = "a pair of struts" + " that meet in a node" * bool(self.meets[0])
            return f"{pair} touches or crosses, {which}, by up to {self.overlap[0]:.2g} mm"
        deepest = np.argmax(self.overlap)
        one, other = self.pairs[deepest]
        among = int(self.meets.sum())
        meeting = f", {'all' if among == count else among} of struts that meet in a node"
        return (
            f"{count} pairs of struts touch or cross{meeting * bool(among)}, first {which}; "
            f"largest overlap {self.overlap[deepest]:.2g} mm between beams {one} and {other}"
        )

    def to_list(self) -> list[dict[str, Any]]:
        """Return the pairs as plain data."""
        return [
            {"beams": [int(one), int(other)], "overlap_mm": float(depth), "first_at": float(onset)}
            for (one, other), depth, onset in zip(self.pairs, self.overlap, self.onset, strict=True)
        ]


def centre_lines(ends: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (s, k, d) points along straight struts from (s, 2, d) their ends."""
    along = np.linspace(0.0, 1.0, SAMPLES)[None, :, None]
    lines: NDArray[np.float64] = ends[:, :1] * (1.0 - along) + ends[:, 1:] * along
    return lines


def find_contacts(
    struts: NDArray[np.int64],
    rest: NDArray[np.float64],
    stroke: Iterable[tuple[float, NDArray[np.float64]]],
    width: ArrayLike,
) -> Contacts:
    """Find the struts that touch or cross in any of the states along a stroke.

    Struts overlap near a joint that they share, so a point on the centre line of one strut counts
    only if it was more than `CLEARANCE` widths away from the centre line of the other at rest. It
    is in contact if it is now less than one width away, the mean of both; where centre lines
    cross, the distance is zero.

    Parameters
    ----------
    struts : (s,) int64
        Beams of the lattice.
    rest : (s, k, d) float64
        Points along the centre lines at rest, which are straight, mm.
    stroke : iterable of (float, (s, k, d) float64)
        Fraction of the full input and the same points in that state, in order of the load.
    width : float or (s,) array_like
        Width of the struts, in space their diameter, mm.

    Returns
    -------
    Contacts
        Each pair once, in ascending order.

    Examples
    --------
    >>> lines = np.array([[[0.0, 0.0], [5.0, 0.0], [10.0, 0.0]]] * 2)
    >>> lines[1] += [0.0, 4.0]
    >>> states = [(load, lines - [[[0.0, 0.0]], [[0.0, 5.0 * load]]]) for load in (0.25, 0.5)]
    >>> find_contacts(np.array([7, 9]), lines, states, 2.0).to_list()
    [{'beams': [7, 9], 'overlap_mm': 0.5, 'first_at': 0.5}]
    """
    found: dict[tuple[int, int], tuple[float, float]] = {}
    widths = np.broadcast_to(np.asarray(width, dtype=np.float64), len(struts))
    for load, moved in stroke:
        for one, other, depth in _overlaps(rest, moved, widths):
            largest, onset = found.get((one, other), (0.0, load))
            found[one, other] = (max(largest, depth), onset)
    ordered = sorted(found.items())
    pairs = np.array([pair for pair, _ in ordered], dtype=np.int64).reshape(-1, 2)
    values = np.array([value for _, value in ordered], dtype=np.float64).reshape(-1, 2)
    one, other = rest[pairs.T][:, :, [0, -1]]
    meets = np.isclose(one[:, :, None], other[:, None]).all(axis=-1).any(axis=(1, 2))
    return Contacts(struts[pairs].reshape(-1, 2), values[:, 0], values[:, 1], meets)


def _overlaps(
    rest: NDArray[np.float64], moved: NDArray[np.float64], widths: NDArray[np.float64]
) -> list[tuple[int, int, float]]:
    """Return the pairs of struts in contact in one state, with their overlap in mm."""
    one, part, other, piece = _near_segments(moved, float(widths.max(initial=0.0)))
    width = 0.5 * (widths[one] + widths[other])
    first = np.stack([moved[one, part], moved[one, part + 1]], axis=1)
    second = np.stack([moved[other, piece], moved[other, piece + 1]], axis=1)
    between, fraction = inner_distances(first, second)
    found: dict[tuple[int, int], float] = {}
    # Both ends of a segment, and the point between them that is nearest to the other strut.
    for distance, where in (
        (distances_to_segments(first[:, 0], second[:, 0], second[:, 1]), 0.0 * fraction),
        (distances_to_segments(first[:, 1], second[:, 0], second[:, 1]), 0.0 * fraction + 1.0),
        (between, fraction),
    ):
        near = distance < width
        i, j, k, share = one[near], other[near], part[near], where[near, None]
        point = (1.0 - share) * rest[i, k] + share * rest[i, k + 1]
        clear = distances_to_segments(point, rest[j, 0], rest[j, -1]) >= CLEARANCE * width[near]
        pairs = np.sort(np.column_stack([i, j])[clear], axis=1).tolist()
        depths = (width - distance)[near][clear].tolist()
        for (a, b), depth in zip(pairs, depths, strict=True):
            found[a, b] = max(depth, found.get((a, b), 0.0))
    return [(*pair, depth) for pair, depth in found.items()]


def _near_segments(
    moved: NDArray[np.float64], width: float
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Return all pairs of segments that may be nearer than a width, in both orders.

    Each as strut and number of the segment along it, for both segments.
    """
    from scipy.spatial import cKDTree

    each = moved.shape[1] - 1
    middles = 0.5 * (moved[:, :-1] + moved[:, 1:]).reshape(-1, moved.shape[2])
    longest = float(np.linalg.norm(np.diff(moved, axis=1), axis=2).max(initial=0.0))
    near = cKDTree(middles).query_pairs(width + longest, output_type="ndarray")
    near = near[near[:, 0] // each != near[:, 1] // each]
    directed = np.concatenate([near, near[:, ::-1]])
    first, second = np.divmod(directed[:, 0], each), np.divmod(directed[:, 1], each)
    return *first, *second
