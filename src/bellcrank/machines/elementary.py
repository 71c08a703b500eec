"""Tasks for elementary actuators: a push down on one side, a motion wanted on the other.

A strut is what passes a motion on as it is: a finger, a spacer. The ports of all are hexagons of
seven nodes, which any turn by 60 degrees and any mirror takes to themselves: whatever way parts are
placed, their ports fit.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.model import Input, Output, Problem, Supports, lattices

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.model import Design, Lattice

HEIGHT = math.sqrt(3.0) / 2.0
PUSH = 0.02
"""Of the height of the lattice: how far the input is pushed."""
REACH = 2
"""Nodes by which the rows of the ports are longer at each end."""
SHORTEST = 3
"""Strut whose ports do not share nodes."""
DIRECTIONS = {
    "right": 0, "up-right": 45, "up": 90, "up-left": 135,
    "left": 180, "down-left": 225, "down": 270, "down-right": 315,
}  # fmt: skip
"""Degrees, counter-clockwise from +x."""


def elementary(columns: int, direction: str, spring: float | None = None) -> Problem:
    """Return the task: push the right port down, move the left one.

    The lattice has `columns` and one less nodes in turn in its rows, about as many rows as
    columns, and stands on the lowest. The ports, at the height of the second row from the top,
    reach out of it by two spacings, so that parts side by side can share them.

    Parameters
    ----------
    columns
        Nodes of the lowest row, at least 5.
    direction
        Of the output: a key of `DIRECTIONS`.
    spring
        k_ext of a spring at each output node, against which it has to work.

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
        name=f"elementary-{columns}-{direction}" + ("" if spring is None else "-loaded"),
        lattice=lattice,
        supports=Supports(fixed=np.arange(columns)),
        input=Input(
            nodes=_hexagon(lattice, (columns, height)), direction=np.array([0.0, -1.0]),
            drive="displacement", amount=PUSH * HEIGHT * rows,
        ),
        output=Output(
            nodes=_hexagon(lattice, (-1.0, height)),
            direction=np.array([math.cos(angle), math.sin(angle)]).round(15), spring=spring,
        ),
    )  # fmt: skip


def strut(length: int) -> Problem:
    """Return a bar of three rows, whose ports are its ends.

    It has no supports: in a machine it hangs on what it is joined to.

    Parameters
    ----------
    length
        From the middle of one port to that of the other, at least 3.

    Raises
    ------
    InvalidSettings

    Examples
    --------
    >>> bar = strut(6)
    >>> bar.lattice.beam_count, bar.lattice.positions[bar.input.nodes].mean(axis=0).round(3)
    (54, array([6.   , 0.866]))
    """
    if length < SHORTEST:
        raise InvalidSettings(f"length: expected at least {SHORTEST}, got {length!r}")
    lattice = lattices["triangular-rows"]([length + 2, length + 3, length + 2], [-0.5, -1.0, -0.5])
    down = np.array([0.0, -1.0])
    return Problem(
        name=f"strut-{length}",
        lattice=lattice,
        supports=Supports(),
        input=Input(
            nodes=_hexagon(lattice, (length, HEIGHT)), direction=down, drive="displacement",
            amount=PUSH * HEIGHT * length,
        ),
        output=Output(nodes=_hexagon(lattice, (0.0, HEIGHT)), direction=down),
        designable=np.arange(lattice.beam_count),
    )  # fmt: skip


def strut_named(name: str) -> Design | None:
    """Return the strut that a name like ``strut-6`` stands for; None for other names.

    Raises
    ------
    InvalidSettings
        If it is too short.

    Examples
    --------
    >>> bar = strut_named("strut-6")
    >>> bar.problem.name, strut_named("lever-6")
    ('strut-6', None)
    """
    kind, _, length = name.partition("-")
    if kind != "strut" or not length.isdecimal():
        return None
    return strut(int(length)).full_design()


def _lattice(columns: int, rows: int) -> Lattice:
    """Rows of a rectangle; the three highest reach out to hold the ports."""
    counts = [columns - row % 2 for row in range(rows)]
    first = [0.5 * (row % 2) for row in range(rows)]
    for row in range(rows - 3, rows):
        counts[row] += 2 * REACH
        first[row] -= REACH
    return lattices["triangular-rows"](counts, first)


def _hexagon(lattice: Lattice, centre: tuple[float, float]) -> NDArray[np.int64]:
    """Return the node at a point and the six around it."""
    distance = np.linalg.norm(lattice.positions - np.array(centre), axis=1)
    return np.flatnonzero(distance < 1.1)
