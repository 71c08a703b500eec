"""One judge for designs of any origin: outlines in nonlinear plane stress, gripped alike.

An outline, whoever drew it, gets hubs of one size at the ports and supports of its task, is cut
into second-order triangles of one size by one mesher, and followed along one stroke, in one
material.
"""

from __future__ import annotations

import itertools
import time
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely

from bellcrank.fem.continuum.mesh import HUB, ContinuumMesh, gripped, triangulated
from bellcrank.fem.continuum.response import respond
from bellcrank.fem.path import PathStatus
from bellcrank.mechanics import efficiency_of
from bellcrank.part.outline import Loop, Outline

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.part.part import Part
    from reproduction.boxes import Box

CHORD = 0.02
"""Largest distance of polygons from the arcs they stand for, mm."""
SMOOTH = 0.35
"""Radius by which corners of contours are rounded, mm."""
DRAWN = 0.15
"""How far outlines kept for pictures may be off, mm."""


def polygon_of(part: Part) -> shapely.Polygon:
    """Return the outline of a part made of struts."""
    lines = shapely.linestrings(part.positions[part.struts])
    half = 0.5 * part.section.width
    whole = shapely.union_all(shapely.buffer(lines, half, quad_segs=8))
    return _rounded(whole, part.fillet_radius)


def contour_of(box: Box, density: NDArray[np.float64], area: float) -> shapely.Polygon | None:
    """Return the shape that densities mean, at the level at which it has some area.

    Parts that hang together with no port are left out.

    Returns
    -------
    Polygon or None
        None if what holds the input holds no output.
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
    # The filter ends at the edge of the box; so does the shape, but not by half an element.
    x[0], x[-1] = box.low[0] - 1e-3, box.high[0] + 1e-3
    y[0], y[-1] = box.low[1] - 1e-3, box.high[1] + 1e-3
    padded = np.pad(density, 1, mode="edge")
    generator = contour_generator(x=x, y=y, z=padded, fill_type=FillType.OuterOffset)
    filled: Any = generator.filled(level, 2.0)
    points, offsets = filled
    pieces = []
    for corners, starts in zip(points, offsets, strict=True):
        rings = [corners[a:b] for a, b in itertools.pairwise(starts)]
        pieces.append(shapely.Polygon(rings[0], rings[1:]).buffer(0))
    frame = shapely.box(*box.low, *box.high)
    return _around_ports(box, _rounded(shapely.union_all(pieces) & frame, SMOOTH))


def _rounded(shape: Any, radius: float) -> Any:
    """Round corners outside and inside, and leave out what is thinner than a tenth of that."""
    if radius <= 0.0:
        return shape
    filled = shape.buffer(radius, quad_segs=6).buffer(-radius, quad_segs=6)
    return filled.buffer(-0.1 * radius).buffer(0.1 * radius).simplify(CHORD)


def _around_ports(box: Box, shape: Any) -> shapely.Polygon | None:
    """Return the one piece that holds input and output, and a support."""
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
    """Return the width of the narrowest place between input, output and a support, mm.

    That is how wide a disc may be that passes from each to each without leaving the shape.
    """
    low, high = 0.0, float(box.spec.scale)
    while high - low > 0.01:
        middle = 0.5 * (low + high)
        if _around_ports(box, shape.buffer(-0.5 * middle)) is None:
            high = middle
        else:
            low = middle
    return round(low, 2)


def judge(box: Box, part: Part, shape: shapely.Polygon, size: float, law: str) -> dict[str, Any]:
    """Follow a shape along the stroke of its task.

    Parameters
    ----------
    part
        Of the task: tells ports, stroke, material, springs; its own struts do not matter.
    size
        Of the largest triangles, mm.
    law
        Of the material.
    """
    began = time.perf_counter()
    radius = HUB * part.section.width
    nodes = [
        node
        for node in gripped(part).tolist()
        if shape.contains(shapely.Point(part.positions[node]).buffer(1.05 * radius))
    ]
    hubs = {node: part.positions[node] for node in nodes}
    raw = triangulated(_outline(shape), hubs, radius, size)
    mesh = ContinuumMesh(
        raw, np.array(nodes), box.problem.lattice.node_count, part.section.thickness
    )
    found = respond(part, mesh, law)
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
        "drawing": drawing(found.field.rest, found.field.displacement, found.field.cells),
    }


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
    """Return the closed curves that bound a mesh: x and y at rest, x and y moved, of each point."""
    edges = np.concatenate([cells[:, [0, 1]], cells[:, [1, 2]], cells[:, [2, 0]]])
    known = {(int(a), int(b)) for a, b in edges}
    after = {a: b for a, b in known if (b, a) not in known}
    curves = []
    while after:
        start, here = after.popitem()
        ring = [start, here]
        while here in after:
            here = after.pop(here)
            ring.append(here)
        curves.append(_thinned(rest, np.array(ring), displacement))
    return curves


def _thinned(
    rest: NDArray[np.float64], ring: NDArray[np.int64], displacement: NDArray[np.float64]
) -> list[list[float]]:
    """Leave out points that lie on the way from one to the next (Douglas and Peucker, 1973)."""
    both = np.column_stack([rest[ring], rest[ring] + displacement[ring]])
    kept = {0, len(ring) - 1}
    open_ = [(0, len(ring) - 1)]
    while open_:
        first, last = open_.pop()
        if last - first < 2:
            continue
        way = both[last] - both[first]
        offset = both[first + 1 : last] - both[first]
        along = np.clip(offset @ way / max(float(way @ way), 1e-12), 0.0, 1.0)
        away = np.linalg.norm(offset - along[:, None] * way, axis=1)
        farthest = first + 1 + int(away.argmax())
        if away.max() > DRAWN:
            kept.add(farthest)
            open_ += [(first, farthest), (farthest, last)]
    found: list[list[float]] = both[sorted(kept)].round(1).tolist()
    return found
