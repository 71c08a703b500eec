"""Nearly square lattices of increasing size, to measure how cost grows with size."""

from __future__ import annotations

import functools
import math

import numpy as np

from bellcrank.model.builtin.registry import builtin
from bellcrank.model.conditions import Input, Output, Supports
from bellcrank.model.lattices.triangular import triangular_rectangle
from bellcrank.model.problem import Problem

SIZES = range(8, 21)


def scaling(size: int) -> Problem:
    """Return the problem of a size.

    The upper right corner is pushed down and the upper left corner moves to the left. The lattice
    has ``size + 2`` rows of alternately `size` and ``size + 1`` nodes; the lowest is the support.
    Input and output are the nodes within a fifth of width and height of their corners. The input
    displacement is 1 % of the height.

    Examples
    --------
    >>> problem = scaling(8)
    >>> problem.lattice.node_count, problem.lattice.beam_count, len(problem.designable)
    (85, 219, 172)
    """
    lattice = triangular_rectangle(columns=size, rows=size + 2)
    x, y = (lattice.positions / lattice.positions.max(axis=0)).T
    # Nodes exactly on the limit are excluded despite rounding errors.
    near = 0.2 - 1e-9
    high = 1.0 - y < near
    return Problem(
        name=f"scaling-{size}",
        lattice=lattice,
        supports=Supports(fixed=np.arange(size)),
        input=Input(
            nodes=np.flatnonzero(high & (1.0 - x < near)),
            direction=np.array([0.0, -1.0]),
            drive="displacement",
            amount=0.01 * (size + 1) * math.sqrt(3.0) / 2.0,
        ),
        output=Output(
            nodes=np.flatnonzero(high & (x < near)),
            direction=np.array([-1.0, 0.0]),
        ),
    )


for _size in SIZES:
    builtin.register(f"scaling-{_size}")(functools.partial(scaling, _size))
