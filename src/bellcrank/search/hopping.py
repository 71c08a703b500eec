"""Basin hopping: climb, disturb a part of the design, climb again, keep what is better.

A climb (`climbing`) ends at a design that no flip of a beam improves. From there a part of
the lattice is drawn anew, more or less densely, and the climb goes on; the new design takes
the place of the old one if it is at least as efficient (Wales and Doye, J. Phys. Chem. A
101, 5111, 1997; iterated local search, Lourenco et al. 2003).

Where nothing has been gained for long, what is missing is often many flips away, each of
which changes next to nothing. Then most steps go to a Markov chain at a low temperature, which
wanders off from the best design; now and then a climb begins where it is.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from bellcrank.mechanics import VERIFICATION_INCREMENT
from bellcrank.model import pack_mask, unpack_mask
from bellcrank.search.blocks import BLOCK, Rows, initial_response, random_numbers, steps_ahead
from bellcrank.search.climbing import Climb, resume_climb
from bellcrank.search.metropolis import ChainState, MetropolisSettings, make_steps
from bellcrank.search.searches import Search, searches
from bellcrank.search.selection import confirmed
from bellcrank.search.settings import SearchSettings, check_part, check_positive, check_whole

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from bellcrank.mechanics import Outcome
    from bellcrank.model import Problem
    from bellcrank.search.evaluator import Evaluator
    from bellcrank.storage import Proposals

PROGRESS = 1e-3
"""Relative gain of efficiency by which a search shows that it is not at its end."""


@dataclass(frozen=True, slots=True, kw_only=True)
class HoppingSettings(SearchSettings):
    """Settings of basin hopping.

    Parameters
    ----------
    radius
        Mean radius of the part that is drawn anew, in mean beam lengths.
    thinnest
        Least part of the beams that is present in it afterwards, on average.
    depth
        Flips that a climb tries in vain before it ends.
    largest_loss
        Predicted loss, as a part of the efficiency, up to which a flip is tried.
    walk
        Steps that the Markov chain makes in place of a kick; 0 for none.
    warmth
        Its temperature, as a part of the efficiency.
    share
        Part of the steps that walks take, where nothing is gained otherwise.
    least_wait, wait
        Steps without a gain after which walks begin: a number, and a part of all so far.

    Raises
    ------
    InvalidSettings, UnknownName
    """

    name: ClassVar[str] = "basin-hopping"
    predicts_flips: ClassVar[bool] = True

    radius: float = 2.5
    thinnest: float = 0.95
    depth: int = 12
    largest_loss: float = 0.01
    walk: int = 1000
    warmth: float = 0.01
    share: float = 0.7
    least_wait: int = 2000
    wait: float = 0.4

    def __post_init__(self) -> None:
        SearchSettings.__post_init__(self)
        check_whole("depth", self.depth, 1)
        for name in ("walk", "least_wait"):
            check_whole(name, getattr(self, name), 0)
        for name in ("radius", "warmth", "share"):
            check_positive(name, getattr(self, name))
        for name in ("thinnest", "largest_loss", "wait", "share"):
            check_part(name, getattr(self, name))


@dataclass(frozen=True, slots=True)
class HoppingState:
    """Where basin hopping stands between two blocks.

    Parameters
    ----------
    step
        Proposals so far.
    mask
        The best design that stands up to a closer look, in hexadecimal; the initial design
        before the first climb.
    best
        Its efficiency, less the penalty for broken goals.
    gained
        Step of the last gain that counts.
    walked
        Step at which the last walk ended.
    walk
        Steps left of a walk; 0 between walks.
    walker
        The design that walks have reached, in hexadecimal; None if the next one begins at the
        best design.
    climbing
        The design that a climb has reached, in hexadecimal, or None between climbs.
    tried
        Beams that the climb has tried in vain since its last gain.
    accepted
        Proposals taken, so far.
    hops
        Climbs that ended, so far.
    """

    step: int
    mask: str
    best: float
    gained: int = 0
    walked: int = 0
    walk: int = 0
    walker: str | None = None
    climbing: str | None = None
    tried: tuple[int, ...] = ()
    accepted: int = 0
    hops: int = 0

    @property
    def efficiency(self) -> float:
        """Of the best design."""
        return self.best

    def to_dict(self) -> dict[str, Any]:
        """Return the state as plain data."""
        return asdict(self)

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Self:
        """Rebuild the state from plain data."""
        return cls(**{**data, "tried": tuple(data["tried"])})


def start(evaluator: Evaluator, _settings: HoppingSettings, _chain: int) -> HoppingState:
    """Return the state before the first climb, from the problem's initial design."""
    efficiency = initial_response(evaluator).score
    return HoppingState(0, pack_mask(evaluator.problem.initial), efficiency)


def is_done(state: HoppingState, settings: HoppingSettings) -> bool:
    """Whether all steps are made."""
    return state.step >= settings.steps


def kick(
    problem: Problem, mask: NDArray[np.bool_], settings: HoppingSettings, rng: np.random.Generator
) -> NDArray[np.bool_]:
    """Draw anew the designable beams of a disc around a random one of them."""
    lattice = problem.lattice
    middle = lattice.positions[lattice.beams[problem.designable]].mean(axis=1)
    length = float(np.mean(lattice.rest_length))
    while True:
        centre = middle[int(rng.integers(len(middle)))]
        radius = settings.radius * length * rng.uniform(0.5, 1.5)
        inside = problem.designable[np.hypot(*(middle - centre).T) < radius]
        kicked = mask.copy()
        kicked[inside] = rng.random(len(inside)) < rng.uniform(settings.thinnest, 1.0)
        if (kicked != mask).any():
            return kicked


def walks_now(state: HoppingState, settings: HoppingSettings) -> bool:
    """Whether it is time for a walk rather than for a kick."""
    if not settings.walk:
        return False
    waited = state.step - state.gained > max(settings.least_wait, settings.wait * state.step)
    between = settings.walk * (1.0 - settings.share) / settings.share
    return waited and state.step - state.walked >= between


def climb_from(
    evaluator: Evaluator, settings: HoppingSettings, mask: str, tried: Iterable[int] = ()
) -> Climb | None:
    """Climb on, or from somewhere else; None from a design without a stable response."""
    bits = unpack_mask(mask, evaluator.problem.lattice.beam_count).copy()
    return resume_climb(evaluator, bits, settings.depth, settings.largest_loss, tried)


@dataclass(slots=True, eq=False)
class Hopper:
    """Basin hopping within a block."""

    evaluator: Evaluator
    settings: HoppingSettings
    state: HoppingState
    rng: np.random.Generator
    last: int
    """Step at which the block ends."""
    climb: Climb | None
    rows: Rows = field(default_factory=Rows)

    def note(
        self,
        mask: NDArray[np.bool_],
        efficiency: float,
        accepted: bool,
        status: Outcome,
        penalty: float = 0.0,
    ) -> None:
        """Record a response and count it."""
        self.rows.add(mask, efficiency, penalty - efficiency, 0.0, accepted, int(status))
        self.state = replace(
            self.state, step=self.state.step + 1, accepted=self.state.accepted + accepted
        )

    def go_on(self) -> None:
        """Make a kick, a flip, the verification of a climb's end, or steps of a walk."""
        if self.state.walk:
            self.walk_on()
            return
        if self.climb is None:
            self.leave()
            return
        beam = self.climb.next_beam()
        if beam is None or self.state.step == self.settings.steps - 1:
            self.end_climb(self.climb)
            return
        mask, response, taken = self.climb.try_flip(beam)
        self.note(mask, response.efficiency, taken, response.status, response.penalty)

    def leave(self) -> None:
        """Disturb the best design; take the initial one as it is for the first climb."""
        state = self.state
        if walks_now(state, self.settings):
            self.state = replace(state, walk=self.settings.walk, walker=state.walker or state.mask)
            return
        mask = self._bits(state.mask)
        if state.hops > 0:
            mask = kick(self.evaluator.problem, mask, self.settings, self.rng)
        response = self.evaluator.evaluate(mask)
        counts = response.is_admissible
        self.note(mask, response.efficiency, counts, response.status, response.penalty)
        if counts:
            self.evaluator.set_reference()
            self.climb = Climb(
                self.evaluator, mask, response.score,
                self.settings.depth, self.settings.largest_loss, [],
            )  # fmt: skip

    def end_climb(self, climb: Climb) -> None:
        """Keep where the climb has led, if that is no worse and stands up to a closer look."""
        if climb.efficiency >= self.state.best:
            response = self.evaluator.evaluate(climb.mask, VERIFICATION_INCREMENT)
            counts = response.is_admissible and response.score >= self.state.best
            self.note(climb.mask, response.efficiency, counts, response.status, response.penalty)
            if counts:
                self._keep(climb.mask, response.score)
        elif self.state.step == self.settings.steps - 1:
            response = self.evaluator.evaluate(climb.mask)
            self.note(climb.mask, response.efficiency, False, response.status, response.penalty)
        self.climb = None
        self.state = replace(self.state, hops=self.state.hops + 1)

    def walk_on(self) -> None:
        """Walk to the end of the walk or of the block, and climb from the end of the walk.

        A design that has no stable response from rest, though it had one as a neighbour, is
        no place to go on from; the next walk begins at the best design again.
        """
        state = self.state
        assert state.walker is not None
        response = self.evaluator.evaluate(self._bits(state.walker))
        if not response.is_admissible:
            self.state = replace(state, walk=0, walked=state.step, walker=None)
            return
        settings = MetropolisSettings(
            cost="negative",
            schedule="constant",
            cold=self.settings.warmth * (abs(state.best) or 1.0),
            unloaded_beams=self.settings.unloaded_beams,
        )
        score = response.score
        chain = ChainState(0, state.walker, score, -score, score)
        count = min(state.walk, self.last - state.step)
        # As many numbers as it wants, whether compiled or not, change nothing for what follows.
        rng = np.random.default_rng(self.rng.integers(2**63))
        chain, proposals = make_steps(self.evaluator, settings, chain, rng, count)
        self.rows.extend(proposals)
        self.state = replace(
            state,
            step=state.step + count,
            accepted=state.accepted + chain.accepted,
            walk=state.walk - count,
            walked=state.step + count,
            walker=chain.mask,
        )
        if not self.state.walk:
            self.climb = climb_from(self.evaluator, self.settings, chain.mask)

    def _keep(self, mask: NDArray[np.bool_], efficiency: float) -> None:
        state = self.state
        self.state = replace(state, mask=pack_mask(mask), best=efficiency)
        if efficiency >= state.best + PROGRESS * abs(efficiency):
            self.state = replace(self.state, gained=state.step, walker=None)

    def _bits(self, mask: str) -> NDArray[np.bool_]:
        return unpack_mask(mask, self.evaluator.problem.lattice.beam_count).copy()


def advance(
    evaluator: Evaluator, settings: HoppingSettings, chain: int, state: HoppingState
) -> tuple[HoppingState, Proposals]:
    """Make the steps of a block."""
    rng = random_numbers(settings.seed, chain, state.step // BLOCK)
    last = state.step + steps_ahead(settings, state.step)
    climb = None
    if state.climbing is not None:
        climb = climb_from(evaluator, settings, state.climbing, state.tried)
    hopper = Hopper(evaluator, settings, state, rng, last, climb)
    while hopper.state.step < last:
        hopper.go_on()
    climb = hopper.climb
    state = replace(
        hopper.state,
        climbing=None if climb is None else pack_mask(climb.mask),
        tried=() if climb is None else tuple(climb.tried),
    )
    return state, hopper.rows.proposals(evaluator.problem)


searches.register("basin-hopping")(
    Search(HoppingSettings, HoppingState, start, advance, is_done, confirmed, leaps=True)
)
