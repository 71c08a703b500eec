"""Basin hopping: climb, disturb a part of the design, climb again, keep what is better.

A climb (`climbing`) ends at a design that no flip of a beam improves. From there a part of
the lattice is drawn anew, more or less densely, and the climb goes on; the new design takes
the place of the old one if it is at least as efficient (Wales and Doye, J. Phys. Chem. A
101, 5111, 1997; iterated local search, Lourenco et al. 2003). Several such lines can begin
from different designs; the worst ones are then given up one by one, so that most of the time
goes to the most promising.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from bellcrank.mechanics import CAREFUL
from bellcrank.model import pack_mask, unpack_mask
from bellcrank.search.blocks import BLOCK, Rows, initial_response, random_numbers, steps_ahead
from bellcrank.search.climbing import Climb, resume_climb
from bellcrank.search.searches import Search, searches
from bellcrank.search.selection import peaks
from bellcrank.search.settings import SearchSettings, check_part, check_positive, check_whole

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.mechanics import Status
    from bellcrank.model import Problem
    from bellcrank.runs import Proposals
    from bellcrank.search.responder import Responder

THINNEST_START = 0.85
"""Least part of the designable beams that a line begins with."""


@dataclass(frozen=True, slots=True, kw_only=True)
class HoppingSettings(SearchSettings):
    """Settings of basin hopping.

    Parameters
    ----------
    lines
        Designs that are improved side by side at first.
    shared
        Part of the steps after which only the best line is left.
    radius
        Mean radius of the part that is drawn anew, in mean beam lengths.
    thinnest
        Least part of the beams that is present in it afterwards, on average.
    depth
        Flips that a climb tries in vain before it ends.
    largest_loss
        Predicted loss, as a part of the efficiency, up to which a flip is tried.

    Raises
    ------
    InvalidSettings, UnknownName
    """

    name: ClassVar[str] = "basin-hopping"

    lines: int = 1
    shared: float = 0.6
    radius: float = 2.5
    thinnest: float = 0.95
    depth: int = 12
    largest_loss: float = 0.01

    def __post_init__(self) -> None:
        SearchSettings.__post_init__(self)
        check_whole("lines", self.lines, 1, 1000)
        check_whole("depth", self.depth, 1)
        check_positive("radius", self.radius)
        check_positive("shared", self.shared)
        for name in ("thinnest", "largest_loss"):
            check_part(name, getattr(self, name))


@dataclass(frozen=True, slots=True)
class Line:
    """A line of designs, each better than the last.

    Parameters
    ----------
    mask
        The design it has reached, in hexadecimal.
    efficiency
        Of it; None before the first climb.
    """

    mask: str
    efficiency: float | None = None

    @property
    def rank(self) -> float:
        """Efficiency for comparison."""
        return -math.inf if self.efficiency is None else self.efficiency


@dataclass(frozen=True, slots=True)
class HoppingState:
    """Where basin hopping stands between two blocks.

    Parameters
    ----------
    step
        Responses so far.
    lines
        Those that are left.
    best
        Highest efficiency of a line so far.
    turn
        Index of the line that is being improved.
    climbing
        The design that a climb has reached, in hexadecimal, or None between climbs.
    tried
        Beams that the climb has tried in vain since its last gain.
    accepted
        Proposals taken, kicks and flips, so far.
    hops
        Climbs that ended, so far.
    """

    step: int
    lines: tuple[Line, ...]
    best: float
    turn: int = 0
    climbing: str | None = None
    tried: tuple[int, ...] = ()
    accepted: int = 0
    hops: int = 0

    @property
    def efficiency(self) -> float:
        """Of the line at hand."""
        return max(self.lines[self.turn].rank, -1e300)

    def to_dict(self) -> dict[str, Any]:
        """Return the state as plain data."""
        return asdict(self)

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Self:
        """Rebuild the state from plain data."""
        lines = tuple(Line(**line) for line in data["lines"])
        return cls(**{**data, "lines": lines, "tried": tuple(data["tried"])})


def start(responder: Responder, settings: HoppingSettings, chain: int) -> HoppingState:
    """Return the state before the first climb.

    The first line begins with the problem's initial design, the others with less of it.
    """
    efficiency = initial_response(responder).score
    problem = responder.problem
    # A stream of its own, since the blocks begin with the same numbers on a resume.
    rng = random_numbers(settings.seed, chain, 2**32 - 1)
    lines = [Line(pack_mask(problem.initial))]
    for _ in range(settings.lines - 1):
        mask = problem.initial.copy()
        present = rng.random(len(problem.designable)) < rng.uniform(THINNEST_START, 1.0)
        mask[problem.designable] &= present
        lines.append(Line(pack_mask(mask)))
    return HoppingState(0, tuple(lines), efficiency)


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


@dataclass(slots=True, eq=False)
class Hopper:
    """Basin hopping within a block."""

    responder: Responder
    settings: HoppingSettings
    state: HoppingState
    rng: np.random.Generator
    climb: Climb | None
    rows: Rows = field(default_factory=Rows)

    def note(
        self,
        mask: NDArray[np.bool_],
        efficiency: float,
        accepted: bool,
        status: Status,
        penalty: float = 0.0,
    ) -> None:
        """Record a response and count it."""
        self.rows.add(mask, efficiency, penalty - efficiency, 0.0, accepted, int(status))
        self.state = replace(
            self.state, step=self.state.step + 1, accepted=self.state.accepted + accepted
        )

    def make_step(self) -> None:
        """Spend one response: on a kick, on a flip, or on the verification of a climb's end."""
        if self.climb is None:
            self.begin_climb()
            return
        beam = self.climb.next_beam()
        if beam is None or self.state.step == self.settings.steps - 1:
            self.end_climb(self.climb)
            return
        mask, response, taken = self.climb.try_flip(beam)
        self.note(mask, response.efficiency, taken, response.status, response.penalty)

    def begin_climb(self) -> None:
        """Disturb the design of the line, or take it as it is where it was never climbed from."""
        line = self.state.lines[self.state.turn]
        problem = self.responder.problem
        mask = unpack_mask(line.mask, problem.lattice.beam_count).copy()
        if line.efficiency is not None:
            mask = kick(problem, mask, self.settings, self.rng)
        response = self.responder.respond(mask)
        counts = response.counts
        self.note(mask, response.efficiency, counts, response.status, response.penalty)
        if counts:
            self.responder.remember()
            self.climb = Climb(
                self.responder, mask, response.score,
                self.settings.depth, self.settings.largest_loss, [],
            )  # fmt: skip
        elif line.efficiency is None:
            self._set_line(replace(line, mask=pack_mask(problem.initial)))
        else:
            self._next_line()

    def end_climb(self, climb: Climb) -> None:
        """Let the line go on from where the climb ended, if that is no worse and stands up."""
        line = self.state.lines[self.state.turn]
        if climb.efficiency >= line.rank:
            response = self.responder.respond(climb.mask, CAREFUL)
            counts = response.counts and response.score >= line.rank
            self.note(climb.mask, response.efficiency, counts, response.status, response.penalty)
            if counts:
                self._set_line(Line(pack_mask(climb.mask), response.score))
        elif self.state.step == self.settings.steps - 1:
            response = self.responder.respond(climb.mask)
            self.note(climb.mask, response.efficiency, False, response.status, response.penalty)
        self.climb = None
        self.state = replace(self.state, hops=self.state.hops + 1)
        self._next_line()

    def _set_line(self, line: Line) -> None:
        lines, turn = self.state.lines, self.state.turn
        self.state = replace(
            self.state,
            lines=(*lines[:turn], line, *lines[turn + 1 :]),
            best=max(self.state.best, line.rank),
        )

    def _next_line(self) -> None:
        """Go on to the next line, after giving up those whose time is over, the worst first."""
        lines = list(self.state.lines)
        used = self.state.step / (self.settings.shared * self.settings.steps)
        allowed = max(1, self.settings.lines - int(self.settings.lines * used))
        turn = self.state.turn + 1
        while len(lines) > allowed:
            worst = min(range(len(lines)), key=lambda index: lines[index].rank)
            del lines[worst]
            turn -= worst < turn
        self.state = replace(self.state, lines=tuple(lines), turn=turn % len(lines))


def advance(
    responder: Responder, settings: HoppingSettings, chain: int, state: HoppingState
) -> tuple[HoppingState, Proposals]:
    """Spend a block of responses."""
    rng = random_numbers(settings.seed, chain, state.step // BLOCK)
    climb = None
    if state.climbing is not None:
        mask = unpack_mask(state.climbing, responder.problem.lattice.beam_count).copy()
        climb = resume_climb(responder, mask, settings.depth, settings.largest_loss, state.tried)
    hopper = Hopper(responder, settings, state, rng, climb)
    last = state.step + steps_ahead(settings, state.step)
    while hopper.state.step < last:
        hopper.make_step()
    climb = hopper.climb
    after = replace(
        hopper.state,
        climbing=None if climb is None else pack_mask(climb.mask),
        tried=() if climb is None else tuple(climb.tried),
    )
    return after, hopper.rows.proposals(responder.problem)


searches.register("basin-hopping")(
    Search(HoppingSettings, HoppingState, start, advance, is_done, peaks, leaps=True)
)
