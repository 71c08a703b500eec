"""Meshes of curved triangles, with hubs at supports, inputs and outputs."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.fem.continuum.backend import ngsolve
from bellcrank.part.outline import Loop

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from bellcrank.part.outline import Outline
    from bellcrank.part.part import Part

HUB = 0.35
"""Radius of a hub as a fraction of the strut width, so small that hubs are within the material."""


@dataclass(frozen=True, slots=True)
class Fineness:
    """How fine a mesh of triangles is.

    Parameters
    ----------
    size
        Largest edge, over the least strut width.
    outline
        Largest angle of an arc of the outline along one edge, rad. Edges are parabolas; with 40
        degrees the relative error of the area of the crane is 2e-5.
    hub
        The same for circles of hubs.
    grading
        How fast triangles grow away from small edges, 0 to 1.
    """

    size: float = 0.5
    outline: float = math.radians(40.0)
    hub: float = math.radians(60.0)
    grading: float = 0.5


FINE = Fineness()
COARSE = Fineness(size=1.0, outline=math.radians(60.0), grading=0.9)
"""Half of the triangles. On a refined design with small fillets motions differ by 1 % from those of
a fine mesh, strains by 5 % and the payload by 7 %."""


@dataclass(frozen=True, slots=True, eq=False)
class ContinuumMesh:
    """Finite elements of a part.

    Parameters
    ----------
    mesh
        Mesh of NGSolve: second-order curved triangles, or straight tetrahedra. Its materials are
        `hub0`, `hub1`, ... around the lattice nodes 0, 1, ... and `strut`.
    hubs : (h,) int64
        Lattice nodes that have a hub, ascending.
    node_count
        Number of lattice nodes.
    thickness
        Factor of integrals over the mesh: the thickness of the part in the plane, mm, and 1 in
        space.
    curves
        Deformation of NGSolve that curves the edges on the surface of a part in space; None for
        other meshes.
    """

    mesh: Any
    hubs: NDArray[np.int64]
    node_count: int
    thickness: float
    curves: Any = None

    @property
    def dimension(self) -> int:
        """2 in the plane, 3 in space."""
        return int(self.mesh.dim)

    @property
    def vertices(self) -> NDArray[np.float64]:
        """(n, 2) or (n, 3) positions of the corners of the elements, mm."""
        corners: NDArray[np.float64] = np.array(self.mesh.ngmesh.Coordinates())
        return corners

    @property
    def elements(self) -> NDArray[np.int64]:
        """(e, 3) or (e, 4) indices of the corners of each element."""
        whole = self.mesh.ngmesh
        found = whole.Elements2D() if self.dimension == 2 else whole.Elements3D()
        corners: NDArray[np.int64] = found.NumPy()["nodes"].astype(np.int64)
        return corners[:, : self.dimension + 1] - 1

    @property
    def hub_of_element(self) -> NDArray[np.int64]:
        """(e,) lattice node of the hub of each element, -1 for elements of struts."""
        whole = self.mesh.ngmesh
        found = whole.Elements2D() if self.dimension == 2 else whole.Elements3D()
        names = self.mesh.GetMaterials()
        nodes = [int(name.removeprefix("hub")) if name != "strut" else -1 for name in names]
        of_element: NDArray[np.int64] = np.array(nodes)[found.NumPy()["index"] - 1]
        return of_element

    def hub(self, *nodes: int) -> Any:
        """Return the region of the hubs of lattice nodes."""
        return self.mesh.Materials("|".join(f"hub{node}" for node in nodes) or "nowhere")


def hub_nodes(part: Part) -> NDArray[np.int64]:
    """Return the lattice nodes of supports, inputs, outputs and loads that have struts, ascending.

    Those of all load cases, so that one mesh serves them.
    """
    problem = part.design.problem
    roles = [case.special_nodes for case in problem.cases.values()]
    built = np.unique(problem.lattice.beams[part.design.mask])
    nodes: NDArray[np.int64] = np.intersect1d(np.concatenate(roles), built)
    return nodes


def plane_mesh(part: Part, size: float | None = None, fineness: Fineness = FINE) -> ContinuumMesh:
    """Mesh a part in the plane with triangles.

    Parameters
    ----------
    part
        Part to be meshed.
    size
        Largest edge of the triangles, mm; that of `fineness` by default.
    fineness
        How fine the mesh is.

    Raises
    ------
    InvalidSettings
        If there is no valid outline, the size is not positive or two hubs touch.
    """
    size = fineness.size * float(part.widths.min()) if size is None else size
    nodes, widest = hub_nodes(part), part.widest
    hubs = dict(zip(nodes.tolist(), part.positions[nodes], strict=True))
    mesh = triangulated(part.outline(), hubs, HUB * widest[nodes], size, fineness)
    mesh.Curve(2)
    return ContinuumMesh(
        mesh, nodes, part.design.problem.lattice.node_count, part.section.thickness
    )


def triangulated(
    outline: Outline,
    hubs: dict[int, NDArray[np.float64]],
    radius: ArrayLike,
    size: float,
    fineness: Fineness = FINE,
) -> Any:
    """Return NGSolve's mesh of an outline with hubs, with straight edges.

    Parameters
    ----------
    outline
        Outline to be meshed.
    hubs
        Centre (2,) of the hub of each lattice node, mm.
    radius : float or (h,) array_like
        Radius of the hubs, mm.
    size
        Largest edge of the triangles, mm.
    fineness
        Angles of arcs along one edge, and the growth of the triangles.
    """
    if not 0.0 < size < math.inf:
        raise InvalidSettings(f"size: expected a length above 0 mm, got {size!r}")
    module = ngsolve()
    from netgen.geom2d import SplineGeometry

    radii = np.broadcast_to(np.asarray(radius, dtype=np.float64), len(hubs))
    check_apart(hubs, radii)
    geometry = SplineGeometry()
    for loop in (*outline.outer, *outline.holes):
        add_loop(geometry, loop, 1, 0, fineness.outline)
    geometry.SetMaterial(1, "strut")
    for domain, (node, centre) in enumerate(hubs.items(), start=2):
        ends = centre + radii[domain - 2] * np.array([[-1.0, 0.0], [1.0, 0.0]])
        add_loop(geometry, Loop(ends, np.ones(2)), domain, 1, fineness.hub)
        geometry.SetMaterial(domain, f"hub{node}")
    # Arcs are divided here and not by Netgen.
    grown = {"grading": fineness.grading, "curvaturesafety": 1.0}
    try:
        return module.Mesh(geometry.GenerateMesh(maxh=size, **grown))
    except Exception as error:  # Netgen's own class, which is not exported
        raise InvalidSettings(
            f"the outline cannot be meshed with triangles of {size:.3g} mm ({error}); choose "
            "another size, or wider gaps between struts"
        ) from error


def check_apart(hubs: dict[int, NDArray[np.float64]], radii: NDArray[np.float64]) -> None:
    """Raise InvalidSettings if two hubs touch."""
    if len(hubs) < 2:
        return
    nodes, centres = list(hubs), np.array(list(hubs.values()))
    from scipy.spatial import cKDTree

    close = cKDTree(centres).query_pairs(2.2 * float(radii.max()))
    for first, second in sorted(close):
        away = float(np.linalg.norm(centres[first] - centres[second]))
        if away > 1.1 * (radii[first] + radii[second]):
            continue
        raise InvalidSettings(
            f"nodes {nodes[first]} and {nodes[second]} are so close to each other that their hubs "
            "touch; choose narrower struts or a larger scale"
        )


def add_loop(geometry: Any, loop: Loop, left: int, right: int, turn: float) -> None:
    """Add a closed curve between two domains to a geometry of Netgen, with divided arcs."""
    corners, turns = split(loop, turn)
    ids = [geometry.AppendPoint(x, y) for x, y in corners.tolist()]
    ends = np.roll(corners, -1, axis=0)
    for k, angle in enumerate(turns.tolist()):
        first, last = ids[k], ids[(k + 1) % len(ids)]
        curve = ["line", first, last]
        if angle:
            # A rational parabola that has the tangents of a circle at its ends is that circle.
            chord = ends[k] - corners[k]
            outward = np.array([chord[1], -chord[0]])
            tip = (corners[k] + ends[k] + math.tan(angle / 2.0) * outward) / 2.0
            curve = ["spline3", first, geometry.AppendPoint(*tip.tolist()), last]
        geometry.Append(curve, leftdomain=left, rightdomain=right)


def split(loop: Loop, largest: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return (m, 2) corners and (m,) turning angles of a loop with divided arcs.

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
