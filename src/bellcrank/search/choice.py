"""Selection of the design of a search; finalists of a frame are verified before one is chosen."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from bellcrank.search.evaluator import verification_evaluator
from bellcrank.search.selection import most_efficient, select
from bellcrank.search.verification import Verifier

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from bellcrank.model import Problem
    from bellcrank.search.selection import Candidate, Choice, Finalist, Refusals, Selection
    from bellcrank.search.settings import SearchSettings
    from bellcrank.search.verification import Verification

MOST = 48
"""Largest number of candidates that are verified."""


@dataclass(frozen=True, slots=True)
class FirstWithoutFault:
    """Choice of the most efficient finalist without a fault.

    Without such a one, the most efficient one that is stable is chosen, or the most efficient.

    Parameters
    ----------
    verifier
        Verifier of the problem.
    report
        Called with the number of finalists verified and the largest number.
    """

    verifier: Verifier
    report: Callable[[int, int], None] = lambda _done, _total: None

    def __call__(self, finalists: Sequence[Finalist]) -> tuple[Finalist, Refusals]:
        """Return the chosen finalist with its verification, and the faults of others."""
        listed = shortlist(finalists)
        verified: list[Finalist] = []
        for done, finalist in enumerate(listed):
            self.report(done, len(listed))
            verification = self.verifier.verify(finalist.design.mask)
            verified.append(replace(finalist, verification=verification))
            if verification.fault is None:
                break
        chosen = min(verified, key=_rank)
        return chosen, [
            (each.response.efficiency, str(_verification(each).fault))
            for each in verified
            if each is not chosen
        ]


def select_design(
    problem: Problem,
    candidates: Iterable[Candidate],
    settings: SearchSettings,
    strain_limit: float = math.nan,
    report: Callable[[int, int], None] = lambda _done, _total: None,
) -> Selection:
    """Select the design of a search: of a frame, the most efficient one without a fault.

    Parameters
    ----------
    problem
        Problem of the search, in the spring model or as a frame.
    candidates
        Candidates of all chains.
    settings
        Settings of the search.
    strain_limit
        Largest admissible principal strain of a frame; nan if it is unknown.
    report
        Called with the number of candidates of a frame verified and the largest number.

    Raises
    ------
    NoDesignFound
        As `select`.
    """
    choose: Choice = most_efficient
    if problem.section is not None:
        choose = FirstWithoutFault(Verifier(problem, settings, strain_limit), report)
    evaluator = verification_evaluator(problem, settings)
    return select(problem, candidates, settings.objective, evaluator, choose)


def _verification(finalist: Finalist) -> Verification:
    assert finalist.verification is not None
    return finalist.verification


def _rank(finalist: Finalist) -> int:
    """Return 0 without a fault, 1 with one, 2 without stability; the order is kept by `min`."""
    found = _verification(finalist)
    return 0 if found.fault is None else 2 - found.is_stable


def shortlist(finalists: Sequence[Finalist]) -> list[Finalist]:
    """Return the best finalists of each chain, in all at most `MOST`, in their order.

    Parameters
    ----------
    finalists
        Finalists in descending order of efficiency.
    """
    seen: dict[int, int] = {}
    ranked = []
    for index, finalist in enumerate(finalists):
        rank = seen.get(finalist.found.chain, 0)
        seen[finalist.found.chain] = rank + 1
        ranked.append((rank, index))
    chosen = sorted(index for _, index in sorted(ranked)[:MOST])
    return [finalists[index] for index in chosen]
