"""The levels `plane` and `solid`: analysis of the printed outline of a part."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.fem.contact import Contacts, centre_lines, find_contacts
from bellcrank.fem.continuum.backend import missing_ngsolve, ngsolve
from bellcrank.fem.continuum.laws import laws
from bellcrank.fem.continuum.response import solve_plane, solve_solid
from bellcrank.fem.levels import Level, levels
from bellcrank.fem.path import PathStatus
from bellcrank.fem.results import Analysis, StrokePoint, stroke_point
from bellcrank.model import require_plane

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from bellcrank.fem.continuum.response import ContinuumResponse, ContinuumState
    from bellcrank.fem.levels import FemSettings
    from bellcrank.fem.results import Field
    from bellcrank.part import Part


SECTION = 1.01
"""Radius of the ball of vertices around a point on a centre line, over that of the strut."""


def check_law(settings: FemSettings) -> None:
    """Raise an error if the law is unknown, or NGSolve is missing."""
    law = laws[settings.law]
    if law.small:
        raise InvalidSettings(
            f"law: {settings.law!r} is for small displacements; use --linear instead"
        )
    ngsolve()


def check_plane(part: Part, settings: FemSettings) -> None:
    """Raise an error if a part has no valid outline, or cannot be computed with these settings."""
    require_plane(part.design.problem, "level 'plane'")
    check_law(settings)
    part.outline()


def check_solid(part: Part, settings: FemSettings) -> None:
    """Raise an error if a part cannot be computed; one in the plane needs a valid outline."""
    check_law(settings)
    if part.dimension == 2:
        part.outline()


def analyse_plane(part: Part, settings: FemSettings, report: Callable[[float], None]) -> Analysis:
    """Analyse a part in plane stress with second-order triangles.

    Parameters
    ----------
    part
        Part to be analysed.
    settings
        Material law, size of the elements, linear or not.
    report
        Called with each load reached.

    Raises
    ------
    InvalidSettings
        If NGSolve is not installed, or struts or fillets are so wide that holes close.
    """
    return _analyse(part, settings, report, "plane", solve_plane)


def analyse_solid(part: Part, settings: FemSettings, report: Callable[[float], None]) -> Analysis:
    """Analyse a part as a solid with second-order tetrahedra.

    Parameters and errors are those of `analyse_plane`.
    """
    return _analyse(part, settings, report, "solid", solve_solid)


levels.register("plane")(
    Level(analyse_plane, check_plane, missing_ngsolve, "2D solid", "up to a minute", in_space=False)
)
levels.register("solid")(
    Level(analyse_solid, check_solid, missing_ngsolve, "3D solid", "some minutes to an hour")
)


def _analyse(
    part: Part,
    settings: FemSettings,
    report: Callable[[float], None],
    level: str,
    solve: Callable[..., ContinuumResponse],
) -> Analysis:
    """Analyse a part in the plane or in space."""
    began = time.perf_counter()
    law = "linear" if settings.linear else settings.law
    response = solve(part, law, settings.size, report=lambda state: report(state.load))
    path = response.path
    if settings.linear and path.status is PathStatus.MECHANISM:
        raise InvalidSettings(f"the part cannot be analysed: {path.status.message}")
    states = [state for state in response.states if state.load or len(response.states) == 1]
    return Analysis(
        part=part,
        level=level,
        theory=law,
        linear=settings.linear,
        status=path.status,
        loss=path.loss,
        points=[_point_of(part, state) for state in states],
        contacts=_contacts_of(part, response),
        field=response.fields[-1],
        cost={
            "seconds": time.perf_counter() - began,
            "unknowns": response.unknowns,
            "elements": response.elements,
            "factorisations": path.factorisations,
        },
    )


def _point_of(part: Part, state: ContinuumState) -> StrokePoint:
    """Return the figures of an equilibrium."""
    problem = part.design.problem
    axes = slice(problem.lattice.dimension)
    return stroke_point(
        part,
        state.load,
        state.motion[:, axes],
        state.force[problem.input.nodes, axes],
        state.rotation,
        energy=state.energy,
        stress=state.stress,
        strain=state.strain,
    )


def _contacts_of(part: Part, response: ContinuumResponse) -> Contacts:
    """Find the struts whose centre lines come too close in any equilibrium of the path."""
    return contacts_along(part, response.states, response.fields, part.widths)


def contacts_along(
    part: Part,
    states: Sequence[ContinuumState],
    fields: Sequence[Field],
    widths: NDArray[np.float64],
) -> Contacts:
    """Find the struts whose centre lines come nearer than a width in any state.

    Parameters
    ----------
    part
        The part.
    states, fields
        Its states along the stroke.
    widths : (s,) float64
        Widths of the struts, mm, with the gaps between them that are wanted.
    """
    lines = centre_lines(part.positions[part.struts])
    points = lines.reshape(-1, lines.shape[2])
    if part.dimension == 2:
        interpolate = _within_triangles(fields[0], points)
    else:
        radii = np.repeat(0.5 * part.widths, lines.shape[1])
        interpolate = _mean_of_sections(fields[0], points, radii)
    stroke = (
        (state.load, lines + interpolate(field.displacement).reshape(lines.shape))
        for state, field in zip(states, fields, strict=True)
    )
    return find_contacts(np.flatnonzero(part.design.mask), lines, stroke, widths)


def _mean_of_sections(
    field: Field, points: NDArray[np.float64], radii: NDArray[np.float64]
) -> Callable[[NDArray[np.float64]], NDArray[np.float64]]:
    """Return a function to the means of the vertices around points on centre lines in space."""
    from scipy.sparse import csr_matrix
    from scipy.spatial import cKDTree

    tree = cKDTree(field.rest)
    nearest, _ = tree.query(points)
    around = tree.query_ball_point(points, SECTION * np.maximum(radii, nearest))
    counts = np.array([len(each) for each in around])
    columns = np.concatenate([np.array(each, dtype=np.int64) for each in around])
    rows = np.repeat(np.arange(len(points)), counts)
    shape = (len(points), len(field.rest))
    weights = csr_matrix((np.repeat(1.0 / counts, counts), (rows, columns)), shape=shape)
    return lambda displacement: np.asarray(weights @ displacement)


def _within_triangles(
    field: Field, points: NDArray[np.float64]
) -> Callable[[NDArray[np.float64]], NDArray[np.float64]]:
    """Return a function that interpolates to points in the plane, or on the floor of a solid."""
    import shapely

    rest, cells = field.rest[:, :2], field.cells
    if field.rest.shape[1] == 3:
        floor = field.rest[:, 2].min() + 1e-9 * np.ptp(field.rest[:, 0])
        cells = cells[(field.rest[cells, 2] <= floor).all(axis=1)]
    corners = rest[cells]
    tree = shapely.STRtree(shapely.polygons(corners))
    # A point on an edge is in two triangles, or in none between curved edges.
    which, cell = tree.query_nearest(shapely.points(points), all_matches=False)
    first, second, third = corners[cell].transpose(1, 0, 2)
    sides = np.stack([second - first, third - first], axis=2)
    local = np.linalg.solve(sides, (points[which] - first)[:, :, None])[:, :, 0]
    weight = np.column_stack([1.0 - local.sum(axis=1), local])

    def interpolate(displacement: NDArray[np.float64]) -> NDArray[np.float64]:
        moved = np.zeros_like(points)
        moved[which] = np.einsum("pk,pkd->pd", weight, displacement[cells[cell], :2])
        return moved

    return interpolate
