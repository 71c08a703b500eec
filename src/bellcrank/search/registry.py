"""Registry of searches, and the functions that apply to any of them.

A search consists of four functions and a state of plain numbers: `start` returns the state
before the first proposal, `advance` makes one block of proposals, `is_done` decides when the
chain ends, and settings and state convert to plain data and back. A chain can therefore be
stopped between any two blocks, stored, and resumed on another machine to the same last bit.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol, Self

from bellcrank.errors import InvalidSettings
from bellcrank.registry import Registry
from bellcrank.search.blocks import BLOCK
from bellcrank.search.constraints.evaluator import ConstrainedEvaluator
from bellcrank.search.selection import CandidateRule, plateau_ends
from bellcrank.search.specification import SpecificationEvaluator

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from bellcrank.search.evaluator import Evaluator
    from bellcrank.search.settings import SearchSettings
    from bellcrank.storage import Proposals

DEFAULT_SEARCH = "basin-hopping"


class State(Protocol):
    """State of a chain between two blocks."""

    @property
    def step(self) -> int:
        """Proposals made so far."""

    @property
    def efficiency(self) -> float:
        """Score of the current design."""

    @property
    def best(self) -> float:
        """Highest score of an accepted design so far."""

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
    """Entry of the registry of searches.

    Parameters
    ----------
    settings, state
        Classes of the settings and of the state.
    start
        Function of ``(evaluator, settings, chain)`` that returns the state before the first
        proposal.
    advance
        Function of ``(evaluator, settings, chain, state)`` that returns the state after a block,
        which ends at a multiple of `BLOCK` steps or with the chain, and one row per proposal.
    is_done
        Function of ``(state, settings)``: whether the chain has ended.
    candidate_rule
        Selects candidates for the final design from the accepted designs.
    plot_running_best
        Whether plots show the best efficiency so far in place of the current one, which varies
        too much to be read.
    title, summary
        Display name, and a description in one sentence.
    """

    settings: type[SearchSettings]
    state: type[State]
    start: Callable[[Evaluator, Any, int], State]
    advance: Callable[[Evaluator, Any, int, Any], tuple[State, Proposals]]
    is_done: Callable[[Any, Any], bool]
    candidate_rule: CandidateRule = plateau_ends
    plot_running_best: bool = False
    title: str = ""
    summary: str = ""


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
        If the problem has no support, or its initial design no unique, stable response.
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
        One row per step.
    """
    if state.step % BLOCK:
        raise InvalidSettings(
            f"chain {chain}: expected a state at a multiple of {BLOCK} steps, got step {state.step}"
        )
    after, proposals = searches[settings.name].advance(evaluator, settings, chain, state)
    if isinstance(evaluator, ConstrainedEvaluator | SpecificationEvaluator):
        proposals = evaluator.groups.expand_proposals(proposals)
    return after, proposals


def is_done(state: State, settings: SearchSettings) -> bool:
    """Whether a chain has ended."""
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
