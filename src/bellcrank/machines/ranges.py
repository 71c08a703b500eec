"""Where a part works in a machine, and whether a table of it reaches there.

A table that was made for a part on its own spans its usual work: its own stroke, hardly sideways,
from a free to a blocked output. In a machine a part may be pushed further than that, backwards, or
across. Then a table is made around the way that the part goes there, as foreseen.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.machines.elements import IN, OUT
from bellcrank.machines.sampling import OVERSHOOT, Reach

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.machines.members import Body

FURTHER = 0.15
"""Beyond the end of the foreseen way, as a part of it."""
ASIDE = 0.3
"""Off the foreseen way, as a part of it; forces in units in which all cost the same energy."""
LIGHT = 0.15
"""Least force off the way, as a part of what would block the output."""
DIGITS = 3
"""Of a range: the same table serves for what differs by rounding errors only."""
TOLERATED = 1.05
"""A little outside is inside."""
ROUNDED = 1e-6
"""Of the range of a variable: what rounding errors may put it outside."""
NOTHING = 1e-9
"""Of the largest: sizes of what a range does not span at all."""


@dataclass(frozen=True, slots=True, eq=False)
class Range:
    """What a table spans: x = axis y_0 + spread y, with y_0 to 1.1 and y between -1 and 1.

    Parameters
    ----------
    reach
        The same, as it is sampled.
    """

    reach: Reach

    def excess(self, x: NDArray[np.float64]) -> float:
        """Return how far out variables (6,) are: 1 at the rim, infinite where nothing reaches.

        Examples
        --------
        >>> prescribed = np.array([True, False])
        >>> span = Range(Reach(prescribed, np.array([2.0, 0.0]), np.array([[0.0], [0.5]])))
        >>> span.excess(np.array([1.1, 0.25])), span.excess(np.array([0.0, 1.0]))
        (0.5, 2.0)
        """
        basis = np.column_stack([self.reach.axis, self.reach.spread])
        unit = np.abs(basis).max(axis=1)
        unit[unit == 0.0] = 1.0
        y, *_ = np.linalg.lstsq(basis / unit[:, None], x / unit, rcond=NOTHING)
        if (np.abs(basis @ y - x) > ROUNDED * unit).any():
            return np.inf
        along = max(y[0] / (1.0 + OVERSHOOT), -y[0] / OVERSHOOT)
        return float(max(along, np.abs(y[1:]).max(initial=0.0)))


def around(body: Body, bend: NDArray[np.float64], way: NDArray[np.float64]) -> Reach:
    """Return a range around the way that a part is foreseen to go in a machine.

    Parameters
    ----------
    body
    bend : (6, 6)
        Second derivative of its potential at rest.
    way : (6,)
        Motion of its input and force on its output at the full stroke; not both zero.
    """
    nodes = body.design.problem.lattice.positions[body.ports[0]]
    radius = float(np.sqrt(((nodes - nodes.mean(axis=0)) ** 2).sum(axis=1).mean()))
    give, vectors = np.linalg.eigh(-bend[OUT, OUT])
    root = vectors / np.sqrt(give)
    # root @ g is a force that costs the energy |g|^2 / 2 on an output that gives way.
    load = float(np.linalg.norm(root.T @ bend[OUT, OUT] @ way[OUT]))
    block = float(np.linalg.norm(root.T @ bend[OUT, IN] @ way[IN]))
    travel = float(np.hypot(np.hypot(way[0], way[1]), radius * way[2]))
    if travel == 0.0:
        # Its output alone is moved: the input goes where it likes, by about as much.
        travel = load * float(np.sqrt(give.max()))
    off = np.zeros((6, 6))
    off[IN, IN] = ASIDE * travel * np.diag([1.0, 1.0, 1.0 / radius])
    off[OUT, OUT] = max(ASIDE * load, LIGHT * block, NOTHING * travel) * root
    along = np.linalg.solve(off, way)
    across = np.linalg.svd(along[None])[2][1:].T
    return Reach(
        prescribed=np.arange(6) < 3,
        axis=_rounded((1.0 + FURTHER) * way),
        spread=_rounded(off @ across),
    )


def _rounded(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Round to some digits of the largest of each variable's numbers."""
    rows = values.reshape(len(values), -1)
    size = np.abs(rows).max(axis=1, keepdims=True)
    unit = 10.0 ** (np.floor(np.log10(np.where(size > 0.0, size, 1.0))) + 1.0 - DIGITS)
    rounded: NDArray[np.float64] = (np.round(rows / unit) * unit).reshape(values.shape)
    return rounded
