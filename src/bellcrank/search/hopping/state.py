"""State of basin hopping between two blocks."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, Literal, NamedTuple, Self

Stage = Literal["first", "restart", "archive"]


class Member(NamedTuple):
    """A verified design of a population: its mask in hexadecimal, and its score."""

    mask: str
    score: float


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
    stage
        The first stage, a restart, or the stage that combines the best designs of all restarts.
    population
        The designs from which local searches start.
    archive
        The best designs of the stages so far, best first.
    chains_left
        Metropolis chains whose result the population of a restart still lacks.
    progress_step
        Step of the last gain that counts as progress, or of the beginning of the stage.
    phase_end
        Step at which the last Metropolis phase of the first stage ended.
    phase_steps_left
        Steps left of a Metropolis phase; 0 outside such phases.
    phase_mask
        The design reached by Metropolis phases, in hexadecimal; None if the next one starts
        elsewhere.
    parent
        Index in the population of the design that the result of the local search may replace.
    search_mask
        The design reached by a local search in progress, in hexadecimal; None if there is none.
    failed
        Beams whose flips failed since the last gain of the local search.
    batch
        Largest number of flips that the local search makes together next; None outside of one.
    accepted
        Accepted proposals so far.
    local_searches
        Completed local searches so far.
    """

    step: int
    mask: str
    best: float
    stage: Stage = "first"
    population: tuple[Member, ...] = ()
    archive: tuple[Member, ...] = ()
    chains_left: int = 0
    progress_step: int = 0
    phase_end: int = 0
    phase_steps_left: int = 0
    phase_mask: str | None = None
    parent: int = 0
    search_mask: str | None = None
    failed: tuple[int, ...] = ()
    batch: int | None = None
    accepted: int = 0
    local_searches: int = 0

    @property
    def efficiency(self) -> float:
        """Score of the best design."""
        return self.best

    @property
    def current(self) -> str:
        """Mask of the design that changes: of the local search, of the phase, or the best one."""
        return self.search_mask or self.phase_mask or self.mask

    @property
    def best_member(self) -> Member:
        """The best design of the population."""
        return max(self.population, key=lambda member: member.score)

    def to_dict(self) -> dict[str, Any]:
        """Return the state as plain data."""
        return asdict(self)

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Self:
        """Rebuild the state from plain data, also from that of a version without restarts."""
        population = data.get("population", [(data["mask"], data["best"])])
        return cls(
            **{
                **data,
                "population": tuple(Member(*each) for each in population),
                "archive": tuple(Member(*each) for each in data.get("archive", ())),
                "failed": tuple(data["failed"]),
            }
        )
