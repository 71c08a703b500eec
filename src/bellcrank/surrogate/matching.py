"""Check that a problem is the one that a network was trained on."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidModel
from bellcrank.model.conditions import ROLLERS
from bellcrank.surrogate.trained_model import lattice_hash

if TYPE_CHECKING:
    from bellcrank.model import Problem

TOLERANCE = 1e-4
"""Largest relative difference of numbers of a task."""


def require_same_problem(known: Problem, given: Problem) -> None:
    """Check that a problem has the lattice and the task of another one.

    Parameters
    ----------
    known
        Problem that a network was trained on.
    given
        Problem of the designs whose efficiency is wanted.

    Raises
    ------
    InvalidModel
        If the problems differ; the message names the first difference.
    """
    first, second = known.lattice, given.lattice
    there, here = (first.node_count, first.beam_count), (second.node_count, second.beam_count)
    if there != here:
        raise InvalidModel(
            f"the model was trained on {known.name!r} with {there[0]} nodes and {there[1]} beams; "
            f"{given.name!r} has {here[0]} and {here[1]}"
        )
    if lattice_hash(first) != lattice_hash(second):
        raise InvalidModel(
            f"the model was trained on {known.name!r}, whose nodes or beams differ from those of "
            f"{given.name!r} in position or order"
        )
    task = _task(given)
    for name, value in _task(known).items():
        other = task[name]
        if not _agree(value, other):
            values = "" if isinstance(value, np.ndarray) else f": {value} in training, {other} here"
            raise InvalidModel(
                f"the model was trained on {known.name!r}, whose {name} differs from that of "
                f"{given.name!r}{values}"
            )


def _agree(first: Any, second: Any) -> bool:
    """Whether two values of a task agree: node numbers exactly, other numbers within TOLERANCE."""
    if isinstance(first, np.ndarray):
        if first.shape != second.shape:
            return False
        tolerance = TOLERANCE if first.dtype == np.float64 else 0.0
        return bool((np.abs(first - second) <= tolerance).all())
    if isinstance(first, float) and isinstance(second, float):
        return math.isclose(first, second, rel_tol=TOLERANCE)
    return bool(first == second)


def _task(problem: Problem) -> dict[str, Any]:
    """Return what determines efficiencies besides the lattice."""
    from bellcrank.mechanics.objectives import objective_of

    task: dict[str, Any] = {}
    for name in ("fixed", *ROLLERS):
        task[f"support ({name})"] = np.sort(getattr(problem.supports, name))
    for name, region in (("input", problem.input), ("output", problem.output)):
        order = np.argsort(region.nodes)
        task[f"{name} region"] = region.nodes[order]
        task[f"{name} direction"] = region.direction[order]
    task["drive"] = problem.input.drive
    task["amount"] = problem.input.amount
    task["output spring"] = problem.output.spring
    task["spring_kind"] = problem.output.spring_kind
    task["stiffness of beams"] = problem.stiffness.bond
    task["stiffness of joints"] = problem.stiffness.angle
    task["cross-section"] = problem.section
    task["material"] = problem.material
    task["aggregate"] = problem.aggregate
    # None and the name of the default are the same objective.
    objective = objective_of(problem)
    by_force = problem.input.drive == "force" and objective.denominator is not None
    task["objective"] = "force" if by_force else "displacement"
    task["exponent of the objective"] = objective.exponent
    return task
