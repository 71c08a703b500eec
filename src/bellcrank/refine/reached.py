"""The best geometries that refinements have reported while they go on."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bellcrank.refine.by_frames import MET

if TYPE_CHECKING:
    from bellcrank.model import Design
    from bellcrank.refine.refinement import Progress


class Reached:
    """The best geometry of each of several refinements.

    That is the latest one that meets all items, since later ones are corrected by better models;
    with random prints, of those of which the largest part meets them. Without any, the one that is
    nearest to meeting them.

    Attributes
    ----------
    latest
        Latest progress of each refinement by the number of its design.
    """

    def __init__(self) -> None:
        self.latest: dict[int, Progress] = {}
        self._best: dict[int, Progress] = {}
        self._nearest: dict[int, Progress] = {}

    def add(self, number: int, progress: Progress) -> None:
        """Record a geometry of the refinement of a design."""
        self.latest[number] = progress
        is_met = progress.rows.violation <= MET
        best, rank = (self._best, share_of) if is_met else (self._nearest, _nearness)
        if number not in best or rank(progress) >= rank(best[number]):
            best[number] = progress

    @property
    def met(self) -> list[Progress]:
        """The best geometry of each refinement that has one that meets all items.

        Those with the largest part of random prints are first, then those with the largest
        objective.
        """
        return sorted(self._best.values(), key=_rank, reverse=True)

    @property
    def best(self) -> list[Progress]:
        """The best geometry of each refinement, the best first."""
        near = [each for number, each in self._nearest.items() if number not in self._best]
        return [*self.met, *sorted(near, key=_nearness, reverse=True)]

    def designs(self) -> list[Design]:
        """Return the best design of each refinement, the best first."""
        return [each.design for each in self.best if each.design is not None]


def share_of(progress: Progress) -> float:
    """Return the part of random prints that meets all items; 1 without prints."""
    return 1.0 if progress.share is None else progress.share


def _rank(progress: Progress) -> tuple[float, bool, float]:
    """Return how good a geometry is that meets all items; larger is better."""
    return share_of(progress), progress.has_objective, progress.rows.objective


def _nearness(progress: Progress) -> float:
    """Return how near a geometry is to meeting all items."""
    return -progress.rows.violation
