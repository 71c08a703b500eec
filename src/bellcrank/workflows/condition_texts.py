"""Inputs and loads of a task in words, under which its items hold."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.model.stroke_ranges import WHOLE
from bellcrank.task import units_of
from bellcrank.task.values import DIRECTIONS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bellcrank.model import Problem
    from bellcrank.model.conditions import Input, Output
    from bellcrank.model.loads import Loads
    from bellcrank.part import PartSpec
    from bellcrank.task import ProblemUnits

    Points = NDArray[np.float64]

NAMED = 0.9999
"""Cosine of the angle to a direction with a name above which the name is used."""
FEW_NODES = 2
"""Largest number of nodes that are named each by its place."""


def condition_texts(problem: Problem, part: PartSpec) -> list[str]:
    """Return the input and the loads of each load case, each as one text.

    The last one is a remark if nothing limits the strain, as the limit of the material is unknown.

    Parameters
    ----------
    problem
        Problem of a frame.
    part
        Size and material of the part.

    Examples
    --------
    >>> from bellcrank.task import find_task
    >>> task = find_task("selector")
    >>> for text in condition_texts(task.problem, task.part):
    ...     print(text)
    A: input 3 mm right on 3 nodes between (1, 36.3) and (6, 53.7) mm
    B: input 3 mm left on 3 nodes between (96, 36.3) and (101, 53.7) mm
    """
    several = len(problem.cases) > 1
    found = [
        f"{name}: {text}" if several else text
        for name, texts in texts_of_cases(problem, part).items()
        for text in texts
    ]
    wanted, material = problem.specification, part.registered_material
    items = () if wanted is None else wanted.items
    if math.isnan(material.strain_limit) and not any(each.quantity == "strain" for each in items):
        found.append(f"no limit of the strain: that of {material.name} is not known")
    return found


def texts_of_cases(problem: Problem, part: PartSpec) -> dict[str, list[str]]:
    """Return input and loads of each load case in words, with the places of their nodes."""
    units = units_of(problem, part)
    positions = problem.lattice.positions * part.scale
    return {
        name: [
            *_input_texts(case.input, units, positions),
            *_load_texts(case.loads, units, positions),
            *(_output_text(key, each, units) for key, each in case.outputs.items() if each.spring),
        ]
        for name, case in problem.cases.items()
    }


def _input_texts(given: Input, units: ProblemUnits, positions: Points) -> list[str]:
    """Return one text for the nodes of each direction and part of the stroke."""
    keys = np.hstack([given.direction.round(4), given.ranges])
    _, first, group = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    found = []
    for index in np.argsort(first):
        own = group.ravel() == index
        if given.drive == "force":
            size = f"of {units.in_part('force', given.amount) * own.sum():.3g} N"
        else:
            size = f"{units.in_part('length', given.amount):.3g} mm"
        span = tuple(given.ranges[own][0])
        part = "" if span == WHOLE else f", {_range_text(span)}"
        where = _at_nodes(given.nodes[own], positions)
        found.append(f"input {size} {_direction(given.direction[own])} {where}{part}")
    return found


def _range_text(span: Sequence[float]) -> str:
    return f"from {100.0 * span[0]:g}% to {100.0 * span[1]:g}% of the stroke"


def _output_text(name: str, output: Output, units: ProblemUnits) -> str:
    assert output.spring is not None
    size = units.in_part("stiffness", output.spring * len(output.nodes))
    return f"spring of {size:.3g} N/mm against {name}"


def _load_texts(loads: Loads, units: ProblemUnits, positions: Points) -> list[str]:
    found = []
    for force in loads.forces:
        whole = force.force.sum(axis=0)
        size = units.in_part("force", float(np.linalg.norm(whole)))
        where = f"{_direction(whole)} {_at_nodes(force.nodes, positions)}"
        when = "with the input" if force.during is None else _range_text(force.during)
        found.append(f"load of {size:.3g} N in all {where}, grows {when}")
    for spring in loads.springs:
        size = units.in_part("stiffness", spring.stiffness * len(spring.nodes))
        towards = _direction(spring.direction)
        found.append(f"spring of {size:.3g} N/mm {_at_nodes(spring.nodes, positions)}, {towards}")
    if loads.weight is not None:
        during = loads.weight_during
        when = "with the input" if during is None else _range_text(during)
        found.append(f"own weight {_direction(loads.weight)}, grows {when}")
    return found


def _at_nodes(nodes: NDArray[np.int64], positions: Points) -> str:
    """Return the places of few nodes, or the corners of the box that holds them."""
    own = positions[nodes]
    if len(own) <= FEW_NODES:
        return f"at {' and '.join(map(_point, own))} mm"
    low, high = _point(own.min(axis=0)), _point(own.max(axis=0))
    return f"on {len(own)} nodes between {low} and {high} mm"


def _point(position: NDArray[np.float64]) -> str:
    return f"({', '.join(f'{value:g}' for value in position.round(1) + 0.0)})"


def _direction(vectors: NDArray[np.float64]) -> str:
    """Return a direction in words, its angle in the plane, or its components in space."""
    each = np.atleast_2d(vectors)
    unit = each / np.linalg.norm(each, axis=1)[:, None]
    if (unit @ unit[0] < NAMED).any():
        return "in a direction at each node"
    for name, axis in DIRECTIONS[len(unit[0])].items():
        if unit[0] @ axis > NAMED:
            return name
    if len(unit[0]) == 2:
        return f"at {np.degrees(np.arctan2(unit[0, 1], unit[0, 0])):.0f} deg"
    return f"along ({', '.join(f'{value:.2f}' for value in unit[0])})"
