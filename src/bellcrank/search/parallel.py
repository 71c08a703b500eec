"""Many chains of one run on the cores of this machine, kept on disk as they go.

Threads are enough: the compiled loop runs without the interpreter lock. Results do not
depend on how many there are.
"""

from __future__ import annotations

import os
import threading
from concurrent.futures import FIRST_EXCEPTION, ThreadPoolExecutor, wait
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.mechanics import evaluators_that_fit
from bellcrank.search.evaluator import make_evaluator
from bellcrank.search.registry import (
    State,
    advance_chain,
    is_done,
    read_state,
    start_chain,
)
from bellcrank.storage import Proposals, RunFolder

if TYPE_CHECKING:
    from collections.abc import Callable

    from bellcrank.search.settings import SearchSettings

SHARD = 4000
"""Steps that are kept in memory before they are written: what a kill can cost in time."""


@dataclass(frozen=True, slots=True)
class Progress:
    """How a chain is doing, told after each block.

    Parameters
    ----------
    chain
        Its number.
    state
        Where it stands.
    temperature
        Of its last proposal.
    steps, accepted
        Proposals made and accepted in the block.
    """

    chain: int
    state: State
    temperature: float
    steps: int
    accepted: int


def default_workers() -> int:
    """Return the number of cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def run_chain(
    folder: RunFolder,
    settings: SearchSettings,
    chain: int,
    stop: threading.Event,
    tell: Callable[[Progress], None],
) -> bool:
    """Advance one chain from where its files end; return whether it is done.

    Every so many steps, at the end and when `stop` is set, what was done is written
    together with the state to go on from.
    """
    next_step, stored = folder.progress(chain)
    evaluator = make_evaluator(folder.problem, settings)
    state = read_state(settings, stored) if stored else start_chain(evaluator, settings, chain)
    pending: list[Proposals] = []
    while not is_done(state, settings) and not stop.is_set():
        state, proposals = advance_chain(evaluator, settings, chain, state)
        pending.append(proposals)
        tell(
            Progress(
                chain,
                state,
                float(proposals.temperature[-1]),
                len(proposals.accepted),
                int(proposals.accepted.sum()),
            )
        )
        if state.step - next_step >= SHARD:
            folder.append(chain, next_step, _joined(pending), state.to_dict())
            next_step, pending = state.step, []
    if pending:
        folder.append(chain, next_step, _joined(pending), state.to_dict())
    return is_done(state, settings)


def _joined(parts: list[Proposals]) -> Proposals:
    return Proposals(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))


def run_chains(
    folder: RunFolder,
    settings: SearchSettings,
    *,
    workers: int | None = None,
    tell: Callable[[Progress], None] = lambda _progress: None,
    stop: threading.Event | None = None,
) -> bool:
    """Run all chains of a run to their end, or until `stop` is set.

    An error in one chain stops the others after their block, so that nothing already
    computed is lost, and is raised then. Ctrl-C does the same.

    Returns
    -------
    bool
        Whether every chain is done.
    """
    stop = stop or threading.Event()
    threads = evaluators_that_fit(
        folder.problem, workers or default_workers(), predict_flips=settings.predicts_flips
    )
    with ThreadPoolExecutor(threads) as pool:
        futures = [
            pool.submit(run_chain, folder, settings, chain, stop, tell)
            for chain in range(settings.chains)
        ]
        try:
            _, unfinished = wait(futures, return_when=FIRST_EXCEPTION)
            if unfinished:
                stop.set()
        except BaseException:
            stop.set()
            raise
    done = [future.result() for future in futures]  # all of them: one may hold an error
    return all(done)
