"""Disordered lattices: a triangular lattice with displaced nodes, triangulated again."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidProblem
from bellcrank.model.lattice import Lattice
from bellcrank.model.lattices.registry import lattices
from bellcrank.model.lattices.triangular import triangular_rectangle

if TYPE_CHECKING:
    from numpy.typing import NDArray

# Boundary triangles with a larger angle opposite to the boundary edge are slivers: the
# triangulation fills concave corners of the outline with them.
WIDEST_ANGLE = math.radians(100.0)


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
    if not 0.0 <= displacement < 0.5:
        raise InvalidProblem(
            f"lattice.displacement: expected 0 or more, below 0.5, got {displacement}"
        )
    regular = triangular_rectangle(columns, rows, spacing)
    angle = 2.0 * math.pi * rng.random(regular.node_count)
    radius = displacement * spacing * np.sqrt(rng.random(regular.node_count))
    shift = radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    positions = regular.positions + shift
    return Lattice(positions, _edges(_without_slivers(positions, _triangulate(positions))))


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


def _edges(triangles: NDArray[np.int64]) -> NDArray[np.int64]:
    edges = np.sort(triangles[:, [[1, 2], [2, 0], [0, 1]]].reshape(-1, 2), axis=1)
    return np.unique(edges, axis=0)
