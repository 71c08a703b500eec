"""From the outline of a part to curved triangles, with hubs where it is held and driven."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial import cKDTree

from bellcrank.errors import InvalidSettings
from bellcrank.fem.continuum.backend import ngsolve
from bellcrank.part.outline import Loop

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.part.outline import Outline
    from bellcrank.part.part import Part

HUB = 0.35
"""Radius of a hub, as a part of the width of struts: always within the material."""
SIZE = 0.5
"""Edges of triangles, as a part of the width."""


@dataclass(frozen=True, slots=True)
class Turns:
    """How much an arc may turn along the edge of one triangle, rad.

    Parameters
    ----------
    outline
        That of the part. By the parabolas that edges of 40 degrees become, the area of the crane
        is wrong by 2e-5.
    hub
        Those round hubs.
    """

    outline: float = math.radians(40.0)
    hub: float = math.radians(60.0)


CURVED = Turns()
NETGEN = {"grading": 0.5, "curvaturesafety": 1.0}
"""Triangles may grow fast, and arcs are cut by us, not by Netgen."""


@dataclass(frozen=True, slots=True, eq=False)
class ContinuumMesh:
    """Finite elements of a part.

    Parameters
    ----------
    mesh
        NGSolve's: triangles, second order and curved, or straight tetrahedra. Materials are
        `hub0`, `hub1`, ... round the nodes 0, 1, ... of the lattice, and `strut`.
    hubs : (h,) int64
        Nodes of the lattice that have a hub, ascending.
    node_count
        Number of nodes of the lattice.
    thickness
        By which what is integrated over the mesh is multiplied: that of a part in the plane,
        mm, and 1 in space.
    """

    mesh: Any
    hubs: NDArray[np.int64]
    node_count: int
    thickness: float

    @property
    def dimension(self) -> int:
        """2 in the plane, 3 in space."""
        return int(self.mesh.dim)

    @property
    def vertices(self) -> NDArray[np.float64]:
        """(n, 2) or (n, 3) corners of the elements, mm."""
        corners: NDArray[np.float64] = np.array(self.mesh.ngmesh.Coordinates())
        return corners

    @property
    def elements(self) -> NDArray[np.int64]:
        """(e, 3) or (e, 4) corners of each element."""
        whole = self.mesh.ngmesh
        found = whole.Elements2D() if self.dimension == 2 else whole.Elements3D()
        corners: NDArray[np.int64] = found.NumPy()["nodes"].astype(np.int64)
        return corners[:, : self.dimension + 1] - 1

    @property
    def hub_of_element(self) -> NDArray[np.int64]:
        """(e,) the lattice's node whose hub each element is in, -1 for those of struts."""
        whole = self.mesh.ngmesh
        found = whole.Elements2D() if self.dimension == 2 else whole.Elements3D()
        names = self.mesh.GetMaterials()
        nodes = [int(name.removeprefix("hub")) if name != "strut" else -1 for name in names]
        of_element: NDArray[np.int64] = np.array(nodes)[found.NumPy()["index"] - 1]
        return of_element

    def hub(self, *nodes: int) -> Any:
        """Return the region of the hubs of some nodes of the lattice."""
        return self.mesh.Materials("|".join(f"hub{node}" for node in nodes) or "nowhere")


def gripped(part: Part) -> NDArray[np.int64]:
    """Return those nodes of the lattice, ascending, at which a part is held, driven or watched."""
    problem = part.design.problem
    roles = [problem.supports.nodes, problem.input.nodes, problem.output.nodes]
    built = np.unique(problem.lattice.beams[part.design.mask])
    nodes: NDArray[np.int64] = np.intersect1d(np.concatenate(roles), built)
    return nodes


def plane_mesh(part: Part, size: float | None = None, turns: Turns = CURVED) -> ContinuumMesh:
    """Cut a part in the plane into triangles.

    Parameters
    ----------
    size
        Of the largest triangles, mm; by default half the width.
    turns
        How finely arcs are cut.

    Raises
    ------
    InvalidSettings
        If there is no such outline or size, or two hubs touch.
    """
    size = SIZE * part.section.width if size is None else size
    nodes, radius = gripped(part), HUB * part.section.width
    hubs = dict(zip(nodes.tolist(), part.positions[nodes], strict=True))
    mesh = triangulated(part.outline(), hubs, radius, size, turns)
    mesh.Curve(2)
    return ContinuumMesh(
        mesh, nodes, part.design.problem.lattice.node_count, part.section.thickness
    )


def triangulated(
    outline: Outline,
    hubs: dict[int, NDArray[np.float64]],
    radius: float,
    size: float,
    turns: Turns = CURVED,
) -> Any:
    """Return NGSolve's mesh of an outline with hubs, the edges of its triangles straight.

    Parameters
    ----------
    hubs
        For each node of the lattice the (2,) centre of its hub, mm.
    radius
        Of the hubs, mm.
    size
        Of the largest triangles, mm.
    turns
        How finely arcs are cut.
    """
    if not 0.0 < size < math.inf:
        raise InvalidSettings(f"size: expected a length above 0 mm, got {size!r}")
    module = ngsolve()
    from netgen.geom2d import SplineGeometry

    check_apart(hubs, radius)
    geometry = SplineGeometry()
    for loop in (*outline.outer, *outline.holes):
        add_loop(geometry, loop, 1, 0, turns.outline)
    geometry.SetMaterial(1, "strut")
    for domain, (node, centre) in enumerate(hubs.items(), start=2):
        ends = centre + np.array([[-radius, 0.0], [radius, 0.0]])
        add_loop(geometry, Loop(ends, np.ones(2)), domain, 1, turns.hub)
        geometry.SetMaterial(domain, f"hub{node}")
    return module.Mesh(geometry.GenerateMesh(maxh=size, **NETGEN))


def check_apart(hubs: dict[int, NDArray[np.float64]], radius: float) -> None:
    """Raise InvalidSettings if two hubs touch."""
    if len(hubs) < 2:
        return
    nodes, centres = list(hubs), np.array(list(hubs.values()))
    close = cKDTree(centres).query_pairs(2.2 * radius)
    for first, second in sorted(close):
        raise InvalidSettings(
            f"nodes {nodes[first]} and {nodes[second]} are so close to each other that they "
            "cannot be gripped one by one; choose narrower struts or a larger scale"
        )


def add_loop(geometry: Any, loop: Loop, left: int, right: int, turn: float) -> None:
    """Add a closed curve between two domains to a geometry of Netgen, in pieces of some turn."""
    corners, turns = split(loop, turn)
    ids = [geometry.AppendPoint(x, y) for x, y in corners.tolist()]
    ends = np.roll(corners, -1, axis=0)
    for k, part in enumerate(turns.tolist()):
        first, last = ids[k], ids[(k + 1) % len(ids)]
        curve = ["line", first, last]
        if part:
            # A rational parabola with the tangents of a circle at its ends is the circle.
            chord = ends[k] - corners[k]
            outward = np.array([chord[1], -chord[0]])
            tip = (corners[k] + ends[k] + math.tan(part / 2.0) * outward) / 2.0
            curve = ["spline3", first, geometry.AppendPoint(*tip.tolist()), last]
        geometry.Append(curve, leftdomain=left, rightdomain=right)


def split(loop: Loop, largest: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return (m, 2) corners and (m,) turns of a loop whose long arcs are cut into pieces.

    Examples
    --------
    >>> corners, turns = split(Loop([[-1.0, 0.0], [1.0, 0.0]], [1.0, 1.0]), np.pi / 3)
    >>> corners[:4].round(3).tolist()
    [[-1.0, 0.0], [-0.5, -0.866], [0.5, -0.866], [1.0, 0.0]]
    >>> np.degrees(turns).round(9).tolist()
    [60.0, 60.0, 60.0, 60.0, 60.0, 60.0]
    """
    corners, turns = [], []
    for start, centre, turn in zip(loop.points, loop.centres, loop.turns, strict=True):
        pieces = max(1, math.ceil(abs(turn) / largest - 1e-9))
        arm = start - centre
        for piece in range(pieces):
            angle = turn * piece / pieces
            cosine, sine = math.cos(angle), math.sin(angle)
            there = centre + np.array([[cosine, -sine], [sine, cosine]]) @ arm
            corners.append(there if piece else start)
            turns.append(turn / pieces)
    return np.array(corners), np.array(turns)
