"""Ranking of candidate designs by nonlinear frame analysis of their parts.

The spring model ranks designs well, but its best design may buckle the other way as a part, or its
struts may touch. Designs of nearly the same efficiency without these faults are usually among those
that the chains have found. The best of each chain are analysed as frames, and the best part is
chosen.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from bellcrank.errors import InvalidSettings
from bellcrank.fem import FemSettings, PathStatus, levels
from bellcrank.part.pieces import check_supported

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from bellcrank.fem import Analysis
    from bellcrank.model import Design
    from bellcrank.part import PartSpec
    from bellcrank.search import Finalist, Refusals, SearchSettings

LEVEL = "frame"
COARSE = FemSettings(elements=3)
"""Settings for ranking."""
FINE = FemSettings()
"""Settings for the confirmation of the best candidate."""
BEAMS = 6000
"""Total number of beams of the candidates that are analysed: some 24 designs of the crane, fewer of
larger problems."""
FEWEST, MOST = 8, 24


@dataclass(frozen=True, slots=True, eq=False)
class CandidateAnalysis:
    """Frame analysis of a candidate.

    Parameters
    ----------
    finalist
        Design.
    analysis
        Frame analysis of its part.
    efficiency
        Efficiency by which parts with equal faults are ranked.
    """

    finalist: Finalist
    analysis: Analysis
    efficiency: float

    @property
    def fault(self) -> str | None:
        """Fault of the part, or None."""
        return fault_of(self.analysis)

    @property
    def rank(self) -> tuple[int, float]:
        """Rank: parts without faults, then parts with faults, then those that lose stability."""
        if self.analysis.status is not PathStatus.CONVERGED:
            return 0, self.efficiency
        return (2 if self.fault is None else 1), self.efficiency


def fault_of(analysis: Analysis) -> str | None:
    """Return the fault of a part, in a few words, or None.

    Examples
    --------
    >>> from bellcrank.model import human_design
    >>> from bellcrank.part import PartSpec
    >>> part = PartSpec().of(human_design("crane"))
    >>> fault_of(levels["frame"](part, COARSE))
    """
    if analysis.status is not PathStatus.CONVERGED:
        return "not stable as a frame"
    if len(analysis.contacts.pairs):
        return "struts touch as a frame"
    if analysis.last.strain > analysis.part.material.strain_limit:
        return "strain above the limit as a frame"
    if not analysis.efficiency > 0.0:
        return "moves the wrong way as a frame"
    return None


def is_held(design: Design) -> bool:
    """Return whether all pieces of a design are supported.

    Examples
    --------
    >>> from bellcrank.model import human_design
    >>> is_held(human_design("crane"))
    True
    """
    try:
        check_supported(design)
    except InvalidSettings:
        return False
    return True


def shortlist(finalists: Sequence[Finalist]) -> list[Finalist]:
    """Return the finalists to be analysed: the best of each chain, then the second best, ...

    Parameters
    ----------
    finalists
        Finalists in descending order of efficiency.
    """
    beams = max(finalists[0].design.beam_count, 1)
    count = min(max(BEAMS // beams, FEWEST), MOST)
    seen: dict[int, int] = {}
    order = []
    for index, finalist in enumerate(finalists):
        chain_rank = seen.get(finalist.found.chain, 0)
        seen[finalist.found.chain] = chain_rank + 1
        order.append((chain_rank, index))
    return [finalists[index] for _, index in sorted(order)[:count]]


@dataclass(frozen=True, slots=True)
class CandidateRanking:
    """Choice among finalists by frame analysis.

    Parameters
    ----------
    spec
        Part for which the design is searched.
    settings
        Settings of the search. Candidates are ranked by the efficiency of their frames, or by that
        of the spring model if the search maximised a mean over strokes.
    report
        Called with the number of candidates analysed, and their total number.
    """

    spec: PartSpec
    settings: SearchSettings
    report: Callable[[int, int], None] = lambda _done, _total: None

    def __call__(self, finalists: Sequence[Finalist]) -> tuple[Finalist, Refusals]:
        """Return the best part, and why other candidates were not chosen."""
        held = [each for each in finalists if is_held(each.design)]
        if not held:
            return finalists[0], []
        listed = shortlist(held)
        analyses = []
        for done, finalist in enumerate(listed):
            self.report(done, len(listed))
            analyses.append(self.analyse(finalist, COARSE))
        self.report(len(listed), len(listed))
        analyses.sort(key=lambda analysed: analysed.rank, reverse=True)
        chosen = self._confirmed(analyses)
        refused = [
            (
                analysed.finalist.response.efficiency,
                analysed.fault or "smaller efficiency as a frame",
            )
            for analysed in analyses
            if analysed.finalist is not chosen
        ]
        refused += [
            (each.response.efficiency, "not supported") for each in finalists if each not in held
        ]
        return chosen, refused

    def analyse(self, finalist: Finalist, settings: FemSettings = FINE) -> CandidateAnalysis:
        """Analyse the part of a finalist as a frame."""
        analysis = levels[LEVEL](self.spec.of(finalist.design), settings)
        full_stroke = self.settings.strokes == (1.0,)
        efficiency = analysis.efficiency if full_stroke else finalist.response.efficiency
        return CandidateAnalysis(
            finalist, analysis, -math.inf if math.isnan(efficiency) else efficiency
        )

    def _confirmed(self, analyses: list[CandidateAnalysis]) -> Finalist:
        """Return the first of the ranked candidates whose fine analysis shows no new fault.

        A fine analysis that does show one replaces the coarse analysis in the list.
        """
        for index, coarse in enumerate(analyses):
            fine = self.analyse(coarse.finalist, FINE)
            if fine.rank[0] >= coarse.rank[0]:
                return fine.finalist
            analyses[index] = fine
        return analyses[0].finalist
