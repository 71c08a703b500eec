"""Levels B and C: a part as a sheet or a body, along the whole stroke."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.fem.contact import Contacts, centre_lines, find_contacts
from bellcrank.fem.continuum.backend import ngsolve
from bellcrank.fem.continuum.laws import laws
from bellcrank.fem.continuum.response import solve_plane, solve_solid
from bellcrank.fem.levels import Level, levels
from bellcrank.fem.path import PathStatus
from bellcrank.fem.results import Analysis, StrokePoint, stroke_point

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from bellcrank.fem.continuum.response import ContinuumState, Response
    from bellcrank.fem.levels import FemSettings
    from bellcrank.fem.results import Field
    from bellcrank.part import Part


def check_outline(part: Part, settings: FemSettings) -> None:
    """Refuse what cannot be meshed: no NGSolve, an unknown law, no such outline."""
    law = laws[settings.law]
    if law.small:
        raise InvalidSettings(f"law: {settings.law!r} is for small motions; ask for --linear")
    ngsolve()
    part.outline()


def analyse_plane(part: Part, settings: FemSettings, tell: Callable[[float], None]) -> Analysis:
    """Analyse a part as a sheet in plane stress, cut into second-order triangles.

    Raises
    ------
    InvalidSettings
        If NGSolve is not installed, or struts or fillets are so wide that holes close.
    """
    return _analyse(part, settings, tell, "plane", solve_plane)


def analyse_solid(part: Part, settings: FemSettings, tell: Callable[[float], None]) -> Analysis:
    """Analyse a part as a body, cut into second-order tetrahedra.

    Raises
    ------
    InvalidSettings
        If NGSolve is not installed, or struts or fillets are so wide that holes close.
    """
    return _analyse(part, settings, tell, "solid", solve_solid)


levels.register("plane")(Level(analyse_plane, check_outline))
levels.register("solid")(Level(analyse_solid, check_outline))


def _analyse(
    part: Part,
    settings: FemSettings,
    tell: Callable[[float], None],
    level: str,
    solve: Callable[..., Response],
) -> Analysis:
    """Analyse a part by one of the two."""
    began = time.perf_counter()
    law = "linear" if settings.linear else settings.law
    found = solve(part, law, settings.size, tell=lambda state: tell(state.load))
    path = found.path
    if settings.linear and path.status is PathStatus.MECHANISM:
        raise InvalidSettings(f"the part cannot be analysed: {path.status.message}")
    states = [state for state in found.states if state.load or len(found.states) == 1]
    return Analysis(
        part=part,
        level=level,
        theory=law,
        linear=settings.linear,
        status=path.status,
        loss=path.loss,
        points=[point_of(part, state) for state in states],
        after=None,
        contacts=contacts_of(part, found),
        field=found.field,
        cost={
            "seconds": time.perf_counter() - began,
            "unknowns": found.unknowns,
            "elements": found.elements,
            "factorisations": path.factorisations,
        },
    )


def point_of(part: Part, state: ContinuumState) -> StrokePoint:
    """Return the figures of an equilibrium."""
    return stroke_point(
        part,
        state.load,
        state.motion[:, :2],
        state.force[part.design.problem.input.nodes, :2],
        energy=state.energy,
        stress=state.stress,
        strain=state.strain,
    )


def contacts_of(part: Part, response: Response) -> Contacts:
    """Find the struts whose centre lines come too close in any equilibrium of the path."""
    lines = centre_lines(part.positions[part.struts])
    interpolate = interpolator(response.field, lines.reshape(-1, 2))
    stroke = (
        (state.load, lines + interpolate(field.displacement).reshape(lines.shape))
        for state, field in zip(response.states, response.fields, strict=True)
    )
    beams = np.flatnonzero(part.design.mask)
    return find_contacts(beams, lines, stroke, part.section.width)


def interpolator(
    field: Field, points: NDArray[np.float64]
) -> Callable[[NDArray[np.float64]], NDArray[np.float64]]:
    """Return a function that interpolates vertex displacements to points of a part.

    Parameters
    ----------
    field
        Any state of the part; in space the points are on its lower face.
    points : (p, 2)
        Within the part at rest, mm.

    Returns
    -------
    callable
        From (n, 2) or (n, 3) displacements of the vertices to (p, 2) those of the points, mm.
    """
    import shapely

    rest, cells = field.rest[:, :2], field.cells
    if field.rest.shape[1] == 3:
        floor = field.rest[:, 2].min() + 1e-9 * np.ptp(field.rest[:, 0])
        cells = cells[(field.rest[cells, 2] <= floor).all(axis=1)]
    corners = rest[cells]
    tree = shapely.STRtree(shapely.polygons(corners))
    # A point on an edge is in two triangles, one between curved edges perhaps in none.
    which, cell = tree.query_nearest(shapely.points(points), all_matches=False)
    first, second, third = corners[cell].transpose(1, 0, 2)
    sides = np.stack([second - first, third - first], axis=2)
    part = np.linalg.solve(sides, (points[which] - first)[:, :, None])[:, :, 0]
    weight = np.column_stack([1.0 - part.sum(axis=1), part])

    def interpolate(displacement: NDArray[np.float64]) -> NDArray[np.float64]:
        moved = np.zeros_like(points)
        moved[which] = np.einsum("pk,pkd->pd", weight, displacement[cells[cell], :2])
        return moved

    return interpolate
