"""Tasks of the page: tables as in task files, in mm, N and g."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from bellcrank.errors import InvalidFile, UnknownName
from bellcrank.model import problem_to_dict, require_plane
from bellcrank.model.parsing import parse, read_table
from bellcrank.task import Task, TaskTable, build_task, bundled_tasks, units_of
from bellcrank.web.limits import NODES, check_lattice, check_size
from bellcrank.workflows.specification import item_label, wanted_text

if TYPE_CHECKING:
    from collections.abc import Mapping

    from bellcrank.model import Problem
    from bellcrank.part import PartSpec
    from bellcrank.task.schema import Shape

NODES_PER_AREA = 2.0 / math.sqrt(3.0)
"""Nodes of a triangular lattice in the square of its spacing."""


def planar_tasks() -> list[dict[str, str]]:
    """Return name and description of the bundled tasks in the plane."""
    found = []
    for name, path in bundled_tasks().items():
        table = read_table(path)
        if len(table["domain"].get("size", ())) != 3:
            found.append({"name": name, "about": table.get("description", "")})
    return found


def bundled_table(name: str) -> dict[str, Any]:
    """Return the table of a bundled task.

    Raises
    ------
    UnknownName
    """
    if name not in {each["name"] for each in planar_tasks()}:
        raise UnknownName(f"there is no task {name!r}")
    return read_table(bundled_tasks()[name])


def task_of(data: Mapping[str, Any]) -> Task:
    """Return the task of a table of a request.

    Raises
    ------
    InvalidFile, InvalidProblem
        Also if it refers to a file, or is too large for the page.
    """
    table = parse(TaskTable, data, "task")
    domain = table.domain
    if isinstance(domain.outline, str):
        raise InvalidFile("domain.outline: expected corners or a shape, not the name of a file")
    check_lattice(domain.lattice)
    _check_area(table)
    task = build_task(table)
    check_size(task.problem.lattice.node_count, task.problem.lattice.beam_count)
    require_plane(task.problem, "task")
    return task


def _check_area(table: TaskTable) -> None:
    """Refuse a domain that would be filled with too many nodes, before it is filled."""
    domain = table.domain
    size = domain.size
    if size is None and domain.outline is not None:
        size = _extent(domain.outline)
    if size is None or len(size) != 2:
        return
    nodes = NODES_PER_AREA * size[0] * size[1] / table.part.spacing**2
    if not nodes <= 4.0 * NODES:
        raise InvalidFile(
            f"domain: about {nodes:.0f} nodes; the limit of the page is {NODES}; choose a smaller "
            "part or a larger spacing"
        )


def _extent(outline: Any) -> tuple[float, float] | None:
    """Return width and height of an outline; None if it is not valid."""
    from bellcrank.task.schema import Shape

    try:
        shape = parse(
            Shape, outline if isinstance(outline, dict) else {"polygon": outline}, "domain.outline"
        )
    except InvalidFile:
        return None  # `build_task` gives the reason
    return _size_of(shape)


def _size_of(shape: Shape) -> tuple[float, float] | None:
    if shape.circle is not None and shape.radius is not None:
        return 2.0 * shape.radius, 2.0 * shape.radius
    if shape.box is not None and len(shape.box) == 4:
        return shape.box[2] - shape.box[0], shape.box[3] - shape.box[1]
    if shape.polygon:
        xs, ys = zip(*(point[:2] for point in shape.polygon), strict=True)
        return max(xs) - min(xs), max(ys) - min(ys)
    return None


def task_data(task: Task) -> dict[str, Any]:
    """Return a task as the page draws it: its problem, its part and what is wanted."""
    return {
        "problem": problem_to_dict(task.problem),
        "part": task.part.to_dict(),
        "description": task.description,
        "items": wanted_items(task.problem, task.part),
    }


def wanted_items(problem: Problem, part: PartSpec) -> list[dict[str, str]]:
    """Return name, label and bounds of the items of a specification; none without one."""
    if problem.specification is None:
        return []
    units = units_of(problem, part)
    return [
        {
            "name": item.name,
            "label": item_label(item, problem),
            "wanted": wanted_text(item, units),
        }
        for item in problem.specification.items
    ]
