"""One Markov chain, as a function from a state to the next and a generator around it.

A chain advances in blocks of a fixed number of steps. At the start of each block the
equilibrium of the current design is computed afresh from rest and the random numbers
are drawn from a stream named by seed, chain and block: the state between two blocks is
a handful of plain numbers, and a chain resumed from it is the same to the last bit.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.mechanics import Evaluator, Response, Status
from bellcrank.model import Problem, pack_mask, unpack_mask
from bellcrank.runs import Proposals
from bellcrank.search.costs import costs
from bellcrank.search.settings import NO_LIMIT, MetropolisSettings

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

BLOCK = 250
"""Steps between two states at which a chain can be stopped and resumed."""


class Responder(Protocol):
    """Whatever can tell the efficiency of a design: mechanics, a network, finite elements."""

    problem: Problem

    def respond(self, mask: NDArray[np.bool_]) -> Response:
        """Response of a design, from nothing."""

    def respond_nearby(self, mask: NDArray[np.bool_]) -> Response:
        """Response of a design similar to the remembered one."""

    def remember(self) -> None:
        """Keep the design evaluated last as the one to start from."""


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


def start_chain(responder: Responder, settings: MetropolisSettings) -> ChainState:
    """Return the state of a chain before its first proposal: the problem's initial design.

    Raises
    ------
    InvalidSettings
        If the initial design has no response, so that there is nothing to compare with.
    """
    problem = responder.problem
    response = responder.respond(problem.initial)
    if response.status is not Status.CONVERGED:
        raise InvalidSettings(
            f"problem {problem.name!r}: the search cannot start from the initial design: "
            f"{response.status.message}"
        )
    return ChainState(
        step=0,
        mask=pack_mask(problem.initial),
        efficiency=response.efficiency,
        cost=costs[settings.cost].of(response.efficiency),
        best=response.efficiency,
    )


def draw_uniforms(seed: int, chain: int, block: int, steps: int) -> NDArray[np.float64]:
    """Random numbers of one block of one chain, the same whenever they are asked for."""
    sequence = np.random.SeedSequence(seed, spawn_key=(chain, block))
    return np.random.Generator(np.random.Philox(sequence)).random((BLOCK, 2))[:steps]


def advance_chain(
    responder: Responder, settings: MetropolisSettings, chain: int, state: ChainState
) -> tuple[ChainState, Proposals]:
    """Advance a chain by one block, or less if `settings.steps` or its patience ends first.

    Returns
    -------
    state
        After the block.
    proposals
        One row for each step made.
    """
    block, offset = divmod(state.step, BLOCK)
    if offset:
        raise InvalidSettings(f"chain {chain}: a state at step {state.step} is not between blocks")
    steps = min(BLOCK, settings.steps - state.step)
    uniforms = draw_uniforms(settings.seed, chain, block, steps)
    if isinstance(responder, Evaluator) and settings.minimiser == "newton":
        return _advance_compiled(responder, settings, state, uniforms)
    return advance_in_python(responder, settings, state, uniforms)


def chain_blocks(
    responder: Responder,
    settings: MetropolisSettings,
    chain: int,
    state: ChainState | None = None,
) -> Iterator[tuple[ChainState, Proposals]]:
    """Yield state and proposals block by block until the chain is done.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> settings = MetropolisSettings(steps=300)
    >>> evaluator = Evaluator(find_problem("scaling-8"))
    >>> [state.step for state, _ in chain_blocks(evaluator, settings, 0)]
    [250, 300]
    """
    state = state or start_chain(responder, settings)
    while not is_done(state, settings):
        state, proposals = advance_chain(responder, settings, chain, state)
        yield state, proposals


def is_done(state: ChainState, settings: MetropolisSettings) -> bool:
    """Whether a chain has made all its steps or lost its patience."""
    return state.step >= settings.steps or state.rejections >= (settings.patience or NO_LIMIT)


def _advance_compiled(
    evaluator: Evaluator,
    settings: MetropolisSettings,
    state: ChainState,
    uniforms: NDArray[np.float64],
) -> tuple[ChainState, Proposals]:
    from bellcrank.search.kernels.metropolis import Chain, Records, Rules, advance

    mask = unpack_mask(state.mask, evaluator.problem.lattice.beam_count)
    evaluator.respond(mask)
    evaluator.remember()
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


def accepts(old_cost: float, new_cost: float, temperature: float, uniform: float) -> bool:
    """Metropolis' rule: always downhill, uphill with probability exp(-rise / T)."""
    return new_cost <= old_cost or uniform < math.exp((old_cost - new_cost) / temperature)


def advance_in_python(
    responder: Responder,
    settings: MetropolisSettings,
    state: ChainState,
    uniforms: NDArray[np.float64],
) -> tuple[ChainState, Proposals]:
    """Advance a chain by one block with any responder, step by step in Python.

    The compiled loop in `bellcrank.search.kernels.metropolis` does the same, faster.
    """
    from bellcrank.search.kernels.metropolis import FORBIDDEN

    problem = responder.problem
    mask = unpack_mask(state.mask, problem.lattice.beam_count).copy()
    responder.respond(mask)
    responder.remember()
    temperatures = settings.temperatures
    rows: list[tuple[NDArray[np.uint8], float, float, float, bool, int]] = []
    for choice, chance in uniforms:
        if is_done(state, settings):
            break
        beam = problem.designable[int(choice * len(problem.designable))]
        mask[beam] ^= True
        temperature = temperatures[min(state.accepted, len(temperatures) - 1)]
        status, efficiency = FORBIDDEN, math.nan
        if not _is_forbidden(problem, settings.minimum_degree, mask, beam):
            response = responder.respond_nearby(mask)
            status, efficiency = int(response.status), response.efficiency
        cost = costs[settings.cost].of(efficiency)
        accepted = status == Status.CONVERGED and accepts(state.cost, cost, temperature, chance)
        rows.append((np.packbits(mask), efficiency, cost, temperature, accepted, status))
        state = replace(state, step=state.step + 1, rejections=state.rejections + 1)
        if accepted:
            state = replace(
                state, efficiency=efficiency, cost=cost, best=max(state.best, efficiency),
                accepted=state.accepted + 1, rejections=0,
            )  # fmt: skip
            responder.remember()
        else:
            mask[beam] ^= True
    masks, efficiencies, all_costs, temperatures_seen, taken, statuses = zip(*rows, strict=True)
    return replace(state, mask=pack_mask(mask)), Proposals(
        np.array(masks),
        np.array(efficiencies),
        np.array(all_costs),
        np.array(temperatures_seen),
        np.array(taken),
        np.array(statuses, dtype=np.int8),
    )


def _is_forbidden(
    problem: Problem, minimum_degree: int, mask: NDArray[np.bool_], beam: int
) -> bool:
    """Whether removing `beam` has left a free end with too few beams."""
    if mask[beam] or not minimum_degree:
        return False
    held = set(problem.supports.fixed.tolist())
    if problem.input.drive == "displacement":
        held.update(problem.input.nodes.tolist())
    degree = np.bincount(problem.lattice.beams[mask].ravel(), minlength=problem.lattice.node_count)
    ends = problem.lattice.beams[beam].tolist()
    return any(degree[node] < minimum_degree and node not in held for node in ends)
