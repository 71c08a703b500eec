"""Parallel tempering: chains at several temperatures that exchange their designs.

Chains at high temperature cross barriers, chains at low temperature refine. Neighbouring chains
exchange their designs with probability min(1, exp((1/T_i - 1/T_j) (C_i - C_j))), which leaves the
distribution of each chain unchanged (Hukushima and Nemoto, J. Phys. Soc. Jpn. 65, 1604, 1996).
The chains (replicas) advance in turns of a fixed number of steps.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar, Self, TypeVar

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.model import pack_mask
from bellcrank.search.blocks import (
    BLOCK,
    ProposalRows,
    initial_response,
    random_numbers,
    steps_in_block,
)
from bellcrank.search.kernels.acceptance import metropolis_accepts
from bellcrank.search.markov.costs import costs
from bellcrank.search.markov.evaluated_design import evaluated_design, reached_from
from bellcrank.search.markov.moves import moves
from bellcrank.search.markov.steps import metropolis_step
from bellcrank.search.registry import Search, searches
from bellcrank.search.selection import peaks
from bellcrank.search.settings import SearchSettings, check_names, check_positive, check_whole

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.search.evaluator import Evaluator
    from bellcrank.storage import Proposals

T = TypeVar("T")

TURN = 25
"""Steps of one replica per turn; a block is a whole number of turns."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TemperingSettings(SearchSettings):
    """Settings of parallel tempering.

    Parameters
    ----------
    steps
        Proposals of all replicas together.
    replicas
        Number of temperatures, in geometric progression from `hot` to `cold`.
    moves, cost
        As in `MetropolisSettings`.

    Examples
    --------
    >>> TemperingSettings(replicas=3, hot=0.4, cold=0.1).temperatures
    array([0.4, 0.2, 0.1])
    """

    name: ClassVar[str] = "tempering"
    predicts_flips: ClassVar[bool] = True

    replicas: int = 6
    hot: float = 0.2
    cold: float = 0.005
    moves: tuple[str, ...] = ("balanced", "balanced", "node")
    cost: str = "negative"

    def __post_init__(self) -> None:
        SearchSettings.__post_init__(self)
        check_whole("replicas", self.replicas, 2, 1000)
        for name in ("hot", "cold"):
            check_positive(name, getattr(self, name), "a temperature")
        if self.cold > self.hot:
            raise InvalidSettings(f"cold: expected at most hot = {self.hot!r}, got {self.cold!r}")
        check_names("moves", self.moves, moves)
        costs[self.cost]  # raises UnknownName

    @property
    def temperatures(self) -> NDArray[np.float64]:
        """Temperature of each replica."""
        return np.geomspace(self.hot, self.cold, self.replicas)


@dataclass(frozen=True, slots=True)
class TemperingState:
    """State of the replicas between two blocks.

    Parameters
    ----------
    step
        Proposals made so far by all replicas.
    mask
        The design of each replica in hexadecimal, in the order of falling temperature.
    efficiencies
        Scores of these designs.
    best
        Highest score of an accepted design so far.
    accepted, exchanges
        Accepted proposals and exchanges so far.
    """

    step: int
    mask: tuple[str, ...]
    efficiencies: tuple[float, ...]
    best: float
    accepted: int = 0
    exchanges: int = 0

    @property
    def efficiency(self) -> float:
        """Score of the replica at the lowest temperature."""
        return self.efficiencies[-1]

    def to_dict(self) -> dict[str, Any]:
        """Return the state as plain data."""
        return asdict(self)

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Self:
        """Rebuild the state from plain data."""
        lists = {key: tuple(data[key]) for key in ("mask", "efficiencies")}
        return cls(**{**data, **lists})


def start(evaluator: Evaluator, settings: TemperingSettings, _chain: int) -> TemperingState:
    """Return the state with all replicas at the problem's initial design."""
    efficiency = initial_response(evaluator).score
    mask = pack_mask(evaluator.problem.initial)
    count = settings.replicas
    return TemperingState(0, (mask,) * count, (efficiency,) * count, efficiency)


def is_done(state: TemperingState, settings: TemperingSettings) -> bool:
    """Whether all steps are made."""
    return state.step >= settings.steps


def advance(
    evaluator: Evaluator, settings: TemperingSettings, chain: int, state: TemperingState
) -> tuple[TemperingState, Proposals]:
    """Advance the replicas in turns for one block, with exchanges after each round."""
    rng = random_numbers(settings.seed, chain, state.step // BLOCK)
    rows = ProposalRows()
    last = state.step + steps_in_block(settings, state.step)
    while state.step < last:
        count = min(TURN, last - state.step)
        replica = state.step // TURN % settings.replicas
        state = _take_turn(evaluator, settings, state, replica, count, rng, rows)
        if replica == settings.replicas - 1 and state.step % TURN == 0:
            state = _exchange(settings, state, rng)
    return state, rows.proposals(evaluator.problem)


def _take_turn(
    evaluator: Evaluator,
    settings: TemperingSettings,
    state: TemperingState,
    replica: int,
    count: int,
    rng: np.random.Generator,
    rows: ProposalRows,
) -> TemperingState:
    temperature = float(settings.temperatures[replica])
    current = first = evaluated_design(evaluator, settings.cost, temperature, state.mask[replica])
    accepted, best = state.accepted, state.best
    for _ in range(count):
        name = settings.moves[int(rng.random() * len(settings.moves))]
        after = metropolis_step(current, moves[name], rng, rows)
        accepted += after is not current
        best = max(best, after.response.score)
        current = after
    current = reached_from(current, first)
    return replace(
        state,
        step=state.step + count,
        mask=_with(state.mask, replica, pack_mask(current.mask)),
        efficiencies=_with(state.efficiencies, replica, current.response.score),
        best=best,
        accepted=accepted,
    )


def _exchange(
    settings: TemperingSettings, state: TemperingState, rng: np.random.Generator
) -> TemperingState:
    """Propose an exchange to every second pair of neighbours, alternating between rounds."""
    temperatures = settings.temperatures
    first = state.step // (TURN * settings.replicas) % 2
    for hot in range(first, settings.replicas - 1, 2):
        cold = hot + 1
        rise = costs[settings.cost].of(state.efficiencies[hot]) - costs[settings.cost].of(
            state.efficiencies[cold]
        )
        log_ratio = (1.0 / temperatures[hot] - 1.0 / temperatures[cold]) * rise
        if metropolis_accepts(float(log_ratio), rng.random()):
            masks, values = state.mask, state.efficiencies
            state = replace(
                state,
                mask=_with(_with(masks, hot, masks[cold]), cold, masks[hot]),
                efficiencies=_with(_with(values, hot, values[cold]), cold, values[hot]),
                exchanges=state.exchanges + 1,
            )
    return state


def _with(values: tuple[T, ...], index: int, value: T) -> tuple[T, ...]:
    return (*values[:index], value, *values[index + 1 :])


searches.register("tempering")(
    Search(
        TemperingSettings,
        TemperingState,
        start,
        advance,
        is_done,
        peaks,
        plot_running_best=True,
        title="Parallel tempering",
        summary="Metropolis chains at several temperatures that exchange their designs.",
    )
)
