"""Layouts of struts to outline, and a slow and obvious way to fill their corners."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import shapely
from scipy.spatial import Delaunay

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    Layout = tuple[NDArray[np.float64], NDArray[np.int64]]


def triangular(columns: int, rows: int, side: float = 10.0) -> Layout:
    i, j = np.meshgrid(np.arange(columns), np.arange(rows))
    positions = side * np.column_stack([(i + 0.5 * (j % 2)).ravel(), 0.75**0.5 * j.ravel()])
    beams = triangulation(positions)
    lengths = np.linalg.norm(positions[beams[:, 1]] - positions[beams[:, 0]], axis=1)
    return positions, beams[lengths < 1.2 * side]


def triangulation(positions: NDArray[np.float64]) -> NDArray[np.int64]:
    corners = Delaunay(positions).simplices
    sides = np.vstack([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]])
    return np.unique(np.sort(sides, axis=1), axis=0)


def connected(rng: np.random.Generator, layout: Layout, keep: float) -> Layout:
    """Leave out struts, but never the only one that reaches a node."""
    positions, beams = layout
    order = rng.permutation(len(beams))
    parent = list(range(len(positions)))

    def root(node: int) -> int:
        while parent[node] != node:
            node = parent[node]
        return node

    kept = []
    for beam in order.tolist():
        a, b = (root(node) for node in beams[beam].tolist())
        if a != b or rng.random() < keep:
            kept.append(beam)
        parent[a] = b
    return positions, beams[np.sort(kept)]


def random_layout(kind: str, seed: int) -> Layout:
    rng = np.random.default_rng(seed)
    keep = rng.uniform(0.3, 1.0)
    if kind == "scattered":
        positions = rng.uniform(0.0, 40.0, (int(rng.integers(5, 18)), 2))
        return connected(rng, (positions, triangulation(positions)), keep)
    positions, beams = triangular(*rng.integers(2, 6, 2).tolist())
    if kind == "jittered":
        positions = positions + rng.uniform(-2.5, 2.5, positions.shape)
    return connected(rng, (positions, beams), keep)


def filled_by_polygons(
    layout: Layout, width: ArrayLike, fillet: float, segments: int
) -> shapely.Geometry:
    """What a disc of radius `fillet` outside the struts cannot cover, with polygons for arcs."""
    positions, beams = layout
    struts = shapely.linestrings(positions[beams])
    swollen = shapely.union_all(
        shapely.buffer(struts, 0.5 * np.asarray(width) + fillet, quad_segs=segments)
    )
    if fillet == 0.0:
        return swollen
    # Each side of the polygon by itself: buffers of whole polygons are simplified first.
    ends = [shapely.get_coordinates(ring) for ring in shapely.get_rings(shapely.get_parts(swollen))]
    sides = np.concatenate([np.stack([ring[:-1], ring[1:]], axis=1) for ring in ends])
    discs = shapely.buffer(shapely.linestrings(sides), fillet, quad_segs=segments)
    return shapely.difference(swollen, shapely.union_all(discs))
