"""Problems with another output, or with a force or stiff springs on it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from bellcrank.model import Loads, NodeForce, Specification

if TYPE_CHECKING:
    from bellcrank.model import Problem

STOP_STIFFNESS = 2e5
"""Stiffness of the springs that hold the output, over the axial stiffness of a beam as long as it
is wide: it does not depend on the geometry, by which blocked forces are differentiated."""


def with_output(problem: Problem, name: str) -> Problem:
    """Return a problem whose primary output is the one of a name; all springs remain.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> from bellcrank.part import PartSpec, frame_problem
    >>> crane = frame_problem(find_problem("crane"), PartSpec())
    >>> with_output(crane, "output") is crane
    True
    """
    outputs = problem.outputs
    if name == next(iter(outputs)):
        return problem
    case = "case" if problem.specification is None else problem.specification.case
    others = {key: output for key, output in outputs.items() if key != name}
    return replace(
        problem, output=outputs[name],
        specification=Specification(case=case, output=name, outputs=others),
    )  # fmt: skip


def with_payload(problem: Problem, force: float) -> Problem:
    """Return a problem with a force on its output against the wanted direction.

    Parameters
    ----------
    force
        Total force, shared equally by the output nodes.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> from bellcrank.part import PartSpec, frame_problem
    >>> crane = frame_problem(find_problem("crane"), PartSpec())
    >>> with_payload(crane, 0.1).loads.forces[0].force.sum(axis=0).round(3)
    array([0.1, 0. ])
    """
    given = problem.loads
    forces = (*given.forces, resisting_force(problem, force))
    return replace(problem, loads=Loads(forces, given.springs, given.weight))


def resisting_force(problem: Problem, force: float) -> NodeForce:
    """Return a force on the output of a problem against the wanted direction.

    Parameters
    ----------
    force
        Total force, shared equally by the output nodes.
    """
    output = problem.output
    return NodeForce(output.nodes, -force / len(output.nodes) * output.direction)


def with_held_output(problem: Problem) -> Problem:
    """Return a problem whose output is held by stiff springs of the kind that it has.

    Along the wanted direction by default, in all directions for isotropic springs.
    """
    assert problem.section is not None
    assert problem.material is not None
    axial = problem.material.young * problem.section.area / problem.section.width
    return replace(problem, output=replace(problem.output, spring=STOP_STIFFNESS * axial))
