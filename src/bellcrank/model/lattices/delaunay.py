"""Disordered lattices: a regular lattice with displaced nodes, triangulated again."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidProblem
from bellcrank.model.lattice import Lattice
from bellcrank.model.lattices.crystals import BODY_CENTRED, UPRIGHT, placements
from bellcrank.model.lattices.registry import lattices
from bellcrank.model.lattices.triangular import triangular_rectangle

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

# Boundary triangles with a larger angle opposite to the boundary edge are slivers: the
# triangulation fills concave corners of the outline with them.
WIDEST_ANGLE = math.radians(100.0)
LONGEST = 1.6
"""Length, in spacings, below which edges of tetrahedra are beams: those of next neighbours have
2 / sqrt(3), and the diagonals of the cubes' faces 1.63."""


@lattices.register("displaced-delaunay")
def displaced_delaunay(
    columns: int,
    rows: int,
    *,
    rng: np.random.Generator,
    displacement: float = 0.2,
    spacing: float = 1.0,
) -> Lattice:
    """Return a triangular rectangle with randomly displaced nodes, triangulated again.

    Without displacement the result is `triangular_rectangle`.

    Parameters
    ----------
    columns, rows
        Size of the rectangle, as in `triangular_rectangle`.
    rng
        Source of the displacements, uniform in a disc around the regular position.
    displacement
        Radius of the disc in spacings, from 0 to below 0.5.
    spacing
        Distance between neighbours before the displacement, lattice units.

    Raises
    ------
    InvalidProblem
        If the size or the displacement is outside its bounds.

    Examples
    --------
    >>> lattice = displaced_delaunay(5, 6, rng=np.random.default_rng(1))
    >>> lattice.node_count
    33
    """
    _check_displacement(displacement)
    regular = triangular_rectangle(columns, rows, spacing)
    angle = 2.0 * math.pi * rng.random(regular.node_count)
    radius = displacement * spacing * np.sqrt(rng.random(regular.node_count))
    shift = radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    positions = regular.positions + shift
    return Lattice(positions, _edges(_without_slivers(positions, _triangulate(positions))))


def _check_displacement(displacement: float) -> None:
    if not 0.0 <= displacement < 0.5:
        raise InvalidProblem(
            f"lattice.displacement: expected 0 or more, below 0.5, got {displacement}"
        )


@lattices.register("displaced-delaunay-space")
def displaced_delaunay_space(
    size: Sequence[float],
    *,
    rng: np.random.Generator,
    displacement: float = 0.2,
    envelope: str = "box",
    spacing: float = 1.0,
) -> Lattice:
    """Return randomly displaced body-centred cubic nodes, joined by a Delaunay triangulation.

    Without displacement, nodes are joined to their 8 nearest and 6 next neighbours.

    Parameters
    ----------
    size, envelope
        As in `bellcrank.model.lattices.octet`.
    rng
        Source of the displacements, uniform in a ball around the regular position.
    displacement
        Radius of the ball in spacings, from 0 to below 0.5.
    spacing
        Distance of nearest neighbours before the displacement, lattice units.

    Raises
    ------
    InvalidProblem
        If a value is outside its bounds, or too few nodes fit.

    Examples
    --------
    >>> lattice = displaced_delaunay_space([3, 3, 3], rng=np.random.default_rng(1))
    >>> lattice.dimension, lattice.node_count
    (3, 35)
    """
    _check_displacement(displacement)
    edge = spacing / math.sqrt(0.75)
    sites = placements(BODY_CENTRED, size, envelope, UPRIGHT, edge)
    regular = max((nodes for nodes, _ in sites), key=len)
    if len(regular) < 9 or (np.ptp(regular, axis=0) < 0.5 * edge).any():
        raise InvalidProblem(f"lattice.size: expected room for several cubes, got {list(size)}")
    direction = rng.normal(size=regular.shape)
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    radius = displacement * spacing * np.cbrt(rng.random(len(regular)))
    positions = regular + radius[:, None] * direction
    tetrahedra = _triangulate(positions)
    beams = _edges(tetrahedra)
    length = np.linalg.norm(positions[beams[:, 1]] - positions[beams[:, 0]], axis=1)
    # Slivers at the surface have long edges.
    return Lattice(positions, beams[length < LONGEST * spacing])


def _triangulate(positions: NDArray[np.float64]) -> NDArray[np.int64]:
    from scipy.spatial import Delaunay

    triangles: NDArray[np.int64] = Delaunay(positions).simplices.astype(np.int64)
    return triangles


def _without_slivers(
    positions: NDArray[np.float64], triangles: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Remove slivers at the boundary, one layer after the other."""
    while True:
        # Corner k of a triangle is opposite to edge k.
        edges = np.sort(triangles[:, [[1, 2], [2, 0], [0, 1]]], axis=2)
        _, inverse, uses = np.unique(
            edges.reshape(-1, 2), axis=0, return_inverse=True, return_counts=True
        )
        outer = (uses[inverse.ravel()] == 1).reshape(-1, 3)
        wide = outer & (_angles(positions, triangles) > WIDEST_ANGLE)
        # A triangle whose corner is on the boundary connects two parts and is kept.
        on_rim = np.zeros(len(positions), dtype=np.bool_)
        on_rim[edges[outer]] = True
        sliver = (wide & ~on_rim[triangles]).any(axis=1)
        if not sliver.any():
            return triangles
        triangles = triangles[~sliver]


def _angles(positions: NDArray[np.float64], triangles: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return the angle (T, 3) at each corner of each triangle, radians."""
    corners = positions[triangles]
    one = np.roll(corners, -1, axis=1) - corners
    two = np.roll(corners, 1, axis=1) - corners
    cross = one[..., 0] * two[..., 1] - one[..., 1] * two[..., 0]
    angles: NDArray[np.float64] = np.arctan2(np.abs(cross), (one * two).sum(axis=2))
    return angles


def _edges(simplices: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the edges of triangles or tetrahedra, once each."""
    pairs = list(itertools.combinations(range(simplices.shape[1]), 2))
    edges = np.sort(simplices[:, pairs].reshape(-1, 2), axis=1)
    return np.unique(edges, axis=0)
