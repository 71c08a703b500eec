"""Routes of designs: motion, sensitivity, parts, files, gallery, machines, live editing."""

from __future__ import annotations

import json
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

from fastapi import APIRouter, WebSocket, WebSocketDisconnect
from fastapi.responses import Response
from starlette.concurrency import run_in_threadpool

from bellcrank.errors import BellcrankError, InvalidFile
from bellcrank.fem import levels
from bellcrank.model import Design, unpack_mask
from bellcrank.provenance import provenance
from bellcrank.web import quick_calls, slow_calls
from bellcrank.web.errors import plain_error
from bellcrank.web.gallery import design_data, entry_named
from bellcrank.web.limits import MESSAGE
from bellcrank.web.page_files import page_files
from bellcrank.web.requests import (
    ComputationsBody,
    DesignBody,
    FemBody,
    FileBody,
    FileSuffix,
    GripBody,
    MotionBody,
    PartBody,
    PlanBody,
    SaveDesignBody,
    StopBody,
)
from bellcrank.web.state import State
from bellcrank.web.task_files import problem_of

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from bellcrank.web.pools import Pool
    from bellcrank.web.state import AppState

router = APIRouter(prefix="/api", tags=["designs"])
CODE = [provenance()[key] for key in ("version", "commit")]
"""The code that computes: stored results of another one are not used."""
WITH_SHARE = (slow_calls.validation, slow_calls.tolerance)
"""Slow computations that write the fraction that is done."""


async def _computed(
    state: AppState,
    pool: Pool,
    function: Callable[..., dict[str, Any]],
    body: DesignBody,
    *more: Any,
) -> dict[str, Any]:
    """Return the result of a function of a problem as text, a mask and further arguments."""
    text = json.dumps(body.problem)
    key = function.__name__, text, body.mask, json.dumps(more, sort_keys=True)
    return await state.results.get(key, lambda: pool.call(function, text, body.mask, *more))


def _slow_key(function: Callable[..., dict[str, Any]], body: PartBody, *more: Any) -> str:
    """Return the text that the result of a slow computation follows from."""
    data = [*CODE, function.__name__, body.problem, body.mask, body.part, *more]
    return json.dumps(data, sort_keys=True)


async def _slow(
    state: AppState,
    pool: Pool,
    function: Callable[..., dict[str, Any]],
    body: PartBody,
    *more: Any,
) -> dict[str, Any]:
    """Return the result of a slow computation on a part, which is also stored in a file."""
    text = json.dumps(body.problem)
    if function is slow_calls.validation:
        title = levels[more[0]].title
    else:
        title = function.__name__.replace("_", " ")
    name = f"{title} of {body.problem.get('name', 'a part')}"
    key = _slow_key(function, body, *more)

    async def compute(share: Path) -> dict[str, Any]:
        further = {"share": str(share)} if function in WITH_SHARE else {}
        call = partial(function, text, body.mask, body.part, *more, **further)
        return await pool.call_named(key, name, call)

    return await state.stored.get(key, compute)


@router.post("/motion")
async def get_motion(body: MotionBody, state: State) -> dict[str, Any]:
    """Return the states of a design along its path, from rest to the full stroke."""
    return await _computed(state, state.pools.thorough, quick_calls.motion, body, body.case)


@router.post("/sensitivity")
async def get_sensitivity(body: DesignBody, state: State) -> dict[str, Any]:
    """Return the change of the efficiency by flipping each beam, evaluated beam by beam."""
    return await _computed(state, state.pools.thorough, quick_calls.sensitivity, body)


@router.post("/part")
async def describe_part(body: GripBody, state: State) -> dict[str, Any]:
    """Return size, mass and printability remarks of the part of a design, with its additions."""
    pool = state.pools.thorough
    return await _computed(state, pool, slow_calls.part_summary, body, body.part, body.grips)


@router.post("/print")
async def estimate_print(body: PartBody, state: State) -> dict[str, Any]:
    """Return printing time, layers and mass of the part of a design by the slicer."""
    return await _slow(state, state.pools.files, slow_calls.print_estimate, body)


@router.post("/response")
async def get_response(body: PartBody, state: State) -> dict[str, Any]:
    """Return the response of a design, verified along the whole stroke."""
    text = json.dumps(body.problem)
    return await state.pools.thorough.call(quick_calls.evaluate, text, body.mask, body.part)


@router.post("/report")
async def report_part(body: PartBody, state: State) -> dict[str, Any]:
    """Return the items of the specification of a design, and its figures as a part."""
    return await _computed(state, state.pools.thorough, quick_calls.part_report, body, body.part)


@router.post("/tolerance")
async def get_tolerance(body: PartBody, state: State) -> dict[str, Any]:
    """Return what a design does over tolerances of print and drive, and without single struts."""
    return await _slow(state, state.pools.checks, slow_calls.tolerance, body)


@router.post("/validation")
async def get_validation(body: FemBody, state: State) -> dict[str, Any]:
    """Return the finite-element analysis of the part of a design."""
    pool = _pool_of(state, body.level)
    return await _slow(state, pool, slow_calls.validation, body, body.level)


def _pool_of(state: AppState, level: str) -> Pool:
    """Return the process of a level: frames and solids do not wait for checks that take minutes.

    Frames take seconds, a solid in space up to an hour.
    """
    pools = {"frame": state.pools.files, "solid": state.pools.solids}
    return pools.get(level, state.pools.checks)


@router.post("/computations")
async def list_computations(body: ComputationsBody, state: State) -> dict[str, Any]:
    """Return what is known of the slow computations on a part; nothing is computed.

    Each is null if it was not begun, has its ``result``, or, while it runs, the ``share`` that is
    done; one that waits has what it ``waits_for``, in words, which is empty while its own process
    starts. Without ``results``, only those that run or wait are listed.
    """

    def read() -> dict[str, Any]:
        def known(
            pool: Pool, function: Callable[..., dict[str, Any]], *more: Any
        ) -> dict[str, Any] | None:
            key = _slow_key(function, body, *more)
            found = state.stored.state(key, running=not body.results)
            if found is None or found.get("share", 0.0) is not None:
                return found
            running, name = pool.running
            return {**found, "waits_for": "" if running == key else name or "another computation"}

        return {
            "validation": {
                level: known(_pool_of(state, level), slow_calls.validation, level)
                for level in levels
            },
            "tolerance": known(state.pools.checks, slow_calls.tolerance),
            "print": known(state.pools.files, slow_calls.print_estimate),
        }

    return await run_in_threadpool(read)


@router.post("/computations/stop")
async def stop_computation(body: StopBody, state: State) -> dict[str, bool]:
    """Stop a slow computation on a part, for all who wait for it; return whether it was running."""
    if body.computation == "tolerance":
        key = _slow_key(slow_calls.tolerance, body)
    else:
        key = _slow_key(slow_calls.validation, body, body.level)
    return {"stopped": state.stored.stop(key)}


@router.post("/files/{suffix}", response_class=Response)
async def make_file(suffix: FileSuffix, body: FileBody, state: State) -> Response:
    """Return a file of a design for printing, cutting, viewing or simulation."""
    about = {"efficiency": body.efficiency, "provenance": body.provenance}
    text = json.dumps(body.problem)
    pool = state.pools.thorough if page_files[suffix].quick else state.pools.files
    content = await pool.call(
        slow_calls.design_file, text, body.mask, f".{suffix}", body.part, about, body.grips
    )
    return Response(content, media_type=page_files[suffix].media_type)


@router.get("/gallery")
async def list_gallery(state: State) -> list[dict[str, Any]]:
    """Return all designs with small pictures, by source."""
    return await run_in_threadpool(state.gallery.listing)


@router.get("/gallery/{source}/{key}")
async def get_design(source: str, key: str, state: State) -> dict[str, Any]:
    """Return one design."""
    return design_data(await run_in_threadpool(state.gallery.find, source, key))


@router.post("/gallery", status_code=201)
async def save_design(body: SaveDesignBody, state: State) -> dict[str, str]:
    """Store a design that was drawn by hand or assembled."""

    def save() -> str:
        problem = problem_of(body.problem)
        mask = unpack_mask(body.mask, problem.lattice.beam_count)
        return state.saved.add(Design(problem, mask, provenance=body.provenance), body.title)

    return {"source": state.saved.name, "key": await run_in_threadpool(save)}


@router.get("/machines/{name}")
async def get_plan(name: str, state: State) -> dict[str, Any]:
    """Return the plan of a bundled machine."""
    return state.machines.plan(name)


@router.post("/machines")
async def build_machine(body: PlanBody, state: State) -> dict[str, Any]:
    """Assemble one design of several parts."""
    designs: dict[str, str] = {}
    parts = body.plan.get("parts")
    for part in parts.values() if isinstance(parts, dict) else ():
        name = part.get("entry") if isinstance(part, dict) else None
        if isinstance(name, str) and name not in designs:
            found = design_data(await run_in_threadpool(entry_named, state.gallery, name))
            designs[name] = json.dumps({"problem": found["problem"], "mask": found["mask"]})
    return await state.pools.thorough.call(slow_calls.machine, body.plan, designs)


@router.websocket("/edit")
async def edit(socket: WebSocket, state: State) -> None:
    """Return the response of each design that a client sends.

    A message is ``{"id": number, "problem": ..., "part": ..., "mask": hex}``; without ``problem``,
    the problem and the part of the previous message are used. The path is followed in large steps.
    """
    await socket.accept()
    text, part = "", {}
    while True:
        try:
            raw = await socket.receive_text()
        except (WebSocketDisconnect, RuntimeError, KeyError):
            return
        number: Any = None
        try:
            message = _read_edit(raw)
            number = message.number
            if message.problem is not None:
                text, part = json.dumps(message.problem), message.part
            if not text:
                raise InvalidFile("problem: is missing")
            result = await state.pools.quick.call(
                quick_calls.evaluate, text, message.mask, part, verified=False
            )
        except BellcrankError as error:
            result = {"error": plain_error(error)}
        await socket.send_text(json.dumps({"id": number, **result}, separators=(",", ":")))


class _Edit(NamedTuple):
    """A message of the editor."""

    number: int | None
    problem: dict[str, Any] | None
    part: dict[str, Any]
    mask: str


def _read_edit(raw: str) -> _Edit:
    """Read a message of the editor.

    Raises
    ------
    InvalidFile
    """
    if len(raw) > MESSAGE:
        raise InvalidFile("the message is too long")
    try:
        data = json.loads(raw)
    except (ValueError, RecursionError):
        raise InvalidFile("the message is no JSON") from None
    mask = data.get("mask") if isinstance(data, dict) else None
    if not isinstance(mask, str):
        raise InvalidFile("mask: expected hexadecimal text")
    problem = data.get("problem")
    if problem is not None and not isinstance(problem, dict):
        raise InvalidFile("problem: expected a table")
    part = data.get("part", {})
    if not isinstance(part, dict):
        raise InvalidFile("part: expected a table")
    number = data.get("id")
    return _Edit(
        number if isinstance(number, int) else None,
        problem,
        part,
        mask,
    )
