"""Runs on the workers of a Dask scheduler, wherever that is."""

from __future__ import annotations

import contextlib
import logging
import os
import queue
import threading
import time
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from bellcrank.campaign.engines.base import Outcome, WorkerDied
from bellcrank.campaign.engines.versions import software, version_difference
from bellcrank.campaign.work import allow_work, describe_store, request_stop, work
from bellcrank.errors import ClusterError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from distributed import Client, Future, Security

    from bellcrank.campaign.engines.base import Engine
    from bellcrank.campaign.store import Store

AHEAD = 1
"""Runs in hand for each worker: none queues behind a run whose worker dies, and dies with it."""
RECOUNT = 5.0
"""Seconds after which the workers are counted again."""
STORYTELLERS = ("distributed", "tornado", "asyncio", "dask_jobqueue")
"""Loggers that write to standard error."""
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
    note
        What to tell whoever started it.
    renew
        Called now and then, to replace workers that are gone for good.
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
            if isinstance(answer, OSError):
                continue  # it died just now; `checked_work` asks the one that takes its place
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
                self._renew()
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
        # In a thread of its own: a worker that cannot be reached must not hold us up.
        threading.Thread(target=self._tell_all_to_stop, daemon=True).start()

    def _tell_all_to_stop(self) -> None:
        with contextlib.suppress(Exception):
            self._client.run(request_stop, self._path, on_error="ignore")


@contextlib.contextmanager
def quiet() -> Iterator[None]:
    """Keep Dask's own stories off standard error: what matters comes as one error."""
    import distributed  # noqa: F401  # its loggers have levels of their own from then on

    names = [
        name
        for name in (*logging.root.manager.loggerDict, *STORYTELLERS)
        if name.partition(".")[0] in STORYTELLERS
    ]
    before = {name: logging.getLogger(name).level for name in names}
    try:
        for name in names:
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)
        yield
    finally:
        for name, level in before.items():
            logging.getLogger(name).setLevel(level)


@contextlib.contextmanager
def connected(
    store: Store,
    where: Any,
    *,
    timeout: float,
    security: Security | None = None,
    note: str | None = None,
    renew: Callable[[], object] = lambda: None,
) -> Iterator[Engine]:
    """Connect to a scheduler, check its workers, and leave it afterwards.

    Parameters
    ----------
    where
        Address of the scheduler, or a cluster of ours.
    timeout
        Seconds to wait for a connection.
    security
        What proves who we are, for ``tls://``.
    note, renew
        For the engine.

    Raises
    ------
    ClusterError
        If it cannot be reached in time, or a worker does not fit.
    """
    from distributed import Client

    try:
        client = Client(where, timeout=timeout, security=security, set_as_default=False)
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
            client.close(timeout=GOODBYE)


def first_line(error: BaseException | None) -> str:
    """Return what an error says, in one line."""
    text = str(error).strip() or type(error).__name__
    return text.splitlines()[0]


def dashboard(cluster: Any) -> str | None:
    """Say where the dashboard is, if what it is made with is installed."""
    if find_spec("bokeh") is None:
        return None
    return f"dashboard: {cluster.dashboard_link}"
