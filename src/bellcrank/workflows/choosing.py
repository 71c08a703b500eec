"""Which of the designs that a search found moves as a part? Finite elements choose.

The model ranks designs well, but what is best in it may be a design that as a part buckles the
other way, or whose struts run into each other. Designs that are nearly as good and do neither are
among those that the chains have found: the best of each chain are followed as frames of struts, and
the best part wins.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from bellcrank.errors import InvalidSettings
from bellcrank.fem import FemSettings, levels
from bellcrank.fem.path import PathStatus
from bellcrank.part.pieces import require_held

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from bellcrank.fem import Analysis
    from bellcrank.model import Design
    from bellcrank.part import PartSpec
    from bellcrank.search import Finalist, Refusals, SearchSettings

LEVEL = "frame"
COARSE = FemSettings(elements=3)
"""For ranking; what seems best is looked at again."""
FINE = FemSettings()
"""For the last word."""
BEAMS = 6000
"""In all designs that are tried together: for a crane some 24 designs, for larger ones fewer."""
FEWEST, MOST = 8, 24


@dataclass(frozen=True, slots=True, eq=False)
class Trial:
    """A finalist, followed as a part.

    Parameters
    ----------
    finalist
        The design.
    analysis
        Of its frame.
    worth
        What ranks it among parts that are as sound.
    """

    finalist: Finalist
    analysis: Analysis
    worth: float

    @property
    def fault(self) -> str | None:
        """What is wrong with the part, if anything."""
        return fault_of(self.analysis)

    @property
    def rank(self) -> tuple[int, float]:
        """Sound parts come before faulty ones, those before parts that lose their stability."""
        if self.analysis.status is not PathStatus.CONVERGED:
            return 0, self.worth
        return (2 if self.fault is None else 1), self.worth


def fault_of(analysis: Analysis) -> str | None:
    """Return what keeps a part from working, in few words; None if nothing does.

    Examples
    --------
    >>> from bellcrank.model import human_design
    >>> from bellcrank.part import PartSpec
    >>> part = PartSpec().of(human_design("crane"))
    >>> fault_of(levels["frame"](part, COARSE))
    """
    if analysis.status is not PathStatus.CONVERGED:
        return "not stable as a frame of struts"
    if len(analysis.contacts.pairs):
        return "struts touch as a frame"
    if analysis.last.strain > analysis.part.material.strain_limit:
        return "strained too far as a frame"
    if not analysis.efficiency > 0.0:
        return "moves the wrong way as a frame"
    return None


def stands(design: Design) -> bool:
    """Return whether all of a design hangs on supports, without which it is no part.

    Examples
    --------
    >>> from bellcrank.model import human_design
    >>> stands(human_design("crane"))
    True
    """
    try:
        require_held(design)
    except InvalidSettings:
        return False
    return True


def shortlist(finalists: Sequence[Finalist]) -> list[Finalist]:
    """Return the finalists to be tried: of each chain the best, turn by turn.

    Parameters
    ----------
    finalists
        The most efficient first.
    """
    beams = max(finalists[0].design.beam_count, 1)
    count = min(max(BEAMS // beams, FEWEST), MOST)
    turns: dict[int, int] = {}
    ranked = []
    for place, finalist in enumerate(finalists):
        turn = turns.get(finalist.found.chain, 0)
        turns[finalist.found.chain] = turn + 1
        ranked.append((turn, place))
    return [finalists[place] for _, place in sorted(ranked)[:count]]


@dataclass(frozen=True, slots=True)
class PartChoice:
    """Chooses among finalists by what their frames do.

    Parameters
    ----------
    spec
        What the design will be made as.
    settings
        Of the search. Frames are ranked by their own efficiency if that is what was searched for,
        by that of the model if it was a mean over strokes.
    tell
        Called with how many designs have been tried, and of how many.
    """

    spec: PartSpec
    settings: SearchSettings
    tell: Callable[[int, int], None] = lambda _done, _total: None

    def __call__(self, finalists: Sequence[Finalist]) -> tuple[Finalist, Refusals]:
        """Return the best part, and why others that seemed better were passed over."""
        standing = [each for each in finalists if stands(each.design)]
        if not standing:
            return finalists[0], []
        listed = shortlist(standing)
        trials = []
        for done, finalist in enumerate(listed):
            self.tell(done, len(listed))
            trials.append(self.trial(finalist, COARSE))
        self.tell(len(listed), len(listed))
        trials.sort(key=lambda trial: trial.rank, reverse=True)
        chosen = self._confirmed(trials)
        refused = [
            (trial.finalist.response.efficiency, trial.fault or "moves less as a frame")
            for trial in trials
            if trial.finalist is not chosen
        ]
        refused += [
            (each.response.efficiency, "hangs on no support")
            for each in finalists
            if each not in standing
        ]
        return chosen, refused

    def trial(self, finalist: Finalist, settings: FemSettings = FINE) -> Trial:
        """Follow a finalist as a part."""
        analysis = levels[LEVEL](self.spec.of(finalist.design), settings)
        own = self.settings.strokes == (1.0,)
        efficiency = analysis.efficiency if own else finalist.response.efficiency
        return Trial(finalist, analysis, -math.inf if math.isnan(efficiency) else efficiency)

    def _confirmed(self, trials: list[Trial]) -> Finalist:
        """Return the first of ranked trials that closer analysis finds as sound as it seemed.

        Those that it finds worse take the place of what they seemed.
        """
        for place, coarse in enumerate(trials):
            fine = self.trial(coarse.finalist, FINE)
            if fine.rank[0] >= coarse.rank[0]:
                return fine.finalist
            trials[place] = fine
        return trials[0].finalist
