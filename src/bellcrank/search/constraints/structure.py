"""Constraints on the beams alone: mass, degree of nodes, connectedness, mirror symmetry."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bellcrank.search.cleaning import pieces
from bellcrank.search.constraints.constraint import (
    Constraint,
    ConstraintType,
    above,
    at_least,
    at_most,
    constraints,
    counted,
    no_value,
)
from bellcrank.search.symmetry import AXES, beam_images

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.model import Problem

TYPICAL_MISSING_BEAMS = 10.0
"""Number of missing beams at which the violation of `degree` is one half."""


def mass_of(problem: Problem, core: NDArray[np.bool_]) -> float:
    """Return the length of the designable beams that carry load, as a fraction of all of them.

    Parameters
    ----------
    core : (M,) bool
        The beams that carry load.
    """
    length = problem.lattice.rest_length[problem.designable]
    return float(length @ core[problem.designable] / length.sum())


def mass(problem: Problem, bound: float) -> Constraint:
    """Bound the mass from above; loose pieces and dead ends do not count.

    Raises
    ------
    ValueError
        If every design satisfies the bound.
    """
    if bound >= 1.0:
        raise ValueError("expected a fraction below 1 of the length of the designable beams")
    length = problem.lattice.rest_length
    share = np.zeros(len(length))
    share[problem.designable] = length[problem.designable] / length[problem.designable].sum()

    def violation(_mask: NDArray[np.bool_], core: NDArray[np.bool_]) -> float:
        return above(float(share @ core), bound)

    def flip_change(core: NDArray[np.bool_]) -> NDArray[np.float64]:
        now = float(share @ core)
        after = np.maximum(now + np.where(core, -share, share), 1e-12)
        change: NDArray[np.float64] = np.maximum(0.0, 1.0 - bound / after) - above(now, bound)
        return change

    return Constraint(structure_violation=violation, flip_change=flip_change)


def whole(rest: str) -> int:
    """Parse ``>= NUMBER`` with an integer."""
    number = at_least(rest)
    if number != int(number):
        raise ValueError(rest)
    return int(number)


def degree(problem: Problem, bound: int) -> Constraint:
    """Bound from below the load-bearing beams at each free node that has some.

    Supports, input and output nodes are not free.

    Raises
    ------
    ValueError
        If no node of the lattice has so many beams.
    """
    beams, nodes = problem.lattice.beams, problem.lattice.node_count
    largest = int(np.bincount(beams.ravel()).max())
    if bound > largest:
        raise ValueError(f"no node of problem {problem.name!r} has more than {largest} beams")
    free = np.ones(nodes, dtype=bool)
    free[[*problem.supports.nodes, *problem.input.nodes, *problem.output.nodes]] = False

    def violation(_mask: NDArray[np.bool_], core: NDArray[np.bool_]) -> float:
        number = np.bincount(beams[core].ravel(), minlength=nodes)
        missing = np.where(free & (number > 0), np.maximum(0, bound - number), 0).sum()
        return counted(float(missing), TYPICAL_MISSING_BEAMS)

    return Constraint(structure_violation=violation)


def connected(problem: Problem, _value: None) -> Constraint:
    """Require one load-bearing piece that contains input, output and a support.

    Each additional piece and each missing one of the three is a fault.
    """
    regions = [problem.supports.nodes, problem.input.nodes, problem.output.nodes]

    def violation(_mask: NDArray[np.bool_], core: NDArray[np.bool_]) -> float:
        touched = np.zeros(problem.lattice.node_count, dtype=bool)
        touched[problem.lattice.beams[core]] = True
        missing = sum(len(nodes) > 0 and not touched[nodes].any() for nodes in regions)
        return counted(missing + max(0, pieces(problem, core) - 1))

    return Constraint(structure_violation=violation, evaluation_cost=1)


def axis_name(rest: str) -> str:
    """Parse ``x``, ``y`` or ``z``."""
    if rest not in AXES:
        raise ValueError(rest)
    return rest


def mirror(problem: Problem, axis: str) -> Constraint:
    """Require that designable beams and their mirror images are present or absent together."""
    images = beam_images(problem, axis)

    def violation(mask: NDArray[np.bool_], _core: NDArray[np.bool_]) -> float:
        present = mask[problem.designable]
        return float(np.mean(present != present[images]))

    return Constraint(structure_violation=violation)


for _name, _usage, _parse, _make in (
    ("mass", "'mass <= NUMBER', the number above 0", at_most, mass),
    ("degree", "'degree >= NUMBER', an integer above 0", whole, degree),
    ("connected", "'connected' alone", no_value, connected),
    ("mirror", "'mirror x', 'mirror y' or in space 'mirror z'", axis_name, mirror),
):
    constraints.register(_name)(ConstraintType(_usage, _parse, _make))
