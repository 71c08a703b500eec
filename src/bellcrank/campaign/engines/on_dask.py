"""Runs on the workers of a Dask scheduler, wherever that is."""

from __future__ import annotations

import contextlib
import logging
import os
import queue
import time
from typing import TYPE_CHECKING, Any

from bellcrank.campaign.engines.base import (
    LOOPBACK,
    Engine,
    EngineOptions,
    Outcome,
    WorkerDied,
    engines,
)
from bellcrank.campaign.engines.versions import software, version_difference
from bellcrank.campaign.work import allow_work, describe_store, request_stop, work
from bellcrank.errors import ClusterError, InvalidSettings, StorageError

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from distributed import Client, Future, Security

    from bellcrank.campaign.store import Store

AHEAD = 1
"""Runs in hand for each worker: none queues behind a run whose worker dies, and dies with it."""
RECOUNT = 5.0
"""Seconds after which the workers are counted again."""
GOODBYE = 10.0
"""Seconds that a worker has to end before it is killed."""


def introduce(store_path: str) -> tuple[dict[str, str | None], str | None]:
    """Tell, from a worker, its versions and which campaign it sees in a folder."""
    allow_work(store_path)
    return software(), describe_store(store_path)


def checked_work(store_path: str, number: int, expected: dict[str, str | None]) -> str:
    """Do a run, unless this worker joined with other versions after the work had begun.

    Raises
    ------
    ClusterError
    """
    if difference := version_difference(expected, software()):
        raise ClusterError(f"a worker that joined later has other versions: {difference}")
    return work(store_path, number)


class DaskEngine:
    """Runs on the workers of one scheduler.

    Parameters
    ----------
    client
        Connected to it.
    store
        Which all workers must see under the same path.
    """

    def __init__(self, client: Client, store: Store, note: str | None) -> None:
        self.note = note
        self._client = client
        self._path = str(store.path)
        self._hash = store.spec.hash
        self._session = f"{store.spec.name}-{os.urandom(4).hex()}"
        self._attempts = 0
        self._hand: dict[int, Future] = {}
        self._ended: queue.SimpleQueue[tuple[int, Future]] = queue.SimpleQueue()
        self._workers = (float("-inf"), 0)

    def check_workers(self) -> None:
        """Refuse workers that would compute something else, or would store it elsewhere.

        Raises
        ------
        ClusterError
            Naming the first such worker.
        """
        answers = self._client.run(introduce, self._path, on_error="return")
        for address, answer in sorted(answers.items()):
            if isinstance(answer, BaseException):
                raise ClusterError(
                    f"worker {address}: cannot work for this campaign: {answer!r}; is the same "
                    f"bellcrank installed there?"
                )
            versions, seen = answer
            if difference := version_difference(software(), versions):
                raise ClusterError(
                    f"worker {address}: has other versions, so that results would differ: "
                    f"{difference}; install the same there"
                )
            if seen != self._hash:
                raise ClusterError(
                    f"worker {address}: does not see this campaign in {self._path}; choose a "
                    f"folder (--out) that all workers share"
                )

    def capacity(self) -> int:
        """Return how many runs to have in hand."""
        counted, workers = self._workers
        if time.monotonic() - counted > RECOUNT:
            with contextlib.suppress(OSError, TimeoutError):
                workers = len(self._client.nthreads())
            self._workers = (time.monotonic(), workers)
        return AHEAD * max(1, workers)

    def submit(self, number: int) -> None:
        """Take a run in hand."""
        self._attempts += 1
        future = self._client.submit(
            checked_work, self._path, number, software(),
            key=f"{self._session}-{number}-{self._attempts}", pure=False,
        )  # fmt: skip
        self._hand[number] = future
        future.add_done_callback(lambda done: self._ended.put((number, done)))

    def collect(self, timeout: float) -> list[Outcome]:
        """Return the attempts that ended since.

        Raises
        ------
        ClusterError
            If the scheduler is gone.
        """
        ended: list[tuple[int, Future]] = []
        with contextlib.suppress(queue.Empty):
            ended.append(self._ended.get(timeout=timeout))
            while True:
                ended.append(self._ended.get_nowait())
        if self._client.status != "running" or any(future.cancelled() for _, future in ended):
            raise ClusterError(
                "the connection to the scheduler was lost; what is done is kept: "
                f"bellcrank campaign resume {self._path} goes on"
            )
        return [self._outcome(number, future) for number, future in ended]

    def _outcome(self, number: int, future: Future) -> Outcome:
        from distributed import KilledWorker

        self._hand.pop(number, None)
        error = None if future.status == "finished" else future.exception()
        future.release()
        if isinstance(error, KilledWorker):
            error = WorkerDied(f"its worker {error.last_worker.address} died")
        return Outcome(number, error)

    def request_stop(self) -> None:
        """Let all runs end after the segment at hand."""
        with contextlib.suppress(OSError, TimeoutError, RuntimeError):
            self._client.run(request_stop, self._path, wait=False)


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Keep Dask's own stories off standard error: what matters comes as one error."""
    names = ("distributed", "tornado", "asyncio", "dask_jobqueue")
    before = {name: logging.getLogger(name).level for name in names}
    try:
        for name in names:
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)
        yield
    finally:
        for name, level in before.items():
            logging.getLogger(name).setLevel(level)


@contextlib.contextmanager
def _engine(store: Store, where: Any, options: EngineOptions, note: str | None) -> Iterator[Engine]:
    """Connect to a scheduler, check its workers, and leave it afterwards.

    Raises
    ------
    ClusterError
        If it cannot be reached in time, or a worker does not fit.
    """
    from distributed import Client

    security = _security(options) if isinstance(where, str) else None
    try:
        client = Client(where, timeout=options.timeout, security=security, set_as_default=False)
    except (OSError, TimeoutError, ValueError) as error:
        raise ClusterError(
            f"scheduler {where}: cannot be reached within {options.timeout:g} s "
            f"({_first_line(error)}); is it running, and is the address right?"
        ) from None
    try:
        engine = DaskEngine(client, store, note)
        engine.check_workers()
        yield engine
    finally:
        with contextlib.suppress(OSError, TimeoutError, RuntimeError):
            client.close(timeout=GOODBYE)


def _first_line(error: BaseException) -> str:
    text = str(error).strip() or type(error).__name__
    return text.splitlines()[0]


def _security(options: EngineOptions) -> Security | None:
    """Return what proves who we are, for ``tls://``.

    Raises
    ------
    InvalidSettings
        If a file is missing, or given without need.
    """
    from distributed import Security

    files = {
        "--tls-ca": options.tls_ca,
        "--tls-cert": options.tls_cert,
        "--tls-key": options.tls_key,
    }
    encrypted = (options.scheduler or "").startswith("tls://")
    if not encrypted:
        if given := [name for name, path in files.items() if path is not None]:
            raise InvalidSettings(f"{given[0]}: only for a scheduler at tls://")
        return None
    for name, path in files.items():
        if path is None or not path.is_file():
            raise InvalidSettings(f"{name}: expected a file, as tls:// needs it; got {path}")
    return Security(
        require_encryption=True,
        tls_ca_file=str(options.tls_ca),
        tls_client_cert=str(options.tls_cert),
        tls_client_key=str(options.tls_key),
    )


@engines.register("local")
@contextlib.contextmanager
def local(store: Store, options: EngineOptions) -> Iterator[Engine]:
    """Compute in processes of this machine, which end with this one."""
    import dask
    from distributed import LocalCluster

    from bellcrank.search import default_workers

    with (
        _quiet(),
        dask.config.set({"distributed.worker.daemon": True}),
        LocalCluster(
            n_workers=options.workers or default_workers(),
            threads_per_worker=1,
            processes=True,
            host=options.host or LOOPBACK,
            dashboard_address=f"{options.host or LOOPBACK}:0",
            memory_limit=0,  # a run holds little, and a worker must not be paused
            silence_logs=logging.CRITICAL + 1,
            preload=["bellcrank.campaign.engines.preload"],
            scheduler_kwargs={"allowed_failures": 0},  # `drive` counts deaths itself
        ) as cluster,
        _engine(store, cluster, options, _dashboard(cluster)) as engine,
    ):
        yield engine


def _dashboard(cluster: Any) -> str | None:
    """Say where the dashboard is, if what it is made with is installed."""
    try:
        import bokeh  # noqa: F401
    except ImportError:
        return None
    return f"dashboard: {cluster.dashboard_link}"


@engines.register("address")
@contextlib.contextmanager
def address(store: Store, options: EngineOptions) -> Iterator[Engine]:
    """Compute on the workers of a scheduler that is running, and stays so afterwards.

    Raises
    ------
    InvalidSettings
        If its address is none.
    """
    where = options.scheduler or ""
    if not where.startswith(("tcp://", "tls://")):
        raise InvalidSettings(
            f"scheduler: expected an address like tcp://host:8786 or tls://host:8786, got {where!r}"
        )
    with _quiet(), _engine(store, where, options, f"scheduler: {where}") as engine:
        yield engine


@engines.register("slurm")
@contextlib.contextmanager
def slurm(store: Store, options: EngineOptions) -> Iterator[Engine]:
    """Compute in SLURM jobs of one core each, which end with this process.

    The scheduler listens on the network, so all talk is encrypted, with keys made for the
    occasion and kept in the store for as long.

    Raises
    ------
    ClusterError
        If dask-jobqueue is not installed, or SLURM refuses.
    """
    try:
        from dask_jobqueue import SLURMCluster
    except ImportError:
        raise ClusterError(
            "engine 'slurm' needs dask-jobqueue: pip install 'bellcrank[cluster]'"
        ) from None
    with _quiet(), _key_folder(store) as keys:
        chosen: dict[str, Any] = {
            "cores": 1, "processes": 1, "memory": "2GB", "nanny": True, "death_timeout": 60,
            "protocol": "tls://", "security": True, "shared_temp_directory": str(keys),
            "scheduler_options": {"host": options.host, "allowed_failures": 0},
            **options.slurm,
        }  # fmt: skip
        try:
            cluster = SLURMCluster(**chosen)
        except (TypeError, ValueError, ImportError, OSError) as error:
            raise ClusterError(f"SLURM cluster: {_first_line(error)}") from None
        with cluster:
            cluster.scale(jobs=options.workers or 1)
            with _engine(store, cluster, options, _dashboard(cluster)) as engine:
                yield engine


@contextlib.contextmanager
def _key_folder(store: Store) -> Iterator[Path]:
    """Make a folder that only we can read, on the file system that all machines share."""
    folder = store.path / f".keys.{os.urandom(4).hex()}"
    try:
        folder.mkdir(mode=0o700)
    except OSError as error:
        raise StorageError(f"{folder}: cannot be made ({error.strerror})") from None
    try:
        yield folder
    finally:
        for path in folder.iterdir():
            path.unlink(missing_ok=True)
        folder.rmdir()
