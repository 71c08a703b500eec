"""What the routes of a server share."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

from fastapi import Depends
from starlette.requests import HTTPConnection

if TYPE_CHECKING:
    from bellcrank.web.actuators import Machines
    from bellcrank.web.gallery import Gallery, Kept
    from bellcrank.web.jobs import Jobs
    from bellcrank.web.pools import Pools
    from bellcrank.web.scheduling import Scheduler


@dataclass(slots=True, eq=False)
class Workshop:
    """Jobs, processes and designs of a server.

    Attributes
    ----------
    ready
        Whether the kernels are compiled and loaded.
    trouble
        Why they are not, and never will be.
    """

    jobs: Jobs
    scheduler: Scheduler
    pools: Pools
    gallery: Gallery
    kept: Kept
    machines: Machines
    ready: bool = False
    trouble: str = ""


def _workshop(connection: HTTPConnection) -> Workshop:
    workshop: Workshop = connection.app.state.workshop
    return workshop


Shop = Annotated[Workshop, Depends(_workshop)]
