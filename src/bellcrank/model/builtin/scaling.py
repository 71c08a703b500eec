"""Square-ish lattices of growing size, to measure how cost grows with it."""

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
    """Push down the upper right corner, watch the upper left one move left.

    The lattice has ``size + 2`` rows of `size` and ``size + 1`` nodes in turn
    and stands on the bottom one. Input and output are the nodes within a fifth
    of width and height of the corners; the push is 1 % of the height.

    Examples
    --------
    >>> problem = scaling(8)
    >>> problem.lattice.node_count, problem.lattice.beam_count, len(problem.designable)
    (85, 219, 172)
    """
    lattice = triangular_rectangle(columns=size, rows=size + 2)
    x, y = (lattice.positions / lattice.positions.max(axis=0)).T
    # Nodes exactly on the line stay outside, wherever rounding puts them.
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
