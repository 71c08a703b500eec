"""What a search lowers: a registry of costs as functions of the efficiency."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.registry import Registry

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Cost:
    """A falling function of the efficiency.

    Parameters
    ----------
    code
        Number under which the compiled chain knows it (`search.kernels.metropolis`).
    of
        The same function, for chains that run in Python.
    rise
        Its change, from an efficiency and changes of it.
    """

    code: int
    of: Callable[[float], float]
    rise: Callable[[float, NDArray[np.float64]], NDArray[np.float64]]


LARGEST_EXPONENT = 700.0
"""What the exponential function can still take."""

costs: Registry[Cost] = Registry("cost")

costs.register("exponential")(
    Cost(
        0,
        lambda efficiency: math.exp(-efficiency),
        lambda efficiency, change: (
            math.exp(-efficiency) * np.expm1(np.minimum(-change, LARGEST_EXPONENT))
        ),
    )
)
"""exp(-efficiency): the paper's. Gains count less the better the design already is."""

costs.register("negative")(
    Cost(1, lambda efficiency: -efficiency, lambda _efficiency, change: -change)
)
"""-efficiency: the published code's."""
