"""Pliers: a force on the handles is converted into a force at the jaws.

Only the upper of two mirror-symmetric halves is modelled. It is supported by rollers along the
mirror line, right of the open mouth, and pinned at one node of that line, the pivot. The halves do
not cross as those of common pliers do, so a plain lever from handle to jaw would open them. Beams
on the mirror line belong to both halves and have their full stiffness here, as in the published
code.
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
    """Convert a force on the handle into a force of the jaw on the gripped object.

    A force of 0.01 pushes each of five nodes at the end of the handle towards the mirror line.
    Three nodes of the jaw act on stiff springs across it. The efficiency is the ratio of the
    total forces.

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
    # Rollers represent the other half, so that beams at them may be removed, unlike at supports.
    fixed_beams = lattice.beams_touching(np.concatenate([pivot, handle, jaw]))
    return Problem(
        name="pliers",
        lattice=lattice,
        supports=Supports(fixed=pivot, fixed_y=np.setdiff1d(row(lattice, 0), pivot)),
        input=Input(nodes=handle, direction=np.array([0.0, -1.0]), drive="force", amount=0.01),
        output=Output(
            nodes=jaw, direction=np.array([0.0, -1.0]), spring=10.0, spring_kind="directional"
        ),
        designable=np.flatnonzero(~fixed_beams),
        aggregate="sum",
    )
