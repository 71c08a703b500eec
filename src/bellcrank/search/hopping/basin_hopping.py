"""Basin hopping: local search, perturbation, local search again; the better design is kept.

A local search ends when several flips in succession fail, or when no flip left is predicted to
help. Then the beams of a disc are redrawn at random, and another local search follows; its result
replaces the design if its score is at least as high and its response is stable when loaded in
small increments (Wales and Doye, J. Phys. Chem. A 101, 5111, 1997; iterated local search, Lourenco
et al. 2003).

On some lattices the next improvement needs many flips that each change the efficiency little.
When progress stalls, most steps therefore go to low-temperature Metropolis phases. The first one
starts from the best design, and each later one where the phase before ended, until there is
progress. A local search from the design that the phase has reached follows each phase.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from bellcrank.mechanics import VERIFICATION_INCREMENT
from bellcrank.model import pack_mask, unpack_mask
from bellcrank.search.blocks import (
    BLOCK,
    ProposalRows,
    initial_response,
    random_numbers,
    steps_in_block,
)
from bellcrank.search.constraints.evaluator import without_base_penalty
from bellcrank.search.hopping.local_search import LocalSearch, start_local_search
from bellcrank.search.hopping.settings import HoppingSettings
from bellcrank.search.markov.metropolis import ChainState, MetropolisSettings, metropolis_phase
from bellcrank.search.registry import Search, searches
from bellcrank.search.selection import confirmed

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.mechanics import Response
    from bellcrank.model import Problem
    from bellcrank.search.evaluator import Evaluator
    from bellcrank.search.hopping.settings import Patience
    from bellcrank.storage import Proposals

PROGRESS = 1e-3
"""Relative gain of efficiency that counts as progress."""


@dataclass(frozen=True, slots=True)
class HoppingState:
    """State of basin hopping between two blocks.

    Parameters
    ----------
    step
        Proposals made so far.
    mask
        The best verified design, in hexadecimal; the initial design until the result of a local
        search has been verified.
    best
        Its score: the efficiency less the penalty for violated goals.
    progress_step
        Step of the last gain that counts as progress.
    phase_end
        Step at which the last Metropolis phase ended.
    phase_steps_left
        Steps left of a Metropolis phase; 0 outside such phases.
    phase_mask
        The design reached by Metropolis phases, in hexadecimal; None if the next one starts from
        the best design.
    search_mask
        The design reached by a local search in progress, in hexadecimal; None if there is none.
    failed
        Beams whose flips failed since the last gain of the local search.
    accepted
        Accepted proposals so far.
    local_searches
        Completed local searches so far.
    """

    step: int
    mask: str
    best: float
    progress_step: int = 0
    phase_end: int = 0
    phase_steps_left: int = 0
    phase_mask: str | None = None
    search_mask: str | None = None
    failed: tuple[int, ...] = ()
    accepted: int = 0
    local_searches: int = 0

    @property
    def efficiency(self) -> float:
        """Score of the best design."""
        return self.best

    def to_dict(self) -> dict[str, Any]:
        """Return the state as plain data."""
        return asdict(self)

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Self:
        """Rebuild the state from plain data."""
        return cls(**{**data, "failed": tuple(data["failed"])})


def start(evaluator: Evaluator, _settings: HoppingSettings, _chain: int) -> HoppingState:
    """Return the state before the first local search, at the problem's initial design."""
    efficiency = initial_response(evaluator).score
    return HoppingState(0, pack_mask(evaluator.problem.initial), efficiency)


def is_done(state: HoppingState, settings: HoppingSettings) -> bool:
    """Whether all steps are made."""
    return state.step >= settings.steps


def perturb(
    problem: Problem, mask: NDArray[np.bool_], settings: HoppingSettings, rng: np.random.Generator
) -> NDArray[np.bool_]:
    """Redraw the designable beams of a disc at random, until the design differs.

    The disc is centred at the midpoint of a random designable beam, and the midpoints of the
    beams lie in it. Its radius is between a half and one and a half times the mean radius.
    """
    lattice = problem.lattice
    middle = lattice.positions[lattice.beams[problem.designable]].mean(axis=1)
    length = float(np.mean(lattice.rest_length))
    while True:
        centre = middle[int(rng.integers(len(middle)))]
        radius = settings.radius * length * rng.uniform(0.5, 1.5)
        inside = problem.designable[np.linalg.norm(middle - centre, axis=1) < radius]
        perturbed = mask.copy()
        perturbed[inside] = rng.random(len(inside)) < rng.uniform(settings.min_density, 1.0)
        if (perturbed != mask).any():
            return perturbed


def phase_is_due(state: HoppingState, settings: HoppingSettings, patience: Patience) -> bool:
    """Whether a Metropolis phase is due in place of a perturbation."""
    if not settings.phase_steps:
        return False
    stalled = state.step - state.progress_step > max(
        patience.min_stall, patience.stall * state.step
    )
    pause = settings.phase_steps * (1.0 - settings.phase_share) / settings.phase_share
    return stalled and state.step - state.phase_end >= pause


@dataclass(slots=True, eq=False)
class BasinHopping:
    """Basin hopping within one block.

    Parameters
    ----------
    last
        Step at which the block ends.
    local
        The local search in progress, if any.
    """

    evaluator: Evaluator
    settings: HoppingSettings
    patience: Patience
    state: HoppingState
    rng: np.random.Generator
    last: int
    local: LocalSearch | None = None
    rows: ProposalRows = field(default_factory=ProposalRows)

    def advance(self) -> None:
        """Make a perturbation, a flip, the verification of a local search, or a phase."""
        if self.state.phase_steps_left:
            self.run_phase()
        elif self.local is None:
            self.leave()
        else:
            beam = self.local.next_beam()
            if beam is None or self.state.step == self.settings.steps - 1:
                self.finish_local_search(self.local)
            else:
                mask, response, accepted = self.local.try_flip(beam)
                self._record(mask, response, accepted)

    def leave(self) -> None:
        """Begin a Metropolis phase if one is due; otherwise start a local search.

        It starts from a perturbation of the best design, the first time from the initial design.
        """
        state = self.state
        if phase_is_due(state, self.settings, self.patience):
            self.state = replace(
                state,
                phase_steps_left=self.settings.phase_steps,
                phase_mask=state.phase_mask or state.mask,
            )
            return
        mask = self._bits(state.mask)
        if state.local_searches > 0:
            mask = perturb(self.evaluator.problem, mask, self.settings, self.rng)
        response = self.evaluator.evaluate(mask)
        self._record(mask, response, response.is_admissible)
        if response.is_admissible:
            self.evaluator.set_reference()
            self.local = LocalSearch(
                self.evaluator, mask, response.score,
                self.patience.max_failures, self.settings.max_predicted_loss, [],
            )  # fmt: skip

    def finish_local_search(self, local: LocalSearch) -> None:
        """Keep the result if it is no worse and stable when followed in small increments.

        The last step of a run records the design reached.
        """
        if local.efficiency >= self.state.best:
            response = self.evaluator.evaluate(local.mask, VERIFICATION_INCREMENT)
            verified = response.is_admissible and response.score >= self.state.best
            self._record(local.mask, response, verified)
            if verified:
                self._keep(local.mask, response.score)
        elif self.state.step == self.settings.steps - 1:
            self._record(local.mask, self.evaluator.evaluate(local.mask), False)
        self.local = None
        self.state = replace(self.state, local_searches=self.state.local_searches + 1)

    def run_phase(self) -> None:
        """Run a Metropolis phase to its end or to that of the block.

        At the end of the phase, start a local search.

        A design may have a stable response from its neighbour but none from rest. The phase then
        ends, and the next one starts from the best design.
        """
        state = self.state
        assert state.phase_mask is not None
        response = self.evaluator.evaluate(self._bits(state.phase_mask))
        if not response.is_admissible:
            self.state = replace(state, phase_steps_left=0, phase_end=state.step, phase_mask=None)
            return
        settings = MetropolisSettings(
            cost="negative",
            schedule="constant",
            cold=self.settings.temperature_factor * (abs(without_base_penalty(state.best)) or 1.0),
            unloaded_beams=self.settings.unloaded_beams,
        )
        score = response.score
        chain = ChainState(0, state.phase_mask, score, -score, score)
        count = min(state.phase_steps_left, self.last - state.step)
        # A generator of its own: compiled and Python loops draw different numbers of values.
        rng = np.random.default_rng(self.rng.integers(2**63))
        chain, proposals = metropolis_phase(self.evaluator, settings, chain, rng, count)
        self.rows.extend(proposals)
        self.state = replace(
            state,
            step=state.step + count,
            accepted=state.accepted + chain.accepted,
            phase_steps_left=state.phase_steps_left - count,
            phase_end=state.step + count,
            phase_mask=chain.mask,
        )
        if not self.state.phase_steps_left:
            self.resume_local_search(chain.mask)

    def resume_local_search(self, mask: str, failed: tuple[int, ...] = ()) -> None:
        """Start a local search from a packed design, if its response is stable."""
        self.local = start_local_search(
            self.evaluator, self._bits(mask),
            self.patience.max_failures, self.settings.max_predicted_loss, failed,
        )  # fmt: skip

    def _record(self, mask: NDArray[np.bool_], response: Response, accepted: bool) -> None:
        self.rows.add(
            mask, response.efficiency, -response.score, 0.0, accepted, int(response.status)
        )
        self.state = replace(
            self.state, step=self.state.step + 1, accepted=self.state.accepted + accepted
        )

    def _keep(self, mask: NDArray[np.bool_], efficiency: float) -> None:
        state = self.state
        self.state = replace(state, mask=pack_mask(mask), best=efficiency)
        if efficiency >= state.best + PROGRESS * abs(efficiency):
            self.state = replace(self.state, progress_step=state.step, phase_mask=None)

    def _bits(self, mask: str) -> NDArray[np.bool_]:
        return unpack_mask(mask, self.evaluator.problem.lattice.beam_count).copy()


def advance(
    evaluator: Evaluator, settings: HoppingSettings, chain: int, state: HoppingState
) -> tuple[HoppingState, Proposals]:
    """Make the steps of one block."""
    rng = random_numbers(settings.seed, chain, state.step // BLOCK)
    last = state.step + steps_in_block(settings, state.step)
    patience = settings.patience(evaluator.problem)
    hopping = BasinHopping(evaluator, settings, patience, state, rng, last)
    if state.search_mask is not None:
        hopping.resume_local_search(state.search_mask, state.failed)
    while hopping.state.step < last:
        hopping.advance()
    local = hopping.local
    state = replace(
        hopping.state,
        search_mask=None if local is None else pack_mask(local.mask),
        failed=() if local is None else tuple(local.failed),
    )
    return state, hopping.rows.proposals(evaluator.problem)


searches.register("basin-hopping")(
    Search(
        HoppingSettings,
        HoppingState,
        start,
        advance,
        is_done,
        confirmed,
        plot_running_best=True,
        title="Basin hopping",
        summary="Local search with restarts from perturbed designs. The best in most cases.",
    )
)
