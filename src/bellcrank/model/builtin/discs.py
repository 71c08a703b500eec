"""Actuators on a disordered lattice: the contact network of jammed discs."""

from __future__ import annotations

import functools

import numpy as np

from bellcrank.model.builtin.registry import builtin
from bellcrank.model.conditions import Input, Output, Supports
from bellcrank.model.lattices.jammed import jammed_discs
from bellcrank.model.problem import Problem

DISCS = 100
SEEDS = range(1, 11)


def discs(seed: int = 1) -> Problem:
    """Return the problem on the disordered lattice of a seed.

    The upper right corner is pushed down and the upper left corner moves to the left. Nodes in
    the lowest tenth of the height are supports. Input and output are the nodes within a fifth of
    width and height of their corners. The input displacement is 1 % of the height.

    Examples
    --------
    >>> problem = discs()
    >>> 150 <= problem.lattice.beam_count <= 250
    True
    """
    lattice = jammed_discs(DISCS, rng=np.random.default_rng(seed))
    width, height = lattice.positions.max(axis=0)
    x, y = (lattice.positions / (width, height)).T
    return Problem(
        name=_name(seed),
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


def _name(seed: int) -> str:
    return "discs" if seed == SEEDS[0] else f"discs-{seed}"


for _seed in SEEDS:
    builtin.register(_name(_seed))(functools.partial(discs, _seed))
