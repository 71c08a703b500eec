"""Objectives and constraints of a refinement.

A constraint is a number that is at most 0 where it is met, normalised like the violations of a
search. Bounds that hold along the stroke are one constraint at each state.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    Values = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Rows:
    """Objectives and constraints of one geometry.

    Parameters
    ----------
    objectives : (k,)
        To be maximised; the smallest counts.
    constraints : (r,)
        At most 0 where they are met.
    names : (r,)
        What each constraint belongs to.
    keys : (r,)
        What distinguishes constraints of one name, of which there may be others in other
        geometries.
    objective_slopes, constraint_slopes : (k, n) and (r, n)
        Derivatives by the variables; (0, n) if they were not asked for.
    """

    objectives: Values
    constraints: Values
    names: tuple[str, ...]
    keys: tuple[tuple[int, ...], ...]
    objective_slopes: Values
    constraint_slopes: Values

    @property
    def objective(self) -> float:
        """The smallest objective; 0 if there is none."""
        return float(self.objectives.min()) if len(self.objectives) else 0.0

    @property
    def violation(self) -> float:
        """Sum of the violations."""
        return float(np.maximum(self.constraints, 0.0).sum())


def joined(parts: Sequence[Rows]) -> Rows:
    """Return several rows as one."""
    return Rows(
        np.concatenate([part.objectives for part in parts]),
        np.concatenate([part.constraints for part in parts]),
        tuple(name for part in parts for name in part.names),
        tuple((k, *key) for k, part in enumerate(parts) for key in part.keys),
        np.concatenate([part.objective_slopes for part in parts]),
        np.concatenate([part.constraint_slopes for part in parts]),
    )
