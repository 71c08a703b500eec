"""Conditions on the coordinates of a superelement: displacements, forces, springs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings

if TYPE_CHECKING:
    from numpy.typing import NDArray

MIN_STIFFNESS = 1e-10
"""Stiffness, as a part of the largest, below which a motion counts as free."""


@dataclass(frozen=True, slots=True, eq=False)
class Conditions:
    """Conditions on k coordinates.

    Parameters
    ----------
    prescribed : (k,) bool
        Whether the displacement of the coordinate is given, instead of the force on it.
    value : (k,)
        That displacement or force.
    spring : (k,)
        Stiffness of springs from rest that act on coordinates with a given force in addition.

    Raises
    ------
    InvalidSettings
        If the shapes differ, a number is not finite, or a spring is negative or acts on a
        prescribed coordinate.

    Examples
    --------
    The first coordinate is moved by 0.1, a spring acts on the second:

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
class LinearEquations:
    """Solutions of the linear equations of m generalised coordinates z under conditions.

    With S the stiffness, q = L z the coordinates of the conditions and k their springs:

        (S + L_f' k L_f) z - L_p' lambda = right + L_f' force,    L_p z = given,

    lambda the forces at the prescribed coordinates.

    Parameters
    ----------
    stiffness : (m, m)
    measures : (k, m)
        The matrix L.
    conditions
        Conditions on q.
    """

    stiffness: NDArray[np.float64]
    measures: NDArray[np.float64]
    conditions: Conditions

    def _loaded(self) -> NDArray[np.float64]:
        """Return (m, m) the stiffness with the springs."""
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
            free = directions[np.count_nonzero(sizes > MIN_STIFFNESS * sizes[0]) :]
            loaded = free @ loaded @ free.T
        if not len(loaded):
            return np.inf, 0.0
        values = np.linalg.eigvalsh(loaded)
        return float(values[0]), float(values[-1])

    def is_stable(self) -> bool:
        """Whether every motion that the conditions leave free is resisted."""
        lowest, largest = self.lowest()
        return lowest > MIN_STIFFNESS * largest

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
        """Return (k, k) the response of every coordinate to a unit of each condition.

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
        response: NDArray[np.float64] = self.measures @ z
        response[prescribed] = force
        return response
