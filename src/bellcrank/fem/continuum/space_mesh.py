"""Meshes of parts in space: tetrahedra that fill the union of round struts and spherical joints.

By isosurface stuffing (Labelle and Shewchuk 2007): a body-centred cubic grid of tetrahedra is cut
at the surface, after vertices that are close to it have moved onto it, which leaves no thin
elements. The edges on the surface are curved.
"""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import combinations
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.fem.continuum.backend import ngsolve
from bellcrank.fem.continuum.fields import surface
from bellcrank.fem.continuum.mesh import ContinuumMesh, hub_nodes
from bellcrank.fem.continuum.solid import solid_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.part.part import Part

    Values = NDArray[np.float64]
    Numbers = NDArray[np.int64]

CELL = 0.55
"""Default edge of the cubes of the grid as a fraction of the strut width. From 0.65 on the section
has too few elements."""
HUB = 0.35
"""Radius of a hub as a fraction of the width of the widest strut that meets there."""
NEAR = {"long": 0.24999, "short": 0.41189}
"""Part of an edge of the grid next to a vertex within which a cut moves the vertex onto the
surface; the long edges are those between centres of cubes. Values of Labelle and Shewchuk."""
BISECTIONS = 12
LARGEST_CURVE = 0.3
"""Largest distance of the middle of an edge on the surface from its chord, in edges of cubes."""
SURFACE_STEPS = 5
"""Newton steps that move the middle of an edge onto the surface."""
FACES = ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2))
"""Corners of the faces of a tetrahedron."""


class Body(Protocol):
    """A body that can be meshed."""

    @property
    def low(self) -> Values:
        """(3,) smallest coordinates, mm."""

    @property
    def high(self) -> Values:
        """(3,) largest coordinates, mm."""

    def distance(self, points: Values) -> Values:
        """Return (n,) values of points (n, 3) that are negative inside and 0 on the surface."""


class RoundStruts:
    """The union of struts with spherical ends.

    Parameters
    ----------
    ends : (s, 2, 3) float64
        Ends of the centre lines, mm.
    radii : (s,) float64
        Radii of the struts, mm.

    Examples
    --------
    >>> struts = RoundStruts(np.array([[[0.0, 0.0, 0.0], [10.0, 0.0, 0.0]]]), np.array([1.0]))
    >>> struts.distance(np.array([[5.0, 2.0, 0.0], [11.5, 0.0, 0.0], [5.0, 0.0, 0.0]])).tolist()
    [1.0, 0.5, -1.0]
    """

    def __init__(self, ends: Values, radii: Values) -> None:
        self.ends, self.radii = ends, radii

    @property
    def low(self) -> Values:
        """(3,) smallest coordinates, mm."""
        return np.asarray((self.ends - self.radii[:, None, None]).min(axis=(0, 1)))

    @property
    def high(self) -> Values:
        """(3,) largest coordinates, mm."""
        return np.asarray((self.ends + self.radii[:, None, None]).max(axis=(0, 1)))

    def distance(self, points: Values) -> Values:
        """Return (n,) the distance of points (n, 3) from the surface, negative inside.

        Infinite farther than two radii from all struts.
        """
        found = np.full(len(points), np.inf)
        for (first, second), radius in zip(self.ends, self.radii.tolist(), strict=True):
            low, high = np.minimum(first, second), np.maximum(first, second)
            near = np.flatnonzero(
                ((points >= low - 3.0 * radius) & (points <= high + 3.0 * radius)).all(axis=1)
            )
            chord, arm = second - first, points[near] - first
            along = np.clip(arm @ chord / (chord @ chord), 0.0, 1.0)
            away = np.linalg.norm(arm - along[:, None] * chord, axis=1) - radius
            found[near] = np.minimum(found[near], away)
        return found

    def on_surface(self, points: Values) -> Values:
        """Return (n, 3) points that are moved onto the surface nearby."""
        step = 1e-4 * float(self.radii.min())
        for _ in range(SURFACE_STEPS):
            slopes = np.column_stack(
                [
                    (self.distance(points + step * axis) - self.distance(points - step * axis))
                    / (2.0 * step)
                    for axis in np.eye(3)
                ]
            )
            size = np.maximum((slopes**2).sum(axis=1), 0.1)
            points = points - (self.distance(points) / size)[:, None] * slopes
        return points


def space_mesh(part: Part, size: float | None = None) -> ContinuumMesh:
    """Mesh a part in space with curved tetrahedra.

    Parameters
    ----------
    part
        Part in space.
    size
        Edge of the cubes of the grid, mm; 0.55 of the least strut width by default.

    Raises
    ------
    InvalidSettings
        If the size is not positive, or too large for the struts.
    """
    size = CELL * float(part.widths.min()) if size is None else size
    if not 0.0 < size < math.inf:
        raise InvalidSettings(f"size: expected a length above 0 mm, got {size!r}")
    struts = RoundStruts(part.positions[part.struts], 0.5 * part.widths)
    vertices, elements = stuffed(struts, size)
    mesh = with_hubs(part, vertices, elements, size)
    return replace(mesh, curves=_curved(mesh, struts, elements, size))


def with_hubs(part: Part, vertices: Values, elements: Numbers, size: float) -> ContinuumMesh:
    """Return the mesh of a body with straight edges, and with the hubs of the ports of a part.

    Parameters
    ----------
    part
        Part with the ports; its struts may be others.
    vertices : (n, 3), mm
    elements : (e, 4)
        Tetrahedra that fill the body.
    size
        Edge of the cubes of the grid, mm, for errors.

    Raises
    ------
    InvalidSettings
        If no element is near a port.
    """
    nodes, widest = hub_nodes(part), part.widest
    hubs = np.full(len(elements), -1)
    middles = vertices[elements].mean(axis=1)
    for node in nodes.tolist():
        away = np.linalg.norm(middles - part.positions[node], axis=1)
        hubs[away < HUB * widest[node]] = node
    missing = np.setdiff1d(nodes, hubs)
    if len(missing):
        raise InvalidSettings(
            f"size: no element within the joint of node {missing[0]} with cubes of {size:.3g} mm; "
            "choose a smaller size"
        )
    return solid_of(vertices, elements, hubs, part.design.problem.lattice.node_count)


def stuffed(body: Body, size: float) -> tuple[Values, Numbers]:
    """Return (n, 3) vertices and (e, 4) tetrahedra that fill a body.

    Parameters
    ----------
    body
        The body.
    size
        Edge of the cubes of the grid, mm.
    """
    vertices, elements = _grid(body, size)
    distance = body.distance(vertices)
    used, numbers = np.unique(elements[distance[elements].min(axis=1) < 0.0], return_inverse=True)
    vertices, distance = vertices[used], distance[used]
    elements = numbers.reshape(-1, 4)
    sides = np.array(list(combinations(range(4), 2)))
    edges = np.unique(np.sort(elements[:, sides].reshape(-1, 2), axis=1), axis=0)
    vertices, side = _moved(body, vertices, edges, np.sign(distance), size)
    crossed = edges[side[edges[:, 0]] * side[edges[:, 1]] < 0.0]
    cuts = _cuts(body, vertices, crossed)
    numbers_of = {
        (one, other): len(vertices) + k for k, (one, other) in enumerate(crossed.tolist())
    }
    whole = (side[elements] <= 0.0).all(axis=1) & (side[elements] < 0.0).any(axis=1)
    mixed = (side[elements] < 0.0).any(axis=1) & (side[elements] > 0.0).any(axis=1)
    found = [
        piece
        for element in elements[mixed].tolist()
        for piece in _inner_pieces(element, side[element].tolist(), numbers_of)
    ]
    filled = np.concatenate([elements[whole], np.array(found, dtype=np.int64).reshape(-1, 4)])
    points = np.concatenate([vertices, cuts])
    volume = _volumes(points, filled)
    filled[volume < 0.0] = filled[volume < 0.0][:, [0, 1, 3, 2]]
    used, numbers = np.unique(filled, return_inverse=True)
    return points[used], numbers.reshape(-1, 4).astype(np.int64)


def _grid(body: Body, size: float) -> tuple[Values, Numbers]:
    """Return vertices and tetrahedra of a body-centred cubic grid over a body."""
    low = body.low - 1.01 * size
    counts = np.ceil((body.high + 1.01 * size - low) / size).astype(np.int64) + 1
    corners = np.stack(np.meshgrid(*map(np.arange, counts + 1), indexing="ij"), axis=-1)
    cubes = np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), axis=-1)
    corners, cubes = corners.reshape(-1, 3), cubes.reshape(-1, 3)

    def corner(where: Numbers) -> Numbers:
        return np.asarray(np.ravel_multi_index(tuple(where.T), tuple(counts + 1)), np.int64)

    def centre(where: Numbers) -> Numbers:
        inside = np.ravel_multi_index(tuple(where.T), tuple(counts))
        return np.asarray(len(corners) + inside, np.int64)

    elements = []
    unit = np.eye(3, dtype=np.int64)
    for axis in range(3):
        second, third = unit[(axis + 1) % 3], unit[(axis + 2) % 3]
        here = cubes[cubes[:, axis] < counts[axis] - 1]
        face = here + unit[axis]
        ring = [corner(face + move) for move in (0 * second, second, second + third, third)]
        pair = centre(here), centre(face)
        elements += [np.column_stack([*pair, ring[k], ring[(k + 1) % 4]]) for k in range(4)]
    vertices = low + size * np.concatenate([corners, cubes + 0.5])
    return vertices, np.concatenate(elements)


def _moved(
    body: Body, vertices: Values, edges: Numbers, side: Values, size: float
) -> tuple[Values, Values]:
    """Move vertices that are close to the surface onto it; return them and all signs."""
    crossed = edges[side[edges[:, 0]] * side[edges[:, 1]] < 0.0]
    cuts = _cuts(body, vertices, crossed)
    length = np.linalg.norm(vertices[crossed[:, 1]] - vertices[crossed[:, 0]], axis=1)
    part = np.linalg.norm(cuts - vertices[crossed[:, 0]], axis=1) / length
    least = np.where(length > 0.95 * size, NEAR["long"], NEAR["short"])
    ends = np.concatenate([crossed[:, 0], crossed[:, 1]])
    parts = np.concatenate([part, 1.0 - part])
    chosen = np.flatnonzero(parts < np.concatenate([least, least]))
    # The nearest cut of each vertex is the last one that is assigned.
    chosen = chosen[np.argsort(-parts[chosen], kind="stable")]
    vertices, side = vertices.copy(), side.copy()
    vertices[ends[chosen]] = np.concatenate([cuts, cuts])[chosen]
    side[ends[chosen]] = 0.0
    return vertices, side


def _cuts(body: Body, vertices: Values, crossed: Numbers) -> Values:
    """Return (c, 3) the points at which edges cross the surface."""
    first, second = vertices[crossed[:, 0]], vertices[crossed[:, 1]]
    inside = body.distance(first) < 0.0
    inner, outer = np.where(inside[:, None], [first, second], [second, first])
    for _ in range(BISECTIONS):
        middle = 0.5 * (inner + outer)
        within = (body.distance(middle) < 0.0)[:, None]
        inner, outer = np.where(within, middle, inner), np.where(within, outer, middle)
    return np.asarray(0.5 * (inner + outer))


def _inner_pieces(
    element: list[int], side: list[float], cuts: dict[tuple[int, int], int]
) -> list[tuple[int, int, int, int]]:
    """Return the tetrahedra of the part of an element that is inside.

    The polyhedron is divided from its lowest vertex, and each face of it from that of the face, so
    that neighbours divide the faces that they share alike.
    """
    faces: list[list[int]] = []
    section: list[tuple[int, int]] = []
    for face in FACES:
        polygon: list[int] = []
        on_surface: list[int] = []
        for k in range(3):
            here, after = face[k], face[(k + 1) % 3]
            if side[here] <= 0.0:
                polygon.append(element[here])
                if side[here] == 0.0:
                    on_surface.append(element[here])
            if side[here] * side[after] < 0.0:
                pair = sorted((element[here], element[after]))
                polygon.append(cuts[pair[0], pair[1]])
                on_surface.append(polygon[-1])
        if len(polygon) >= 3:
            faces.append(polygon)
        if len(on_surface) == 2 and any(side[k] > 0.0 for k in face):
            section.append((on_surface[0], on_surface[1]))
    if len(section) >= 3:
        faces.append(_polygon(section))
    lowest = min(vertex for face in faces for vertex in face)
    found = []
    for polygon in faces:
        if lowest in polygon:
            continue
        start = polygon.index(min(polygon))
        ordered = polygon[start:] + polygon[:start]
        found += [
            (lowest, ordered[0], ordered[k], ordered[k + 1]) for k in range(1, len(ordered) - 1)
        ]
    return found


def _polygon(sides: list[tuple[int, int]]) -> list[int]:
    """Return the corners of the polygon that sides enclose, in order."""
    left = list(sides)
    first, last = left.pop()
    polygon = [first]
    while last != first:
        polygon.append(last)
        index = next(k for k, pair in enumerate(left) if last in pair)
        one, other = left.pop(index)
        last = other if last == one else one
    return polygon


def _volumes(vertices: Values, elements: Numbers) -> Values:
    """Return (e,) the signed volumes of tetrahedra."""
    corners = vertices[elements]
    sides = corners[:, 1:] - corners[:, :1]
    return np.asarray(np.linalg.det(sides) / 6.0)


def _curved(mesh: ContinuumMesh, struts: RoundStruts, elements: Numbers, size: float) -> Any:
    """Curve the edges on the surface of a mesh; return the deformation, which it needs."""
    module, region = ngsolve(), mesh.mesh
    corners = np.array(list(combinations(range(3), 2)))
    faces = np.sort(surface(elements), axis=1)
    edges = np.unique(faces[:, corners].reshape(-1, 2), axis=0)
    vertices = mesh.vertices
    middle = vertices[edges].mean(axis=1)
    shift = struts.on_surface(middle) - middle
    length = np.linalg.norm(shift, axis=1, keepdims=True)
    shift *= np.minimum(1.0, LARGEST_CURVE * size / np.maximum(length, 1e-300))
    space = module.VectorH1(region, order=2)
    scalar = space.components[0]
    numbers = {
        tuple(sorted(vertex.nr for vertex in edge.vertices)): edge.nr for edge in region.edges
    }
    chosen = [
        scalar.GetDofNrs(module.NodeId(module.EDGE, numbers[one, other]))[0]
        for one, other in edges.tolist()
    ]
    deformation = module.GridFunction(space)
    values = deformation.vec.FV().NumPy().reshape(3, -1)
    values[:, chosen] = shift.T / _bubble_at_middle(region, scalar)
    region.SetDeformation(deformation)
    return deformation


def _bubble_at_middle(region: Any, scalar: Any) -> float:
    """Return the value of the shape function of an edge in its middle."""
    finite = scalar.GetFE(next(iter(region.Elements())))
    middles = [
        0.5 * np.add(*pair)
        for pair in combinations([(1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 0, 0)], 2)
    ]
    shapes = np.array([np.asarray(finite.CalcShape(*point)) for point in middles])
    bubbles = shapes[:, 4:].ravel()
    return float(bubbles[np.argmax(np.abs(bubbles))])
