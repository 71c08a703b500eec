"""The registry of searches, and what can be done with any of them.

A search is four functions around a state of plain numbers: `start` gives the state before
the first proposal, `advance` makes a block of proposals, `is_done` tells when to stop, and
settings and state go to plain data and back. A chain can thus be stopped between any two
blocks, kept in a file, and gone on with elsewhere to the same last bit.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol, Self

from bellcrank.errors import InvalidSettings
from bellcrank.registry import Registry
from bellcrank.search.blocks import BLOCK
from bellcrank.search.goals import GoalEvaluator
from bellcrank.search.selection import Offers, plateau_ends

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from bellcrank.search.evaluator import Evaluator
    from bellcrank.search.settings import SearchSettings
    from bellcrank.storage import Proposals

DEFAULT_SEARCH = "basin-hopping"


class State(Protocol):
    """Where a chain stands between two blocks."""

    @property
    def step(self) -> int:
        """Proposals made so far."""

    @property
    def efficiency(self) -> float:
        """Of the current design."""

    @property
    def best(self) -> float:
        """Highest efficiency of an accepted design so far."""

    @property
    def accepted(self) -> int:
        """Accepted proposals so far."""

    def to_dict(self) -> dict[str, Any]:
        """Return the state as plain data."""

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Self:
        """Rebuild the state from plain data."""


@dataclass(frozen=True, slots=True)
class Search:
    """One way to search.

    Parameters
    ----------
    settings, state
        Classes of what it is told and of where it stands.
    start
        ``(evaluator, settings, chain)`` to the state before the first proposal.
    advance
        ``(evaluator, settings, chain, state)`` to the state after a block, which ends at a
        multiple of `BLOCK` steps or with the chain, and one row for each proposal in it.
    is_done
        ``(state, settings)``: whether the chain has ended.
    offers
        Which of the accepted designs are worth building.
    leaps
        Whether the path goes up and down so much that a picture should show the best so far.
    """

    settings: type[SearchSettings]
    state: type[State]
    start: Callable[[Evaluator, Any, int], State]
    advance: Callable[[Evaluator, Any, int, Any], tuple[State, Proposals]]
    is_done: Callable[[Any, Any], bool]
    offers: Offers = plateau_ends
    leaps: bool = False


searches: Registry[Search] = Registry("search")


def read_settings(data: dict[str, Any]) -> SearchSettings:
    """Rebuild the settings of a search from plain data.

    Examples
    --------
    >>> settings = read_settings({"search": "paper", "steps": 500})
    >>> settings.name, settings.steps, settings.unloaded_beams
    ('paper', 500, 'keep')

    Raises
    ------
    UnknownName, InvalidSettings
    """
    return searches[str(data.get("search", DEFAULT_SEARCH))].settings.from_dict(data)


def read_state(settings: SearchSettings, data: dict[str, Any]) -> State:
    """Rebuild the state of a chain from plain data."""
    return searches[settings.name].state.from_dict(data)


def start_chain(evaluator: Evaluator, settings: SearchSettings, chain: int = 0) -> State:
    """Return the state of a chain before its first proposal.

    Raises
    ------
    InvalidSettings
        If the initial design has no response, so that there is nothing to compare with.
    """
    return searches[settings.name].start(evaluator, settings, chain)


def advance_chain(
    evaluator: Evaluator, settings: SearchSettings, chain: int, state: State
) -> tuple[State, Proposals]:
    """Advance a chain by one block, or less if it ends first.

    Returns
    -------
    state
        After the block.
    proposals
        One row for each step made.
    """
    if state.step % BLOCK:
        raise InvalidSettings(f"chain {chain}: a state at step {state.step} is not between blocks")
    after, proposals = searches[settings.name].advance(evaluator, settings, chain, state)
    if isinstance(evaluator, GoalEvaluator):
        proposals = evaluator.as_meant(proposals)
    return after, proposals


def is_done(state: State, settings: SearchSettings) -> bool:
    """Whether a chain has made all its steps, or ended for another reason."""
    return searches[settings.name].is_done(state, settings)


def chain_blocks(
    evaluator: Evaluator, settings: SearchSettings, chain: int, state: State | None = None
) -> Iterator[tuple[State, Proposals]]:
    """Yield state and proposals block by block until the chain is done.

    Examples
    --------
    >>> from bellcrank.mechanics import SpringEvaluator
    >>> from bellcrank.model import find_problem
    >>> settings = read_settings({"search": "paper", "steps": 300})
    >>> evaluator = SpringEvaluator(find_problem("scaling-8"))
    >>> [state.step for state, _ in chain_blocks(evaluator, settings, 0)]
    [250, 300]
    """
    state = state or start_chain(evaluator, settings, chain)
    while not is_done(state, settings):
        state, proposals = advance_chain(evaluator, settings, chain, state)
        yield state, proposals
