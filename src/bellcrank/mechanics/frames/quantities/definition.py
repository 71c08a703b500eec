"""Definition of a quantity, and their registry."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from bellcrank.registry import Registry

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from bellcrank.mechanics.frames.equilibria import Equilibrium
    from bellcrank.mechanics.kernels.arrays import Floats, Ints
    from bellcrank.model import Problem

    Values = NDArray[np.float64]

Load = Literal["input", "held output", "payload", "dead load", "weight"]
"""Load of an equilibrium: the input; the input with the output held along the wanted direction; the
input with a force on the output against that direction, which grows with the input or acts before
it; the own weight alone, at rest."""


class Measures(NamedTuple):
    """Measures of an equilibrium."""

    value: Floats
    """(k,)"""
    motion: Floats | None = None
    """(N, b) linear motion K^-1 w on which they depend besides the equilibrium."""
    beams: Ints | None = None
    """(k,) beams that they belong to."""


class Slopes(NamedTuple):
    """Derivatives of measures."""

    fields: NDArray[np.float64]
    """(k, N, b) by the unknowns of the equilibrium."""
    on_held: NDArray[np.float64] | None = None
    """(k, N, b) adjoints on held unknowns; zero by default."""
    by_motion: NDArray[np.float64] | None = None
    """(k, N, b) by the unknowns of the linear motion."""


def vector(values: Values) -> Values:
    """Return the measures themselves."""
    return values


def single(values: Values) -> Values:
    """Return the only measure."""
    only: NDArray[np.float64] = values[..., 0]
    return only


@dataclass(frozen=True, slots=True)
class Quantity:
    """A quantity of a design as a frame.

    Parameters
    ----------
    measure
        Function from an equilibrium to its measures.
    slopes
        Function from an equilibrium and its measures to their derivatives.
    combine
        Function from measures (..., k) to the quantity (...), or (..., c) for one of c components.
    gradient
        Function from measures (k,) to the derivatives (k,) of the quantity.
    load
        Load of the equilibrium.
    after_flips
        Function from an equilibrium, its measures, flipped beams (n,), the forces (n, 2 b) on
        their ends and predicted measures (n, k) to the measures to combine; None to combine the
        predicted ones.
    """

    measure: Callable[[Equilibrium], Measures]
    slopes: Callable[[Equilibrium, Measures], Slopes]
    combine: Callable[[Values], Values] = single
    gradient: Callable[[Floats], Floats] = np.ones_like
    load: Load = "input"
    after_flips: Callable[[Equilibrium, Measures, Ints, Values, Values], Values] | None = None

    def value(self, equilibrium: Equilibrium) -> float:
        """Return the quantity at an equilibrium of its load."""
        return float(self.combine(self.measure(equilibrium).value))


quantities: Registry[Quantity] = Registry("quantity")
"""Quantities of frames by name."""


class Weights(NamedTuple):
    """Weights of the displacements of some nodes in measures."""

    nodes: Ints
    """(n,)"""
    values: NDArray[np.float64]
    """(k, n, d)"""

    def sums(self, displacement: Floats) -> Floats:
        """Return (k,) the weighted sums of displacements (N, d)."""
        chosen = displacement[self.nodes, : self.values.shape[2]]
        found: Floats = self.values.reshape(len(self.values), -1) @ chosen.ravel()
        return found

    def fields(self, equilibrium: Equilibrium) -> NDArray[np.float64]:
        """Return (k, N, b) the weights of all nodes; those of rotations are zero."""
        count, _, dimension = self.values.shape
        fields = equilibrium.fields(count)
        rows, nodes = np.indices((count, len(self.nodes)))
        np.add.at(fields[..., :dimension], (rows, self.nodes[nodes]), self.values)
        return fields


def linear(
    weights: Callable[[Problem], Weights],
) -> tuple[
    Callable[[Equilibrium], Measures],
    Callable[[Equilibrium, Measures], Slopes],
]:
    """Return `Quantity.measure` and `Quantity.slopes` of weighted sums of displacements."""
    stored = lru_cache(maxsize=64)(weights)

    def measure(equilibrium: Equilibrium) -> Measures:
        return Measures(stored(equilibrium.problem).sums(equilibrium.state.u))

    def slopes(equilibrium: Equilibrium, _measures: Measures) -> Slopes:
        return Slopes(stored(equilibrium.problem).fields(equilibrium))

    return measure, slopes


def ratio(numerator: Values, denominator: Values) -> Values:
    """Return a quotient; nan where the denominator is zero."""
    nowhere = np.full(np.shape(numerator), np.nan)
    return np.asarray(np.divide(numerator, denominator, out=nowhere, where=denominator != 0.0))
