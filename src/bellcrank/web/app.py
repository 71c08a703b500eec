"""The application: pages, routes and error responses."""

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
from bellcrank.export.slicer import has_slicer
from bellcrank.processes import default_workers
from bellcrank.web import design_routes, quick_calls, run_routes, task_routes
from bellcrank.web.errors import plain_error
from bellcrank.web.gallery import BundledDesigns, Gallery, RunDesigns, SavedDesigns
from bellcrank.web.jobs import Jobs
from bellcrank.web.machine_gallery import Actuators, Machines, Struts
from bellcrank.web.pools import Busy, ServerEnds, Stopped, TimeLimitExceeded, make_pools
from bellcrank.web.registries import registered
from bellcrank.web.requests import ErrorResponse
from bellcrank.web.results import StoredResults
from bellcrank.web.scheduler import Scheduler
from bellcrank.web.security import AccessControl
from bellcrank.web.state import AppState, State

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable, Coroutine

STATIC = Path(__file__).parent / "static"
PAGES = {
    "/": ("index.html", "text/html; charset=utf-8"),
    "/app.js": ("app.js", "text/javascript; charset=utf-8"),
    "/space.js": ("space.js", "text/javascript; charset=utf-8"),
    "/app.css": ("app.css", "text/css; charset=utf-8"),
    "/icon.svg": ("icon.svg", "image/svg+xml"),
}
ERROR_RESPONSES: dict[int | str, dict[str, Any]] = {
    code: {"model": ErrorResponse} for code in (400, 401, 403, 404, 409, 413, 415, 422, 503, 507)
}


def make_app(folder: Path, *, token: str | None = None, searches: int | None = None) -> FastAPI:
    """Return the server for the runs in a folder.

    Parameters
    ----------
    folder
        Folder of runs and saved designs.
    token
        Required from every client; None for a server that only this machine can reach.
    searches
        Searches that run at the same time; the number of processors by default.
    """
    jobs = Jobs(folder / "runs")
    saved = SavedDesigns(folder / "designs")
    machines = Machines()
    gallery = Gallery(RunDesigns(jobs), saved, machines, BundledDesigns(), Actuators(), Struts())
    stored = StoredResults(folder / "results")
    scheduler = Scheduler(jobs, searches)
    state = AppState(jobs, scheduler, make_pools(), gallery, saved, machines, stored)

    @contextlib.asynccontextmanager
    async def lifespan(_app: FastAPI) -> AsyncIterator[None]:
        state.scheduler.open()
        preparation = asyncio.create_task(_prepare(state))
        yield
        preparation.cancel()
        await state.scheduler.close()
        state.pools.end()

    app = FastAPI(
        title="bellcrank",
        version=__version__,
        openapi_url="/api/openapi.json",
        docs_url=None,  # these pages would load scripts from elsewhere
        redoc_url=None,
        lifespan=lifespan,
        responses=ERROR_RESPONSES,
    )
    app.state.bellcrank = state
    app.add_middleware(GZipMiddleware, minimum_size=1000, compresslevel=4)
    app.add_middleware(AccessControl, token=token)
    for routes in (task_routes, design_routes, run_routes):
        app.include_router(routes.router)
    _add_pages(app)
    _add_error_handlers(app)

    @app.get("/api/about", tags=["server"])
    def about(state: State) -> dict[str, Any]:
        """Return version, state and load of the server."""
        return {
            "version": __version__,
            "ready": state.ready,
            "error": state.error,
            "processors": default_workers(),
            "slicer": has_slicer(),
            "searches": state.scheduler.slots,
            "running": len(state.scheduler.running),
            "queued": len(state.scheduler.queue),
        }

    @app.get("/api/registries", tags=["server"])
    def registries() -> dict[str, list[dict[str, Any]]]:
        """Return the names and descriptions of searches, materials, file formats and levels."""
        return registered()

    return app


async def _prepare(state: AppState) -> None:
    """Load the kernels and build the machines of the gallery, which takes seconds."""
    try:
        await asyncio.gather(state.pools.prepare(), run_in_threadpool(state.gallery.listing))
    except BellcrankError as error:
        state.error = first_line(error)
    else:
        state.ready = True
        with contextlib.suppress(BellcrankError):  # the first task in space compiles them then
            await state.pools.checks.call(quick_calls.load_space_kernels)


def _add_pages(app: FastAPI) -> None:
    """Serve the files of the page by name, from memory: no address is used as a path."""
    for address, (name, media) in PAGES.items():
        app.add_api_route(
            address, _page((STATIC / name).read_bytes(), media), include_in_schema=False
        )


def _page(content: bytes, media: str) -> Callable[..., Coroutine[Any, Any, Response]]:
    """Return a handler that serves fixed content with an entity tag."""
    headers = {
        "etag": f'"{hashlib.sha256(content).hexdigest()[:16]}"',
        "cache-control": "no-cache",
    }

    async def page(request: Request) -> Response:
        if request.headers.get("if-none-match") == headers["etag"]:
            return Response(status_code=304, headers=headers)
        return Response(content, media_type=media, headers=headers)

    return page


def _add_error_handlers(app: FastAPI) -> None:
    """Convert errors to a message and the key that it concerns."""

    async def bellcrank_error(_request: Request, error: Exception) -> JSONResponse:
        return JSONResponse(plain_error(error), _status(error))

    async def invalid_request(_request: Request, error: Exception) -> JSONResponse:
        assert isinstance(error, RequestValidationError)
        first = error.errors()[0]
        path = [str(part) for part in first["loc"] if part not in {"body", "path", "query"}]
        key = ".".join(path)
        reason = str(first["msg"]).removeprefix("Value error, ")
        expected = reason.removeprefix("Input should be ")
        message = f"{key}: expected {expected}" if expected != reason else f"{key}: {reason}"
        return JSONResponse({"message": message.removeprefix(": "), "key": key}, 422)

    async def http_error(_request: Request, error: Exception) -> JSONResponse:
        assert isinstance(error, HTTPException)
        headers = getattr(error, "headers", None)
        return JSONResponse({"message": str(error.detail), "key": ""}, error.status_code, headers)

    app.add_exception_handler(BellcrankError, bellcrank_error)
    app.add_exception_handler(RequestValidationError, invalid_request)
    app.add_exception_handler(HTTPException, http_error)


def _status(error: Exception) -> int:
    kinds: tuple[tuple[type[Exception], int], ...] = (
        (Busy, 503),
        (ServerEnds, 503),
        (Stopped, 409),
        (TimeLimitExceeded, 503),
        (UnknownName, 404),
        (StorageError, 507),
        (CorruptRun, 422),
    )
    return next((code for kind, code in kinds if isinstance(error, kind)), 422)
