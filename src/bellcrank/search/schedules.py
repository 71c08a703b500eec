"""How the temperature falls with the number of accepted steps: a registry.

A schedule is a table: the temperature after 0, 1, 2, ... accepted steps, whose last
entry holds for ever.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from bellcrank.registry import Registry

Schedule = Callable[[float, float, int], NDArray[np.float64]]

schedules: Registry[Schedule] = Registry("schedule")


@schedules.register("linear")
def linear(start: float, end: float, accepted: int) -> NDArray[np.float64]:
    """Fall linearly from `start` to `end` over `accepted` accepted steps (the paper).

    Examples
    --------
    >>> linear(0.06, 0.02, 2)
    array([0.06, 0.04, 0.02])
    """
    return np.linspace(start, end, accepted + 1)


@schedules.register("geometric")
def geometric(start: float, end: float, accepted: int) -> NDArray[np.float64]:
    """Fall by a constant factor at each of `accepted` accepted steps.

    Examples
    --------
    >>> geometric(0.04, 0.01, 2)
    array([0.04, 0.02, 0.01])
    """
    return np.geomspace(start, end, accepted + 1)


@schedules.register("constant")
def constant(start: float, end: float, accepted: int) -> NDArray[np.float64]:  # noqa: ARG001
    """Stay at `end`; nothing is annealed.

    Examples
    --------
    >>> constant(0.06, 0.01, 100)
    array([0.01])
    """
    return np.array([end])
