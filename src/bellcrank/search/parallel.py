"""Several chains of one run in parallel, stored as they advance.

Each chain has a thread. The compiled loop of the spring model releases the interpreter lock, so
threads use all cores; chains of frames are computed in processes (`bellcrank.processes`). The
results do not depend on their number.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import BellcrankError
from bellcrank.mechanics import evaluators_that_fit
from bellcrank.processes import POLL_INTERVAL, FunctionProcess, default_workers
from bellcrank.search.chain_process import chain_steps, received_steps, send_steps
from bellcrank.search.registry import State, is_done, read_state
from bellcrank.storage import Proposals, RunFolder

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from bellcrank.search.settings import SearchSettings

SEGMENT_STEPS = 4000
"""Steps after which the proposals of a chain are written to disk."""
STOP_TIMEOUT = 0.5
"""Seconds in which a chain can end its block after a request to stop."""


@dataclass(frozen=True, slots=True)
class Progress:
    """Progress of a chain, reported after each block.

    Parameters
    ----------
    chain
        Number of the chain.
    state
        State of the chain after the block.
    temperature
        Temperature of its last proposal.
    steps, accepted
        Number of proposals made and accepted in the block.
    """

    chain: int
    state: State
    temperature: float
    steps: int
    accepted: int


class ChainRunner:
    """Advances one chain from its last stored state and stores what it proposes.

    A compiled block cannot be interrupted. `close` therefore stores the complete blocks from
    another thread and makes `run` discard the block that it is still computing.

    Parameters
    ----------
    folder
        Run that the chain belongs to.
    settings
        Settings of the search.
    chain
        Number of the chain.

    Attributes
    ----------
    chain
        Number of the chain.
    done
        Whether the chain has reached its end.
    """

    def __init__(
        self,
        folder: RunFolder,
        settings: SearchSettings,
        chain: int,
        *,
        in_process: bool = False,
    ) -> None:
        self.done = False
        self._in_process = in_process
        self._process: FunctionProcess | None = None
        self._folder = folder
        self._settings = settings
        self.chain = chain
        self._lock = threading.Lock()
        self._closed = False
        self._pending: list[Proposals] = []
        self._stored_steps = 0
        self._state: State | None = None

    def run(self, stopped: Callable[[], bool], progress: Callable[[Progress], None]) -> None:
        """Advance the chain to its end, or until `stopped()` or `close`."""
        folder, settings, chain = self._folder, self._settings, self.chain
        self._stored_steps, stored = folder.progress(chain)
        if stored and is_done(read_state(settings, stored), settings):
            self.done = True
            self.close()
            return
        for state, proposals in self._steps():
            with self._lock:
                if self._closed:
                    return
                self._state = state
                self._pending.append(proposals)
                if state.step - self._stored_steps >= SEGMENT_STEPS:
                    self._store()
            temperature = float(proposals.temperature[-1])
            accepted = int(proposals.accepted.sum())
            progress(Progress(chain, state, temperature, len(proposals.accepted), accepted))
            self.done = is_done(state, settings)
            if stopped():
                break
        self.close()

    def _steps(self) -> Iterator[tuple[State, Proposals]]:
        """Yield blocks, from a process if the chain has one."""
        if not self._in_process:
            yield from chain_steps(self._folder, self._settings, self.chain)
            return
        with self._lock:
            if self._closed:
                return
            path = str(self._folder.path.resolve())
            self._process = FunctionProcess(
                send_steps.__module__, send_steps.__name__, path, self.chain
            )
        try:
            yield from received_steps(self._process, self._settings)
        except RuntimeError:
            if not self._closed:
                raise

    def close(self) -> None:
        """Store the complete blocks; what `run` computes afterwards is discarded."""
        with self._lock:
            self._closed = True
            if self._process is not None:
                self._process.kill()
            self._store()

    def _store(self) -> None:
        if self._pending:
            assert self._state is not None
            columns = zip(*self._pending, strict=True)
            self._pending = []
            rows = Proposals(*map(np.concatenate, columns))
            self._folder.append(self.chain, self._stored_steps, rows, self._state.to_dict())
            self._stored_steps = self._state.step


def run_chains(
    folder: RunFolder,
    settings: SearchSettings,
    *,
    workers: int | None = None,
    progress: Callable[[Progress], None] = lambda _progress: None,
    stop: threading.Event | None = None,
) -> bool:
    """Run all chains of a run to their end, or until `stop` is set.

    After a request to stop, an error in a chain or Ctrl-C, the other chains may end their block
    within `STOP_TIMEOUT`; complete blocks are stored, incomplete ones are discarded.

    Parameters
    ----------
    folder
        Run that the chains belong to.
    settings
        Settings of the search.
    workers
        Number of chains at a time; by default one for each core.
    progress
        Called with the progress of a chain after each block, from the thread of that chain.
    stop
        Event that requests a stop.

    Returns
    -------
    bool
        Whether every chain has reached its end.
    """
    stop = stop or threading.Event()
    count = evaluators_that_fit(
        folder.problem, workers or default_workers(), predict_flips=settings.predicts_flips
    )
    several = min(count, settings.chains) > 1 and folder.problem.section is not None
    runners = [
        ChainRunner(folder, settings, chain, in_process=several) for chain in range(settings.chains)
    ]
    waiting = deque(runners)
    errors: list[BaseException] = []

    def stopped() -> bool:
        return bool(errors) or stop.is_set()

    def work() -> None:
        while not stopped():
            try:
                runner = waiting.popleft()
            except IndexError:
                return
            try:
                runner.run(stopped, progress)
            except BaseException as error:  # raised again below
                errors.append(error)

    # Daemon threads do not delay the end of the process while they compute a block.
    threads = [threading.Thread(target=work, daemon=True) for _ in range(min(count, len(runners)))]
    for thread in threads:
        thread.start()
    try:
        while any(thread.is_alive() for thread in threads) and not stopped():
            _join(threads, POLL_INTERVAL)
        _join(threads, STOP_TIMEOUT)
    finally:
        for runner in runners:
            try:
                runner.close()
            except BellcrankError as error:
                errors.append(error)
    if errors:
        raise errors[0]
    return all(runner.done for runner in runners)


def _join(threads: Sequence[threading.Thread], timeout: float) -> None:
    """Wait until all threads have ended, or for `timeout` seconds."""
    end = time.monotonic() + timeout
    for thread in threads:
        thread.join(max(0.0, end - time.monotonic()))
