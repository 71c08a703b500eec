"""The protocol of an engine, its options and the registry.

All engines call `bellcrank.campaign.work.work`; none transports data. Each is a context manager
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

    from bellcrank.campaign.store import Store


class WorkerDied(BellcrankError, RuntimeError):
    """A worker ended during a run: killed, out of memory, or out of time."""


class Outcome(NamedTuple):
    """Result of an attempt at a run.

    Parameters
    ----------
    number
        Number of the run.
    error
        Error of the attempt, if it failed.
    """

    number: int
    error: BaseException | None


class Engine(Protocol):
    """Place where runs are computed."""

    note: str | None
    """Note for the user, such as the address of a dashboard."""

    def capacity(self) -> int:
        """Return the number of runs that it can compute at the same time."""

    def submit(self, number: int) -> None:
        """Start to compute a run."""

    def collect(self, timeout: float) -> list[Outcome]:
        """Return the attempts that have ended, after waiting up to `timeout` seconds for one.

        Raises
        ------
        ClusterError
            If the engine itself is lost.
        """

    def request_stop(self) -> None:
        """Let all runs end after the current segment."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EngineOptions:
    """Options of the engines; each uses those that apply to it.

    Parameters
    ----------
    workers
        Number of worker processes; by default one for each core, or one SLURM job.
    host
        Address on which the scheduler of ``slurm`` listens.
    scheduler
        Address of a running Dask scheduler, ``tcp://host:port`` or ``tls://host:port``.
    timeout
        Seconds to wait for a connection.
    slurm
        Options of ``SLURMCluster`` of dask-jobqueue.

    Raises
    ------
    InvalidSettings
        If the number of workers is less than 1.
    """

    workers: int | None = None
    host: str | None = None
    scheduler: str | None = None
    timeout: float = 15.0
    slurm: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.workers is not None and self.workers < 1:
            raise InvalidSettings(f"workers: expected at least 1, got {self.workers}")


engines: Registry[Callable[[Store, EngineOptions], AbstractContextManager[Engine]]] = Registry(
    "engine"
)
