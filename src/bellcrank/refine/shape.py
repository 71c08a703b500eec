"""Constraints on the geometry at rest: struts, angles, holes and gaps that print; the volume."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from bellcrank.refine.domain import distances_inside
from bellcrank.refine.gaps import gaps_of

if TYPE_CHECKING:
    from collections.abc import Sequence

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
SMALLEST_GAP = 0.6
"""Smallest gap between struts without a common node, over the width of the section."""
MASS_WEIGHT = 20.0
"""Weight of the mass against other constraints, so that it does not grow where these are missed."""
NEAR_ANGLE = np.radians(45.0)
"""Angles below which they are constraints."""
NEAR_DOMAIN = 0.5
"""Distance of the surface of a strut from the domain, over its width, below which it counts."""
SHARES = (0.0, 0.25, 0.5, 0.75, 1.0)
"""Points of a strut, as parts of its length, that must be inside the domain."""


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
    beams = np.flatnonzero(mask)
    kinds = (_length_rows, _angle_rows, _hole_rows, _gap_rows, _domain_rows)
    parts = [rows(problem, beams) for rows in kinds]
    if np.isfinite(volume):
        whole, moved, wider = volume_of(problem, mask)
        scale = volume / MASS_WEIGHT
        value = np.array([(whole - volume) / scale])
        parts.append(ShapeRows(value, ("mass",), ((),), moved[None] / scale, wider[None] / scale))
    return ShapeRows(
        np.concatenate([part.values for part in parts]),
        tuple(name for part in parts for name in part.names),
        tuple(key for part in parts for key in part.keys),
        np.concatenate([part.positions for part in parts]),
        np.concatenate([part.widths for part in parts]),
    )


def _rows_of(
    problem: Problem,
    name: str,
    values: Values,
    keys: NDArray[np.int64],
    by_position: Sequence[tuple[NDArray[np.int64], Values]],
    by_width: Sequence[tuple[NDArray[np.int64], Values]] = (),
) -> ShapeRows:
    """Return constraints, one for each row of `keys`.

    Their derivatives are given for one node (r,) or one beam (r,) of each at a time.
    """
    count, every = len(values), np.arange(len(values))
    positions = np.zeros((count, *problem.lattice.positions.shape))
    widths = np.zeros((count, problem.lattice.beam_count))
    for nodes, rates in by_position:
        positions[every, nodes] += rates
    for beams, rates in by_width:
        widths[every, beams] += rates
    return ShapeRows(values, (name,) * count, tuple(map(tuple, keys.tolist())), positions, widths)


def _length_rows(problem: Problem, beams: NDArray[np.int64]) -> ShapeRows:
    """Return the constraints on the slenderness of struts."""
    lattice, width = problem.lattice, problem.beam_widths[beams]
    first, second = lattice.beams[beams].T
    along = lattice.positions[second] - lattice.positions[first]
    length = np.linalg.norm(along, axis=1)
    short = length < 2.0 * SLENDERNESS * width
    beams, first, second, along, length, width = (
        each[short] for each in (beams, first, second, along, length, width)
    )
    slope = along / (length * width)[:, None]
    return _rows_of(
        problem, "length of struts", SLENDERNESS - length / width, beams[:, None],
        [(second, -slope), (first, slope)], [(beams, length / width**2)],
    )  # fmt: skip


def _angle_rows(problem: Problem, beams: NDArray[np.int64]) -> ShapeRows:
    """Return the constraints on the angles between struts that meet in a node."""
    positions, ends = problem.lattice.positions, problem.lattice.beams[beams]
    node, other = np.concatenate([ends, ends[:, ::-1]]).T
    order = np.lexsort((other, node))
    node, other = node[order], other[order]
    most = int(np.bincount(node).max())
    # Neighbours in the order of the nodes, then those after the next one, and so on.
    later = [np.flatnonzero(node[k:] == node[:-k]) for k in range(1, most)]
    first = np.concatenate([np.zeros(0, np.int64), *later])
    second = first + np.repeat(np.arange(1, most), [len(each) for each in later])
    node, one, two = node[first], other[first], other[second]
    sides = [positions[each] - positions[node] for each in (one, two)]
    lengths = [np.linalg.norm(each, axis=1)[:, None] for each in sides]
    units = [side / length for side, length in zip(sides, lengths, strict=True)]
    cosine = np.clip((units[0] * units[1]).sum(axis=1), -1.0, 1.0)
    angle = np.arccos(cosine)
    near = np.flatnonzero((angle > 1e-6) & (angle < NEAR_ANGLE))
    node, one, two, angle = node[near], one[near], two[near], angle[near]
    (u, v), (a, b) = (each[near] for each in units), (each[near] for each in lengths)
    sine = (np.sin(angle) * SMALLEST_ANGLE)[:, None]
    by_one = (v - np.cos(angle)[:, None] * u) / (a * sine)
    by_two = (u - np.cos(angle)[:, None] * v) / (b * sine)
    return _rows_of(
        problem, "angle between struts", 1.0 - angle / SMALLEST_ANGLE,
        np.column_stack([node, one, two]),
        [(one, by_one), (two, by_two), (node, -by_one - by_two)],
    )  # fmt: skip


def _hole_rows(problem: Problem, beams: NDArray[np.int64]) -> ShapeRows:
    """Return the constraints on the radius of the circle within triangles, over their width."""
    lattice = problem.lattice
    corners, sides = _triangles(lattice.beams, beams)
    dimension = lattice.dimension
    points = np.zeros((len(corners), 3, 3))
    points[..., :dimension] = lattice.positions[corners]
    edges = np.roll(points, -1, axis=1) - points
    lengths = np.linalg.norm(edges, axis=2)
    half = 0.5 * lengths.sum(axis=1)
    normal = np.cross(edges[:, 0], edges[:, 1])
    doubled = np.linalg.norm(normal, axis=1)
    width = problem.beam_widths[sides].mean(axis=1)
    ratio = 0.5 * doubled / (half * width)
    small = (ratio < 2.0 * SMALLEST_HOLE) & (doubled > 0.0)
    corners, sides, edges, lengths, half, doubled, width, ratio, normal = (
        each[small]
        for each in (corners, sides, edges, lengths, half, doubled, width, ratio, normal)
    )
    opposite = np.roll(edges, -1, axis=1)
    of_area = 0.5 * np.cross((normal / doubled[:, None])[:, None], opposite)
    units = edges / lengths[..., None]
    of_half = 0.5 * (np.roll(units, 1, axis=1) - units)
    rates = of_area / (half * width)[:, None, None] - (ratio / half)[:, None, None] * of_half
    rates = rates[..., :dimension]
    by_width = ratio / (3.0 * width * SMALLEST_HOLE)
    return _rows_of(
        problem, "holes between struts", 1.0 - ratio / SMALLEST_HOLE, corners,
        [(corners[:, k], -rates[:, k] / SMALLEST_HOLE) for k in range(3)],
        [(sides[:, k], by_width) for k in range(3)],
    )  # fmt: skip


def _triangles(
    ends: NDArray[np.int64], beams: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return (t, 3) the nodes and (t, 3) the beams of all triangles of beams."""
    number = {tuple(sorted(ends[beam].tolist())): beam for beam in beams.tolist()}
    higher: dict[int, set[int]] = {}
    for low, high in number:
        higher.setdefault(low, set()).add(high)
    nodes = [
        (low, middle, high)
        for low, middle in number
        for high in higher[low] & higher.get(middle, set())
    ]
    sides = [(number[a, b], number[b, c], number[a, c]) for a, b, c in nodes]
    return (
        np.array(nodes, dtype=np.int64).reshape(-1, 3),
        np.array(sides, dtype=np.int64).reshape(-1, 3),
    )


def _gap_rows(problem: Problem, beams: NDArray[np.int64]) -> ShapeRows:
    """Return the constraints on the gaps between struts without a common node."""
    assert problem.section is not None
    least = SMALLEST_GAP * problem.section.width
    found = gaps_of(problem, beams, np.zeros((problem.lattice.node_count, 3)), 2.0 * least)
    count = len(found.value)
    return ShapeRows(
        1.0 - found.value / least, ("gaps between struts",) * count,
        tuple(map(tuple, found.keys.tolist())),
        -found.fields[..., : problem.lattice.dimension] / least, -found.widths / least,
    )  # fmt: skip


def _domain_rows(problem: Problem, beams: NDArray[np.int64]) -> ShapeRows:
    """Return the constraints on the distances of struts from the boundary of the domain.

    Ends that keep their positions may be at the boundary, as those at supports: struts are there as
    wide as twice the distance from it, or as the section if that is more.
    """
    wanted, lattice = problem.specification, problem.lattice
    domain = () if wanted is None else wanted.domain
    held = np.zeros(lattice.node_count, dtype=bool)
    held[problem.special_nodes_of_all_cases] = True
    share = np.tile(np.array(SHARES), len(beams))
    beam = np.repeat(beams, len(SHARES))
    end = lattice.beams[beam, (share > 0.5).astype(np.int64)]
    if not domain:
        beam, share, end = beam[:0], share[:0], end[:0]
    is_held = held[end] & (share % 1.0 == 0.0)
    ends, width = lattice.beams[beam], problem.beam_widths[beam]
    weights = np.stack([1.0 - share, share], axis=1)
    points = np.einsum("pk,pkd->pd", weights, lattice.positions[ends])
    if not len(points):
        none = np.zeros(0, dtype=np.int64)
        return _rows_of(
            problem, "domain", np.zeros(0), np.zeros((0, 3), np.int64), [(none, points)]
        )
    found = distances_inside(points, domain, (0.5 + NEAR_DOMAIN) * float(width.max()))
    beam, share, width = beam[found.point], share[found.point], width[found.point]
    ends, weights, is_held = ends[found.point], weights[found.point], is_held[found.point]
    # A held end closer to the boundary than half of the section is as far as that.
    assert problem.section is not None
    least = 0.5 * problem.section.width
    is_held &= found.value < least
    distance = np.where(is_held, least, found.value)
    value = 0.5 - distance / width
    near = np.flatnonzero(value > -NEAR_DOMAIN)
    rate = -(np.where(is_held[:, None], 0.0, found.slopes) / width[:, None])[near]
    return _rows_of(
        problem, "domain", value[near],
        np.column_stack([beam, np.rint(4.0 * share).astype(np.int64), found.face])[near],
        [(ends[near, k], weights[near, k, None] * rate) for k in range(2)],
        [(beam[near], ((0.5 - value) / width)[near])],
    )  # fmt: skip
