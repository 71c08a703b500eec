"""Tasks of the page: tables as in task files, in mm, N and g."""

from __future__ import annotations

import math
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidFile, InvalidProblem, InvalidSettings, UnknownName
from bellcrank.machines.elementary import DIRECTIONS, elementary
from bellcrank.model import builtin, problem_to_dict
from bellcrank.model.parsing import parse, read_table
from bellcrank.part import PartSpec, frame_problem
from bellcrank.search import SpecificationEvaluator
from bellcrank.task import Task, TaskTable, build_task, bundled_tasks, lattice_of, units_of
from bellcrank.task.build import NARROWEST
from bellcrank.task.domain import region_of
from bellcrank.task.shapes import nodes_at
from bellcrank.web.errors import plain_error
from bellcrank.web.items import wanted_items
from bellcrank.web.limits import NODES, check_lattice, check_size
from bellcrank.workflows.condition_texts import texts_of_cases

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from bellcrank.model import Lattice, Problem

PLANE = 2
"""Number of lengths of a domain in the plane."""
DENSITY = {2: 2.0 / math.sqrt(3.0), 3: math.sqrt(2.0)}
"""Nodes of a triangular lattice in the square of its spacing, of an octet lattice in its cube."""
LARGEST_RATIO = 4.0
"""Ratio of the nodes in the bounds of a domain to the limit above which it is not filled."""
ELEMENT = "element-"
"""Start of the names of tasks for parts of machines."""
ELEMENT_COLUMNS = 7
"""Number of columns of their lattices."""


def known_tasks() -> list[dict[str, str]]:
    """Return name, kind and description of the bundled tasks, and of parts of machines.

    Tasks in the plane come first.
    """
    tables = {name: read_table(path) for name, path in bundled_tasks().items()}
    found = [
        {
            "name": name,
            "kind": "in space" if _is_in_space(table["domain"]) else "in the plane",
            "about": table.get("description", ""),
        }
        for name, table in sorted(tables.items(), key=lambda item: _is_in_space(item[1]["domain"]))
    ]
    parts = [
        {
            "name": ELEMENT + direction,
            "kind": "parts of machines",
            "about": f"Part of a machine: push down on the right, move {direction} on the left.",
        }
        for direction in DIRECTIONS
    ]
    return [*found, *parts]


def _is_in_space(domain: Mapping[str, Any]) -> bool:
    return len(domain.get("size", ())) > PLANE


def bundled_table(name: str) -> dict[str, Any]:
    """Return the table of a bundled task.

    Raises
    ------
    UnknownName
    """
    if name not in {each["name"] for each in known_tasks()}:
        raise UnknownName(f"there is no task {name!r}")
    if name.startswith(ELEMENT):
        problem = elementary(ELEMENT_COLUMNS, name.removeprefix(ELEMENT))
        return plain_table({**table_of(problem, PartSpec()), "name": name})
    return plain_table(read_table(bundled_tasks()[name]), name)


def plain_table(data: Mapping[str, Any], source: str = "task") -> dict[str, Any]:
    """Return a table with lengths in mm, forces in N, angles in degrees and ratios as numbers.

    What is wanted of outputs keeps its units.

    Examples
    --------
    >>> plain_table({"name": "a", "domain": {"size": ["6cm", 50]}, "cases": []})
    {'name': 'a', 'domain': {'size': [60.0, 50.0]}, 'cases': []}
    """
    table: dict[str, Any] = parse(TaskTable, data, source).model_dump(
        by_alias=True, exclude_none=True, exclude_defaults=True, mode="json"
    )
    for case in table["cases"]:
        for load in case.get("loads", ()):
            if "force" in load:
                load["force"] = f"{load['force']!r} N"  # a load has to have its unit
    return table


def table_of(problem: Problem, part: PartSpec) -> dict[str, Any]:
    """Return a task on the lattice of a problem, with its supports, input and output.

    The gain of the output is maximised. Items of a specification, other load cases and rules for
    single beams are left out.
    """
    frame = problem if problem.section is not None else frame_problem(problem, part)
    units = units_of(frame, part)
    lattice, supports = problem.lattice, problem.supports
    held = {
        "all": supports.fixed,
        "x": supports.fixed_x,
        "y": supports.fixed_y,
        "z": supports.fixed_z,
    }
    given, output = problem.input, problem.output
    if given.drive == "displacement":
        drive = {"displacement": units.in_part("length", given.amount)}
    else:
        drive = {"force": units.in_part("force", given.amount * len(given.nodes))}
    wanted: dict[str, Any] = {"gain": [{"value": "maximise"}]}
    if output.spring is not None:
        wanted["spring"] = units.in_part("stiffness", output.spring * len(output.nodes))
    return {
        "name": problem.name,
        "part": {
            key: value
            for key, value in part.to_dict().items()
            if key in {"width", "thickness", "material"}
        }
        | {"spacing": part.scale},
        "domain": {
            "lattice": {
                "kind": "nodes",
                "positions": lattice.positions.tolist(),
                "beams": lattice.beams.tolist(),
            }
        },
        "supports": [
            {"at": [{"nodes": nodes.tolist()}], "hold": hold}
            for hold, nodes in held.items()
            if len(nodes)
        ],
        "cases": [
            {
                "inputs": [
                    {"at": [{"nodes": nodes}], "direction": direction, **drive}
                    for direction, nodes in _by_direction(given.nodes, given.direction)
                ],
                "outputs": [
                    {
                        "at": [{"nodes": output.nodes.tolist()}],
                        "direction": output.direction.mean(axis=0).tolist(),
                        **wanted,
                    }
                ],
            }
        ],
    }


def _by_direction(
    nodes: NDArray[np.int64], directions: NDArray[np.float64]
) -> list[tuple[list[float], list[int]]]:
    """Return the nodes of each direction."""
    found: dict[tuple[float, ...], list[int]] = {}
    for node, direction in zip(nodes.tolist(), directions.tolist(), strict=True):
        found.setdefault(tuple(direction), []).append(node)
    return [(list(direction), each) for direction, each in found.items()]


def table_in(data: Mapping[str, Any]) -> TaskTable:
    """Return the table of a task of a request.

    Raises
    ------
    InvalidFile
        Also if it refers to a file, or is too large for the page.
    """
    table = parse(TaskTable, data, "task")
    if isinstance(table.domain.outline, str):
        raise InvalidFile("domain.outline: expected corners or a shape, not the name of a file")
    check_lattice(table.domain.lattice)
    _check_domain(table)
    return table


def task_of(table: TaskTable) -> Task:
    """Return the task of a table that `table_in` accepts, which a search can start with.

    Raises
    ------
    InvalidFile, InvalidProblem
    """
    task = build_task(table)
    check_size(task.problem.lattice.node_count, task.problem.lattice.beam_count)
    try:
        SpecificationEvaluator(task.problem)
    except InvalidSettings as error:  # the lattice is not as symmetric as the limits ask
        raise InvalidProblem(str(error)) from None
    return task


def _check_domain(table: TaskTable) -> None:
    """Refuse a domain for too many nodes before it is filled."""
    domain = table.domain
    is_filled = domain.size is not None or domain.outline is not None
    if not is_filled or not table.part.spacing >= NARROWEST:
        return  # `build_task` refuses the spacing
    if domain.size is not None and len(domain.size) > PLANE:
        lengths = tuple(domain.size)
    else:
        left, bottom, right, top = region_of(domain, Path()).bounds
        lengths = right - left, top - bottom
    dimension = len(lengths)
    nodes = DENSITY[dimension] * math.prod(lengths) / table.part.spacing**dimension
    if not nodes <= LARGEST_RATIO * NODES:
        raise InvalidFile(
            f"domain: about {nodes:.0f} nodes; the limit of the page is {NODES}; choose a smaller "
            "part or a larger spacing"
        )


def task_data(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return a task as the page draws it.

    Returns
    -------
    dict
        ``lattice`` and ``part``; ``regions``, the nodes of each table with a region; ``missing``,
        the key of the first table without one; ``fault``, why there is no problem; ``problem`` and
        its ``items``; ``conditions``, the inputs and loads of each load case in words.

    Raises
    ------
    InvalidFile, InvalidProblem
        If there is no lattice.
    """
    table = table_in(data)
    lattice, part = lattice_of(table)
    check_size(lattice.node_count, lattice.beam_count)
    missing = _missing(table)
    found: dict[str, Any] = {
        "lattice": {"positions": lattice.positions.tolist(), "beams": lattice.beams.tolist()},
        "part": part.to_dict(),
        "regions": _regions(table, lattice, part),
        "missing": missing,
        "fault": None,
        "problem": None,
        "items": [],
        "conditions": [],
    }
    if missing is None:
        try:
            task = task_of(table)
        except (InvalidFile, InvalidProblem) as error:
            found["fault"] = plain_error(error)
        else:
            found["problem"] = problem_to_dict(task.problem)
            found["items"] = wanted_items(task.problem, task.part)
            found["conditions"] = [
                {"case": name, "texts": texts}
                for name, texts in texts_of_cases(task.problem, task.part).items()
            ]
    return found


def _missing(table: TaskTable) -> str | None:
    """Return the key of the first table that has no region yet."""
    is_free = table.domain.problem is None
    if is_free and not table.supports and not all(case.supports for case in table.cases):
        return "supports"
    given = {f"supports[{k}]": each.at for k, each in enumerate(table.supports)}
    for c, case in enumerate(table.cases):
        if is_free and not case.inputs:
            return f"cases[{c}].inputs"
        if not case.outputs:
            return f"cases[{c}].outputs"
        for name in ("supports", "inputs", "outputs", "loads"):
            for k, each in enumerate(getattr(case, name)):
                given[f"cases[{c}].{name}[{k}]"] = each.at
    return next((key for key, at in given.items() if not at and (is_free or at is not None)), None)


def _regions(table: TaskTable, lattice: Lattice, part: PartSpec) -> dict[str, Any]:
    """Return the nodes of all regions of a task, in the order of its tables."""
    positions = lattice.positions * part.scale
    spacing = part.scale * float(np.median(lattice.rest_length))
    base = None if table.domain.problem is None else builtin[table.domain.problem]()

    def nodes(section: Any, usual: Sequence[int] = ()) -> list[int]:
        if section.at is None:
            return list(usual)
        if not section.at:
            return []
        with suppress(InvalidProblem):  # `build_task` gives the reason
            found: list[int] = nodes_at(section.at, positions, spacing, "at").tolist()
            return found
        return []

    given = [] if base is None else base.input.nodes.tolist()
    moved = [] if base is None else base.output.nodes.tolist()
    held = [] if base is None else base.supports.fixed.tolist()
    return {
        "supports": [nodes(each) for each in table.supports],
        "given": {"input": given, "output": moved, "supports": held},
        "cases": [
            {
                "inputs": [nodes(each, given) for each in case.inputs],
                "outputs": [nodes(each, moved) for each in case.outputs],
                "loads": [nodes(each) for each in case.loads],
                "supports": [nodes(each) for each in case.supports],
            }
            for case in table.cases
        ],
    }
