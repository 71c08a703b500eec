"""Nonlinear plane-stress analysis of arbitrary outlines with equal conditions.

All outlines get hubs of equal size at the ports and supports of their task, and are meshed with
second-order triangles of equal size. Stroke and material are the same.
"""

from __future__ import annotations

import itertools
import time
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely

from bellcrank.fem.continuum.mesh import HUB, ContinuumMesh, hub_nodes, triangulated
from bellcrank.fem.continuum.response import solve_mesh
from bellcrank.fem.path import PathStatus
from bellcrank.mechanics import efficiency_of
from bellcrank.part.outline import Loop, Outline

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.part.part import Part
    from reproduction.boxes import Box

CHORD = 0.02
"""Largest distance between polygons and the arcs that they approximate, mm."""
SMOOTH = 0.35
"""Radius of rounded corners of contours, mm."""
PICTURE_TOLERANCE = 0.15
"""Largest deviation of stored outlines for pictures, mm."""


def polygon_of(part: Part) -> shapely.Polygon:
    """Return the outline of the struts of a part."""
    lines = shapely.linestrings(part.positions[part.struts])
    whole = shapely.union_all(shapely.buffer(lines, 0.5 * part.widths, quad_segs=8))
    return _rounded(whole, part.fillet_radius)


def contour_of(box: Box, density: NDArray[np.float64], area: float) -> shapely.Polygon | None:
    """Return the contour of densities at the level that gives an area.

    Pieces without a port are removed.

    Returns
    -------
    Polygon or None
        None if input, output and a support are not connected.
    """
    low, high = 0.02, 0.98
    for _ in range(25):
        level = 0.5 * (low + high)
        shape = _at_level(box, density, level)
        if shape is not None and shape.area > area:
            low = level
        else:
            high = level
    return _at_level(box, density, low)


def _at_level(box: Box, density: NDArray[np.float64], level: float) -> shapely.Polygon | None:
    from contourpy import FillType, contour_generator

    rows, columns = len(density), len(density[0])
    step = (box.high - box.low) / np.array([columns, rows])
    x = box.low[0] + step[0] * (np.arange(-1, columns + 1) + 0.5)
    y = box.low[1] + step[1] * (np.arange(-1, rows + 1) + 0.5)
    # The contour extends to the edges of the box, not to the centres of the outer elements.
    x[0], x[-1] = box.low[0] - 1e-3, box.high[0] + 1e-3
    y[0], y[-1] = box.low[1] - 1e-3, box.high[1] + 1e-3
    padded = np.pad(density, 1, mode="edge")
    generator = contour_generator(x=x, y=y, z=padded, fill_type=FillType.OuterOffset)
    filled: Any = generator.filled(level, 2.0)
    points, offsets = filled
    pieces = []
    for corners, starts in zip(points, offsets, strict=True):
        boundaries = [corners[a:b] for a, b in itertools.pairwise(starts)]
        pieces.append(shapely.Polygon(boundaries[0], boundaries[1:]).buffer(0))
    frame = shapely.box(*box.low, *box.high)
    return _around_ports(box, _rounded(shapely.union_all(pieces) & frame, SMOOTH))


def _rounded(shape: Any, radius: float) -> Any:
    """Round all corners, and remove parts thinner than a fifth of the radius."""
    if radius <= 0.0:
        return shape
    filled = shape.buffer(radius, quad_segs=6).buffer(-radius, quad_segs=6)
    return filled.buffer(-0.1 * radius).buffer(0.1 * radius).simplify(CHORD)


def _around_ports(box: Box, shape: Any) -> shapely.Polygon | None:
    """Return the piece that contains input, output and a support, or None."""
    pieces = list(shape.geoms) if hasattr(shape, "geoms") else [shape]
    problem = box.problem
    for piece in pieces:
        inside = {
            name: [piece.contains(shapely.Point(box.positions[node])) for node in nodes]
            for name, nodes in (
                ("input", problem.input.nodes),
                ("output", problem.output.nodes),
                ("support", problem.supports.fixed),
            )
        }
        if all(inside["input"]) and all(inside["output"]) and any(inside["support"]):
            return piece
    return None


def narrowest(box: Box, shape: shapely.Polygon) -> float:
    """Return the smallest width between input, output and a support, mm.

    This is the largest diameter of a disc that can move between them within the shape.
    """
    low, high = 0.0, float(box.spec.scale)
    while high - low > 0.01:
        middle = 0.5 * (low + high)
        if _around_ports(box, shape.buffer(-0.5 * middle)) is None:
            high = middle
        else:
            low = middle
    return round(low, 2)


def analyse_outline(
    box: Box, part: Part, shape: shapely.Polygon, size: float, law: str
) -> dict[str, Any]:
    """Compute the response of an outline along the stroke of its task.

    Parameters
    ----------
    part
        Part that defines ports, stroke, material and springs; its struts are not used.
    size
        Largest triangle size, mm.
    law
        Material law.
    """
    began = time.perf_counter()
    mesh = mesh_of(part, shape, size)
    found = solve_mesh(part, mesh, law)
    last = found.states[-1]
    done = found.path.status is PathStatus.CONVERGED
    moved = efficiency_of(box.problem, last.motion / part.scale, load=last.load)
    return {
        "status": found.path.status.value,
        "reached": last.load,
        "efficiency": moved if done else None,
        "efficiency_there": moved,
        "von_mises_MPa": last.stress,
        "principal_strain": last.strain,
        "input_force_N": last.input_force,
        "area_mm2": float(shape.area),
        "triangles": found.elements,
        "seconds": round(time.perf_counter() - began, 1),
        "drawing": drawing(
            found.fields[-1].rest, found.fields[-1].displacement, found.fields[-1].cells
        ),
    }


def mesh_of(part: Part, shape: shapely.Polygon, size: float) -> ContinuumMesh:
    """Mesh an outline with triangles of a largest size, and with the hubs of a part inside it."""
    radius = HUB * part.section.width
    nodes = [
        node
        for node in hub_nodes(part).tolist()
        if shape.contains(shapely.Point(part.positions[node]).buffer(1.05 * radius))
    ]
    hubs = {node: part.positions[node] for node in nodes}
    raw = triangulated(_outline(shape), hubs, radius, size)
    count = part.design.problem.lattice.node_count
    return ContinuumMesh(raw, np.array(nodes), count, part.section.thickness)


def _outline(shape: shapely.Polygon) -> Outline:
    shape = shapely.geometry.polygon.orient(shape.simplify(CHORD))
    outer, *holes = [
        Loop(np.array(ring.coords)[:-1], np.zeros(len(ring.coords) - 1))
        for ring in (shape.exterior, *shape.interiors)
    ]
    return Outline((outer,), tuple(holes))


def drawing(
    rest: NDArray[np.float64], displacement: NDArray[np.float64], cells: NDArray[np.int64]
) -> list[list[list[float]]]:
    """Return the boundary curves of a mesh: x and y at rest and displaced of each point."""
    edges = np.concatenate([cells[:, [0, 1]], cells[:, [1, 2]], cells[:, [2, 0]]])
    directed = {(int(a), int(b)) for a, b in edges}
    after = {a: b for a, b in directed if (b, a) not in directed}
    curves = []
    while after:
        start, here = after.popitem()
        ring = [start, here]
        while here in after:
            here = after.pop(here)
            ring.append(here)
        curves.append(_simplified(rest, np.array(ring), displacement))
    return curves


def _simplified(
    rest: NDArray[np.float64], ring: NDArray[np.int64], displacement: NDArray[np.float64]
) -> list[list[float]]:
    """Remove nearly collinear points (Douglas and Peucker, 1973)."""
    both = np.column_stack([rest[ring], rest[ring] + displacement[ring]])
    selected = {0, len(ring) - 1}
    open_ = [(0, len(ring) - 1)]
    while open_:
        first, last = open_.pop()
        if last - first < 2:
            continue
        chord = both[last] - both[first]
        offset = both[first + 1 : last] - both[first]
        along = np.clip(offset @ chord / max(float(chord @ chord), 1e-12), 0.0, 1.0)
        away = np.linalg.norm(offset - along[:, None] * chord, axis=1)
        farthest = first + 1 + int(away.argmax())
        if away.max() > PICTURE_TOLERANCE:
            selected.add(farthest)
            open_ += [(first, farthest), (farthest, last)]
    found: list[list[float]] = both[sorted(selected)].round(1).tolist()
    return found
