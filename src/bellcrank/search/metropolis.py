"""Metropolis chains: the paper's search, and the same with better moves.

A chain advances in blocks of a fixed number of steps. At the start of each block the
equilibrium of the current design is computed afresh from rest and the random numbers
are drawn from a stream named by seed, chain and block: the state between two blocks is
a handful of plain numbers, and a chain resumed from it is the same to the last bit.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.mechanics import SpringEvaluator, UnloadedBeams
from bellcrank.model import pack_mask, unpack_mask
from bellcrank.search.blocks import (
    BLOCK,
    Rows,
    initial_response,
    random_numbers,
    steps_ahead,
)
from bellcrank.search.costs import costs
from bellcrank.search.moves import moves
from bellcrank.search.schedules import schedules
from bellcrank.search.searches import Search, searches
from bellcrank.search.settings import NO_LIMIT, SearchSettings, check_positive, check_whole
from bellcrank.search.walking import place_of, step
from bellcrank.storage import Proposals

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.search.evaluator import Evaluator


@dataclass(frozen=True, slots=True, kw_only=True)
class MetropolisSettings(SearchSettings):
    """Settings of the paper's search; the defaults are the paper's.

    Parameters
    ----------
    moves
        Names in the registry of moves, drawn with equal chances; one named twice is drawn
        twice as often.
    cost, schedule
        Names in the registries of costs and schedules.
    hot, cold
        Temperatures at the start and after annealing.
    annealing
        Accepted steps over which the temperature falls.
    minimum_degree
        Least number of beams that a removal may leave at a free node; 0 for no rule.
    patience
        Rejections in a row after which a chain ends; None for never.

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
    minimum_degree: int = 0
    patience: int | None = None

    def __post_init__(self) -> None:
        SearchSettings.__post_init__(self)
        check_whole("annealing", self.annealing, 0)
        check_whole("minimum_degree", self.minimum_degree, 0)
        if self.patience is not None:
            check_whole("patience", self.patience, 1)
        for name in ("hot", "cold"):
            check_positive(name, getattr(self, name), "a temperature")
        if not self.moves or isinstance(self.moves, str):
            raise InvalidSettings(f"moves: expected names of moves, got {self.moves!r}")
        for registry, names in (
            (costs, [self.cost]),
            (schedules, [self.schedule]),
            (moves, self.moves),
        ):
            for name in names:
                registry[name]  # an unknown name explains itself

    @property
    def temperatures(self) -> NDArray[np.float64]:
        """Temperature after 0, 1, 2, ... accepted steps."""
        return schedules[self.schedule](self.hot, self.cold, self.annealing)


@dataclass(frozen=True, slots=True, kw_only=True)
class InformedSettings(MetropolisSettings):
    """Settings of a Metropolis chain that looks before it leaps.

    Beams are flipped by what their flip is predicted to do, nodes are cleared and filled,
    and the temperature falls in units of the efficiency. For the rest, see
    `MetropolisSettings`.
    """

    name: ClassVar[str] = "informed"
    predicts_flips: ClassVar[bool] = True

    unloaded_beams: UnloadedBeams = "prune_all"
    moves: tuple[str, ...] = ("balanced", "balanced", "delayed", "node")
    cost: str = "negative"
    schedule: str = "geometric"
    hot: float = 0.1
    cold: float = 0.005
    annealing: int = 4000


@dataclass(frozen=True, slots=True)
class ChainState:
    """Where a chain stands between two blocks.

    Parameters
    ----------
    step
        Proposals made so far.
    mask
        The current design in hexadecimal.
    efficiency, cost
        Of the current design.
    best
        Highest efficiency of an accepted design so far.
    accepted
        Accepted proposals so far.
    rejections
        Rejected proposals since the last accepted one.
    """

    step: int
    mask: str
    efficiency: float
    cost: float
    best: float
    accepted: int = 0
    rejections: int = 0

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
    """Whether a chain has made all its steps or lost its patience."""
    return state.step >= settings.steps or state.rejections >= (settings.patience or NO_LIMIT)


def advance(
    evaluator: Evaluator, settings: MetropolisSettings, chain: int, state: ChainState
) -> tuple[ChainState, Proposals]:
    """Advance a chain by one block, or less if its steps or its patience end first."""
    rng = random_numbers(settings.seed, chain, state.step // BLOCK)
    return make_steps(evaluator, settings, state, rng, steps_ahead(settings, state.step))


def make_steps(
    evaluator: Evaluator,
    settings: MetropolisSettings,
    state: ChainState,
    rng: np.random.Generator,
    count: int,
) -> tuple[ChainState, Proposals]:
    """Make so many steps, at most a block of them, or less if the patience ends first."""
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
    from bellcrank.search.kernels.metropolis import Chain, Records, Rules, advance

    mask = unpack_mask(state.mask, evaluator.problem.lattice.beam_count)
    evaluator.evaluate(mask)
    evaluator.set_reference()
    chain = Chain(
        mask=mask.astype(np.uint8),
        packed=np.packbits(mask),
        value=np.array([state.efficiency, state.cost, state.best]),
        counts=np.array([state.accepted, state.rejections]),
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
    rules = Rules(
        cost=costs[settings.cost].code,
        core=evaluator.core,
        minimum_degree=settings.minimum_degree,
        patience=settings.patience or NO_LIMIT,
    )
    made = advance(
        evaluator.system, evaluator.problem.designable, rules, settings.temperatures, uniforms,
        chain, evaluator.known, evaluator.structure, evaluator.displacement, evaluator.scratch,
        records,
    )  # fmt: skip
    efficiency, cost, best = chain.value.tolist()
    accepted, rejections = chain.counts.tolist()
    after = ChainState(
        state.step + made, chain.packed.tobytes().hex(), efficiency, cost, best,
        accepted, rejections,
    )  # fmt: skip
    return after, Proposals(
        records.mask[:made],
        records.efficiency[:made],
        records.cost[:made],
        records.temperature[:made],
        records.accepted[:made].astype(bool),
        records.status[:made].astype(np.int8),
    )


def advance_in_python(
    evaluator: Evaluator,
    settings: MetropolisSettings,
    state: ChainState,
    rng: np.random.Generator,
    count: int,
) -> tuple[ChainState, Proposals]:
    """Make steps with any evaluator and any moves.

    The compiled loop in `bellcrank.search.kernels.metropolis` does the same, faster, where
    single beams are flipped.
    """
    chosen = [moves[name] for name in settings.moves]
    temperatures = settings.temperatures
    here = place_of(evaluator, settings.cost, temperatures[0], state.mask)
    rows = Rows()
    last = state.step + count
    while state.step < last and not is_done(state, settings):
        here.temperature = float(temperatures[min(state.accepted, len(temperatures) - 1)])
        move = chosen[0] if len(chosen) == 1 else chosen[int(rng.random() * len(chosen))]
        after = step(here, move, rng, rows, settings.minimum_degree)
        state = replace(state, step=state.step + 1, rejections=state.rejections + 1)
        if after is not here:
            efficiency = after.response.score
            state = replace(
                state, efficiency=efficiency, cost=after.cost, best=max(state.best, efficiency),
                accepted=state.accepted + 1, rejections=0,
            )  # fmt: skip
        here = after
    return replace(state, mask=pack_mask(here.mask)), rows.proposals(evaluator.problem)


searches.register("paper")(Search(MetropolisSettings, ChainState, start, advance, is_done))
searches.register("informed")(Search(InformedSettings, ChainState, start, advance, is_done))
