"""The nonlinear answers of an actuator as one polynomial: a potential of its ports.

Let x be the displacements of some coordinates and the forces on the others. With W the stored
energy and sums over the others, the potential

    Phi(x) = W - sum F q

has the remaining quantities as its derivatives: the force at a coordinate whose displacement is
in x, and minus the displacement of one whose force is. Fitting Phi instead of its derivatives one
by one keeps what they owe each other (reciprocity), so that chains of such actuators neither make
nor lose energy. With the input moved and the output loaded, a free output, which may go far along
a curve, is simply F = 0, whereas W(q_in, q_out) would be a narrow, curved valley there.

The quadratic part is exact: it comes from the tangent at rest. Cubic and higher terms are fitted by
least squares to Phi and to its derivatives on sampled equilibria.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations_with_replacement
from math import comb
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.mechanics import Conditions

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bellcrank.mechanics import State, Superelement


@dataclass(frozen=True, slots=True, eq=False)
class Potential:
    """A polynomial in k variables, each a displacement or a force.

    Parameters
    ----------
    prescribed : (k,) bool
        Whether each variable is the displacement of its coordinate; else the force on it.
    quadratic : (k, k)
        Second derivative at rest; symmetric.
    scale : (k,)
        Unit of each variable in the higher terms.
    exponents : (t, k) int64
        Of the higher terms.
    coefficients : (t,)
        In units of energy.

    Examples
    --------
    A spring that hardens, Phi = u^2 + u^4, moved:

    >>> hardening = Potential(
    ...     prescribed=np.array([True]), quadratic=np.array([[2.0]]), scale=np.ones(1),
    ...     exponents=np.array([[4]]), coefficients=np.ones(1),
    ... )
    >>> hardening.answer(np.array([0.5])), hardening.energy(np.array([0.5]))
    (array([1.5]), 0.3125)
    """

    prescribed: NDArray[np.bool_]
    quadratic: NDArray[np.float64]
    scale: NDArray[np.float64]
    exponents: NDArray[np.int64]
    coefficients: NDArray[np.float64]

    def _value(self, x: NDArray[np.float64]) -> float:
        higher = monomials(x[None] / self.scale, self.exponents)[0]
        return float(0.5 * x @ self.quadratic @ x + higher @ self.coefficients)

    def _slope(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        higher = slopes(x[None] / self.scale, self.exponents)[0] / self.scale[:, None]
        slope: NDArray[np.float64] = self.quadratic @ x + higher @ self.coefficients
        return slope

    def answer(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (k,) the force at each prescribed coordinate, the displacement of each other."""
        slope = self._slope(x)
        return np.where(self.prescribed, slope, -slope)

    def energy(self, x: NDArray[np.float64]) -> float:
        """Return the stored energy W."""
        loaded = ~self.prescribed
        return self._value(x) + float(x[loaded] @ self.answer(x)[loaded])

    def transfer(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (k, k) the derivative of `answer`, as `mechanics.Linear.transfer` has it."""
        scaled = x[None] / self.scale
        bend = np.array(self.quadratic)
        for i in range(len(x)):
            lower, factor = lowered(self.exponents, i)
            higher = slopes(scaled, lower)[0] @ (factor * self.coefficients)
            bend[i] += higher / (self.scale[i] * self.scale)
        return np.where(self.prescribed[:, None], bend, -bend)

    def expand(
        self, x: NDArray[np.float64]
    ) -> tuple[float, NDArray[np.float64], NDArray[np.float64]]:
        """Return the potential, its slope (k,) and its second derivative (k, k) at once."""
        value, slope, bend = self._higher(x / self.scale)
        own = self.quadratic @ x
        return (
            float(0.5 * x @ own) + value,
            own + slope / self.scale,
            self.quadratic + bend / np.outer(self.scale, self.scale),
        )

    def _higher(
        self, x: NDArray[np.float64]
    ) -> tuple[float, NDArray[np.float64], NDArray[np.float64]]:
        """Sum the higher terms and their derivatives, all in one product of factors."""
        count = len(x)
        powers = np.arange(int(self.exponents.max(initial=0)) + 1)
        table = np.zeros((3, count, len(powers)))
        table[0] = x[:, None] ** powers
        table[1, :, 1:] = table[0, :, :-1] * powers[1:]
        table[2, :, 1:] = table[1, :, :-1] * powers[1:]
        place = np.arange(count)
        # (3, k, t): each factor of each term, and its first and second derivative.
        factors = table[:, place, self.exponents].transpose(0, 2, 1)
        order = np.eye(count, dtype=np.int64)
        first, second = np.triu_indices(count)
        each = factors[order[:, None] + order[None, :], place][first, second]
        bend = np.zeros((count, count))
        bend[first, second] = each.prod(axis=1) @ self.coefficients
        bend[second, first] = bend[first, second]
        return (
            float(factors[0].prod(axis=0) @ self.coefficients),
            factors[order, place].prod(axis=1) @ self.coefficients,
            bend,
        )


def lowered(
    exponents: NDArray[np.int64], variable: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return exponents and factors of the derivatives of monomials by a variable."""
    lower = exponents.copy()
    factor = lower[:, variable].copy()
    lower[:, variable] = np.maximum(factor - 1, 0)
    return lower, factor


def monomials(x: NDArray[np.float64], exponents: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return (n, t) each monomial at each of n places.

    Examples
    --------
    >>> monomials(np.array([[2.0, 3.0]]), np.array([[1, 1], [0, 3]]))
    array([[ 6., 27.]])
    """
    powers = x[:, :, None] ** np.arange(int(exponents.max(initial=0)) + 1)
    columns = np.arange(x.shape[1])
    found: NDArray[np.float64] = powers[:, columns, exponents].prod(axis=2)
    return found


def slopes(x: NDArray[np.float64], exponents: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return (n, k, t) the derivatives of each monomial.

    Examples
    --------
    >>> slopes(np.array([[2.0, 3.0]]), np.array([[1, 2]]))[0]
    array([[ 9.],
           [12.]])
    """
    parts = [lowered(exponents, i) for i in range(x.shape[1])]
    return np.stack([factor * monomials(x, lower) for lower, factor in parts], axis=1)


def exponents_of(variables: int, degree: int) -> NDArray[np.int64]:
    """Return (t, k) the exponents of all monomials of degree 3 to `degree`.

    Examples
    --------
    >>> exponents_of(2, 3).tolist()
    [[3, 0], [2, 1], [1, 2], [0, 3]]
    """
    rows = [
        np.bincount(chosen, minlength=variables)
        for total in range(3, degree + 1)
        for chosen in combinations_with_replacement(range(variables), total)
    ]
    return np.array(rows, dtype=np.int64).reshape(-1, variables)


def term_count(variables: int, degree: int) -> int:
    """Return how many terms of degree 3 and more there are.

    Examples
    --------
    >>> term_count(6, 4) == len(exponents_of(6, 4))
    True
    """
    return comb(variables + degree, degree) - comb(variables + 2, 2)


def variables_of(state: State, prescribed: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return (k,) what is asked of each coordinate in a state: a displacement or a force."""
    return np.where(prescribed, state.coordinates, state.force)


def answers_of(state: State, prescribed: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return (k,) what each coordinate answers in a state."""
    return np.where(prescribed, state.force, state.coordinates)


def fit_potential(
    element: Superelement,
    prescribed: NDArray[np.bool_],
    states: Sequence[State],
    degree: int,
) -> Potential:
    """Fit a potential to equilibria of an actuator.

    Every equilibrium gives k + 1 equations: the potential, and its derivatives, each in units
    of the largest that occurs.

    Parameters
    ----------
    element
    prescribed : (k,) bool
        Which variables are displacements.
    states
        At least enough for twice as many equations as terms.
    degree
        Of the polynomial, 2 or more; 2 is the linear two-port.

    Raises
    ------
    InvalidSettings
        If the degree is below 2, or there are too few states.

    Examples
    --------
    >>> from bellcrank.machines.ports import mean_ports
    >>> from bellcrank.model import find_problem
    >>> element = mean_ports(find_problem("crane").full_design())
    >>> linear = fit_potential(element, np.array([True, False]), [], 2)
    >>> linear.answer(np.array([0.1, 0.0])).round(4)
    array([ 0.9686, -0.0044])
    """
    count = len(prescribed)
    if degree < 2:
        raise InvalidSettings(f"degree: expected at least 2, got {degree}")
    terms = term_count(count, degree)
    if len(states) * (count + 1) < 2 * terms:
        raise InvalidSettings(
            f"states: expected at least {-(-2 * terms // (count + 1))} for a polynomial of degree "
            f"{degree} in {count} variables, got {len(states)}"
        )
    conditions = Conditions(prescribed, np.zeros(count), np.zeros(count))
    transfer = element.linear(element.rest(), conditions).transfer()
    quadratic = np.where(prescribed[:, None], transfer, -transfer)
    quadratic = 0.5 * (quadratic + quadratic.T)
    exponents = exponents_of(count, degree)
    if degree == 2:
        return Potential(prescribed, quadratic, np.ones(count), exponents, np.zeros(0))
    x = np.array([variables_of(state, prescribed) for state in states])
    answers = np.array([answers_of(state, prescribed) for state in states])
    loaded = np.where(prescribed, 0.0, 1.0)
    value = np.array([state.energy for state in states]) - (loaded * x * answers).sum(axis=1)
    slope = np.where(prescribed, answers, -answers)
    scale = np.abs(x).max(axis=0)
    scale[scale == 0.0] = 1.0
    unit = np.abs(slope).max(axis=0)
    unit[unit == 0.0] = 1.0
    height = float(np.abs(value).max()) or 1.0
    higher = value - 0.5 * np.einsum("ni,ij,nj->n", x, quadratic, x)
    steeper = slope - x @ quadratic
    by_value = monomials(x / scale, exponents) / height
    by_slope = slopes(x / scale, exponents) / (scale * unit)[:, None]
    matrix = np.concatenate([by_value, by_slope.reshape(-1, terms)])
    right = np.concatenate([higher / height, (steeper / unit).ravel()])
    coefficients = np.linalg.lstsq(matrix, right, rcond=None)[0]
    return Potential(prescribed, quadratic, scale, exponents, coefficients)
