"""After the search: from what the chains saw to one design that can be built.

The paper takes the design from a plateau of the efficiency. What looks best in the
model is not always best in the hand: dead-end beams soften joints there and nowhere
else. So candidates from all chains are cleaned first and compared after.
"""

from __future__ import annotations

import heapq
from collections import Counter
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.mechanics import VERIFICATION_INCREMENT, Response, SpringEvaluator, Status
from bellcrank.model import Design, Problem
from bellcrank.search.cleaning import clean, pieces
from bellcrank.search.goals import GoalEvaluator
from bellcrank.search.verdict import Verdict

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from numpy.typing import NDArray

    from bellcrank.search.evaluator import Evaluator

Offers: TypeAlias = "Callable[[NDArray[np.float64], NDArray[np.uint8]], list[int]]"
"""From efficiencies (n,) and packed masks (n, bytes) of the accepted designs, in order, to the
indices of those worth building."""
PLATEAU_TOLERANCE = 0.005
"""Relative change of the efficiency up to which an accepted step leaves it unmoved."""
PLATEAU_LENGTH = 4
"""Accepted changes that make a plateau."""
CANDIDATES = 60
"""Of each chain, cleaned and compared."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """A design that a chain accepted.

    Parameters
    ----------
    efficiency
        As recorded by the chain.
    chain, step
        Where it was found.
    mask
        Its packed mask.
    """

    efficiency: float
    chain: int
    step: int
    mask: bytes


@dataclass(frozen=True, slots=True, eq=False)
class Finalist:
    """A candidate that can be built once it is cleaned.

    Parameters
    ----------
    found
        The candidate, as the chain left it.
    design
        Cleaned: one piece, nothing loose, no dead ends.
    response
        Its response from rest.
    """

    found: Candidate
    design: Design
    response: Response


Refusals: TypeAlias = "list[tuple[float, str]]"
"""Efficiencies of designs that were refused, and why."""
Choice: TypeAlias = "Callable[[Sequence[Finalist]], tuple[Finalist, Refusals]]"
"""From finalists, the most efficient first, to one of them and what speaks against others."""


@dataclass(frozen=True, slots=True, eq=False)
class Selection:
    """The design to build, and how it came about.

    Parameters
    ----------
    design
        Cleaned: one piece, nothing loose, no dead ends.
    response
        Its response from rest.
    found
        The candidate it was cleaned from, as the chain left it.
    efficiency_before, efficiency_after
        Before and after cleaning, both from rest in the literal model.
    refused
        Candidates that looked better, by the reason they were refused for.
    """

    design: Design
    response: Response
    found: Candidate
    efficiency_before: float
    efficiency_after: float
    refused: dict[str, int]


def plateaus(
    efficiency: NDArray[np.float64],
    tolerance: float = PLATEAU_TOLERANCE,
    length: int = PLATEAU_LENGTH,
) -> list[tuple[int, int]]:
    """Find the stretches over which accepted changes leave the efficiency unmoved.

    Parameters
    ----------
    efficiency : (n,)
        Of the accepted designs, in order.
    tolerance
        Largest relative departure from the first efficiency of the stretch.
    length
        Least number of accepted changes in it.

    Returns
    -------
    list of (first, last)
        Half-open ranges of indices, in order, not overlapping.

    Examples
    --------
    >>> plateaus(np.array([0.1, 0.5, 0.5, 0.501, 0.5, 0.5, 0.9]))
    [(1, 6)]
    """
    found: list[tuple[int, int]] = []
    first = 0
    for index in range(1, len(efficiency) + 1):
        ended = index == len(efficiency) or abs(
            efficiency[index] - efficiency[first]
        ) > tolerance * abs(efficiency[first])
        if ended:
            if index - first > length:
                found.append((first, index))
            first = index
    return found


def plateau_ends(efficiency: NDArray[np.float64], _masks: NDArray[np.uint8]) -> list[int]:
    """Return where the plateaus end, what their changes have shed by then having done no work.

    A chain without plateaus offers all its designs.

    Examples
    --------
    >>> plateau_ends(np.array([0.1, 0.5, 0.5, 0.501, 0.5, 0.5, 0.9]), np.empty((7, 1), np.uint8))
    [5]
    """
    return [last - 1 for _, last in plateaus(efficiency)] or list(range(len(efficiency)))


def peaks(efficiency: NDArray[np.float64], _masks: NDArray[np.uint8]) -> list[int]:
    """Return where the efficiency falls next, or is at its end.

    Examples
    --------
    >>> peaks(np.array([0.1, 0.5, 0.4, 0.7, 0.7]), np.empty((5, 1), np.uint8))
    [1, 4]
    """
    falls = np.append(efficiency[1:] < efficiency[:-1], True)[: len(efficiency)]
    return np.flatnonzero(falls).tolist()


def confirmed(efficiency: NDArray[np.float64], masks: NDArray[np.uint8]) -> list[int]:
    """Return the peaks, less those above the best design that was accepted twice in a row.

    That is how a search shows that it has looked closely at a design and kept it. What seems
    better, and was not kept, is of no use, and may be there in any number.

    Examples
    --------
    >>> masks = np.array([[1], [2], [2], [3]], np.uint8)
    >>> confirmed(np.array([0.1, 0.5, 0.5, 0.7]), masks)
    [2]
    """
    kept = np.flatnonzero((masks[1:] == masks[:-1]).all(axis=1)) + 1
    limit = efficiency[kept].max() if len(kept) else np.inf
    below = [index for index in peaks(efficiency, masks) if efficiency[index] <= limit]
    return sorted({*kept.tolist(), *below})


def candidates_of(
    chain: int,
    step: NDArray[np.int64],
    mask: NDArray[np.uint8],
    efficiency: NDArray[np.float64],
    offers: Offers = plateau_ends,
    count: int = CANDIDATES,
) -> list[Candidate]:
    """Pick the most efficient of the designs that a chain offers, best first.

    Parameters
    ----------
    step, mask, efficiency
        (n,), (n, bytes) and (n,) of the accepted proposals, in order.
    offers
        From efficiencies and masks to the indices of the designs worth building.
    count
        How many at most.
    """
    ranked = [(float(efficiency[index]), index) for index in offers(efficiency, mask)]
    return [
        Candidate(value, chain, int(step[index]), mask[index].tobytes())
        for value, index in heapq.nlargest(count, ranked)
    ]


def _cleaned(
    problem: Problem, candidates: Iterable[Candidate], evaluator: SpringEvaluator, judge: Evaluator
) -> Iterator[tuple[Candidate, Design]]:
    """Yield each candidate cleaned, each cleaned design once."""
    seen: set[bytes] = set()
    for candidate in candidates:
        cleaned = clean(Design(problem, _bits(problem, candidate)), evaluator)
        if isinstance(judge, GoalEvaluator):
            cleaned = cleaned.with_mask(judge.closed(cleaned.mask))
        key = np.packbits(cleaned.mask).tobytes()
        if key not in seen:
            seen.add(key)
            yield candidate, cleaned


def _bits(problem: Problem, candidate: Candidate) -> NDArray[np.bool_]:
    bits = np.unpackbits(np.frombuffer(candidate.mask, np.uint8))
    return bits[: problem.lattice.beam_count].astype(bool)


def _why_not(judge: Evaluator, design: Design, response: Response) -> str | None:
    """Return the reason to refuse a cleaned design, if there is one."""
    if response.status is Verdict.UNMET and isinstance(judge, GoalEvaluator):
        return f"breaks {', '.join(judge.broken(design.mask))}"
    if response.status is not Status.CONVERGED:
        return response.status.label
    return "in several pieces" if pieces(design.problem, design.mask) > 1 else None


def most_efficient(finalists: Sequence[Finalist]) -> tuple[Finalist, Refusals]:
    """Choose the first."""
    return finalists[0], []


def select(
    problem: Problem,
    candidates: Iterable[Candidate],
    objective: str | None = None,
    judge: Evaluator | None = None,
    choose: Choice = most_efficient,
) -> Selection:
    """Clean the candidates and choose the one that is most efficient afterwards.

    Only designs in one piece with a unique, stable response from rest are considered, and
    only those that keep all goals. Where mirror images are to be alike, those of what is left
    by cleaning stay.

    Parameters
    ----------
    judge
        Who knows the goals and strokes of the search, in the literal model; none by default.
    choose
        Who has the last word among those that qualify.

    Raises
    ------
    InvalidSettings
        If no candidate qualifies.
    """
    candidates = list(candidates)
    # The design keeps the objective of its search: whatever reads it computes the same figure.
    problem = replace(problem, objective=objective or problem.objective)
    evaluator = SpringEvaluator(problem)
    judge = judge or evaluator
    finalists: list[Finalist] = []
    refused: Refusals = []
    for candidate, design in _cleaned(problem, candidates, evaluator, judge):
        response = judge.evaluate(design.mask, largest_increment=VERIFICATION_INCREMENT)
        if (reason := _why_not(judge, design, response)) is not None:
            refused.append((response.efficiency, reason))
        else:
            finalists.append(Finalist(candidate, design, response))
    if not finalists:
        raise InvalidSettings(_none_left(problem, len(candidates), refused, judge))
    finalists.sort(key=lambda each: each.response.efficiency, reverse=True)
    chosen, passed_over = choose(finalists)
    best = chosen.response.efficiency
    reasons = [reason for value, reason in (*refused, *passed_over) if value > best]
    return Selection(
        design=chosen.design,
        response=chosen.response,
        found=chosen.found,
        efficiency_before=judge.evaluate(_bits(problem, chosen.found)).efficiency,
        efficiency_after=best,
        refused={reason: reasons.count(reason) for reason in sorted(set(reasons))},
    )


def _none_left(problem: Problem, count: int, refused: Refusals, judge: Evaluator) -> str:
    """Say why no candidate qualifies."""
    goals = judge.goals if isinstance(judge, GoalEvaluator) else ()
    if goals and not count:
        return (
            f"problem {problem.name!r}: the search accepted no design that keeps its goals "
            f"({', '.join(goals)}); relax them, or search longer (--steps)"
        )
    if not count:
        return (
            f"problem {problem.name!r}: the search accepted no design, so that there is none to "
            "build; search longer (--steps), or begin with another design (--from)"
        )
    reasons = Counter(reason for _, reason in refused)
    listed = ", ".join(f"{number} {reason}" for reason, number in reasons.most_common(3))
    return (
        f"problem {problem.name!r}: none of {count} accepted designs is one stable "
        f"piece{' that keeps the goals' if goals else ''} ({listed}); "
        "search longer (--steps) or with more chains (--chains)"
    )
