"""Problems for elementary actuators, and struts.

An elementary actuator is pushed down on the right and moves its left port in one of eight
directions. A strut transmits a motion unchanged. All ports are hexagons of seven nodes, which are
invariant under rotation by 60 degrees and reflection, so that ports fit in every orientation.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.model import Input, Output, Problem, Supports, lattices
from bellcrank.part import PartSpec, frame_problem

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.model import Design, Lattice

HEIGHT = math.sqrt(3.0) / 2.0
STROKE = 0.02
"""Input displacement as a fraction of the height of the lattice."""
PORT_EXTENSION = 2
"""Number of nodes by which the rows of the ports are longer at each end."""
MIN_STRUT = 3
"""Length of the shortest strut whose ports share no node."""
DIRECTIONS = {
    "right": 0, "up-right": 45, "up": 90, "up-left": 135,
    "left": 180, "down-left": 225, "down": 270, "down-right": 315,
}  # fmt: skip
"""Angle of each direction in degrees, counter-clockwise from +x."""


def elementary(columns: int, direction: str) -> Problem:
    """Return the problem: the right port is pushed down, the left port is to move.

    The rows of the lattice have alternately `columns` and `columns` - 1 nodes; there are about as
    many rows as columns, and the lowest row is supported. The ports lie at the height of the
    second row from the top and extend beyond the lattice by two spacings, so that adjacent parts
    can share them.

    Parameters
    ----------
    columns
        Number of nodes of the lowest row, at least 5.
    direction
        Output direction, a key of `DIRECTIONS`.

    Raises
    ------
    InvalidSettings

    Examples
    --------
    >>> problem = elementary(9, "down")
    >>> problem.lattice.beam_count, len(problem.designable), len(problem.input.nodes)
    (249, 189, 7)
    """
    if direction not in DIRECTIONS:
        raise InvalidSettings(
            f"direction: expected one of {', '.join(DIRECTIONS)}, got {direction!r}"
        )
    if columns < 5:
        raise InvalidSettings(f"columns: expected at least 5, got {columns!r}")
    rows = columns + columns % 2  # an even number: the ports are in a long row
    lattice = _lattice(columns, rows)
    angle = math.radians(DIRECTIONS[direction])
    height = HEIGHT * (rows - 2)
    return Problem(
        name=f"elementary-{columns}-{direction}",
        lattice=lattice,
        supports=Supports(fixed=np.arange(columns)),
        input=Input(
            nodes=_hexagon(lattice, (columns, height)), direction=np.array([0.0, -1.0]),
            drive="displacement", amount=STROKE * HEIGHT * rows,
        ),
        output=Output(
            nodes=_hexagon(lattice, (-1.0, height)),
            direction=np.array([math.cos(angle), math.sin(angle)]).round(15),
        ),
    )  # fmt: skip


def strut(length: int) -> Problem:
    """Return a bar of three rows of nodes, with a port at each end and without supports.

    Parameters
    ----------
    length
        Distance of the centres of its ports, at least 3.

    Raises
    ------
    InvalidSettings

    Examples
    --------
    >>> bar = strut(6)
    >>> bar.lattice.beam_count, bar.lattice.positions[bar.input.nodes].mean(axis=0).round(3)
    (54, array([6.   , 0.866]))
    """
    if length < MIN_STRUT:
        raise InvalidSettings(f"length: expected at least {MIN_STRUT}, got {length!r}")
    lattice = lattices["triangular-rows"]([length + 2, length + 3, length + 2], [-0.5, -1.0, -0.5])
    down = np.array([0.0, -1.0])
    return Problem(
        name=f"strut-{length}",
        lattice=lattice,
        supports=Supports(),
        input=Input(
            nodes=_hexagon(lattice, (length, HEIGHT)), direction=down, drive="displacement",
            amount=STROKE * HEIGHT * length,
        ),
        output=Output(nodes=_hexagon(lattice, (0.0, HEIGHT)), direction=down),
        designable=np.arange(lattice.beam_count),
    )  # fmt: skip


def strut_named(name: str) -> Design | None:
    """Return the strut with a name like ``strut-6`` as a frame; None for other names.

    Its beams are struts of the default part, 2 mm wide on 10 mm.

    Raises
    ------
    InvalidSettings
        If the strut is too short.

    Examples
    --------
    >>> bar = strut_named("strut-6")
    >>> bar.problem.name, strut_named("lever-6")
    ('strut-6', None)
    """
    kind, _, length = name.partition("-")
    if kind != "strut" or not length.isdecimal():
        return None
    return frame_problem(strut(int(length)), PartSpec()).full_design()


def _lattice(columns: int, rows: int) -> Lattice:
    """Return a rectangular lattice whose three upper rows extend to hold the ports."""
    counts = [columns - row % 2 for row in range(rows)]
    first = [0.5 * (row % 2) for row in range(rows)]
    for row in range(rows - 3, rows):
        counts[row] += 2 * PORT_EXTENSION
        first[row] -= PORT_EXTENSION
    return lattices["triangular-rows"](counts, first)


def _hexagon(lattice: Lattice, centre: tuple[float, float]) -> NDArray[np.int64]:
    """Return the node at a point and its six neighbours."""
    distance = np.linalg.norm(lattice.positions - np.array(centre), axis=1)
    return np.flatnonzero(distance < 1.1)
