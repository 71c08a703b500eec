"""Basin hopping: local search, perturbation, local search again; the better design is kept.

A local search (`local_search`) ends when several flips in succession fail, or when no flip left is
predicted to help. Then the beams of a disc are redrawn at random, and another local search
follows; its result replaces the design if its score is at least as high and its response is stable
when loaded in small increments (Wales and Doye, J. Phys. Chem. A 101, 5111, 1997; iterated local
search, Lourenco et al. 2003).

On some lattices the next improvement needs many flips that each change the efficiency little.
When progress stalls, most steps therefore go to low-temperature Metropolis phases. The first one
starts from the best design, and each later one where the phase before ended, until there is
progress. A local search from the design that the phase has reached follows each phase.

The search restarts when the first stage has made no progress for `restart_after` steps for each
designable beam. A restart runs a few Metropolis chains from the initial design at a low
temperature, and a local search from the end of each. Local searches then start from perturbations
of the designs found and from combinations of two of them, until there is no more progress. The best
design goes to an archive, whose designs are combined in the same way before the next restart.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

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
from bellcrank.search.hopping.coarse_start import coarse_start
from bellcrank.search.hopping.local_search import LocalSearch, start_local_search
from bellcrank.search.hopping.settings import HoppingSettings
from bellcrank.search.hopping.state import HoppingState, Member
from bellcrank.search.hopping.variation import perturb, recombine
from bellcrank.search.markov.metropolis import ChainState, MetropolisSettings, metropolis_phase
from bellcrank.search.registry import Search, searches
from bellcrank.search.selection import confirmed

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.mechanics import Response
    from bellcrank.search.evaluator import Evaluator
    from bellcrank.search.hopping.settings import Limits
    from bellcrank.storage import Proposals

PROGRESS = 1e-3
"""Relative gain of efficiency that counts as progress."""


def start(evaluator: Evaluator, settings: HoppingSettings, chain: int) -> HoppingState:
    """Return the state before the first local search.

    It is at the problem's initial design, or at a better one from a coarser lattice.
    """
    score, initial = initial_response(evaluator).score, evaluator.problem.initial
    coarse = coarse_start(evaluator, settings, chain)
    if coarse is not None and (found := evaluator.evaluate(coarse).score) > score:
        score, initial = found, coarse
    mask = pack_mask(initial)
    return HoppingState(0, mask, score, population=(Member(mask, score),))


def is_done(state: HoppingState, settings: HoppingSettings) -> bool:
    """Whether all steps are made."""
    return state.step >= settings.steps


def phase_is_due(state: HoppingState, settings: HoppingSettings, limits: Limits) -> bool:
    """Whether a Metropolis phase is due in place of a perturbation."""
    if state.stage != "first" or not settings.phase_steps:
        return False
    stalled = state.step - state.progress_step > max(limits.min_stall, limits.stall * state.step)
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
    limits: Limits
    state: HoppingState
    rng: np.random.Generator
    last: int
    local: LocalSearch | None = None
    rows: ProposalRows = field(default_factory=ProposalRows)

    def advance(self) -> None:
        """Make steps of a Metropolis chain, a flip or a verification, or start a local search."""
        if self.state.phase_steps_left:
            self.run_phase()
        elif self.local is None:
            self.leave()
        else:
            beams = self.local.next_flips()
            if beams is None or self.state.step == self.settings.steps - 1:
                self.finish_local_search(self.local)
            else:
                mask, response, accepted = self.local.try_flips(beams)
                self._record(mask, response, accepted)

    def leave(self) -> None:
        """Begin a Metropolis chain if one is due; otherwise start a local search.

        The first local search starts from the initial design, each other one from a perturbation
        of a design of the population or from a combination of two.
        """
        if self.stage_is_over():
            self.begin_next_stage()
        state = self.state
        if state.chains_left:
            problem = self.evaluator.problem
            steps = max(1, round(self.settings.restart_steps * len(problem.designable)))
            self.state = replace(
                state, phase_steps_left=steps, phase_mask=pack_mask(problem.initial)
            )
            return
        if phase_is_due(state, self.settings, self.limits):
            self.state = replace(
                state,
                phase_steps_left=self.settings.phase_steps,
                phase_mask=state.phase_mask or state.mask,
            )
            return
        mask = self.next_start()
        response = self.evaluator.evaluate(mask)
        self._record(mask, response, response.is_admissible)
        if response.is_admissible:
            self.evaluator.set_reference()
            self.local = LocalSearch(
                self.evaluator, mask, response.score, self.limits,
                self.settings.max_predicted_loss, [], self.limits.largest_batch,
            )  # fmt: skip

    def next_start(self) -> NDArray[np.bool_]:
        """Return the design from which the next local search starts."""
        population = self.state.population
        if self.state.local_searches == 0:
            return self._bits(population[0].mask)
        problem = self.evaluator.problem
        if len(population) == 1:
            return perturb(problem, self._bits(population[0].mask), self.settings, self.rng)
        parent, other = self.rng.choice(len(population), 2, replace=False).tolist()
        self.state = replace(self.state, parent=parent)
        mask, partner = self._bits(population[parent].mask), self._bits(population[other].mask)
        if self.rng.random() < self.settings.restart_recombination and (mask != partner).any():
            return recombine(problem, mask, partner, self.rng)
        return perturb(problem, mask, self.settings, self.rng)

    def stage_is_over(self) -> bool:
        """Whether the stage has made no progress for long enough."""
        state, settings = self.state, self.settings
        patience = self.limits.restart_after
        if not patience or state.chains_left:
            return False
        if state.stage != "first":
            patience = settings.restart_patience * len(state.population)
        stalled = state.step - state.progress_step
        return stalled > patience * len(self.evaluator.problem.designable)

    def begin_next_stage(self) -> None:
        """Begin a restart, or combine the archive after a restart."""
        state = self.state
        in_archive = state.stage == "archive"
        found = state.population if in_archive else (*state.archive, state.best_member)
        distinct = [Member(*each) for each in dict(found).items()]
        distinct.sort(key=lambda member: -member.score)
        archive = tuple(distinct[: self.settings.restart_archive])
        combine = state.stage == "restart" and len(archive) > 1
        self.state = replace(
            state,
            stage="archive" if combine else "restart",
            population=archive if combine else (),
            archive=archive,
            chains_left=0 if combine else self.settings.restart_chains,
            progress_step=state.step,
            phase_mask=None,
            parent=0,
        )

    def finish_local_search(self, local: LocalSearch) -> None:
        """Keep the result if it is no worse and stable when followed in small increments.

        The last step of a run records the design reached.
        """
        state = self.state
        filling = state.chains_left > 0
        required = -np.inf if filling else state.population[state.parent].score
        if local.efficiency >= required:
            response = self.evaluator.evaluate(local.mask, VERIFICATION_INCREMENT)
            verified = response.is_admissible and response.score >= required
            self._record(local.mask, response, verified)
            if verified:
                self._keep(local.mask, response.score)
        elif state.step == self.settings.steps - 1:
            self._record(local.mask, self.evaluator.evaluate(local.mask), False)
        self.local = None
        self.state = replace(self.state, local_searches=self.state.local_searches + 1)

    def run_phase(self) -> None:
        """Run a Metropolis chain to its end or to that of the block.

        At its end, start a local search.

        A design may have a stable response from its neighbour but none from rest. The chain then
        ends, and the next one starts elsewhere.
        """
        state = self.state
        assert state.phase_mask is not None
        response = self.evaluator.evaluate(self._bits(state.phase_mask))
        if not response.is_admissible:
            self.state = replace(state, phase_steps_left=0, phase_end=state.step, phase_mask=None)
            return
        factor = (
            self.settings.restart_temperature
            if state.chains_left
            else self.settings.temperature_factor
        )
        settings = MetropolisSettings(
            cost="negative",
            schedule="constant",
            cold=factor * (abs(without_base_penalty(state.best)) or 1.0),
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

    def resume_local_search(
        self, mask: str, failed: tuple[int, ...] = (), batch: int | None = None
    ) -> None:
        """Start a local search from a packed design, if its response is stable."""
        self.local = start_local_search(
            self.evaluator, self._bits(mask),
            self.limits, self.settings.max_predicted_loss, failed, batch,
        )  # fmt: skip

    def _record(self, mask: NDArray[np.bool_], response: Response, accepted: bool) -> None:
        self.rows.add(
            mask, response.efficiency, -response.score, 0.0, accepted, int(response.status)
        )
        self.state = replace(
            self.state, step=self.state.step + 1, accepted=self.state.accepted + accepted
        )

    def _keep(self, mask: NDArray[np.bool_], score: float) -> None:
        """Add a verified design to a population that is not complete, or replace its parent."""
        state = self.state
        member = Member(pack_mask(mask), score)
        if state.chains_left:
            self.state = replace(
                state,
                population=(*state.population, member),
                chains_left=state.chains_left - 1,
                progress_step=state.step,
                phase_mask=None,
            )
        else:
            population = list(state.population)
            population[state.parent] = member
            self.state = replace(state, population=tuple(population))
            best = state.best_member.score
            if score >= best + PROGRESS * abs(score):
                self.state = replace(self.state, progress_step=state.step, phase_mask=None)
        if score >= self.state.best:
            self.state = replace(self.state, mask=member.mask, best=score)

    def _bits(self, mask: str) -> NDArray[np.bool_]:
        return unpack_mask(mask, self.evaluator.problem.lattice.beam_count).copy()


def advance(
    evaluator: Evaluator, settings: HoppingSettings, chain: int, state: HoppingState
) -> tuple[HoppingState, Proposals]:
    """Make the steps of one block."""
    rng = random_numbers(settings.seed, chain, state.step // BLOCK)
    last = state.step + steps_in_block(settings, state.step)
    limits = settings.limits(evaluator.problem)
    hopping = BasinHopping(evaluator, settings, limits, state, rng, last)
    if state.search_mask is not None:
        hopping.resume_local_search(state.search_mask, state.failed, state.batch)
        if hopping.local is None:
            # Stable next to its reference, but not from rest: this local search is over.
            hopping.state = replace(state, local_searches=state.local_searches + 1)
    while hopping.state.step < last:
        hopping.advance()
    local = hopping.local
    state = replace(
        hopping.state,
        search_mask=None if local is None else pack_mask(local.mask),
        failed=() if local is None else tuple(local.failed),
        batch=None if local is None else local.batch,
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
        summary="Local searches from perturbed designs. The best in most cases.",
    )
)
