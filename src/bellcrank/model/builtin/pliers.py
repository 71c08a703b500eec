"""Pliers: squeeze the handles, and the jaws should press.

Both halves are mirror images, so that only the upper one is modelled. It rests
on rollers along the mirror line, right of the open mouth, and is pinned at one
node of that line, the pivot. The halves do not cross, as those of ordinary
pliers do, so that a plain lever from handle to jaw would open them. A beam that
lies on the mirror line belongs to both halves and still counts in full here, as
in the published code.
"""

from __future__ import annotations

import numpy as np

from bellcrank.model.builtin.registry import builtin
from bellcrank.model.conditions import Input, Output, Supports
from bellcrank.model.lattices.triangular import triangular_rows
from bellcrank.model.problem import Problem
from bellcrank.model.regions import leftmost, nearest, rightmost, row

# The two lowest rows end where the mouth begins.
ROW_COUNTS = (14, 14, 21, 20, 21, 20, 20, 19, 19)
ROW_FIRST_X = (7.0, 6.5, 0.0, 0.5, 0.0, 0.5, 1.0, 1.5, 2.0)
PIVOT = (12.0, 0.0)


@builtin.register("pliers")
def pliers() -> Problem:
    """Turn a squeeze of the handle into a force of the jaw on what it grips.

    Five nodes at the end of the handle are pushed towards the mirror line, with
    0.01 each; three nodes of the jaw press against stiff springs across it.
    Efficiency compares total forces.

    Examples
    --------
    >>> problem = pliers()
    >>> problem.input.drive, problem.aggregate
    ('force', 'sum')
    >>> 300 <= len(problem.designable) <= 500
    True
    """
    lattice = triangular_rows(ROW_COUNTS, ROW_FIRST_X)
    pivot = nearest(lattice, PIVOT)
    handle = rightmost(lattice, -1, 5)
    jaw = leftmost(lattice, 2, 3)
    # Rollers only stand for the other half, so beams may be cut off from them,
    # unlike from a support.
    kept = lattice.beams_touching(np.concatenate([pivot, handle, jaw]))
    return Problem(
        name="pliers",
        lattice=lattice,
        supports=Supports(fixed=pivot, fixed_y=np.setdiff1d(row(lattice, 0), pivot)),
        input=Input(nodes=handle, direction=np.array([0.0, -1.0]), drive="force", amount=0.01),
        output=Output(
            nodes=jaw, direction=np.array([0.0, -1.0]), spring=10.0, spring_kind="directional"
        ),
        designable=np.flatnonzero(~kept),
        aggregate="sum",
    )
