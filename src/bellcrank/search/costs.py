"""What a search lowers: a registry of costs as functions of the efficiency."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from bellcrank.registry import Registry

if TYPE_CHECKING:
    from collections.abc import Callable


@dataclass(frozen=True, slots=True)
class Cost:
    """A falling function of the efficiency.

    Parameters
    ----------
    code
        Number under which the compiled chain knows it (`search.kernels.metropolis`).
    of
        The same function, for chains that run in Python.
    """

    code: int
    of: Callable[[float], float]


costs: Registry[Cost] = Registry("cost")

costs.register("exponential")(Cost(0, lambda efficiency: math.exp(-efficiency)))
"""exp(-efficiency): the paper's. Gains count less the better the design already is."""

costs.register("negative")(Cost(1, lambda efficiency: -efficiency))
"""-efficiency: the published code's."""
