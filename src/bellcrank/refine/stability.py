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
SOFT = 2.0
"""Lowest stiffness over the smallest one up to which a local minimum is searched more closely."""


def softest_states(
    state: Callable[[float], Equilibrium | None], fractions: Iterable[float] = ()
) -> dict[float, tuple[Equilibrium, Measures]] | None:
    """Return states along the stroke with their lowest stiffness; None if one is not found.

    At equal fractions, and closer to each other about the local minima, since the lowest stiffness
    falls and rises steeply near a bifurcation.

    Parameters
    ----------
    state
        Function from a fraction of the stroke to the equilibrium there.
    fractions
        Fractions of the stroke at which it is computed besides.
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
        if not all(value > 0.0 for value in values.values()):
            return None
        step *= 0.5
        nearby = {each + move for each in _local_minima(values) for move in (-step, step)}
        values |= {each: at(each) for each in nearby if 0.0 < each <= 1.0 and each not in values}
    return found if all(value > 0.0 for value in values.values()) else None


def _local_minima(values: dict[float, float]) -> list[float]:
    """Return the fractions at which the lowest stiffness is smaller than at both neighbours."""
    fractions = sorted(values)
    padded = np.array([np.inf, *(values[each] for each in fractions), np.inf])
    inner = padded[1:-1]
    is_low = (inner <= padded[:-2]) & (inner <= padded[2:]) & (inner < SOFT * inner.min())
    return [each for each, low in zip(fractions, is_low.tolist(), strict=True) if low]


def references(values: Mapping[float, float]) -> dict[float, tuple[float, float]]:
    """Return what the lowest stiffness at each fraction of the stroke is compared with.

    In a valley, the largest one before or after it, whichever is smaller; a value counts as before
    and after itself, so that values on a slope are not in a valley. Where a part of the largest
    one before is more, that: a path that gets ever softer is near its end.

    Parameters
    ----------
    values
        Lowest stiffness by fraction of the stroke.

    Returns
    -------
    dict
        The fraction of the reference, and its factor: 1, or `DECLINE` for one before.

    Examples
    --------
    >>> references({0.2: 5.0, 0.4: 1.0, 0.6: 3.0, 0.8: 0.5})
    {0.2: (0.2, 1.0), 0.4: (0.6, 1.0), 0.6: (0.6, 1.0), 0.8: (0.2, 0.5)}
    """
    fractions = sorted(values)
    found = {}
    for k, here in enumerate(fractions):
        before, after = (
            max(side, key=values.__getitem__) for side in (fractions[: k + 1], fractions[k:])
        )
        choices = (min(before, after, key=values.__getitem__), 1.0), (before, DECLINE)
        found[here] = max(choices, key=lambda each: each[1] * values[each[0]])
    return found
