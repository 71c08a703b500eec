"""The first two actuators of the paper.

The input on the right is pushed down. The output on the left moves to the left in `crane` and up
in `anti-parallel`. Both use the same lattice, supported at its three lowest rows.
"""

from __future__ import annotations

import math

import numpy as np

from bellcrank.model.builtin.registry import builtin
from bellcrank.model.conditions import Input, Output, Supports
from bellcrank.model.lattices.triangular import triangular_rows
from bellcrank.model.problem import Problem
from bellcrank.model.regions import leftmost, rightmost

ROW_COUNTS = (11, 12, 11, 11, 10, 11, 10, 11, 10, 12, 12, 12)
ROW_FIRST_X = (0.5, 0.0, 0.5, 0.0, 0.5, 0.0, 0.5, 0.0, 0.5, -1.0, -0.5, -1.0)


@builtin.register("crane")
def crane() -> Problem:
    """Convert a downward input into an output motion to the left.

    The lattice has 133 nodes and 352 beams, of which 203 are designable.

    Examples
    --------
    >>> problem = crane()
    >>> problem.lattice.node_count, problem.lattice.beam_count, len(problem.designable)
    (133, 352, 203)
    """
    return _actuator("crane", towards=(-1.0, 0.0))


@builtin.register("anti-parallel")
def anti_parallel() -> Problem:
    """Convert a downward input into an upward output motion, on the lattice of `crane`.

    Examples
    --------
    >>> anti_parallel().output.direction[0]
    array([0., 1.])
    """
    return _actuator("anti-parallel", towards=(0.0, 1.0))


def _actuator(name: str, towards: tuple[float, float]) -> Problem:
    lattice = triangular_rows(ROW_COUNTS, ROW_FIRST_X)
    input_rows = ((-1, 3), (-2, 4), (-3, 3))
    output_rows = ((-1, 3), (-2, 3), (-3, 3))
    return Problem(
        name=name,
        lattice=lattice,
        supports=Supports(fixed=np.arange(sum(ROW_COUNTS[:3]))),
        input=Input(
            nodes=np.sort(np.concatenate([rightmost(lattice, row, n) for row, n in input_rows])),
            direction=np.array([0.0, -1.0]),
            drive="displacement",
            amount=math.sqrt(3.0) / 4.0,
        ),
        output=Output(
            nodes=np.sort(np.concatenate([leftmost(lattice, row, n) for row, n in output_rows])),
            direction=np.array(towards),
        ),
    )
