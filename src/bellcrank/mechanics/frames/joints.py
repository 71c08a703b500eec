"""Joints of finite size: the ends of beams that do not bend.

Up to where its edges meet those of its neighbours, a strut is part of a joint, which does not bend.
This length differs on the two sides of a strut; the joint has the mean of both. It follows from the
angles between the struts and from their widths, so that it is known for a design, not for a lattice
from which beams are removed. Against the sheet, no factor in front of it does better than 1
(``python -m benchmarks.fidelity --only joints``).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from scipy.sparse import csr_matrix

    from bellcrank.mechanics.kernels.arrays import Floats, Ints
    from bellcrank.model import Problem

LARGEST = 0.4
"""Largest part of a beam that one joint takes."""
OPPOSITE = 0.05
"""Deviation from opposite directions, twice in radians, within which beams have almost no joint."""
ROUNDED = 0.05
"""Half the range in which kinks are rounded, so that responses are smooth in the geometry: of the
cosine of the angle between beams at a right angle, and of joints near the largest size, over it."""
COMPLEX_STEP = 1e-30


def with_joints(problem: Problem, mask: NDArray[np.bool_]) -> Problem:
    """Return a problem whose joints are those of a design.

    Unchanged without a section, in space, and where the joints of the section are points.

    Parameters
    ----------
    mask : (M,) bool
        Which beams are present; the joints of the others are points.

    Examples
    --------
    >>> from dataclasses import replace
    >>> from bellcrank.model import Section, find_problem
    >>> crane = replace(find_problem("crane"), section=Section(0.2, 0.5, joint=0.06))
    >>> joints = with_joints(crane, crane.initial).joints
    >>> print(f"{joints.max():.3f}, between beams that meet at 60 degrees")
    0.173, between beams that meet at 60 degrees
    """
    if problem.section is None or problem.section.joint == 0.0 or problem.lattice.dimension == 3:
        return problem
    return replace(problem, joints=joint_lengths(problem, mask))


def joint_lengths(problem: Problem, mask: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return (M, 2) the lengths of the joints at both ends of the beams of a design in the plane.

    Lattice units.
    """
    lattice = problem.lattice
    corners = _corners(lattice.positions, lattice.beams, mask)
    shapes = corners.shapes(lattice.positions, lattice.beams, problem.beam_widths)
    largest = LARGEST * lattice.rest_length[:, None]
    below = 1.0 - _lengths(corners, shapes, lattice.beam_count) / largest
    return np.asarray(largest * (1.0 - _ramp(below)))


def _lengths(corners: _Corners, shapes: tuple[Floats, ...], count: int) -> Floats:
    """Return (M, 2) the lengths of joints without regard to the length of their beams."""
    out = np.zeros((count, 2))
    for (beams, ends), length in zip(corners.sides, _meeting(*shapes), strict=True):
        np.add.at(out, (beams, ends), 0.5 * length)
    return out


def _ramp(x: Any) -> Any:
    """Return the larger of x and 0, with a quadratic rise between -`ROUNDED` and `ROUNDED`."""
    rise = (x + ROUNDED) ** 2 / (4.0 * ROUNDED)
    return np.where(x.real > ROUNDED, x, np.where(x.real < -ROUNDED, 0.0, rise))


def joint_slopes(problem: Problem, mask: NDArray[np.bool_]) -> csr_matrix:
    """Return (2 M, N d + M) the derivatives of the joints by positions and widths.

    Row 2 m + e is that of end e of beam m; columns are all coordinates, then all widths.
    """
    from scipy.sparse import csr_matrix

    lattice, widths = problem.lattice, problem.beam_widths
    positions, beams = lattice.positions, lattice.beams
    coordinates = positions.size
    corners = _corners(positions, beams, mask)
    shapes = corners.shapes(positions, beams, widths)
    chords, wide = corners.arms(beams), [side[0] for side in corners.sides]
    rows: list[Ints] = []
    columns: list[Ints] = []
    values: list[Floats] = []

    def add(row: Ints, column: Ints, value: Floats) -> None:
        rows.append(row)
        columns.append(column)
        values.append(value)

    for arm in range(2):
        for kind in range(3):
            moved: list[Any] = [np.array(each, dtype=complex) for each in shapes]
            if kind == 2:
                moved[2 + arm] += 1j * COMPLEX_STEP
            else:
                moved[arm][:, kind] += 1j * COMPLEX_STEP
            for (own, ends), length in zip(corners.sides, _meeting(*moved), strict=True):
                rate = 0.5 * length.imag / COMPLEX_STEP
                if kind == 2:
                    add(2 * own + ends, coordinates + wide[arm], rate)
                else:
                    node, far = chords[arm]
                    add(2 * own + ends, 2 * far + kind, rate)
                    add(2 * own + ends, 2 * node + kind, -rate)
    shape = (2 * len(beams), coordinates + len(beams))
    indices = np.concatenate(rows), np.concatenate(columns)
    slopes: csr_matrix = csr_matrix((np.concatenate(values), indices), shape=shape)
    # Joints near the largest size L follow the length of their beam: L - L f(1 - x / L).
    length = lattice.rest_length
    largest = LARGEST * length[:, None]
    below = 1.0 - _lengths(corners, shapes, len(beams)) / largest
    rate = np.clip((below + ROUNDED) / (2.0 * ROUNDED), 0.0, 1.0)
    by_largest = 1.0 - _ramp(below) - (1.0 - below) * rate
    free = csr_matrix(slopes.multiply(rate.reshape(-1, 1)))
    beam, end = np.nonzero(by_largest)
    axis = (positions[beams[beam, 1]] - positions[beams[beam, 0]]) / length[beam, None]
    axis *= LARGEST * by_largest[beam, end][:, None]
    row = np.repeat(2 * beam + end, 2)
    column = (2 * beams[beam][:, :, None] + np.arange(2)).transpose(1, 0, 2).reshape(2, -1)
    bounded = csr_matrix(
        (np.concatenate([-axis.ravel(), axis.ravel()]), (np.tile(row, 2), column.ravel())),
        shape=shape,
    )
    return csr_matrix(free + bounded)


@dataclass(frozen=True, slots=True)
class _Corners:
    """Corners between neighbouring beams at a node: the second is the next one anticlockwise.

    Parameters
    ----------
    first, second : (c,)
        Their beams.
    first_end, second_end : (c,)
        Which of their ends is at the node.
    """

    first: Ints
    second: Ints
    first_end: Ints
    second_end: Ints

    @property
    def sides(self) -> list[tuple[Ints, Ints]]:
        """Beam and end on each side of the corners."""
        return [(self.first, self.first_end), (self.second, self.second_end)]

    def arms(self, beams: Ints) -> list[tuple[Ints, Ints]]:
        """Return the node of the corner and the other end of each of both beams."""
        return [(beams[own, end], beams[own, 1 - end]) for own, end in self.sides]

    def shapes(self, positions: Floats, beams: Ints, widths: Floats) -> tuple[Floats, ...]:
        """Return both vectors (c, 2) from the node along the beams, and both widths (c,)."""
        vectors = [positions[far] - positions[node] for node, far in self.arms(beams)]
        return (*vectors, widths[self.first].copy(), widths[self.second].copy())


def _corners(positions: Floats, beams: Ints, mask: NDArray[np.bool_]) -> _Corners:
    """Return the corners between the beams of a design."""
    present = np.flatnonzero(mask)
    beam = np.concatenate([present, present])
    end = np.repeat([0, 1], len(present))
    node, far = beams[beam, end], beams[beam, 1 - end]
    x, y = (positions[far] - positions[node]).T
    order = np.lexsort((np.arctan2(y, x), node))
    beam, end, node = beam[order], end[order], node[order]
    # The next one at the same node; after the last one the first one.
    begins = np.flatnonzero(np.diff(node, prepend=-1))
    following = np.arange(1, len(node) + 1)
    following[np.append(begins[1:], len(node)) - 1] = begins
    several = following != np.arange(len(node))
    first, second = np.flatnonzero(several), following[several]
    return _Corners(beam[first], beam[second], end[first], end[second])


def _meeting(one: Any, two: Any, width1: Any, width2: Any) -> tuple[Any, Any]:
    """Return how far from the node the edges of two beams meet, along each of them.

    For widths a and b and the angle t between the beams, (a + b cos t) / (2 sin t) along the
    second one. Beyond a right angle, where the edge of a wide beam may meet the end of a narrow
    one, a / (2 tan(t / 2)); next to opposite beams less, so that the derivative is continuous.
    """
    size = np.sqrt((one * one).sum(axis=1) * (two * two).sum(axis=1))
    cosine = (one * two).sum(axis=1) / size
    sine = (one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]) / size
    convex = sine.real > 0.0
    cotangent = np.where(convex, sine / (1.0 - cosine), 0.0)  # of half the angle
    rounded = cotangent * cotangent / np.sqrt(cotangent * cotangent + OPPOSITE**2)
    acute = _ramp(cosine)
    factor = 0.5 * rounded / (1.0 + acute)
    return factor * (width2 + width1 * acute), factor * (width1 + width2 * acute)
