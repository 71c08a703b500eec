"""Routes of searches: start, follow, pause, resume, stop, delete."""

from __future__ import annotations

import asyncio
import json
import shutil
from dataclasses import replace
from pathlib import Path
from tempfile import mkdtemp
from typing import TYPE_CHECKING, Annotated, Any

from fastapi import APIRouter, WebSocket, WebSocketDisconnect
from fastapi.responses import FileResponse
from pydantic import Field
from starlette.background import BackgroundTask
from starlette.concurrency import run_in_threadpool

from bellcrank.errors import BellcrankError, InvalidSettings, UnknownName
from bellcrank.model import human_counterpart, problem_to_dict
from bellcrank.storage.history import HISTORY
from bellcrank.web import curves, quick_calls
from bellcrank.web.errors import plain_error
from bellcrank.web.jobs import Record
from bellcrank.web.requests import RunBody
from bellcrank.web.state import State
from bellcrank.web.task_files import problem_of
from bellcrank.web.task_tables import table_in, task_of

if TYPE_CHECKING:
    from bellcrank.model import Problem
    from bellcrank.web.jobs import Job
    from bellcrank.web.state import AppState

router = APIRouter(prefix="/api/runs", tags=["runs"])

RunName = Annotated[str, Field(pattern=r"^[a-z0-9]{12}$")]
REFINEMENT = {"search": "refinement", "steps": 1000, "chains": 1, "seed": 0, "goals": []}
"""Settings of a refinement; its steps are the largest number of geometries."""
INTERVAL = 0.1
"""Seconds between two messages to a client."""


@router.get("")
def list_runs(state: State) -> list[dict[str, Any]]:
    """Return all searches, the latest first."""
    return [{**job.summary(), "place": state.scheduler.position(job)} for job in state.jobs]


@router.post("", status_code=201)
async def start_run(body: RunBody, state: State) -> dict[str, str]:
    """Queue a search."""
    problem, record = await run_in_threadpool(validated, body)
    job = state.jobs.add(problem, record)
    state.scheduler.add(job)
    return {"id": job.name}


def validated(body: RunBody) -> tuple[Problem, Record]:
    """Return problem and record of a request; an invalid one is refused before it is queued."""
    from bellcrank.model import Design, unpack_mask
    from bellcrank.part import PartSpec, frame_problem
    from bellcrank.search import read_settings
    from bellcrank.search.constraints import parse_goal
    from bellcrank.workflows.tolerance import with_tolerances

    task = None if body.task is None else task_of(table_in(body.task))
    problem = problem_of(body.problem or {}) if task is None else task.problem
    settings = read_settings(
        {
            "search": body.method,
            "steps": body.steps,
            "chains": body.chains,
            "seed": body.seed,
            "goals": body.goals,
        }
    )
    for goal in body.goals:
        parse_goal(goal).constraint(problem)
    spec = None if task is None else task.part
    if body.part is not None:
        spec = PartSpec.from_dict(body.part)
        if not problem.is_specified:  # else the problem is of its part already
            problem = frame_problem(problem, spec)
    if spec is not None:
        spec.of(problem.full_design())
    if body.reference is not None:
        unpack_mask(body.reference, problem.lattice.beam_count)
    if body.start is not None:
        problem = replace(problem, initial=unpack_mask(body.start, problem.lattice.beam_count))
    if body.refine and not problem.is_specified:
        raise InvalidSettings("a refinement needs a specification: ask for something of an output")
    if body.tolerant:
        design = Design(problem, problem.initial)
        problem = with_tolerances(design, spec or PartSpec()).problem
    plain = json.loads(json.dumps(settings.to_dict()))
    record = Record(
        title=body.title,
        session=body.session,
        settings=REFINEMENT if body.refine else plain,
        part=None if spec is None else spec.to_dict(),
        task=body.task,
        reference=body.reference,
        refine=body.refine,
    )
    return problem, record


@router.get("/{name}")
async def get_run(name: RunName, state: State) -> dict[str, Any]:
    """Return a search with its task, its comparison and, if there is one, its design.

    The problem is that of the design, whose nodes a refinement has moved.
    """
    job = state.jobs[name]
    problem, design = await run_in_threadpool(lambda: (job.problem(), job.design()))
    text = json.dumps(problem_to_dict(problem))
    return {
        **job.summary(),
        "place": state.scheduler.position(job),
        "problem": problem_to_dict(problem if design is None else design.problem),
        "mask": None if design is None else design.mask_hex,
        "task": job.record.task,
        "provenance": {} if design is None else json.loads(json.dumps(dict(design.provenance))),
        "comparison": await _comparison(state, job, problem, text),
    }


async def _comparison(
    state: AppState, job: Job, problem: Problem, text: str
) -> dict[str, Any] | None:
    """Return a design by hand for the same task: the user's own, or else the bundled one."""
    if job.record.reference is not None:
        title, mask = "yours", job.record.reference
    else:
        human = human_counterpart(problem)
        if human is None:
            return None
        title, mask = "by hand", human.mask_hex
    response = await state.pools.quick.call(quick_calls.evaluate, text, mask)
    return {"title": title, "mask": mask, "efficiency": response["efficiency"]}


@router.post("/{name}/pause")
def pause_run(name: RunName, state: State) -> dict[str, str]:
    """Pause a search."""
    state.scheduler.pause(state.jobs[name])
    return {"id": name}


@router.post("/{name}/resume")
async def resume_run(name: RunName, state: State) -> dict[str, str]:
    """Resume a search."""
    state.scheduler.add(state.jobs[name])
    return {"id": name}


@router.post("/{name}/stop")
async def stop_run(name: RunName, state: State) -> dict[str, str]:
    """Stop a search and choose its best design."""
    state.scheduler.stop(state.jobs[name])
    return {"id": name}


@router.delete("/{name}")
async def delete_run(name: RunName, state: State) -> dict[str, str]:
    """Delete a search that is not running."""
    if name in state.scheduler.running:
        raise InvalidSettings("this search is running; stop it first")
    job = state.jobs[name]
    if job in state.scheduler.queue:
        state.scheduler.queue.remove(job)
    await run_in_threadpool(state.jobs.remove, name)
    return {"id": name}


@router.get("/{name}/history.parquet", response_class=FileResponse)
async def get_history(name: RunName, state: State) -> FileResponse:
    """Return all proposals of a search that has ended or is paused."""
    job = state.jobs[name]
    if name in state.scheduler.running:
        raise InvalidSettings("this search is running; stop or pause it first")
    run = job.path / "run"
    media = "application/vnd.apache.parquet"
    if (run / HISTORY).is_file():
        return FileResponse(run / HISTORY, media_type=media)
    if not (run / "run.json").is_file():
        raise UnknownName("this search has not started and has no history")
    folder = Path(await run_in_threadpool(mkdtemp, prefix="bellcrank-"))
    clean = BackgroundTask(shutil.rmtree, folder, ignore_errors=True)
    try:
        await state.pools.files.call(curves.copy_history, run, folder)
    except BaseException:
        await clean()
        raise
    return FileResponse(folder / HISTORY, media_type=media, background=clean)


@router.websocket("/{name}/live")
async def follow(socket: WebSocket, name: str, state: State) -> None:
    """Send the state of a search, at most ten times a second, whenever it has changed."""
    await socket.accept()
    try:
        job = state.jobs[name]
    except BellcrankError as error:
        await socket.send_text(json.dumps({"error": plain_error(error)}))
        await socket.close()
        return
    closed = asyncio.create_task(_until_closed(socket))
    loading = asyncio.create_task(_load_curves(state, job))
    try:
        seen: dict[int, int] = {}
        epoch, changed, moved = -1, -1, None
        while not closed.done():
            if job.changed != changed:
                changed = job.changed
                reset = job.curves.epoch != epoch
                if reset:
                    epoch, seen = job.curves.epoch, {}
                message = _live_state(state, job, job.curves.since(seen), reset=reset)
                # The displayed design has some ten kilobytes: it is sent when it is another one.
                message["moved"] = None if job.moved is moved else job.moved
                moved = job.moved
                await socket.send_text(json.dumps(message, separators=(",", ":")))
            await asyncio.wait([closed], timeout=INTERVAL)
    except (WebSocketDisconnect, RuntimeError):
        pass
    finally:
        closed.cancel()
        loading.cancel()


async def _until_closed(socket: WebSocket) -> None:
    """Return when the client has closed the connection."""
    while (await socket.receive())["type"] != "websocket.disconnect":
        pass


async def _load_curves(state: AppState, job: Job) -> None:
    """Read the curves of a search that ran under an earlier server, once."""
    if job.curves_loaded:
        return
    job.curves_loaded = True
    try:
        read = await state.pools.thorough.call(curves.read_run_curves, job.path / "run")
    except BellcrankError:
        job.curves_loaded = False
        return
    except asyncio.CancelledError:
        job.curves_loaded = False
        raise
    later = job.curves.chains
    for chain, points in read["curves"].items():
        known = points[-1][0] if points else 0
        fresh = [point for point in later.get(chain, []) if point[0] > known]
        later[chain] = [*points, *fresh]
    job.curves.epoch += 1
    job.changed += 1


def _live_state(
    state: AppState, job: Job, points: dict[int, list[curves.Point]], *, reset: bool
) -> dict[str, Any]:
    summary = job.summary()
    progress = job.progress if job.record.status == "running" else {}
    return {
        "run": {**summary, "place": state.scheduler.position(job)},
        "reset": reset,
        "points": points,
        "chains": job.progress.get("chains", {}),
        "speed": progress.get("speed"),
        "left": progress.get("left"),
        "tried": progress.get("tried"),
        "refined": progress.get("refined"),
    }
