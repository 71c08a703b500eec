"""Metropolis chains: the search of the paper.

A chain advances in blocks of a fixed number of steps. At the start of each block the equilibrium
of the current design is computed afresh from rest, and the random numbers come from a stream
identified by seed, chain and block. The state between two blocks is therefore a few plain
numbers, and a chain resumed from it is identical to the last bit.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from bellcrank.mechanics import SpringEvaluator, UnloadedBeams
from bellcrank.model import pack_mask, unpack_mask
from bellcrank.search.blocks import (
    BLOCK,
    ProposalRows,
    initial_response,
    random_numbers,
    steps_in_block,
)
from bellcrank.search.markov.costs import costs, schedules
from bellcrank.search.markov.evaluated_design import evaluated_design, reached_from
from bellcrank.search.markov.moves import moves
from bellcrank.search.markov.steps import metropolis_step
from bellcrank.search.registry import Search, searches
from bellcrank.search.settings import (
    SearchSettings,
    check_names,
    check_positive,
    check_whole,
)
from bellcrank.storage import Proposals

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.search.evaluator import Evaluator


@dataclass(frozen=True, slots=True, kw_only=True)
class MetropolisSettings(SearchSettings):
    """Settings of the paper's search; the defaults are those of the paper.

    Parameters
    ----------
    moves
        Names in the registry of moves, drawn with equal probability; a name given twice is drawn
        twice as often.
    cost, schedule
        Names in the registries of costs and temperature schedules.
    hot, cold
        Temperatures at the start and after annealing.
    annealing
        Accepted steps over which the temperature decreases.

    Raises
    ------
    InvalidSettings, UnknownName

    Examples
    --------
    >>> MetropolisSettings(steps=1000).temperatures[[0, 50, 100]]
    array([0.06  , 0.0305, 0.001 ])
    """

    name: ClassVar[str] = "paper"

    unloaded_beams: UnloadedBeams = "keep"
    moves: tuple[str, ...] = ("flip",)
    cost: str = "exponential"
    schedule: str = "linear"
    hot: float = 0.06
    cold: float = 1e-3
    annealing: int = 100

    def __post_init__(self) -> None:
        SearchSettings.__post_init__(self)
        check_whole("annealing", self.annealing, 0)
        for name in ("hot", "cold"):
            check_positive(name, getattr(self, name), "a temperature")
        check_names("moves", self.moves, moves)
        costs[self.cost]  # raises UnknownName
        schedules[self.schedule]

    @property
    def temperatures(self) -> NDArray[np.float64]:
        """Temperature after 0, 1, 2, ... accepted steps."""
        return schedules[self.schedule](self.hot, self.cold, self.annealing)


@dataclass(frozen=True, slots=True)
class ChainState:
    """State of a Metropolis chain between two blocks.

    Parameters
    ----------
    step
        Proposals made so far.
    mask
        The current design in hexadecimal.
    efficiency, cost
        Score and cost of the current design.
    best
        Highest score of an accepted design so far.
    accepted
        Accepted proposals so far.
    """

    step: int
    mask: str
    efficiency: float
    cost: float
    best: float
    accepted: int = 0

    def to_dict(self) -> dict[str, Any]:
        """Return the state as plain data."""
        return asdict(self)

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Self:
        """Rebuild the state from plain data."""
        return cls(**data)


def start(evaluator: Evaluator, settings: MetropolisSettings, _chain: int) -> ChainState:
    """Return the state of a chain at the problem's initial design."""
    efficiency = initial_response(evaluator).score
    return ChainState(
        step=0,
        mask=pack_mask(evaluator.problem.initial),
        efficiency=efficiency,
        cost=costs[settings.cost].of(efficiency),
        best=efficiency,
    )


def is_done(state: ChainState, settings: MetropolisSettings) -> bool:
    """Whether a chain has made all its steps."""
    return state.step >= settings.steps


def advance(
    evaluator: Evaluator, settings: MetropolisSettings, chain: int, state: ChainState
) -> tuple[ChainState, Proposals]:
    """Advance a chain by one block."""
    rng = random_numbers(settings.seed, chain, state.step // BLOCK)
    return metropolis_phase(evaluator, settings, state, rng, steps_in_block(settings, state.step))


def metropolis_phase(
    evaluator: Evaluator,
    settings: MetropolisSettings,
    state: ChainState,
    rng: np.random.Generator,
    count: int,
) -> tuple[ChainState, Proposals]:
    """Make `count` steps, at most one block.

    Single flips with the spring model run in a compiled loop.
    """
    flips_only = set(settings.moves) == {"flip"}
    if isinstance(evaluator, SpringEvaluator) and flips_only:
        return _advance_compiled(evaluator, settings, state, rng.random((BLOCK, 2))[:count])
    return advance_in_python(evaluator, settings, state, rng, count)


def _advance_compiled(
    evaluator: SpringEvaluator,
    settings: MetropolisSettings,
    state: ChainState,
    uniforms: NDArray[np.float64],
) -> tuple[ChainState, Proposals]:
    from bellcrank.search.kernels.metropolis import Chain, Records, advance

    mask = unpack_mask(state.mask, evaluator.problem.lattice.beam_count)
    evaluator.evaluate(mask)
    evaluator.set_reference()
    chain = Chain(
        mask=mask.astype(np.uint8),
        packed=np.packbits(mask),
        value=np.array([state.efficiency, state.cost, state.best]),
        accepted=np.array([state.accepted]),
    )
    steps = len(uniforms)
    records = Records(
        mask=np.empty((steps, len(chain.packed)), np.uint8),
        efficiency=np.empty(steps),
        cost=np.empty(steps),
        temperature=np.empty(steps),
        accepted=np.empty(steps, np.uint8),
        status=np.empty(steps, np.uint8),
    )
    advance(
        evaluator.system, evaluator.problem.designable, costs[settings.cost].code, evaluator.core,
        settings.temperatures, uniforms, chain, evaluator.reference, evaluator.structure,
        evaluator.displacement, evaluator.scratch, records,
    )  # fmt: skip
    efficiency, cost, best = chain.value.tolist()
    after = ChainState(
        state.step + steps, chain.packed.tobytes().hex(), efficiency, cost, best,
        int(chain.accepted[0]),
    )  # fmt: skip
    return after, Proposals(
        records.mask,
        records.efficiency,
        records.cost,
        records.temperature,
        records.accepted.astype(bool),
        records.status.astype(np.int8),
    )


def advance_in_python(
    evaluator: Evaluator,
    settings: MetropolisSettings,
    state: ChainState,
    rng: np.random.Generator,
    count: int,
) -> tuple[ChainState, Proposals]:
    """Make steps with any evaluator and any moves.

    For single flips the results equal those of `bellcrank.search.kernels.metropolis`.
    """
    chosen = [moves[name] for name in settings.moves]
    temperatures = settings.temperatures
    current = first = evaluated_design(evaluator, settings.cost, temperatures[0], state.mask)
    begun, rows = state, ProposalRows()
    for _ in range(count):
        current.temperature = float(temperatures[min(state.accepted, len(temperatures) - 1)])
        move = chosen[0] if len(chosen) == 1 else chosen[int(rng.random() * len(chosen))]
        after = metropolis_step(current, move, rng, rows)
        if after is not current:
            efficiency = after.response.score
            state = replace(
                state, efficiency=efficiency, cost=after.cost, best=max(state.best, efficiency),
                accepted=state.accepted + 1,
            )  # fmt: skip
        current = after
    if reached_from(current, first) is not current:
        unchanged = {name: getattr(begun, name) for name in ("mask", "efficiency", "cost", "best")}
        state = replace(state, **unchanged)
    else:
        state = replace(state, mask=pack_mask(current.mask))
    return replace(state, step=state.step + count), rows.proposals(evaluator.problem)


searches.register("paper")(
    Search(
        MetropolisSettings,
        ChainState,
        start,
        advance,
        is_done,
        title="Metropolis (paper)",
        summary="Single random flips with annealing, as published by Bonfanti et al. (2020).",
    )
)
