"""Costs that Markov chains minimise, and temperature schedules: two registries."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bellcrank.registry import Registry
from bellcrank.search.kernels.acceptance import exponential_cost, negative_cost

Schedule = Callable[[float, float, int], NDArray[np.float64]]
"""From initial temperature, final temperature and number of accepted steps to a table."""

LARGEST_EXPONENT = 700.0
"""Bound on the argument of the exponential function, which overflows beyond it."""


@dataclass(frozen=True, slots=True)
class Cost:
    """A decreasing function of the efficiency.

    Parameters
    ----------
    code
        Number of the function in the compiled chain (`search.kernels.metropolis`).
    of
        The function itself.
    change
        Its change, from an efficiency and (n,) changes of the efficiency.
    inverse
        The efficiency of a cost; minus infinity where every efficiency has a lower cost.
    """

    code: int
    of: Callable[[float], float]
    change: Callable[[float, NDArray[np.float64]], NDArray[np.float64]]
    inverse: Callable[[float], float]


def _exponential_change(efficiency: float, change: NDArray[np.float64]) -> NDArray[np.float64]:
    growth: NDArray[np.float64] = np.expm1(np.minimum(-change, LARGEST_EXPONENT))
    return math.exp(-efficiency) * growth


def _exponential_inverse(cost: float) -> float:
    return -math.log(cost) if 0.0 < cost < math.inf else -math.inf


costs: Registry[Cost] = Registry("cost")
costs.register("exponential")(Cost(0, exponential_cost, _exponential_change, _exponential_inverse))
"""exp(-efficiency), the cost of the paper."""
costs.register("negative")(
    Cost(1, negative_cost, lambda _efficiency, change: -change, operator.neg)
)
"""-efficiency, the cost of the code published with the paper."""

schedules: Registry[Schedule] = Registry("schedule")
"""Tables of the temperature after 0, 1, 2, ... accepted steps; the last entry holds afterwards."""


@schedules.register("linear")
def linear(start: float, end: float, accepted: int) -> NDArray[np.float64]:
    """Decrease linearly from `start` to `end` over `accepted` accepted steps (the paper).

    Examples
    --------
    >>> linear(0.06, 0.02, 2)
    array([0.06, 0.04, 0.02])
    """
    return np.linspace(start, end, accepted + 1)


@schedules.register("constant")
def constant(start: float, end: float, accepted: int) -> NDArray[np.float64]:  # noqa: ARG001
    """Keep the temperature at `end`.

    Examples
    --------
    >>> constant(0.06, 0.01, 100)
    array([0.01])
    """
    return np.array([end])
