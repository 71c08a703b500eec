"""Problems with another output, or with a force or stiff springs on it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.model import NodeForce, Specification
from bellcrank.model.stroke_ranges import delayed

if TYPE_CHECKING:
    from bellcrank.model import Problem

DEAD = 0.25
"""Part of the load in which a dead load grows, before the input."""
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
    return replace(problem, loads=replace(given, forces=forces))


def with_dead_load(problem: Problem, force: float) -> Problem:
    """Return a problem with a force on its output that acts before the input and during it.

    It grows in the first part of the load (`DEAD`), the input and the other forces in the rest; the
    own weight grows in all of it unless it has a range of its own.

    Parameters
    ----------
    force
        Total force against the wanted direction, shared equally by the output nodes.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> from bellcrank.part import PartSpec, frame_problem
    >>> crane = frame_problem(find_problem("crane"), PartSpec())
    >>> loaded = with_dead_load(crane, 0.1)
    >>> loaded.loads.forces[0].during, loaded.input.ranges[0].tolist()
    ((0.0, 0.25), [0.25, 1.0])
    """
    dead = replace(resisting_force(problem, force), during=(0.0, DEAD))
    given = problem.loads

    def later(during: tuple[float, float]) -> tuple[float, float]:
        begin, end = delayed(np.array([during]), DEAD)[0].tolist()
        return begin, end

    forces = [replace(each, during=later(each.range)) for each in given.forces]
    during = None if given.weight_during is None else later(given.weight_during)
    return replace(
        problem,
        input=replace(problem.input, during=delayed(problem.input.ranges, DEAD)),
        loads=replace(given, forces=(dead, *forces), weight_during=during),
    )


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
