"""Solids of parts in space: the union of round struts, with a sphere in each joint."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.export.flattening import SAGITTA
from bellcrank.export.solid import Solid

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.part import Part

SLIVER = 1e-6
"""Volume, over the cube of the radius of the struts, below which a closed surface is left out."""
GOLDEN_ANGLE = math.pi * (3.0 - math.sqrt(5.0))
"""Angle by which the prism of each strut is turned against the one before: prisms in the same
position meet in points and edges, where readers of STL files join surfaces that only touch."""
ATTEMPTS = 8
"""Number of unions, each turned otherwise, until all vertices differ in single precision."""
LEAST_SIDES = 12
"""Smallest number of sides of the prism of a strut."""


def struts_solid(part: Part, sagitta: float = SAGITTA) -> Solid:
    """Return the surface of a part in space.

    Struts are prisms with the area of their section, joints polyhedra with the volume of a sphere
    as wide as the widest strut that meets there.

    Parameters
    ----------
    part
        Part in space.
    sagitta : float, mm
        Largest distance between a strut and its prism.

    Raises
    ------
    InvalidSettings
        If the sagitta is not above 0.

    Examples
    --------
    The twelve edges of a cube enclose five independent loops, so that the Euler number is -8:

    >>> from bellcrank.model import Input, Output, Problem, Section, Supports, lattices
    >>> from bellcrank.part import PartSpec
    >>> problem = Problem(
    ...     name="cube", lattice=lattices["cubic"]([1, 1, 1], diagonals="none"),
    ...     supports=Supports(fixed=[0, 1, 2]), section=Section.round(0.2), designable=[0],
    ...     input=Input([7], [0, 0, -1], "displacement", 0.1), output=Output([4], [1, 0, 0]),
    ... )
    >>> struts_solid(PartSpec().of(problem.full_design())).euler_number
    -8
    """
    if not 0.0 < sagitta < math.inf:
        raise InvalidSettings(f"sagitta: expected a length above 0 mm, got {sagitta!r}")
    for attempt in range(ATTEMPTS):
        solid = _surface(part, sagitta, turned=float(attempt))
        if _is_distinct(solid):
            break
    return solid


def _surface(part: Part, sagitta: float, turned: float) -> Solid:
    """Return the union of struts and joints, whose first prism is turned by an angle."""
    import manifold3d

    radii = 0.5 * part.widths
    ball = 0.5 * part.widest
    shapes = [
        _strut(part.positions[ends], float(radius), sagitta, turned + GOLDEN_ANGLE * number)
        for number, (ends, radius) in enumerate(zip(part.struts, radii, strict=True))
    ]
    shapes += [
        _sphere(part.positions[node], float(ball[node]), sagitta) for node in np.flatnonzero(ball)
    ]
    whole = manifold3d.Manifold.batch_boolean(shapes, manifold3d.OpType.Add)
    # Rounding leaves closed surfaces without a volume where struts touch.
    least = SLIVER * float(radii.min()) ** 3
    pieces = [piece for piece in whole.decompose() if piece.volume() > least]
    mesh = manifold3d.Manifold.compose(pieces).to_mesh64()
    return Solid(np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts))


def _is_distinct(solid: Solid) -> bool:
    """Whether all vertices differ in single precision, from which STL files are read."""
    vertices = solid.on_bed().vertices.astype(np.float32)
    return len(np.unique(vertices, axis=0)) == len(vertices)


def sides_of(radius: float, sagitta: float) -> int:
    """Return the number of sides of a regular polygon with the area of a circle, a multiple of 4.

    Its corners are outside the circle by at most r phi^2 / 6, with phi half the angle of a side.

    Examples
    --------
    >>> sides_of(1.0, 0.01), sides_of(10.0, 0.01)
    (16, 44)
    """
    count = math.pi / math.sqrt(6.0 * min(sagitta / radius, 1.0))
    return max(LEAST_SIDES, 4 * math.ceil(count / 4.0))


def _strut(ends: NDArray[np.float64], radius: float, sagitta: float, turned: float) -> Any:
    """Return the prism of a strut between two ends (2, 3), turned about its axis by an angle."""
    import manifold3d

    sides = sides_of(radius, sagitta)
    angle = 2.0 * math.pi / sides
    around = radius * math.sqrt(angle / math.sin(angle))
    first, chord = ends[0], ends[1] - ends[0]
    length = float(np.linalg.norm(chord))
    axis = chord / length
    up = np.array([0.0, 0.0, 1.0] if abs(axis[2]) < 0.9 else [1.0, 0.0, 0.0])
    side = np.cross(up, axis)
    side /= np.linalg.norm(side)
    side = math.cos(turned) * side + math.sin(turned) * np.cross(axis, side)
    turn = np.column_stack([side, np.cross(axis, side), axis, first])
    return manifold3d.Manifold.cylinder(length, around, around, sides).transform(turn)


def _sphere(centre: NDArray[np.float64], radius: float, sagitta: float) -> Any:
    """Return the polyhedron of a joint."""
    import manifold3d

    # Its corners are outside by as much as those of struts with twice as many sides.
    ball = manifold3d.Manifold.sphere(radius, 2 * sides_of(radius, sagitta))
    ratio = math.cbrt(4.0 / 3.0 * math.pi * radius**3 / ball.volume())
    return ball.scale([ratio] * 3).translate(centre.tolist())
