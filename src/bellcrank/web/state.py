"""State that the routes of a server share."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated

from fastapi import Depends
from starlette.requests import HTTPConnection

from bellcrank.web.results import Results, StoredResults

if TYPE_CHECKING:
    from bellcrank.web.gallery import Gallery, SavedDesigns
    from bellcrank.web.jobs import Jobs
    from bellcrank.web.machine_gallery import Machines
    from bellcrank.web.pools import Pools
    from bellcrank.web.scheduler import Scheduler


@dataclass(slots=True, eq=False)
class AppState:
    """Jobs, processes and designs of a server.

    Attributes
    ----------
    ready
        Whether the kernels are compiled and loaded.
    error
        Why they cannot be loaded; empty if they can.
    """

    jobs: Jobs
    scheduler: Scheduler
    pools: Pools
    gallery: Gallery
    saved: SavedDesigns
    machines: Machines
    stored: StoredResults
    results: Results = field(default_factory=Results)
    ready: bool = False
    error: str = ""


def _state(connection: HTTPConnection) -> AppState:
    state: AppState = connection.app.state.bellcrank
    return state


State = Annotated[AppState, Depends(_state)]
