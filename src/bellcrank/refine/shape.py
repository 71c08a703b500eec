"""Constraints on the geometry at rest: slender struts, angles that print, and the volume."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.model import Problem

    Values = NDArray[np.float64]

SLENDERNESS = 1.5
"""Smallest length of a strut over its width."""
SMALLEST_ANGLE = np.radians(20.0)
"""Smallest angle between struts that meet."""
SMALLEST_HOLE = 0.75
"""Smallest radius of the circle within a triangle of struts, over their mean width; below 0.5 the
hole closes."""
NEAR_ANGLE = np.radians(45.0)
"""Angles below which they are constraints."""


class ShapeRows(NamedTuple):
    """Constraints, at most 0 where they are met, and their derivatives."""

    values: Values
    """(r,)"""
    names: tuple[str, ...]
    keys: tuple[tuple[int, ...], ...]
    positions: Values
    """(r, N, d) derivatives by the positions of the nodes."""
    widths: Values
    """(r, M) derivatives by the widths of the beams."""


def volume_of(problem: Problem, mask: NDArray[np.bool_]) -> tuple[float, Values, Values]:
    """Return the volume of the struts, and its derivatives by positions (N, d) and widths (M,)."""
    section, lattice = problem.section, problem.lattice
    assert section is not None
    area = section.area_of(problem.beam_widths) * mask
    power = 2 if section.shape == "round" else 1
    ends = lattice.positions[lattice.beams]
    along = ends[:, 1] - ends[:, 0]
    length = np.linalg.norm(along, axis=1)
    slope = (area / length)[:, None] * along
    positions = np.zeros(lattice.positions.shape)
    np.add.at(positions, lattice.beams[:, 1], slope)
    np.add.at(positions, lattice.beams[:, 0], -slope)
    return float(area @ length), positions, power * area * length / problem.beam_widths


def shape_rows(problem: Problem, mask: NDArray[np.bool_], volume: float) -> ShapeRows:
    """Return the constraints on the geometry of a design.

    Parameters
    ----------
    mask : (M,) bool
        Beams of the design.
    volume
        Largest volume of its struts, cubed lattice units; infinite without a limit.
    """
    lattice, widths = problem.lattice, problem.beam_widths
    beams = np.flatnonzero(mask)
    along = lattice.positions[lattice.beams[beams, 1]] - lattice.positions[lattice.beams[beams, 0]]
    length = np.linalg.norm(along, axis=1)
    unit = along / length[:, None]
    values: list[float] = []
    names: list[str] = []
    keys: list[tuple[int, ...]] = []
    by_position: list[tuple[int, int, Values]] = []
    by_width: list[tuple[int, int, float]] = []
    for k in np.flatnonzero(length < 2.0 * SLENDERNESS * widths[beams]).tolist():
        beam, row = int(beams[k]), len(values)
        values.append(SLENDERNESS - length[k] / widths[beam])
        names.append("length of struts")
        keys.append((beam,))
        slope = unit[k] / widths[beam]
        by_position += [
            (row, int(lattice.beams[beam, 1]), -slope), (row, int(lattice.beams[beam, 0]), slope),
        ]  # fmt: skip
        by_width.append((row, beam, length[k] / widths[beam] ** 2))
    for node, one, two, angle, slopes in _narrow_angles(problem, beams, unit, length):
        row = len(values)
        values.append((SMALLEST_ANGLE - angle) / SMALLEST_ANGLE)
        names.append("angle between struts")
        keys.append((node, one, two))
        for other, slope in zip((one, two), slopes, strict=True):
            by_position += [
                (row, other, -slope / SMALLEST_ANGLE), (row, node, slope / SMALLEST_ANGLE),
            ]  # fmt: skip
    for nodes, ratio, rates, sides in _small_triangles(problem, beams):
        row = len(values)
        values.append(1.0 - ratio / SMALLEST_HOLE)
        names.append("holes between struts")
        keys.append(tuple(nodes))
        by_position += [
            (row, node, -rate / SMALLEST_HOLE) for node, rate in zip(nodes, rates, strict=True)
        ]
        mean = float(widths[sides].mean())
        by_width += [(row, side, ratio / (3.0 * mean * SMALLEST_HOLE)) for side in sides]
    count = len(values) + bool(np.isfinite(volume))
    positions = np.zeros((count, *lattice.positions.shape))
    of_widths = np.zeros((count, lattice.beam_count))
    for row, node, rate in by_position:
        positions[row, node] += rate
    for row, beam, wide in by_width:
        of_widths[row, beam] += wide
    if np.isfinite(volume):
        whole, moved, wider = volume_of(problem, mask)
        values.append(whole / volume - 1.0)
        names.append("mass")
        keys.append(())
        positions[-1], of_widths[-1] = moved / volume, wider / volume
    return ShapeRows(
        np.array(values, dtype=np.float64), tuple(names), tuple(keys), positions, of_widths
    )


def _narrow_angles(
    problem: Problem, beams: NDArray[np.int64], unit: Values, length: Values
) -> list[tuple[int, int, int, float, tuple[Values, Values]]]:
    """Return node, other ends, angle and its derivatives by them of struts that meet narrowly."""
    lattice, found = problem.lattice, []
    at: dict[int, list[tuple[int, Values, float]]] = {}
    for k, beam in enumerate(beams.tolist()):
        first, second = lattice.beams[beam].tolist()
        at.setdefault(first, []).append((second, unit[k], float(length[k])))
        at.setdefault(second, []).append((first, -unit[k], float(length[k])))
    for node, others in at.items():
        for (one, a, length_a), (two, b, length_b) in combinations(others, 2):
            cosine = float(np.clip(a @ b, -1.0, 1.0))
            angle = float(np.arccos(cosine))
            if angle >= NEAR_ANGLE or angle < 1e-6:
                continue
            sine = np.sin(angle)
            slopes = ((cosine * a - b) / (sine * length_a), (cosine * b - a) / (sine * length_b))
            found.append((node, one, two, angle, slopes))
    return found


def _small_triangles(
    problem: Problem, beams: NDArray[np.int64]
) -> list[tuple[list[int], float, Values, list[int]]]:
    """Return nodes, radius over width, its derivatives (3, 2) and beams of small triangles."""
    lattice, widths = problem.lattice, problem.beam_widths
    number = {}
    others: dict[int, set[int]] = {}
    for beam in beams.tolist():
        first, second = lattice.beams[beam].tolist()
        number[first, second] = number[second, first] = beam
        others.setdefault(first, set()).add(second)
        others.setdefault(second, set()).add(first)
    found = []
    for first, around in others.items():
        for second, third in combinations(sorted(each for each in around if each > first), 2):
            if third not in others[second]:
                continue
            nodes = [first, second, third]
            points = lattice.positions[nodes]
            edges = np.roll(points, -1, axis=0) - points
            lengths = np.linalg.norm(edges, axis=1)
            half = 0.5 * float(lengths.sum())
            doubled = float(edges[0, 0] * edges[1, 1] - edges[0, 1] * edges[1, 0])
            area, side = 0.5 * abs(doubled), np.sign(doubled)
            sides = [number[nodes[k], nodes[(k + 1) % 3]] for k in range(3)]
            width = float(widths[sides].mean())
            ratio = area / (half * width)
            if ratio >= 2.0 * SMALLEST_HOLE:
                continue
            opposite = np.roll(edges, -1, axis=0)
            of_area = 0.5 * side * np.column_stack([-opposite[:, 1], opposite[:, 0]])
            units = edges / lengths[:, None]
            of_half = 0.5 * (np.roll(units, 1, axis=0) - units)
            rates = (of_area - area / half * of_half) / (half * width)
            found.append((nodes, ratio, rates, sides))
    return found
