"""A lattice without order: the network of contacts of jammed discs."""

from __future__ import annotations

import numpy as np

from bellcrank.model.builtin.registry import builtin
from bellcrank.model.conditions import Input, Output, Supports
from bellcrank.model.lattices.jammed import jammed_discs
from bellcrank.model.problem import Problem

DISCS = 100
SEED = 1


@builtin.register("discs")
def discs() -> Problem:
    """Push down the upper right corner of a disordered lattice, move the upper left.

    The lowest tenth of the height is the support; input and output lie within a
    fifth of width and height of the corners; the push is 1 % of the height.

    Examples
    --------
    >>> problem = discs()
    >>> 150 <= problem.lattice.beam_count <= 250
    True
    """
    lattice = jammed_discs(DISCS, rng=np.random.default_rng(SEED))
    width, height = lattice.positions.max(axis=0)
    x, y = (lattice.positions / (width, height)).T
    return Problem(
        name="discs",
        lattice=lattice,
        supports=Supports(fixed=np.flatnonzero(y < 0.1)),
        input=Input(
            nodes=np.flatnonzero((x > 0.8) & (y > 0.8)),
            direction=np.array([0.0, -1.0]),
            drive="displacement",
            amount=0.01 * float(height),
        ),
        output=Output(
            nodes=np.flatnonzero((x < 0.2) & (y > 0.8)),
            direction=np.array([-1.0, 0.0]),
        ),
    )
