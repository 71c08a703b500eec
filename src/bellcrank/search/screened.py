"""Chains whose proposals a scorer screens, by the rule of `bellcrank.search.delayed_acceptance`.

What the scorer is asked does not depend on what the mechanics answers until a flip is accepted:
the random numbers of the next few proposals are drawn ahead, and those are scored in one batch.
That changes nothing in where the chain goes.

Examples
--------
>>> from bellcrank.mechanics import SpringEvaluator
>>> from bellcrank.model import find_problem
>>> from bellcrank.search.scorers import MechanicsScorer
>>> problem = find_problem("scaling-8")
>>> evaluator = SpringEvaluator(problem)
>>> settings = ScreenedSettings(steps=300)
>>> *_, (state, proposals) = screened_blocks(
...     evaluator, MechanicsScorer(SpringEvaluator(problem)), settings, chain=0
... )
>>> state.step, state.responses + state.saved
(300, 300)
>>> state.saved > 0
True
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.model import pack_mask
from bellcrank.search.blocks import (
    BLOCK,
    Rows,
    initial_response,
    random_numbers,
    steps_ahead,
)
from bellcrank.search.delayed_acceptance import ScreenedSettings, corrected, log_passes
from bellcrank.search.place import Place, flipped
from bellcrank.search.scorers import costs_of
from bellcrank.search.verdict import Verdict
from bellcrank.search.walking import consider, place_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from bellcrank.search.evaluator import Evaluator
    from bellcrank.search.scorers import Scorer
    from bellcrank.storage import Proposals


@dataclass(frozen=True, slots=True)
class ScreenedState:
    """Where a screened chain stands between two blocks.

    Parameters
    ----------
    step
        Proposals made so far.
    mask
        The current design in hexadecimal.
    efficiency
        Of the current design, by the mechanics.
    best
        Highest efficiency of an accepted design so far.
    accepted
        Accepted proposals so far.
    responses
        Proposals that the mechanics was asked about.
    scored
        Designs that the scorer was asked about.
    """

    step: int
    mask: str
    efficiency: float
    best: float
    accepted: int = 0
    responses: int = 0
    scored: int = 0

    @property
    def saved(self) -> int:
        """Proposals that the mechanics was not asked about."""
        return self.step - self.responses


def start_screened(evaluator: Evaluator) -> ScreenedState:
    """Return the state of a chain at the problem's initial design.

    Raises
    ------
    InvalidSettings
        If that has no unique, stable response.
    """
    efficiency = initial_response(evaluator).score
    return ScreenedState(0, pack_mask(evaluator.problem.initial), efficiency, efficiency)


def screened_blocks(
    evaluator: Evaluator,
    scorer: Scorer,
    settings: ScreenedSettings,
    chain: int,
    state: ScreenedState | None = None,
) -> Iterator[tuple[ScreenedState, Proposals]]:
    """Yield state and proposals block by block until the chain is done.

    Proposals that the scorer held back have the status `REJECTED_EARLY` and no efficiency.

    Raises
    ------
    InvalidSettings
        If the initial design has no unique, stable response.
    """
    state = state or start_screened(evaluator)
    while state.step < settings.steps:
        state, proposals = advance_screened(evaluator, scorer, settings, chain, state)
        yield state, proposals


def advance_screened(
    evaluator: Evaluator,
    scorer: Scorer,
    settings: ScreenedSettings,
    chain: int,
    state: ScreenedState,
) -> tuple[ScreenedState, Proposals]:
    """Advance a chain by one block, or less if its steps end first."""
    block = ScreenedBlock(evaluator, settings, chain, state)
    for _ in block.beams:
        score_ahead(scorer, [block])
        block.step()
    return block.state, block.rows.proposals(evaluator.problem)


class ScreenedBlock:
    """A block of a screened chain in the making: scored ahead, and made step by step.

    Parameters
    ----------
    evaluator
        Of this chain alone as long as the block lasts: it remembers where the chain is.
    state
        Of the chain before the block; of that name, the attribute is of now.

    Attributes
    ----------
    beams : (count,) int64
        To be flipped one after the other, each from wherever the chain is then.
    rows
        Of the proposals made so far.
    """

    def __init__(
        self, evaluator: Evaluator, settings: ScreenedSettings, chain: int, state: ScreenedState
    ) -> None:
        rng = random_numbers(settings.seed, chain, state.step // BLOCK)
        self._uniforms = rng.random((BLOCK, 3))[: steps_ahead(settings, state.step)]
        designable = evaluator.problem.designable
        self.beams = designable[(self._uniforms[:, 0] * len(designable)).astype(np.int64)]
        self.settings = settings
        self.state = state
        self.rows = Rows()
        self._temperatures = settings.temperatures
        self._here = place_of(evaluator, settings.cost, self._temperatures[0], state.mask)
        self._cost = math.nan
        self._is_new = True
        self._ahead: dict[int, float] = {}

    def unscored(self) -> NDArray[np.bool_]:
        """Return the designs (k, M) that must be scored before the next step; none if k is 0."""
        number = len(self.rows)
        last = number if number in self._ahead else number + self.settings.lookahead
        beams = self.beams[number:last]
        masks = np.repeat(self._here.mask[None], len(beams) + self._is_new, axis=0)
        masks[np.arange(len(beams)), beams] ^= True
        return masks

    def take(self, costs: NDArray[np.float64]) -> None:
        """Take in the scorer's costs (k,) of what is `unscored`."""
        told = costs.tolist()
        if self._is_new:
            self._cost, self._is_new = told.pop(), False
        self._ahead = dict(enumerate(told, len(self.rows)))
        self.state = replace(self.state, scored=self.state.scored + len(costs))

    def step(self) -> None:
        """Make the next proposal; nothing must be `unscored`."""
        number, here, state = len(self.rows), self._here, self.state
        table = self._temperatures
        here.temperature = float(table[min(state.accepted, len(table) - 1)])
        there, asked = _step(
            here, self._ahead[number] - self._cost, self.beams[number],
            self._uniforms[number, 1:], self.settings, self.rows,
        )  # fmt: skip
        self.state = replace(state, step=state.step + 1, responses=state.responses + asked)
        if there is not here:
            self._move(there, self._ahead[number])

    def _move(self, there: Place, cost: float) -> None:
        """Go there; nothing ahead is known from there."""
        efficiency = there.response.score
        self.state = replace(
            self.state, mask=pack_mask(there.mask), efficiency=efficiency,
            best=max(self.state.best, efficiency), accepted=self.state.accepted + 1,
        )  # fmt: skip
        self._here, self._cost, self._ahead = there, cost, {}


def score_ahead(scorer: Scorer, blocks: Sequence[ScreenedBlock]) -> None:
    """Ask the scorer, in one batch, all that the next steps of some blocks have to know."""
    asked = [block.unscored() for block in blocks]
    masks = np.concatenate(asked)
    if not len(masks):
        return
    told = costs_of(blocks[0].settings.cost, scorer.score(masks))
    ends = np.cumsum([len(each) for each in asked])[:-1]
    for block, part in zip(blocks, np.split(told, ends), strict=True):
        if len(part):
            block.take(part)


def _step(
    here: Place,
    rise: float,
    beam: int,
    uniforms: NDArray[np.float64],
    settings: ScreenedSettings,
    rows: Rows,
) -> tuple[Place, bool]:
    """Make one proposal; return where the chain is then, and whether the mechanics was asked."""
    mask = flipped(here.mask, np.array([beam]))
    there_passes = log_passes(rise, here.temperature, settings)
    if uniforms[0] >= math.exp(there_passes):
        rows.add(mask, math.nan, math.nan, here.temperature, False, Verdict.REJECTED_EARLY)
        return here, False
    back_passes = log_passes(-rise, here.temperature, settings)

    def log_ratio(_there: Place, gain: float) -> float:
        return corrected(gain, there_passes, back_passes)

    return consider(here, mask, log_ratio, float(uniforms[1]), rows), True
