"""Bounds of a specification that a search before a refinement asks for."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from bellcrank.model import ObjectiveTerm

if TYPE_CHECKING:
    from bellcrank.model import Item, Problem

RELAXED = {"off_axis": 0.1, "rotation": 5.0}
"""Smallest bounds of unwanted motions, in either direction, that a search asks for before a
refinement. The beams determine a motion roughly and the positions of the nodes exactly: a search
for less than this finds stiff designs with small gains."""
WANTED = frozenset({"gain", "travel", "rotation"})
"""Quantities of which a search before a refinement comes near a wanted value."""
WANTED_TOLERANCE = 0.15
"""Smallest tolerance of a wanted value, as a part of it."""


def relaxed(problem: Problem) -> Problem:
    """Return a problem with the bounds of its specification that a search before a refinement has.

    Upper bounds on unwanted motions are at least those of `RELAXED`, and lower ones at most their
    opposites. A wanted motion with two bounds has a tolerance of at least `WANTED_TOLERANCE`. All
    other items keep their bounds. Without an objective, gains with a lower bound are maximised: a
    search for the largest margin alone ends at stiff designs that hardly move.

    Examples
    --------
    >>> from bellcrank.task import find_task
    >>> problem = relaxed(find_task("stage").problem)
    >>> [item.at_most for item in problem.specification.items if item.quantity == "rotation"]
    [5.0]
    """
    wanted = problem.specification
    if wanted is None:
        return problem
    items = tuple(map(_relaxed, wanted.items))
    maximise = wanted.maximise or tuple(
        ObjectiveTerm(quantity=item.quantity, case=item.case, output=item.output)
        for item in wanted.items
        if item.quantity == "gain" and item.at_least is not None and item.at_least > 0.0
    )
    return replace(problem, specification=replace(wanted, items=items, maximise=maximise))


def _relaxed(item: Item) -> Item:
    low, high = item.at_least, item.at_most
    if (low or 0.0) <= 0.0 <= (high or 0.0):
        least = RELAXED.get(item.quantity, 0.0)
        low = None if low is None else min(low, -least)
        high = None if high is None else max(high, least)
    elif low is not None and high is not None and item.quantity in WANTED:
        middle = 0.5 * (low + high)
        least = WANTED_TOLERANCE * abs(middle)
        low, high = min(low, middle - least), max(high, middle + least)
    return replace(item, at_least=low, at_most=high)
