"""Engines that compute runs on the workers of a Dask scheduler (extra ``cluster``)."""

from __future__ import annotations

import contextlib
import logging
import os
import platform
import queue
import threading
import time
from contextlib import contextmanager
from functools import cache
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from bellcrank.campaign.engines.base import Engine, EngineOptions, Outcome, WorkerDied, engines
from bellcrank.campaign.work import allow_work, describe_store, request_stop, work
from bellcrank.errors import ClusterError, InvalidSettings, first_line
from bellcrank.provenance import provenance

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from distributed import Client, Future

    from bellcrank.campaign.store import Store

RECOUNT_INTERVAL = 5.0
"""Seconds after which the workers are counted again."""
LOGGERS = ("distributed", "tornado", "asyncio", "dask_jobqueue")
"""Loggers that write to standard error."""
CLOSE_TIMEOUT = 10.0


def require(engine: str, *modules: str) -> None:
    """Check that the modules of an engine are installed.

    Raises
    ------
    ClusterError
        If one is missing; the message names the extra that installs it.
    """
    for module in modules:
        if find_spec(module) is None:
            raise ClusterError(
                f"engine {engine!r} needs {module}, which is not installed: "
                f"pip install 'bellcrank[cluster]'; engine 'processes' uses this machine without it"
            )


@cache
def software() -> dict[str, str | None]:
    """Return the versions in this process of all that results depend on.

    Examples
    --------
    >>> list(software())
    ['bellcrank', 'commit', 'python', 'numpy', 'numba']
    """
    found = provenance()
    python = ".".join(platform.python_version_tuple()[:2])
    return {
        "bellcrank": found["version"],
        "commit": found["commit"],
        "python": python,
        "numpy": found["numpy"],
        "numba": found["numba"],
    }


def version_difference(ours: dict[str, str | None], theirs: dict[str, str | None]) -> str | None:
    """Return the first difference between two sets of versions in words, or None.

    An unknown commit is compatible with every commit.

    Examples
    --------
    >>> version_difference({"numpy": "2.4"}, {"numpy": "2.3"})
    'numpy 2.3 there and 2.4 here'
    """
    for name, here in ours.items():
        there = theirs.get(name)
        if here != there and not (name == "commit" and None in (here, there)):
            return f"{name} {there or 'missing'} there and {here or 'missing'} here"
    return None


def describe_worker(store_path: str) -> tuple[dict[str, str | None], str | None]:
    """Return the versions on a worker and the hash of the campaign that it finds in a folder."""
    allow_work(store_path)
    return software(), describe_store(store_path)


def checked_work(store_path: str, number: int, expected: dict[str, str | None]) -> str:
    """Compute a run on a worker, which may have joined after the workers were checked.

    Raises
    ------
    ClusterError
        If the worker has other versions.
    """
    if difference := version_difference(expected, software()):
        raise ClusterError(f"a worker that joined later has other versions: {difference}")
    return work(store_path, number)


class DaskEngine:
    """Computes runs on the workers of one scheduler, one run at a time on each.

    Parameters
    ----------
    client
        Client connected to the scheduler.
    store
        Store that all workers must find under the same path.
    note
        Note for the user.
    renew
        Called regularly, to replace workers that have ended.
    """

    def __init__(
        self, client: Client, store: Store, note: str | None, renew: Callable[[], object]
    ) -> None:
        self.note = note
        self._renew = renew
        self._client = client
        self._path = str(store.path)
        self._hash = store.spec.hash
        self._session = f"{store.spec.name}-{os.urandom(4).hex()}"
        self._attempts = 0
        self._futures: dict[int, Future] = {}
        self._ended: queue.SimpleQueue[tuple[int, Future]] = queue.SimpleQueue()
        self._counted = float("-inf")
        self._workers = 0

    def check_workers(self) -> None:
        """Check that all workers have the same versions and find the same store.

        Raises
        ------
        ClusterError
            If one does not; the message names it.
        """
        replies = self._client.run(describe_worker, self._path, on_error="return")
        for address, reply in sorted(replies.items()):
            if isinstance(reply, OSError):
                continue  # it has ended meanwhile; `checked_work` checks its replacement
            if isinstance(reply, BaseException):
                raise ClusterError(
                    f"worker {address}: cannot work for this campaign: {reply!r}; is the same "
                    f"bellcrank installed there?"
                )
            versions, found = reply
            if difference := version_difference(software(), versions):
                raise ClusterError(
                    f"worker {address}: has other versions, so that results would differ: "
                    f"{difference}; install the same there"
                )
            if found != self._hash:
                raise ClusterError(
                    f"worker {address}: does not find this campaign in {self._path}; choose a "
                    f"folder (--out) that all workers share"
                )

    def capacity(self) -> int:
        """Return the number of workers, at least 1."""
        if time.monotonic() - self._counted > RECOUNT_INTERVAL:
            with contextlib.suppress(OSError, TimeoutError):
                self._workers = len(self._client.nthreads())
                self._renew()
            self._counted = time.monotonic()
        return max(1, self._workers)

    def submit(self, number: int) -> None:
        """Start to compute a run."""
        self._attempts += 1
        key = f"{self._session}-{number}-{self._attempts}"
        future = self._client.submit(
            checked_work, self._path, number, software(), key=key, pure=False
        )
        self._futures[number] = future
        future.add_done_callback(lambda done: self._ended.put((number, done)))

    def collect(self, timeout: float) -> list[Outcome]:
        """Return the attempts that have ended.

        Raises
        ------
        ClusterError
            If the connection to the scheduler is lost.
        """
        ended: list[tuple[int, Future]] = []
        with contextlib.suppress(queue.Empty):
            ended.append(self._ended.get(timeout=timeout))
            while True:
                ended.append(self._ended.get_nowait())
        if self._client.status != "running" or any(future.cancelled() for _, future in ended):
            raise ClusterError(
                f"the connection to the scheduler was lost; to continue: "
                f"bellcrank campaign resume {self._path}"
            )
        return [self._outcome(number, future) for number, future in ended]

    def _outcome(self, number: int, future: Future) -> Outcome:
        from distributed import KilledWorker

        self._futures.pop(number, None)
        error = None if future.status == "finished" else future.exception()
        future.release()
        if isinstance(error, KilledWorker):
            error = WorkerDied(f"its worker {error.last_worker.address} died")
        return Outcome(number, error)

    def request_stop(self) -> None:
        """Let all runs end after the current segment."""

        def send() -> None:
            with contextlib.suppress(Exception):
                self._client.run(request_stop, self._path, on_error="ignore")

        # In a thread, since a worker that cannot be reached would block.
        threading.Thread(target=send, daemon=True).start()


@contextmanager
def _quiet() -> Iterator[None]:
    """Silence the loggers of Dask: what matters is reported as one error."""
    import distributed  # noqa: F401  # sets the levels of its loggers

    names = {name for name in logging.root.manager.loggerDict if name.startswith(LOGGERS)}
    before = {name: logging.getLogger(name).level for name in (*names, *LOGGERS)}
    try:
        for name in before:
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)
        yield
    finally:
        for name, level in before.items():
            logging.getLogger(name).setLevel(level)


@contextmanager
def _connected(
    store: Store,
    where: Any,
    *,
    timeout: float,
    note: str | None = None,
    renew: Callable[[], object] = lambda: None,
) -> Iterator[Engine]:
    """Connect to a scheduler, given by its address or as a cluster, and check its workers.

    Raises
    ------
    ClusterError
        If it cannot be reached within `timeout` seconds, or a worker does not fit.
    """
    from distributed import Client

    try:
        client = Client(where, timeout=timeout, set_as_default=False)
    except (OSError, TimeoutError, ValueError) as error:
        raise ClusterError(
            f"scheduler {where}: cannot be reached within {timeout:g} s "
            f"({first_line(error)}); is it running, and is the address right?"
        ) from None
    try:
        engine = DaskEngine(client, store, note, renew)
        engine.check_workers()
        yield engine
    finally:
        with contextlib.suppress(OSError, TimeoutError, RuntimeError):
            client.close(timeout=CLOSE_TIMEOUT)


@engines.register("dask")
@contextmanager
def dask(store: Store, options: EngineOptions) -> Iterator[Engine]:
    """Compute on the workers of a running Dask scheduler, which keeps running afterwards.

    For ``tls://`` the certificates are those of Dask's configuration (``distributed.comm.tls``).

    Raises
    ------
    InvalidSettings
        If its address is invalid.
    ClusterError
        If Dask is not installed.
    """
    address = options.scheduler or ""
    if not address.startswith(("tcp://", "tls://")):
        raise InvalidSettings(
            f"scheduler: expected an address like tcp://host:8786 or tls://host:8786, got "
            f"{address!r}"
        )
    require("dask", "distributed")
    note = f"scheduler: {address}"
    with _quiet(), _connected(store, address, timeout=options.timeout, note=note) as engine:
        yield engine


@engines.register("slurm")
@contextmanager
def slurm(store: Store, options: EngineOptions) -> Iterator[Engine]:
    """Compute in SLURM jobs of one core each, which end with this process.

    The scheduler listens on the network, so all connections are encrypted with temporary keys,
    which are kept in the store meanwhile.

    Raises
    ------
    ClusterError
        If dask-jobqueue is not installed, or SLURM refuses.
    """
    require("slurm", "distributed", "dask_jobqueue", "cryptography")
    from dask_jobqueue import SLURMCluster

    chosen: dict[str, Any] = {
        "cores": 1, "processes": 1, "memory": "2GB", "nanny": True, "death_timeout": 60,
        "protocol": "tls://", "security": True, "shared_temp_directory": str(store.path),
        "scheduler_options": {
            "host": options.host, "allowed_failures": 0,
            "dashboard_address": f"{options.host or ''}:0",
        },
        **options.slurm,
    }  # fmt: skip
    with _quiet():
        try:
            cluster = SLURMCluster(**chosen)
        except (TypeError, ValueError, ImportError, OSError) as error:
            raise ClusterError(f"SLURM cluster: {first_line(error)}") from None
        with cluster:
            count = options.workers or 1
            cluster.scale(jobs=count)
            dashboard = f"dashboard: {cluster.dashboard_link}" if find_spec("bokeh") else None
            with _connected(
                store,
                cluster,
                timeout=options.timeout,
                note=dashboard,
                renew=lambda: cluster.scale(jobs=count),
            ) as engine:
                yield engine
