"""Designs: how they move, what each beam does, what they become."""

from __future__ import annotations

import json
from typing import Any

from fastapi import APIRouter, WebSocket, WebSocketDisconnect
from fastapi.responses import Response
from starlette.concurrency import run_in_threadpool

from bellcrank.errors import BellcrankError, InvalidFile
from bellcrank.model import Design, unpack_mask
from bellcrank.web import making, solving
from bellcrank.web.gallery import entry_named, whole
from bellcrank.web.limits import MESSAGE
from bellcrank.web.pools import plain_error
from bellcrank.web.state import Shop
from bellcrank.web.tables import (
    MEDIA,
    SWIFT,
    DesignBody,
    FemBody,
    FileBody,
    FileSuffix,
    KeepBody,
    PartBody,
    PlanBody,
)
from bellcrank.web.texts import problem_of

router = APIRouter(prefix="/api", tags=["designs"])


@router.post("/motion")
async def get_motion(body: DesignBody, shop: Shop) -> dict[str, Any]:
    """Return the states of a design along its path, from rest to the full stroke."""
    text = json.dumps(body.problem)
    return await shop.pools.thorough.call(solving.motion, text, body.mask)


@router.post("/sensitivity")
async def get_sensitivity(body: DesignBody, shop: Shop) -> dict[str, Any]:
    """Return what flipping each beam changes, computed beam by beam."""
    text = json.dumps(body.problem)
    return await shop.pools.thorough.call(solving.sensitivity, text, body.mask)


@router.post("/part")
async def describe_part(body: PartBody, shop: Shop) -> dict[str, Any]:
    """Return size, mass and remarks of the part that a design becomes."""
    text = json.dumps(body.problem)
    return await shop.pools.thorough.call(making.remarks, text, body.mask, body.part)


@router.post("/validation")
async def get_validation(body: FemBody, shop: Shop) -> dict[str, Any]:
    """Return what finite elements say of the part."""
    text = json.dumps(body.problem)
    return await shop.pools.slow.call(making.validation, text, body.mask, body.part, body.level)


@router.post("/files/{suffix}", response_class=Response)
async def make_file(suffix: FileSuffix, body: FileBody, shop: Shop) -> Response:
    """Return a file of a design: to print, to cut, to look at, to compute with."""
    about = {"efficiency": body.efficiency, "provenance": body.provenance}
    text = json.dumps(body.problem)
    pool = shop.pools.thorough if suffix in SWIFT else shop.pools.slow
    content = await pool.call(making.design_file, text, body.mask, f".{suffix}", body.part, about)
    return Response(content, media_type=MEDIA[suffix])


@router.get("/gallery")
async def list_gallery(shop: Shop) -> list[dict[str, Any]]:
    """All designs with small pictures, by source."""
    return await run_in_threadpool(shop.gallery.listing)


@router.get("/gallery/{source}/{key}")
async def get_design(source: str, key: str, shop: Shop) -> dict[str, Any]:
    """Return one design."""
    return whole(await run_in_threadpool(shop.gallery.find, source, key))


@router.post("/gallery", status_code=201)
async def keep_design(body: KeepBody, shop: Shop) -> dict[str, str]:
    """Keep a design that was drawn by hand or put together."""

    def keep() -> str:
        problem = problem_of(body.problem)
        mask = unpack_mask(body.mask, problem.lattice.beam_count)
        return shop.kept.add(Design(problem, mask, provenance=body.provenance), body.title)

    return {"source": shop.kept.name, "key": await run_in_threadpool(keep)}


@router.get("/machines/{name}")
async def get_plan(name: str, shop: Shop) -> dict[str, Any]:
    """Return the plan of a machine that comes along, to go on from."""
    return shop.machines.plan(name)


@router.post("/machines")
async def build_machine(body: PlanBody, shop: Shop) -> dict[str, Any]:
    """Make one design of several parts."""
    designs: dict[str, str] = {}
    parts = body.plan.get("parts")
    for part in parts.values() if isinstance(parts, dict) else ():
        name = part.get("entry") if isinstance(part, dict) else None
        if isinstance(name, str) and name not in designs:
            found = whole(await run_in_threadpool(entry_named, shop.gallery, name))
            designs[name] = json.dumps({"problem": found["problem"], "mask": found["mask"]})
    return await shop.pools.thorough.call(making.machine, body.plan, designs)


@router.websocket("/edit")
async def edit(socket: WebSocket, shop: Shop) -> None:
    """Answer each design with its response.

    A message is ``{"id": number, "problem": ..., "mask": hex}``; the problem may be left out
    where it is that of the message before.
    """
    await socket.accept()
    text = ""
    while True:
        try:
            raw = await socket.receive_text()
        except (WebSocketDisconnect, RuntimeError, KeyError):
            return
        number: Any = None
        try:
            number, problem, mask = _read_edit(raw)
            if problem is not None:
                text = json.dumps(problem)
            if not text:
                raise InvalidFile("problem: is missing")
            answer = await shop.pools.quick.call(solving.respond, text, mask)
        except BellcrankError as error:
            answer = {"error": plain_error(error)}
        await socket.send_text(json.dumps({"id": number, **answer}, separators=(",", ":")))


def _read_edit(raw: str) -> tuple[Any, dict[str, Any] | None, str]:
    """Read a message of a person who draws.

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
    number = data.get("id")
    return (number if isinstance(number, int) else None), problem, mask
