"""Routes of lattices and tasks: generate, check, read and write."""

from __future__ import annotations

import json
from typing import Any

from fastapi import APIRouter
from starlette.concurrency import run_in_threadpool

from bellcrank.errors import UnknownName
from bellcrank.machines.elementary import DIRECTIONS, elementary
from bellcrank.model import IN_SPACE, builtin, lattices, problem_to_dict
from bellcrank.model.calls import call_with_keys
from bellcrank.part import PartSpec, frame_problem
from bellcrank.web import quick_calls
from bellcrank.web.limits import check_lattice, check_size
from bellcrank.web.requests import LatticeBody, SaveBody, TableBody, TaskBody, TextBody
from bellcrank.web.state import State
from bellcrank.web.task_files import problem_of, read_task, write_task
from bellcrank.web.task_tables import bundled_table, planar_tasks, task_data, task_of

router = APIRouter(prefix="/api", tags=["tasks"])

ELEMENTARY_COLUMNS = 7
"""Number of columns of the elementary tasks offered by the page."""


@router.get("/problems")
def list_problems() -> list[dict[str, str]]:
    """Return the bundled tasks, in groups."""
    named = [
        {"name": name, "group": "Built in", "about": (make.__doc__ or "").strip().split("\n")[0]}
        for name, make in builtin.items()
        if name not in IN_SPACE
    ]
    parts = [
        {
            "name": f"elementary-{direction}",
            "group": "Parts of machines",
            "about": f"Push down on the right, move {direction} on the left.",
        }
        for direction in DIRECTIONS
    ]
    return [*named, *parts]


@router.get("/problems/{name}")
def get_problem(name: str) -> dict[str, Any]:
    """Return a bundled task."""
    if name in builtin and name not in IN_SPACE:
        return problem_to_dict(builtin[name]())
    direction = name.removeprefix("elementary-")
    if direction != name and direction in DIRECTIONS:
        return problem_to_dict(elementary(ELEMENTARY_COLUMNS, direction))
    raise UnknownName(f"there is no task {name!r}")


@router.get("/tasks")
def list_tasks() -> list[dict[str, str]]:
    """Return the bundled tasks with a specification."""
    return planar_tasks()


@router.get("/tasks/{name}")
def get_task(name: str) -> dict[str, Any]:
    """Return the table of a bundled task."""
    return bundled_table(name)


@router.post("/tasks/build")
async def build(body: TableBody) -> dict[str, Any]:
    """Return the problem, the part and the items of a table."""
    return await run_in_threadpool(lambda: task_data(task_of(body.task)))


@router.post("/lattices")
def make_lattice(body: LatticeBody) -> dict[str, Any]:
    """Generate the lattice that a table describes."""
    given = dict(body.lattice)
    check_lattice(given)
    kind = given.pop("kind", "")
    lattice = call_with_keys(lattices[kind], given, "lattice")
    check_size(lattice.node_count, lattice.beam_count)
    return {"positions": lattice.positions.tolist(), "beams": lattice.beams.tolist()}


@router.post("/tasks/read")
async def load_task(body: TextBody) -> dict[str, Any]:
    """Read a task or a design from a file."""
    problem, lattice, design = await run_in_threadpool(read_task, body.text, body.suffix)
    return {
        "problem": problem_to_dict(problem),
        "lattice": lattice,
        "mask": None if design is None else design.mask_hex,
    }


@router.post("/tasks/write")
async def save_task(body: SaveBody) -> dict[str, str]:
    """Return a task as text of a file."""

    def write() -> str:
        return write_task(problem_of(body.problem), body.lattice, body.suffix)

    return {"text": await run_in_threadpool(write)}


@router.post("/tasks/check")
async def check_task(body: TaskBody, state: State) -> dict[str, Any]:
    """Check a task and return the response of its initial design.

    For a part, the result contains the section and the material that make the task that of a
    frame; both are None for the spring model.
    """

    def as_part() -> dict[str, Any]:
        problem = problem_of(body.problem)
        if body.part is None:
            return body.problem
        frame = frame_problem(problem, PartSpec.from_dict(body.part, "part"))
        data = problem_to_dict(frame)
        return {**body.problem, "section": data["section"], "material": data["material"]}

    problem = await run_in_threadpool(as_part)
    result = {key: problem.get(key) for key in ("section", "material")} | {"response": None}
    if not state.ready:
        return result
    return {
        **result,
        **await state.pools.quick.call(quick_calls.check, json.dumps(problem), body.goals),
    }
