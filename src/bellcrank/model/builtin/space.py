"""Actuators in space, on octet lattices.

The upper right edge is pushed down. The upper left edge moves to the left in `orthogonal` and in
the lattices of increasing size, and up in `space-anti-parallel`. The lowest layer is the support.
Struts are round, a fifth of their length in diameter.
"""

from __future__ import annotations

import functools
import math

import numpy as np

from bellcrank.model.builtin.registry import builtin
from bellcrank.model.conditions import Input, Output, Supports
from bellcrank.model.lattices.crystals import octet
from bellcrank.model.problem import Problem
from bellcrank.model.section import Section

SIZES = range(6, 15, 2)
"""Numbers of layers; only with even ones is the lattice symmetric."""
IN_SPACE = ("orthogonal", "space-anti-parallel", *(f"space-{size}" for size in SIZES))
"""Names of the bundled problems in space."""
DEPTH = 4
"""Depth of the lattices, in layers."""
LAYER = math.sqrt(0.5)
"""Distance of layers of an octet lattice, beam lengths."""
SECTION = Section.round(0.2, joint=0.06)


@builtin.register("orthogonal")
def orthogonal() -> Problem:
    """Convert a downward input into an output motion to the left.

    The lattice has 7 x 5 x 7 layers of nodes.

    Examples
    --------
    >>> problem = orthogonal()
    >>> problem.lattice.node_count, problem.lattice.beam_count, len(problem.designable)
    (123, 516, 484)
    """
    return _actuator("orthogonal", 6, (-1.0, 0.0, 0.0))


@builtin.register("space-anti-parallel")
def space_anti_parallel() -> Problem:
    """Convert a downward input into an upward output motion, on the lattice of `orthogonal`.

    Examples
    --------
    >>> space_anti_parallel().output.direction[0]
    array([0., 0., 1.])
    """
    return _actuator("space-anti-parallel", 6, (0.0, 0.0, 1.0))


def space(size: int) -> Problem:
    """Return `orthogonal` with another number of layers, to measure how cost grows with size.

    Parameters
    ----------
    size
        Width and height in distances of layers, even.

    Examples
    --------
    >>> [space(size).lattice.beam_count for size in (6, 10, 14)]
    [516, 1380, 2660]
    """
    return _actuator(f"space-{size}", size, (-1.0, 0.0, 0.0))


for _size in SIZES:
    builtin.register(f"space-{_size}")(functools.partial(space, _size))


def _actuator(name: str, size: int, towards: tuple[float, float, float]) -> Problem:
    """Return a problem; beams within the support, the input and the output are not designable."""
    lattice = octet([size * LAYER, DEPTH * LAYER, size * LAYER])
    x, _, z = np.rint(lattice.positions / LAYER).astype(np.int64).T
    regions = [z == 0, (z == size) & (x >= size - 1), (z == size) & (x <= 1)]
    fixed = np.any([region[lattice.beams].all(axis=1) for region in regions], axis=0)
    support, pushed, moved = (np.flatnonzero(region) for region in regions)
    return Problem(
        name=name,
        lattice=lattice,
        section=SECTION,
        supports=Supports(fixed=support),
        input=Input(
            nodes=pushed,
            direction=np.array([0.0, 0.0, -1.0]),
            drive="displacement",
            amount=0.05 * size * LAYER,
        ),
        output=Output(nodes=moved, direction=np.array(towards)),
        designable=np.flatnonzero(~fixed),
    )
