"""What is asked of each coordinate of a superelement: a displacement, a force, or a spring."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings

if TYPE_CHECKING:
    from numpy.typing import NDArray

SMALLEST = 1e-10
"""Lowest stiffness, as a part of the largest, at which something counts as held."""


@dataclass(frozen=True, slots=True, eq=False)
class Conditions:
    """What is asked of k coordinates.

    Parameters
    ----------
    prescribed : (k,) bool
        Whether its displacement is given; else the force on it is.
    value : (k,)
        That displacement, or that force.
    spring : (k,)
        Stiffness of springs from rest that act on coordinates with a given force, too.

    Raises
    ------
    InvalidSettings
        If the shapes differ, a number is not finite, or a spring is negative or acts on a
        prescribed coordinate.

    Examples
    --------
    The first moved by 0.1, the second resisted by a spring:

    >>> moved = Conditions(np.array([True, False]), np.array([0.1, 0.0]), np.array([0.0, 2.0]))
    """

    prescribed: NDArray[np.bool_]
    value: NDArray[np.float64]
    spring: NDArray[np.float64]

    def __post_init__(self) -> None:
        prescribed = np.array(self.prescribed, dtype=np.bool_)
        value = np.array(self.value, dtype=np.float64)
        spring = np.array(self.spring, dtype=np.float64)
        if not prescribed.shape == value.shape == spring.shape == (len(value),):
            raise InvalidSettings(
                "conditions: expected three arrays of one shape (k,), got "
                f"{prescribed.shape}, {value.shape} and {spring.shape}"
            )
        if not (np.isfinite(value).all() and np.isfinite(spring).all()):
            raise InvalidSettings("conditions: expected finite numbers")
        if (spring < 0.0).any() or (spring[prescribed] != 0.0).any():
            raise InvalidSettings(
                "conditions: springs must not be negative, nor act where a displacement is given"
            )
        for name, array in (("prescribed", prescribed), ("value", value), ("spring", spring)):
            object.__setattr__(self, name, array)


@dataclass(frozen=True, slots=True, eq=False)
class Linear:
    """Solutions of the linear equations of m generalised coordinates z under conditions.

    With S the stiffness, q = L z the coordinates the conditions are about and k their springs:

        (S + L_f' k L_f) z - L_p' lambda = right + L_f' force,    L_p z = given,

    lambda the forces at the prescribed ones.

    Parameters
    ----------
    stiffness : (m, m)
    measures : (k, m)
        The matrix L.
    conditions
        Which are prescribed, and the springs.
    """

    stiffness: NDArray[np.float64]
    measures: NDArray[np.float64]
    conditions: Conditions

    def _loaded(self) -> NDArray[np.float64]:
        """(m, m) the stiffness with the springs."""
        rows = self.measures * np.sqrt(self.conditions.spring)[:, None]
        total: NDArray[np.float64] = self.stiffness + rows.T @ rows
        return total

    def lowest(self) -> tuple[float, float]:
        """Return lowest and largest stiffness against motions that the conditions leave free.

        Infinite and zero if there are none.
        """
        loaded = self._loaded()
        fixed = self.measures[self.conditions.prescribed]
        if len(fixed):
            _, sizes, directions = np.linalg.svd(fixed)
            free = directions[np.count_nonzero(sizes > SMALLEST * sizes[0]) :]
            loaded = free @ loaded @ free.T
        if not len(loaded):
            return np.inf, 0.0
        values = np.linalg.eigvalsh(loaded)
        return float(values[0]), float(values[-1])

    def is_stable(self) -> bool:
        """Whether every motion that the conditions leave free is resisted."""
        lowest, largest = self.lowest()
        return lowest > SMALLEST * largest

    def solve(
        self, right: NDArray[np.float64], given: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return z and the forces at the prescribed coordinates.

        Parameters
        ----------
        right : (m,) or (m, c)
            Forces by z.
        given : (p,) or (p, c)
            Displacements of the prescribed coordinates.

        Raises
        ------
        LinAlgError
            If the equations are singular.
        """
        fixed = self.measures[self.conditions.prescribed]
        count = len(fixed)
        whole = np.block([[self._loaded(), -fixed.T], [fixed, np.zeros((count, count))]])
        solved = np.linalg.solve(whole, np.concatenate([right, given]))
        return solved[: len(right)], solved[len(right) :]

    def transfer(self) -> NDArray[np.float64]:
        """Return (k, k) what every coordinate answers to a unit of what is asked of each.

        Column j is for a unit displacement of coordinate j where that is prescribed, and for a
        unit force on it where not; row i is the force at coordinate i where its displacement is
        prescribed, and its displacement where not. With all prescribed this is the stiffness,
        with none the compliance, and in between a hybrid matrix.

        Raises
        ------
        LinAlgError
            If the equations are singular.
        """
        prescribed = self.conditions.prescribed
        unit = np.eye(len(prescribed))
        z, force = self.solve(self.measures.T @ np.where(prescribed, 0.0, unit), unit[prescribed])
        answer: NDArray[np.float64] = self.measures @ z
        answer[prescribed] = force
        return answer
