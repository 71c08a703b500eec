"""Routes of tasks: bundled ones, build, read and write."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter
from starlette.concurrency import run_in_threadpool

from bellcrank.part import PartSpec
from bellcrank.task.schema import SCHEMA
from bellcrank.web.requests import ProblemBody, TableBody, TextBody
from bellcrank.web.state import State
from bellcrank.web.task_files import problem_of, read_region, read_upload, to_toml
from bellcrank.web.task_pictures import task_pictures
from bellcrank.web.task_tables import (
    bundled_table,
    known_tasks,
    plain_table,
    table_of,
    task_data,
)

router = APIRouter(prefix="/api/tasks", tags=["tasks"])


@router.get("")
def list_tasks() -> list[dict[str, str]]:
    """Return name and description of the bundled tasks."""
    return known_tasks()


@router.get("/pictures")
async def list_pictures() -> list[dict[str, Any]]:
    """Return small pictures of the bundled tasks."""
    return await run_in_threadpool(task_pictures)


@router.post("/build")
async def build(body: TableBody) -> dict[str, Any]:
    """Return the problem, the part, the nodes of all regions and the items of a task."""
    return await run_in_threadpool(task_data, body.task)


@router.post("/read")
async def read_file(body: TextBody, state: State) -> dict[str, Any]:
    """Read a task, a problem or a design; a design is stored in the gallery."""

    def read() -> dict[str, Any]:
        table, design = read_upload(body.text, body.suffix)
        if design is None:
            return {"task": table, "design": None}
        key = state.saved.add(design, design.problem.name)
        return {"task": None, "design": {"source": state.saved.name, "key": key}}

    return await run_in_threadpool(read)


@router.post("/region")
async def read_drawing(body: TextBody) -> dict[str, Any]:
    """Return the region inside the closed curves of a DXF or SVG file."""
    return await run_in_threadpool(read_region, body.text, body.suffix)


@router.post("/write")
async def write_file(body: TableBody) -> dict[str, str]:
    """Return a task as the text of a task file."""

    def write() -> str:
        return to_toml({"schema": SCHEMA, **plain_table(body.task)})

    return {"text": await run_in_threadpool(write)}


@router.post("/from-problem")
async def from_problem(body: ProblemBody) -> dict[str, Any]:
    """Return a task on the lattice of a problem, with its supports, input and output."""

    def convert() -> dict[str, Any]:
        part = PartSpec.from_dict(body.part, "part")
        return plain_table(table_of(problem_of(body.problem), part))

    return await run_in_threadpool(convert)


@router.get("/{name}")
def get_task(name: str) -> dict[str, Any]:
    """Return the table of a bundled task."""
    return bundled_table(name)
