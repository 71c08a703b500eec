"""The server: pages, routes, and what happens when something is wrong."""

from __future__ import annotations

import asyncio
import contextlib
import hashlib
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse, Response
from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.middleware.gzip import GZipMiddleware

from bellcrank import __version__
from bellcrank.errors import BellcrankError, CorruptRun, StorageError, UnknownName, first_line
from bellcrank.part import materials
from bellcrank.search import default_workers
from bellcrank.web import design_routes, run_routes, task_routes
from bellcrank.web.actuators import Actuators, Machines, Struts
from bellcrank.web.gallery import BuiltIn, Gallery, Kept, OwnRuns
from bellcrank.web.jobs import Jobs
from bellcrank.web.pools import Busy, TookTooLong, make_pools, plain_error
from bellcrank.web.scheduling import Scheduler
from bellcrank.web.security import Guard
from bellcrank.web.state import Shop, Workshop
from bellcrank.web.tables import Complaint

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable, Coroutine

STATIC = Path(__file__).parent / "static"
PAGES = {
    "/": ("index.html", "text/html; charset=utf-8"),
    "/app.js": ("app.js", "text/javascript; charset=utf-8"),
    "/app.css": ("app.css", "text/css; charset=utf-8"),
    "/icon.svg": ("icon.svg", "image/svg+xml"),
}
COMPLAINTS: dict[int | str, dict[str, Any]] = {
    code: {"model": Complaint} for code in (400, 401, 403, 404, 413, 415, 422, 503, 507)
}


def make_app(folder: Path, *, token: str | None = None, searches: int | None = None) -> FastAPI:
    """Return the server for the runs in a folder.

    Parameters
    ----------
    folder
        Where runs and kept designs are.
    token
        That everybody must know; None where only this machine can ask.
    searches
        At the same time; as many as there are processors by default.
    """
    jobs = Jobs(folder / "runs")
    kept = Kept(folder / "designs")
    machines = Machines()
    gallery = Gallery(OwnRuns(jobs), kept, machines, BuiltIn(), Actuators(), Struts())
    workshop = Workshop(jobs, Scheduler(jobs, searches), make_pools(), gallery, kept, machines)

    @contextlib.asynccontextmanager
    async def alive(_app: FastAPI) -> AsyncIterator[None]:
        workshop.scheduler.open()
        warming = asyncio.create_task(_warm(workshop))
        yield
        warming.cancel()
        await workshop.scheduler.close()
        workshop.pools.close()

    app = FastAPI(
        title="bellcrank",
        version=__version__,
        openapi_url="/api/openapi.json",
        docs_url=None,  # these pages would load scripts from elsewhere
        redoc_url=None,
        lifespan=alive,
        responses=COMPLAINTS,
    )
    app.state.workshop = workshop
    app.add_middleware(GZipMiddleware, minimum_size=1000, compresslevel=4)
    app.add_middleware(Guard, token=token)
    for routes in (task_routes, design_routes, run_routes):
        app.include_router(routes.router)
    _add_pages(app)
    _add_complaints(app)

    @app.get("/api/about", tags=["server"])
    def about(shop: Shop) -> dict[str, Any]:
        """Say what server this is, and whether it is ready to compute."""
        return {
            "version": __version__,
            "ready": shop.ready,
            "trouble": shop.trouble,
            "processors": default_workers(),
            "searches": shop.scheduler.slots,
            "running": len(shop.scheduler.running),
            "queued": len(shop.scheduler.queue),
            "materials": {
                name: {"young": each.young, "poisson": each.poisson}
                for name, each in materials.items()
            },
        }

    return app


async def _warm(workshop: Workshop) -> None:
    """Make ready what takes seconds the first time: kernels, and machines of the gallery."""
    try:
        await asyncio.gather(workshop.pools.warm(), run_in_threadpool(workshop.gallery.listing))
    except BellcrankError as error:
        workshop.trouble = first_line(error)
    else:
        workshop.ready = True


def _add_pages(app: FastAPI) -> None:
    """Serve the files of the page, by name and from memory: no address becomes a path."""
    for address, (name, media) in PAGES.items():
        app.add_api_route(
            address, _page((STATIC / name).read_bytes(), media), include_in_schema=False
        )


def _page(content: bytes, media: str) -> Callable[..., Coroutine[Any, Any, Response]]:
    """Return what answers with some content, or says that it has not changed."""
    headers = {
        "etag": f'"{hashlib.sha256(content).hexdigest()[:16]}"',
        "cache-control": "no-cache",
    }

    async def page(request: Request) -> Response:
        if request.headers.get("if-none-match") == headers["etag"]:
            return Response(status_code=304, headers=headers)
        return Response(content, media_type=media, headers=headers)

    return page


def _add_complaints(app: FastAPI) -> None:
    """Turn errors into one sentence and what it is about."""

    async def refuse(_request: Request, error: Exception) -> JSONResponse:
        return JSONResponse(plain_error(error), _status(error))

    async def invalid(_request: Request, error: Exception) -> JSONResponse:
        assert isinstance(error, RequestValidationError)
        first = error.errors()[0]
        place = [str(part) for part in first["loc"] if part not in {"body", "path", "query"}]
        key = ".".join(place)
        expected = str(first["msg"]).removeprefix("Input should be ")
        said = f"{key}: expected {expected}" if expected != first["msg"] else f"{key}: {expected}"
        return JSONResponse({"message": said.removeprefix(": "), "key": key}, 422)

    async def missing(_request: Request, error: Exception) -> JSONResponse:
        assert isinstance(error, HTTPException)
        headers = getattr(error, "headers", None)
        return JSONResponse({"message": str(error.detail), "key": ""}, error.status_code, headers)

    app.add_exception_handler(BellcrankError, refuse)
    app.add_exception_handler(RequestValidationError, invalid)
    app.add_exception_handler(HTTPException, missing)


def _status(error: Exception) -> int:
    kinds: tuple[tuple[type[Exception], int], ...] = (
        (Busy, 503),
        (TookTooLong, 503),
        (UnknownName, 404),
        (StorageError, 507),
        (CorruptRun, 422),
    )
    return next((code for kind, code in kinds if isinstance(error, kind)), 422)
