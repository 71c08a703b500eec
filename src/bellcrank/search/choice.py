"""Selection of the design of a search; finalists of a frame are verified before one is chosen."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from bellcrank.search.evaluator import verification_evaluator
from bellcrank.search.selection import Chosen, most_efficient, select
from bellcrank.search.verdict import Verdict
from bellcrank.search.verification import Verifier

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from bellcrank.mechanics import ItemResult
    from bellcrank.model import Problem
    from bellcrank.search.selection import Candidate, Choice, Finalist, Selection
    from bellcrank.search.settings import SearchSettings
    from bellcrank.search.verification import Verification

MOST = 48
"""Largest number of candidates that are verified."""
MOST_UNMET = 12
"""The same for candidates that do not meet their specification in the model of the search."""
STARTS = 3
"""Largest number of designs of each chain that may be refined."""
MOST_OTHERS = 8
"""Largest number of candidates of each chain that are verified for them."""
DIFFERENCE = 0.1
"""Part of the beams of two designs, at least, in which they differ if both may be refined."""
MOST_NEAREST = 5
"""Largest number of designs that are reported where none meets the specification."""


@dataclass(frozen=True, slots=True)
class FirstWithoutFault:
    """Choice of the best finalist without a fault.

    Without such a one, the best one that is stable is chosen, or the best; for a problem with a
    specification the stable one with the smallest total violation.

    Parameters
    ----------
    verifier
        Verifier of the problem.
    report
        Called with the number of finalists verified and the largest number.
    """

    verifier: Verifier
    report: Callable[[int, int], None] = lambda _done, _total: None

    def __call__(self, finalists: Sequence[Finalist]) -> Chosen:
        """Return the chosen finalist with its verification, the faults of others, and the nearest.

        The nearest ones are those of which none is better in every item (`nondominated`), if no
        finalist meets the specification.
        """
        listed = shortlist(finalists)
        verified: list[Finalist] = []
        for finalist in listed:
            verified.append(self._verified(finalist, len(verified), len(listed)))
            if _verification(verified[-1]).fault is None:
                break
        chosen = min(verified, key=_rank)
        refusals = [
            (each.response.score, str(_verification(each).fault))
            for each in verified
            if each is not chosen
        ]
        others, reserve = [], []
        if chosen.items:
            others = self._others(chosen, verified, listed)
            reserve = _further(finalists, [chosen, *others])
        near = [] if _verification(chosen).fault is None else nearest(verified)
        return Chosen(chosen, refusals, near, others, reserve)

    def _verified(self, finalist: Finalist, done: int, total: int) -> Finalist:
        self.report(done, total)
        return replace(finalist, verification=self.verifier.verify(finalist.design.mask))

    def _others(
        self, chosen: Finalist, verified: list[Finalist], listed: Sequence[Finalist]
    ) -> list[Finalist]:
        """Return further finalists that may be refined, the best first.

        A few of each chain without a fault that differ from each other, or the one that misses
        least.
        """
        found: list[Finalist] = []
        for chain in sorted({each.found.chain for each in listed}):
            own = [chosen] if chosen.found.chain == chain else []
            missed: list[Finalist] = []
            tried = 0
            for finalist in [*verified, *listed[len(verified) :]]:
                if len(own) == STARTS or tried == MOST_OTHERS:
                    break
                is_new = all(_differ(finalist, each) for each in [chosen, *found, *own])
                if finalist.found.chain != chain or not is_new:
                    continue
                checked = finalist
                if checked.verification is None:
                    checked = self._verified(finalist, len(verified), len(listed))
                    tried += 1
                (missed if _verification(checked).fault else own).append(checked)
            if not own and missed:
                own = [min(missed, key=_rank)]
            found += [each for each in own if each is not chosen]
        return sorted(found, key=lambda each: (*_rank(each), -each.response.score))


def _further(finalists: Sequence[Finalist], taken: Sequence[Finalist]) -> list[Finalist]:
    """Return at most `STARTS` finalists of each chain that differ from those taken, best first."""
    found: list[Finalist] = []
    for finalist in finalists:
        same_chain = [each for each in found if each.found.chain == finalist.found.chain]
        if len(same_chain) < STARTS and all(_differ(finalist, each) for each in [*taken, *found]):
            found.append(finalist)
    return found


def _differ(first: Finalist, second: Finalist) -> bool:
    """Whether two designs differ in more than a few beams."""
    one, two = first.design.mask, second.design.mask
    return int((one != two).sum()) > DIFFERENCE * int((one | two).sum())


def nearest(verified: Sequence[Finalist]) -> list[Finalist]:
    """Return the verified finalists nearest to a specification: at most `MOST_NEAREST`.

    They are stable, and none of the others is better in every item (`nondominated`).
    """
    stable = [each for each in verified if _verification(each).items]
    front = nondominated([_violations(_verification(each).items) for each in stable])
    return sorted((stable[index] for index in front), key=_rank)[:MOST_NEAREST]


def nondominated(violations: Sequence[Sequence[float]]) -> list[int]:
    """Return the indices of the vectors that no other one equals or beats in every component.

    Of equal vectors the first one counts.

    Examples
    --------
    >>> nondominated([[0.1, 0.5], [0.3, 0.2], [0.3, 0.6], [0.1, 0.5]])
    [0, 1]
    """
    found = []
    for index, own in enumerate(violations):
        better = any(
            all(a <= b for a, b in zip(other, own, strict=True))
            and (tuple(other) != tuple(own) or number < index)
            for number, other in enumerate(violations)
            if number != index
        )
        if not better:
            found.append(index)
    return found


def _violations(items: Sequence[ItemResult]) -> list[float]:
    return [item.violation for item in items]


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


def _rank(finalist: Finalist) -> tuple[int, float]:
    """Return 0 without a fault, 1 with one, 2 without stability, and the total violation.

    The order of equal ones is kept by `min`.
    """
    found = _verification(finalist)
    rank = 0 if found.fault is None else 2 - found.is_stable
    return rank, sum(_violations(found.items))


def shortlist(finalists: Sequence[Finalist]) -> list[Finalist]:
    """Return the finalists to verify, in their order.

    The best ones of each chain, in all at most `MOST`; of those that do not meet the specification
    of their problem in the model of the search, the ones of which none of their chain is better in
    every item, at most `MOST_UNMET`.

    Parameters
    ----------
    finalists
        Finalists in descending order of the score.
    """
    seen: dict[int, int] = {}
    ranked = []
    unmet = []
    for index, finalist in enumerate(finalists):
        if finalist.response.status is Verdict.UNMET:
            unmet.append(index)
            continue
        rank = seen.get(finalist.found.chain, 0)
        seen[finalist.found.chain] = rank + 1
        ranked.append((rank, index))
    chosen = sorted(index for _, index in sorted(ranked)[:MOST])
    fronts = []
    for chain in {finalists[index].found.chain for index in unmet}:
        own = [index for index in unmet if finalists[index].found.chain == chain]
        front = nondominated([_violations(finalists[index].items) for index in own])
        fronts += list(enumerate(own[number] for number in front))
    chosen += sorted(index for _, index in sorted(fronts)[:MOST_UNMET])
    return [finalists[index] for index in chosen]
