"""What an engine is: somewhere to compute runs, and nothing else.

All engines call `bellcrank.campaign.work.work`; none carries data. Each is a context manager
that leaves no process behind.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from bellcrank.errors import BellcrankError, InvalidSettings
from bellcrank.registry import Registry

if TYPE_CHECKING:
    from collections.abc import Callable
    from contextlib import AbstractContextManager
    from pathlib import Path

    from bellcrank.campaign.store import Store

LOOPBACK = "127.0.0.1"


class WorkerDied(BellcrankError, RuntimeError):
    """A worker ended in the middle of a run: killed, out of memory, or out of time."""


class Outcome(NamedTuple):
    """How an attempt at a run ended.

    Parameters
    ----------
    number
        Of the run.
    error
        What went wrong, if anything did.
    """

    number: int
    error: BaseException | None


class Engine(Protocol):
    """Somewhere to compute runs."""

    note: str | None
    """What to tell whoever started it, such as where to look."""

    def capacity(self) -> int:
        """Return how many runs it should have in hand."""

    def submit(self, number: int) -> None:
        """Take a run in hand."""

    def collect(self, timeout: float) -> list[Outcome]:
        """Return the attempts that ended since, waiting some seconds for the first.

        Raises
        ------
        ClusterError
            If the engine itself is lost.
        """

    def request_stop(self) -> None:
        """Let all runs end after the segment at hand."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EngineOptions:
    """What engines are told; each looks at what concerns it.

    Parameters
    ----------
    workers
        Processes of one thread each; by default one for each core, or for ``slurm`` each job.
    host
        Address to listen on. Loopback, unless told otherwise.
    scheduler
        Address of one that is running, ``tcp://host:port`` or ``tls://host:port``.
    tls_ca, tls_cert, tls_key
        Files that prove to each other who scheduler and client are.
    timeout
        Seconds to wait for a connection.
    slurm
        Options of dask-jobqueue's ``SLURMCluster``.

    Raises
    ------
    InvalidSettings
        If there is to be no worker.
    """

    workers: int | None = None
    host: str | None = None
    scheduler: str | None = None
    tls_ca: Path | None = None
    tls_cert: Path | None = None
    tls_key: Path | None = None
    timeout: float = 15.0
    slurm: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.workers is not None and self.workers < 1:
            raise InvalidSettings(f"workers: expected at least 1, got {self.workers}")


engines: Registry[Callable[[Store, EngineOptions], AbstractContextManager[Engine]]] = Registry(
    "engine"
)
