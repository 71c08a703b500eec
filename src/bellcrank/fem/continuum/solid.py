"""Meshes of tetrahedra: the triangles of the plane extruded by the thickness."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.fem.continuum.backend import ngsolve
from bellcrank.fem.continuum.mesh import ContinuumMesh, Fineness, plane_mesh

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.part.part import Part

SIZE = 1.0
"""Default edge length of triangles as a fraction of the strut width."""
STRAIGHT_EDGES = Fineness(outline=math.radians(60.0), hub=math.radians(90.0))


def solid_mesh(part: Part, size: float | None = None, layers: int = 1) -> ContinuumMesh:
    """Mesh a part in space with straight tetrahedra.

    Parameters
    ----------
    part
        Part to be meshed.
    size
        Largest edge of the triangles, mm; the strut width by default.
    layers
        Number of layers of elements across the thickness.

    Raises
    ------
    InvalidSettings
        If there is no valid outline, the size or number of layers is not positive, or two hubs
        touch.
    """
    if layers < 1:
        raise InvalidSettings(f"layers: expected at least 1 across the thickness, got {layers}")
    size = SIZE * float(part.widths.min()) if size is None else size
    plane = plane_mesh(part, size, STRAIGHT_EDGES)
    vertices = raised(plane.vertices, part.section.thickness, layers)
    elements = tetrahedra(plane.elements, len(plane.vertices), layers)
    hubs = np.repeat(plane.hub_of_element, 3 * layers)
    return solid_of(vertices, elements, hubs, plane.node_count)


def raised(vertices: NDArray[np.float64], thickness: float, layers: int) -> NDArray[np.float64]:
    """Return ((layers + 1) n, 3) copies of (n, 2) vertices at all heights, layer by layer."""
    heights = np.linspace(0.0, thickness, layers + 1)
    flat = np.tile(vertices, (layers + 1, 1))
    return np.column_stack([flat, np.repeat(heights, len(vertices))])


def tetrahedra(triangles: NDArray[np.int64], count: int, layers: int) -> NDArray[np.int64]:
    """Return (3 t layers, 4) the tetrahedra of the prisms over (t, 3) triangles.

    The tetrahedra of one triangle are consecutive. The diagonal of each vertical face starts at the
    bottom at the vertex with the lower index, so that neighbouring prisms share it.

    Parameters
    ----------
    triangles : (t, 3) int64
        Vertices of the triangles.
    count
        Number of vertices of each layer.
    layers
        Number of layers.

    Examples
    --------
    >>> tetrahedra(np.array([[0, 1, 2]]), 3, 1).tolist()
    [[0, 1, 2, 5], [0, 4, 1, 5], [0, 3, 4, 5]]
    """
    low = np.sort(triangles, axis=1)
    # Sorting reverses the orientation of a triangle if it takes an odd number of exchanges.
    first, second, third = triangles.T
    turned = ((first > second) ^ (second > third)) ^ (first > third)
    i, j, k = low.T
    prisms = np.stack(
        [
            np.column_stack([i, j, k, k + count]),
            np.column_stack([i, j + count, j, k + count]),
            np.column_stack([i, i + count, j + count, k + count]),
        ],
        axis=1,
    )
    prisms[turned] = prisms[turned][:, :, [0, 2, 1, 3]]
    shift = count * np.arange(layers)
    raised_prisms = prisms[:, None] + shift[None, :, None, None]
    filled: NDArray[np.int64] = raised_prisms.reshape(-1, 4)
    return filled


def solid_of(
    vertices: NDArray[np.float64],
    elements: NDArray[np.int64],
    hubs: NDArray[np.int64],
    node_count: int,
) -> ContinuumMesh:
    """Return the mesh of tetrahedra.

    Parameters
    ----------
    vertices : (n, 3) float64
        Positions, mm.
    elements : (e, 4) int64
        Corners of the elements, the first three counter-clockwise as seen from the side opposite
        to the fourth.
    hubs : (e,) int64
        Lattice node of the hub of each element, or -1.
    node_count
        Number of lattice nodes.
    """
    module = ngsolve()
    from netgen.meshing import Mesh

    mesh = Mesh(dim=3)
    mesh.AddPoints(np.ascontiguousarray(vertices))
    found = np.unique(hubs)
    for index, node in enumerate(found.tolist(), start=1):
        mesh.SetMaterial(index, "strut" if node < 0 else f"hub{node}")
        corners = np.ascontiguousarray(elements[hubs == node], dtype=np.int32)
        mesh.AddElements(dim=3, index=index, data=corners, base=0)
    return ContinuumMesh(module.Mesh(mesh), found[found >= 0], node_count, 1.0)
