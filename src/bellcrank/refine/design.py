"""Refinement of designs, corrected by frames with more elements."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.mechanics import ItemResult, tightened
from bellcrank.model import Item, ObjectiveTerm, Specification
from bellcrank.refine.refinement import RefinementSettings, refine_rows
from bellcrank.refine.rows import RowEvaluator
from bellcrank.refine.shape import shape_rows, volume_of
from bellcrank.refine.variables import variables_of
from bellcrank.search import HoppingSettings
from bellcrank.search.verification import Verifier

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from bellcrank.model import Design, Problem
    from bellcrank.refine.refinement import Progress
    from bellcrank.refine.variables import Variables

RESERVE = 0.02
"""Part of their size by which bounds are tightened, so that more elements meet them too."""
PRINTABLE = 1e-2
"""Part of the smallest angle or length by which one may be smaller: rounding of the steps."""
ROUNDS = 3
"""Number of times a design is refined, each corrected by the result of the one before."""


@dataclass(frozen=True, slots=True)
class State:
    """A design before or after its refinement, by frames with eight elements in each beam.

    Parameters
    ----------
    objective
        Smallest objective; the smallest margin where there is none.
    items
        Items of the specification; empty if the response is not stable.
    met
        Whether all of them are met, and the geometry prints.
    """

    objective: float
    items: tuple[ItemResult, ...]
    met: bool


@dataclass(frozen=True, slots=True, eq=False)
class Refinement:
    """A refined design.

    Parameters
    ----------
    design
        The design, whose problem has the positions and widths. It is the given one if no step
        improved it.
    before, after
        States of the given design and of this one.
    steps, evaluations
        Number of accepted steps and of evaluated geometries.
    reason
        Why the refinement ended.
    """

    design: Design
    before: State
    after: State
    steps: int
    evaluations: int
    reason: str


def specified(problem: Problem, strain_limit: float = math.nan) -> Problem:
    """Return a problem with a specification: its own, or to maximise the gain without contact.

    Parameters
    ----------
    strain_limit
        Largest strain for a problem without a specification; nan if it is unknown.

    Raises
    ------
    InvalidSettings
        If a problem without a specification is driven by forces.
    """
    if problem.is_specified:
        return problem
    if problem.input.drive == "force":
        raise InvalidSettings(
            f"problem {problem.name!r} has no specification and is driven by forces; write a task "
            "that says what is wanted"
        )
    (output,) = problem.outputs
    (case,) = problem.cases
    items = [Item(quantity="clearance", case=case, at_least=0.0)]
    if math.isfinite(strain_limit):
        items.append(Item(quantity="strain", case=case, at_most=strain_limit))
    gain = ObjectiveTerm(quantity="gain", case=case, output=output)
    own = Specification(case=case, output=output, items=tuple(items), maximise=(gain,))
    return replace(problem, specification=own)


def refine_design(
    design: Design,
    settings: RefinementSettings | None = None,
    report: Callable[[Progress], bool] = lambda _progress: True,
    strain_limit: float = math.nan,
) -> Refinement:
    """Move the nodes of a design, and change the widths of its struts, to meet its specification.

    The result is verified by frames with eight elements in each strut. Where it misses items that
    the model of the refinement meets, bounds are corrected by the difference and the design is
    refined again. A result that is no better than the given design is discarded.

    Parameters
    ----------
    design
        A design of a frame in the plane.
    settings
        Settings of the refinement.
    report
        Called with each accepted step; the refinement stops if it returns False.
    strain_limit
        Largest strain for a problem without a specification.

    Raises
    ------
    InvalidSettings
        If the design is in space, has no section, or has no stable response.
    """
    settings = settings or RefinementSettings()
    problem = design.problem
    if problem.section is None or problem.lattice.dimension == 3:
        raise InvalidSettings(
            f"problem {problem.name!r}: expected a frame in the plane; designs of springs and "
            "designs in space are not refined"
        )
    wanted = specified(problem, strain_limit)
    given = replace(design, problem=wanted)
    width = problem.section.width
    bounds = (settings.narrowest * width, settings.widest * width)
    variables = variables_of(given, settings.largest_move, bounds)
    volume = volume_of(wanted, design.mask)[0] if settings.same_mass else math.inf
    before = state_of(wanted, design.mask)
    best, chosen = before, np.zeros(variables.count)
    vector = chosen
    correction: dict[int, float] = {}
    steps = evaluations = 0
    reason = "the response of the design is not stable"
    assert wanted.specification is not None
    began = time.monotonic()
    for _ in range(ROUNDS):
        items = [
            moved(tightened(item, RESERVE), correction.get(index, 0.0))
            for index, item in enumerate(wanted.specification.items)
        ]
        rows = RowEvaluator(variables, design.mask, items, volume)
        left = max(0.0, settings.seconds - (time.monotonic() - began))
        path, goes_on = [], True
        for progress in refine_rows(rows, replace(settings, seconds=left), vector):
            path.append(progress)
            goes_on = report(progress)
            if not goes_on:
                break
        if not path:
            break
        reason = path[-1].reason or "stopped"
        steps, evaluations = steps + path[-1].step, evaluations + path[-1].evaluations
        found, vector = _latest(variables, design.mask, [each.vector for each in path])
        if _is_better(found, best):
            best, chosen = found, vector
        if found.met or not found.items or not goes_on:
            break
        correction = _differences(variables.problem_at(vector), design.mask, found)
    refined = design
    if best is not before:
        positions, widths = variables.geometry(chosen)
        same = bounds[0] == bounds[1] and problem.widths is None
        refined = replace(
            design, problem=problem.with_geometry(positions, None if same else widths)
        )
    return Refinement(refined, before, best, steps, evaluations, reason)


def _latest(
    variables: Variables, mask: NDArray[np.bool_], path: list[NDArray[np.float64]]
) -> tuple[State, NDArray[np.float64]]:
    """Return the state and the vector of the last geometry that meets all with eight elements.

    The later ones may be too close to a loss of stability. That of the last geometry, if none is
    found among a few.
    """
    last = state_of(variables.problem_at(path[-1]), mask)
    if last.met:
        return last, path[-1]
    low, high = 0, len(path) - 1
    found = last, path[-1]
    while high - low > 1:
        middle = (low + high) // 2
        state = state_of(variables.problem_at(path[middle]), mask)
        if state.met:
            low, found = middle, (state, path[middle])
        else:
            high = middle
    return found


def state_of(problem: Problem, mask: NDArray[np.bool_]) -> State:
    """Return the state of a design of a problem with a specification."""
    found = Verifier(problem, HoppingSettings()).verify(mask)
    assert problem.specification is not None
    if not found.items:
        return State(-math.inf, (), met=False)
    objective = found.response.efficiency - found.response.penalty
    if found.fault is not None:
        objective = -sum(item.violation for item in found.items)
    narrow = shape_rows(problem, mask, math.inf).values.max(initial=0.0)
    return State(objective, found.items, met=found.fault is None and narrow < PRINTABLE)


def moved(item: Item, change: float) -> Item:
    """Return an item whose bounds are lower by a change, by which a better model is higher."""
    return replace(
        item,
        at_least=None if item.at_least is None else item.at_least - change,
        at_most=None if item.at_most is None else item.at_most - change,
    )


def _differences(problem: Problem, mask: NDArray[np.bool_], found: State) -> dict[int, float]:
    """Return by how much items are higher with eight elements than with one."""
    from bellcrank.mechanics import VERIFICATION_INCREMENT
    from bellcrank.search import SpecificationEvaluator

    evaluator = SpecificationEvaluator(problem)
    if not evaluator.evaluate(mask, VERIFICATION_INCREMENT).is_admissible:
        return {}
    out = {}
    for index, (here, there) in enumerate(zip(evaluator.results(), found.items, strict=True)):
        difference = there.value - here.value
        if here.item.quantity not in {"clearance", "stable_stroke"} and math.isfinite(difference):
            out[index] = difference
    return out


def _is_better(new: State, old: State) -> bool:
    """Whether a state meets more, or has the larger objective."""
    if not new.items:
        return False
    return (new.met, new.objective) > (old.met, old.objective)
