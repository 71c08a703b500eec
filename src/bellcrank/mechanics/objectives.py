"""Objectives: definitions of the efficiency, in a registry.

Every objective is a ratio

    efficiency = numerator_scale * sum over output nodes of |u| f_n(gamma) / denominator

with f_n(gamma) = 2 cos(gamma/2)^n - 1 and gamma the angle between the displacement
u of an output node and its wanted direction; n = 2 gives the projection t_out . u
(Bonfanti et al. 2020, eqs. 1 to 3). To add one, write a function from a problem to
an `Objective` and register it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.registry import Registry

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike

    from bellcrank.model import Problem


@dataclass(frozen=True, slots=True)
class Objective:
    """Parameters of an efficiency as a function of the displacements.

    Parameters
    ----------
    numerator_scale
        Factor of the sum over the output nodes.
    exponent
        n >= 2 in f_n; the larger n, the less counts motion off the wanted direction.
    denominator
        A constant; None for the scaled motion of the input.
    denominator_scale
        Factor of the sum of t_in . u over the input nodes, if that is the denominator.
    """

    numerator_scale: float
    exponent: float = 2.0
    denominator: float | None = None
    denominator_scale: float = 1.0


objectives: Registry[Callable[..., Objective]] = Registry("objective")


def _share(problem: Problem, count: int) -> float:
    """Return the weight of one node: 1 / count for a mean, 1 for a sum."""
    return 1.0 / count if problem.aggregate == "mean" else 1.0


@objectives.register("displacement")
def displacement(problem: Problem) -> Objective:
    """Return output motion over input motion, both along their directions (eq. 1)."""
    return directional(problem, 2.0)


@objectives.register("directional")
def directional(problem: Problem, exponent: float = 4.0) -> Objective:
    """Return output motion over input motion; motion off the direction counts less (eq. 2)."""
    inputs, outputs = problem.input, problem.output
    scale = _share(problem, len(inputs.nodes))
    known = inputs.drive == "displacement"
    return Objective(
        numerator_scale=_share(problem, len(outputs.nodes)),
        exponent=exponent,
        denominator=scale * len(inputs.nodes) * inputs.amount if known else None,
        denominator_scale=scale,
    )


@objectives.register("force")
def force(problem: Problem, exponent: float = 2.0) -> Objective:
    """Return the force in the output springs over the input force (eq. 3).

    Raises
    ------
    InvalidSettings
        If the problem is not driven by a force, or has no output spring.
    """
    inputs, outputs = problem.input, problem.output
    if inputs.drive != "force" or outputs.spring is None:
        raise InvalidSettings(
            f"objective 'force' needs a problem with drive = 'force' and an output spring; "
            f"{problem.name!r} has drive = {inputs.drive!r} and spring = {outputs.spring!r}"
        )
    return Objective(
        numerator_scale=outputs.spring * _share(problem, len(outputs.nodes)),
        exponent=exponent,
        denominator=inputs.amount * _share(problem, len(inputs.nodes)) * len(inputs.nodes),
    )


def objective_of(problem: Problem, name: str | None = None) -> Objective:
    """Return the objective `name` of a problem; by default the problem's own.

    A problem that names none is judged by displacement, or by force if it is driven
    by forces against output springs. ``directional:6`` sets the exponent.

    Raises
    ------
    UnknownName, InvalidSettings

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> objective_of(find_problem("crane"), "directional:3").exponent
    3.0
    """
    name, _, parameter = objective_name(problem, name).partition(":")
    make = objectives[name]
    if not parameter:
        return make(problem)
    try:
        exponent = float(parameter)
    except ValueError:
        exponent = math.nan
    if name == "displacement" or not 2.0 <= exponent < math.inf:
        raise InvalidSettings(
            f"objective {name}:{parameter}: the part after the colon is the exponent n >= 2 "
            "of 'directional' or 'force'"
        )
    return make(problem, exponent)


def objective_name(problem: Problem, name: str | None = None) -> str:
    """Return the name of the objective in use: `name`, else the problem's own, else the default.

    The default is ``"force"`` for forces against output springs, otherwise ``"displacement"``.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> objective_name(find_problem("crane")), objective_name(find_problem("pliers"))
    ('displacement', 'force')
    """
    return name or problem.objective or _usual_objective(problem)


def _usual_objective(problem: Problem) -> str:
    loaded = problem.input.drive == "force" and problem.output.spring is not None
    return "force" if loaded else "displacement"


def efficiency_of(
    problem: Problem, displacement: ArrayLike, name: str | None = None, load: float = 1.0
) -> float:
    """Return the efficiency of a motion of the nodes of the lattice.

    Parameters
    ----------
    displacement : (N, d)
        Displacement of the nodes, in lattice units.
    name
        Objective; by default that of the problem.
    load
        Fraction of the full input that causes the motion.

    Returns
    -------
    float
        nan if the input does not move.

    Raises
    ------
    UnknownName, InvalidSettings

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> crane = find_problem("crane")
    >>> moved = np.zeros((crane.lattice.node_count, 2))
    >>> moved[crane.output.nodes] = [-crane.input.amount, 0.0]
    >>> round(efficiency_of(crane, moved), 12)
    1.0
    """
    objective = objective_of(problem, name)
    motion = np.asarray(displacement, dtype=np.float64)
    there = motion[problem.output.nodes]
    size = np.linalg.norm(there, axis=1)
    along = (there * problem.output.direction).sum(axis=1)
    cosine = np.divide(along, size, out=np.zeros_like(size), where=size > 0.0)
    half = np.sqrt(np.clip(0.5 * (1.0 + cosine), 0.0, 1.0))
    total = float((size * (2.0 * half**objective.exponent - 1.0)).sum())
    if objective.denominator is not None:
        given = load * objective.denominator
    else:
        pushed = (motion[problem.input.nodes] * problem.input.direction).sum()
        given = objective.denominator_scale * float(pushed)
    return objective.numerator_scale * total / given if given else math.nan
