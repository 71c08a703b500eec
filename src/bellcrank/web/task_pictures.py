"""Small pictures of the bundled tasks."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.task import find_task
from bellcrank.web.gallery import picture_of, projected
from bellcrank.web.task_tables import ELEMENT, known_tasks

if TYPE_CHECKING:
    from collections.abc import Iterator

    from bellcrank.model import Problem
    from bellcrank.model.conditions import Input, Output

DIGITS = 2
"""Digits of the coordinates, lattice units."""


@cache
def task_pictures() -> list[dict[str, Any]]:
    """Return name, description and picture of the bundled tasks without parts of machines.

    A picture has the lattice, and supports, inputs and outputs of all load cases; ``arrows`` are
    x, y and the components of each direction of inputs, and of outputs unless their rotation
    counts.
    """
    return [_picture(each) for each in known_tasks() if not each["name"].startswith(ELEMENT)]


def _picture(about: dict[str, str]) -> dict[str, Any]:
    task = find_task(about["name"])
    assert task is not None
    problem = task.problem
    cases = problem.cases.values()
    wanted = problem.specification
    assert wanted is not None
    turning = {each.item.output for each in wanted.maximise if each.item.quantity == "rotation"}
    inputs = [case.input for case in cases]
    outputs = [each for case in cases for each in case.outputs.values()]
    moving = [each for case in cases for name, each in case.outputs.items() if name not in turning]
    picture = picture_of(
        problem,
        problem.full_design().mask,
        {
            "supports": np.unique(np.concatenate([case.supports.nodes for case in cases])),
            "input": np.unique(np.concatenate([each.nodes for each in inputs])),
            "output": np.unique(np.concatenate([each.nodes for each in outputs])),
        },
    )
    arrows = {
        name: [arrow for each in sections for arrow in _arrows(problem, each)]
        for name, sections in (("input", inputs), ("output", moving))
    }
    return {**about, "picture": picture, "arrows": arrows}


def _arrows(problem: Problem, section: Input | Output) -> Iterator[list[float]]:
    """Generate place and direction, as drawn, of an arrow for the nodes of each direction."""
    directions, group = np.unique(section.direction.round(4), axis=0, return_inverse=True)
    for k, direction in enumerate(directions):
        middle = problem.lattice.positions[section.nodes[group.ravel() == k]].mean(axis=0)
        start, end = projected(np.stack([middle, middle + direction]))
        yield np.concatenate([start, end - start]).round(DIGITS).tolist()
