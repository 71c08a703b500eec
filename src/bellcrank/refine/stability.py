"""The softest states of a path, near which it may lose its stability."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bellcrank.mechanics.frames.quantities.forces import LOWEST_STIFFNESS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from bellcrank.mechanics.frames.equilibria import Equilibrium
    from bellcrank.mechanics.frames.quantities import Measures

STABLE_STATES = 16
"""States along the stroke at which the lowest stiffness is computed first."""
HALVINGS = 3
"""Number of times the distance of states about a soft one is halved."""
DECLINE = 0.5
"""Part of the largest stiffness before a state with which it is compared where it only falls."""
FAR = 0.5
"""Reference over the lowest stiffness below which it is not compared with it."""
SOFT = 2.0
"""Lowest stiffness over the smallest one up to which a local minimum is searched more closely."""


def softest_states(
    state: Callable[[float], Equilibrium | None], fractions: Iterable[float] = ()
) -> tuple[dict[float, tuple[Equilibrium, Measures]], float | None]:
    """Return states along the stroke with their lowest stiffness.

    At equal fractions, and closer to each other about the local minima, since the lowest stiffness
    falls and rises steeply near a bifurcation.

    Parameters
    ----------
    state
        Function from a fraction of the stroke to the equilibrium there.
    fractions
        Fractions of the stroke at which it is computed besides.

    Returns
    -------
    states
        By fraction of the stroke.
    lost
        First fraction at which there is no stable state; None if all are stable.
    """
    found: dict[float, tuple[Equilibrium, Measures]] = {}

    def at(fraction: float) -> float:
        here = state(fraction)
        if here is None:
            return np.nan
        found[fraction] = (here, LOWEST_STIFFNESS.measure(here))
        return float(found[fraction][1].value[0])

    grid = {k / STABLE_STATES for k in range(1, STABLE_STATES + 1)}
    values = {each: at(each) for each in sorted(grid.union(fractions))}
    step = 1.0 / STABLE_STATES
    for _ in range(HALVINGS):
        if (lost := _first_unstable(values)) is not None:
            return found, lost
        step *= 0.5
        nearby = {each + move for each in _local_minima(values) for move in (-step, step)}
        values |= {each: at(each) for each in nearby if 0.0 < each <= 1.0 and each not in values}
    return found, _first_unstable(values)


def _first_unstable(values: Mapping[float, float]) -> float | None:
    return min((each for each, value in values.items() if not value > 0.0), default=None)


def _local_minima(values: dict[float, float]) -> list[float]:
    """Return the fractions at which the lowest stiffness is smaller than at both neighbours."""
    fractions = sorted(values)
    padded = np.array([np.inf, *(values[each] for each in fractions), np.inf])
    inner = padded[1:-1]
    is_low = (inner <= padded[:-2]) & (inner <= padded[2:]) & (inner < SOFT * inner.min())
    return [each for each, low in zip(fractions, is_low.tolist(), strict=True) if low]


def references(values: Mapping[float, float]) -> dict[float, tuple[tuple[float, float], ...]]:
    """Return what the lowest stiffness at each fraction of the stroke is compared with.

    In a valley, the largest one before or a later one, whichever is smaller; a value counts as
    before itself, so that values on a slope are not in a valley. And a part of the largest one
    before: a path that gets ever softer is near its end. Only values at equal fractions are
    references: the others depend on where the local minima are, so that the largest one of all
    would jump from one geometry to the next.

    Parameters
    ----------
    values
        Lowest stiffness by fraction of the stroke.

    Returns
    -------
    dict
        The fractions of the references, and their factors: 1, or `DECLINE`. Those that are far
        smaller than the value itself are left out (`FAR`).

    Examples
    --------
    >>> found = references({0.25: 5.0, 0.5: 1.0, 0.75: 3.0, 1.0: 0.4})
    >>> found[0.5], found[0.75], found[1.0]
    (((0.25, 0.5), (0.75, 1.0)), ((0.25, 0.5),), ((0.25, 0.5),))
    """
    equal = [each for each in sorted(values) if float(each * STABLE_STATES).is_integer()]
    found: dict[float, tuple[tuple[float, float], ...]] = {}
    for here in sorted(values):
        before = max((*(each for each in equal if each < here), here), key=values.__getitem__)
        valleys = {min(before, each, key=values.__getitem__) for each in equal if each > here}
        pairs = [(before, DECLINE), *((each, 1.0) for each in sorted(valleys))]
        found[here] = tuple(
            (peak, factor) for peak, factor in pairs if factor * values[peak] > FAR * values[here]
        )
    return found
