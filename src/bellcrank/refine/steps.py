"""Steps of a refinement: linear programs within a trust region.

The step maximises the smallest objective less a multiple of the violations of all constraints, each
linear in the variables, with every variable within a box. The program is solved by HiGHS through
`scipy.optimize.linprog`.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.refine.rows import Rows

    Values = NDArray[np.float64]

MANY = 2000
"""Number of constraints, as over scenarios, from which those that no step reaches are left out."""
PENALTY = 20.0
"""Weight of a violation against the objective over its size."""


class Step(NamedTuple):
    """A step and the merit that its linear model has after it."""

    change: Values
    """(n,)"""
    merit: float


def merit_of(rows: Rows, size: float) -> float:
    """Return the objective over a size, less the penalty of the violations."""
    return rows.objective / size - PENALTY * rows.violation


def corrected(rows: Rows, after: Rows, change: Values) -> Rows:
    """Return rows with the slopes of one geometry that are exact at another, a step away.

    A step with these corrects for the curvature of the constraints along the first one.

    Parameters
    ----------
    rows, after
        Rows before and after a step.
    change : (n,)
        The step.
    """
    found = {pair: k for k, pair in enumerate(zip(after.names, after.keys, strict=True))}
    constraints = rows.constraints.copy()
    linear = rows.constraint_slopes @ change
    for k, pair in enumerate(zip(rows.names, rows.keys, strict=True)):
        if pair in found:
            constraints[k] = after.constraints[found[pair]] - linear[k]
    objectives = after.objectives - rows.objective_slopes @ change
    return replace(rows, objectives=objectives, constraints=constraints)


def _that_matter(rows: Rows, low: Values, high: Values) -> Rows:
    """Return the rows without those that no step within its bounds makes matter.

    Those are constraints that are met after all steps, and objectives that are never the smallest.
    """
    _, most = _range(rows.constraint_slopes, low, high)
    reached = rows.constraints + most > 0.0
    least, most = _range(rows.objective_slopes, low, high)
    smallest = (rows.objectives + most).min(initial=np.inf)
    used = rows.objectives + least <= smallest
    return replace(
        rows,
        objectives=rows.objectives[used],
        constraints=rows.constraints[reached],
        objective_slopes=rows.objective_slopes[used],
        constraint_slopes=rows.constraint_slopes[reached],
    )


def _range(slopes: Values, low: Values, high: Values) -> tuple[Values, Values]:
    """Return the smallest and largest change (r,) of rows within the bounds of a step."""
    rising, falling = np.maximum(slopes, 0.0), np.minimum(slopes, 0.0)
    return rising @ low + falling @ high, rising @ high + falling @ low


def linear_step(rows: Rows, low: Values, high: Values, size: float) -> Step | None:
    """Return the step that is best for the linear model; None if HiGHS finds none.

    Parameters
    ----------
    rows
        Objectives and constraints with their derivatives.
    low, high : (n,)
        Bounds of the step.
    size
        Size of the objective, by which it is divided.
    """
    from scipy.optimize import linprog

    if len(rows.constraints) > MANY:
        rows = _that_matter(rows, low, high)
    count, objectives, constraints = len(low), len(rows.objectives), len(rows.constraints)
    cost = np.concatenate(
        [np.zeros(count), [-1.0 if objectives else 0.0], np.full(constraints, PENALTY)]
    )
    matrix = np.zeros((objectives + constraints, len(cost)))
    matrix[:objectives, :count] = -rows.objective_slopes / size
    matrix[:objectives, count] = 1.0
    matrix[objectives:, :count] = rows.constraint_slopes
    matrix[objectives:, count + 1 :] = -np.eye(constraints)
    bound = np.concatenate([rows.objectives / size, -rows.constraints])
    bounds = np.full((len(cost), 2), [0.0, np.inf])
    bounds[:count, 0], bounds[:count, 1] = low, high
    bounds[count] = (-np.inf, np.inf) if objectives else (0.0, 0.0)
    low_high = list(zip(*bounds.T.tolist(), strict=True))
    found = linprog(cost, A_ub=matrix, b_ub=bound, bounds=low_high, method="highs")
    if found.x is None or found.fun is None:
        return None
    return Step(np.asarray(found.x[:count]), -float(found.fun))
