"""Specification of problems that have none: the largest efficiency without contact."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from bellcrank.model import Item, ObjectiveTerm, Specification

if TYPE_CHECKING:
    from bellcrank.model import Problem


def specified(problem: Problem, strain_limit: float = math.nan) -> Problem:
    """Return a problem with a specification: its own, or the largest efficiency without contact.

    The efficiency is the gain, or the force in the output springs over that of the input, if the
    problem is driven by forces against output springs.

    Parameters
    ----------
    strain_limit
        Largest strain for a problem without a specification; nan if it is unknown.
    """
    if problem.is_specified:
        return problem
    (output,) = problem.outputs
    (case,) = problem.cases
    items = [Item(quantity="clearance", case=case, at_least=0.0)]
    if math.isfinite(strain_limit):
        items.append(Item(quantity="strain", case=case, at_most=strain_limit))
    own = Specification(
        case=case, output=output, items=tuple(items), maximise=(_efficiency(problem, case, output),)
    )
    return replace(problem, specification=own)


def _efficiency(problem: Problem, case: str, output: str) -> ObjectiveTerm:
    """Return the objective whose value is the efficiency."""
    given, spring = problem.input, problem.output.spring
    if given.drive == "displacement" or spring is None:
        return ObjectiveTerm(quantity="gain", case=case, output=output)
    # The springs at the output resist with the force of the input at this travel.
    travel = given.amount * len(given.nodes) / (spring * len(problem.output.nodes))
    return ObjectiveTerm(quantity="travel", case=case, output=output, scale=travel)
