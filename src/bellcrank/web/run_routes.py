"""Searches: begun, followed, paused, ended."""

from __future__ import annotations

import asyncio
import json
import shutil
from pathlib import Path
from tempfile import mkdtemp
from typing import TYPE_CHECKING, Annotated, Any

from fastapi import APIRouter, WebSocket, WebSocketDisconnect
from fastapi.responses import FileResponse
from pydantic import Field
from starlette.background import BackgroundTask
from starlette.concurrency import run_in_threadpool

from bellcrank.errors import BellcrankError, InvalidSettings, UnknownName
from bellcrank.model import human_design, problem_to_dict
from bellcrank.web import solving, tracing
from bellcrank.web.jobs import Record
from bellcrank.web.pools import plain_error
from bellcrank.web.state import Shop
from bellcrank.web.tables import RunBody
from bellcrank.web.texts import problem_of

if TYPE_CHECKING:
    from bellcrank.model import Problem
    from bellcrank.web.jobs import Job
    from bellcrank.web.state import Workshop

HISTORY = "history.parquet"
router = APIRouter(prefix="/api/runs", tags=["runs"])

RunName = Annotated[str, Field(pattern=r"^[a-z0-9]{12}$")]
INTERVAL = 0.1
"""Seconds between two messages to a page."""


@router.get("")
def list_runs(shop: Shop) -> list[dict[str, Any]]:
    """All searches, the latest first."""
    return [{**job.summary(), "place": shop.scheduler.place(job)} for job in shop.jobs]


@router.post("", status_code=201)
async def begin_run(body: RunBody, shop: Shop) -> dict[str, str]:
    """Queue a search."""
    problem, record = await run_in_threadpool(_prepared, body)
    job = shop.jobs.add(problem, record)
    shop.scheduler.add(job)
    return {"id": job.name}


def _prepared(body: RunBody) -> tuple[Problem, Record]:
    """Refuse what could not be searched, before it is queued."""
    from bellcrank.model import unpack_mask
    from bellcrank.part import PartSpec
    from bellcrank.search import read_settings
    from bellcrank.search.constraints import parse_goal

    problem = problem_of(body.problem)
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
    part = None
    if body.part is not None:
        spec = PartSpec.from_dict(body.part)
        spec.of(problem.full_design())
        part = spec.to_dict()
    if body.reference is not None:
        unpack_mask(body.reference, problem.lattice.beam_count)
    record = Record(
        title=body.title,
        session=body.session,
        settings=json.loads(json.dumps(settings.to_dict())),
        part=part,
        reference=body.reference,
    )
    return problem, record


@router.get("/{name}")
async def get_run(name: RunName, shop: Shop) -> dict[str, Any]:
    """Return a search with its task, what it is compared with, and its design if there is one."""
    job = shop.jobs[name]
    problem, design = await run_in_threadpool(lambda: (job.problem(), job.design()))
    text = json.dumps(problem_to_dict(problem))
    return {
        **job.summary(),
        "place": shop.scheduler.place(job),
        "problem": problem_to_dict(problem),
        "mask": None if design is None else design.mask_hex,
        "provenance": {} if design is None else json.loads(json.dumps(dict(design.provenance))),
        "comparison": await _comparison(shop, job, problem, text),
    }


async def _comparison(
    shop: Workshop, job: Job, problem: Problem, text: str
) -> dict[str, Any] | None:
    """Return a design by hand for the same task: the person's own, or the one that comes along."""
    if job.record.reference is not None:
        title, mask = "yours", job.record.reference
    else:
        human = human_design(problem.name)
        same = human is not None and len(human.mask) == problem.lattice.beam_count
        if (
            human is None
            or not same
            or not (human.problem.lattice.beams == problem.lattice.beams).all()
        ):
            return None
        title, mask = "by hand", human.mask_hex
    response = await shop.pools.quick.call(solving.respond, text, mask)
    return {"title": title, "mask": mask, "efficiency": response["efficiency"]}


@router.post("/{name}/pause")
def pause_run(name: RunName, shop: Shop) -> dict[str, str]:
    """Let a search rest."""
    shop.scheduler.pause(shop.jobs[name])
    return {"id": name}


@router.post("/{name}/resume")
async def resume_run(name: RunName, shop: Shop) -> dict[str, str]:
    """Go on with a search."""
    shop.scheduler.add(shop.jobs[name])
    return {"id": name}


@router.post("/{name}/stop")
async def stop_run(name: RunName, shop: Shop) -> dict[str, str]:
    """End a search and take the best it has found."""
    shop.scheduler.stop(shop.jobs[name])
    return {"id": name}


@router.delete("/{name}")
async def delete_run(name: RunName, shop: Shop) -> dict[str, str]:
    """Delete a search that does not run."""
    if name in shop.scheduler.running:
        raise InvalidSettings("this search is running; stop it first")
    job = shop.jobs[name]
    if job in shop.scheduler.queue:
        shop.scheduler.queue.remove(job)
    await run_in_threadpool(shop.jobs.remove, name)
    return {"id": name}


@router.get("/{name}/history.parquet", response_class=FileResponse)
async def get_history(name: RunName, shop: Shop) -> FileResponse:
    """Return every proposal of a search that has ended, or rests."""
    job = shop.jobs[name]
    if name in shop.scheduler.running:
        raise InvalidSettings("this search is running; stop it first, or let it rest")
    run = job.path / "run"
    media = "application/vnd.apache.parquet"
    if (run / HISTORY).is_file():
        return FileResponse(run / HISTORY, media_type=media)
    if not (run / "run.json").is_file():
        raise UnknownName("this search has not begun, and has no history")
    folder = Path(await run_in_threadpool(mkdtemp, prefix="bellcrank-"))
    clean = BackgroundTask(shutil.rmtree, folder, ignore_errors=True)
    try:
        await shop.pools.slow.call(tracing.copy_history, run, folder)
    except BaseException:
        await clean()
        raise
    return FileResponse(folder / HISTORY, media_type=media, background=clean)


@router.websocket("/{name}/live")
async def follow(socket: WebSocket, name: str, shop: Shop) -> None:
    """Tell how a search goes, ten times a second while there is news."""
    await socket.accept()
    try:
        job = shop.jobs[name]
    except BellcrankError as error:
        await socket.send_text(json.dumps({"error": plain_error(error)}))
        await socket.close()
        return
    listening = asyncio.create_task(_until_left(socket))
    loading = asyncio.create_task(_load_curves(shop, job))
    try:
        seen: dict[int, int] = {}
        epoch, changed = -1, -1
        while not listening.done():
            if job.changed != changed:
                changed = job.changed
                reset = job.trace.epoch != epoch
                if reset:
                    epoch, seen = job.trace.epoch, {}
                news = _news(shop, job, job.trace.since(seen), reset=reset)
                await socket.send_text(json.dumps(news, separators=(",", ":")))
            await asyncio.wait([listening], timeout=INTERVAL)
    except (WebSocketDisconnect, RuntimeError):
        pass
    finally:
        listening.cancel()
        loading.cancel()


async def _until_left(socket: WebSocket) -> None:
    """Return when the page is gone."""
    while (await socket.receive())["type"] != "websocket.disconnect":
        pass


async def _load_curves(shop: Workshop, job: Job) -> None:
    """Read what a search did under an earlier server, once."""
    if job.known_trace:
        return
    job.known_trace = True
    try:
        read = await shop.pools.thorough.call(tracing.read_run_curves, job.path / "run")
    except BellcrankError:
        job.known_trace = False
        return
    except asyncio.CancelledError:
        job.known_trace = False
        raise
    later = job.trace.chains
    for chain, points in read["curves"].items():
        known = points[-1][0] if points else 0
        fresh = [point for point in later.get(chain, []) if point[0] > known]
        later[chain] = [*points, *fresh]
    job.trace.epoch += 1
    job.changed += 1


def _news(
    shop: Workshop, job: Job, points: dict[int, list[tracing.Point]], *, reset: bool
) -> dict[str, Any]:
    summary = job.summary()
    told = job.told if job.record.status == "running" else {}
    return {
        "run": {**summary, "place": shop.scheduler.place(job)},
        "reset": reset,
        "points": points,
        "chains": job.told.get("chains", {}),
        "speed": told.get("speed"),
        "left": told.get("left"),
        "tried": told.get("tried"),
        "moved": job.moved,
    }
