"""The blocks of a chain, from its stored state; also those computed in a process."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from bellcrank.search.evaluator import make_evaluator
from bellcrank.search.registry import (
    State,
    advance_chain,
    is_done,
    read_settings,
    read_state,
    start_chain,
)
from bellcrank.storage import Proposals, RunFolder

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from bellcrank.search.settings import SearchSettings


def chain_steps(
    folder: RunFolder, settings: SearchSettings, chain: int
) -> Iterator[tuple[State, Proposals]]:
    """Yield the states of a chain after each block and its proposals, from its stored state.

    Parameters
    ----------
    folder
        Run that the chain belongs to.
    settings
        Settings of the search.
    chain
        Number of the chain.
    """
    _, stored = folder.progress(chain)
    evaluator = make_evaluator(folder.problem, settings)
    state = read_state(settings, stored) if stored else start_chain(evaluator, settings, chain)
    while not is_done(state, settings):
        state, proposals = advance_chain(evaluator, settings, chain, state)
        yield state, proposals


def send_steps(send: Callable[[object], None], path: str, chain: int) -> None:
    """Send the blocks of a chain of a run folder as plain data, for `received_steps`."""
    folder = RunFolder.open(path)
    for state, proposals in chain_steps(folder, read_settings(folder.settings), chain):
        send((state.to_dict(), tuple(proposals)))


def received_steps(
    sent: Iterable[Any], settings: SearchSettings
) -> Iterator[tuple[State, Proposals]]:
    """Yield what `chain_steps` yields in the process that sent it."""
    for state, proposals in sent:
        yield read_state(settings, state), Proposals(*proposals)
