"""Selection of one design from the accepted designs of all chains.

The paper takes the design from a plateau of the efficiency. Dead-end beams soften joints in the
spring model but not in a real part, so candidates from all chains are cleaned before they are
compared.
"""

from __future__ import annotations

import heapq
from collections import Counter
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import numpy as np

from bellcrank.errors import NoDesignFound
from bellcrank.mechanics import VERIFICATION_INCREMENT, Response, model_evaluator
from bellcrank.model import Design, Problem
from bellcrank.search.cleaning import clean, pieces
from bellcrank.search.constraints.evaluator import ConstrainedEvaluator
from bellcrank.search.specification import SpecificationEvaluator
from bellcrank.search.verdict import Verdict

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from numpy.typing import NDArray

    from bellcrank.mechanics import ItemResult, ModelEvaluator
    from bellcrank.search.evaluator import Evaluator
    from bellcrank.search.verification import Verification

CandidateRule: TypeAlias = "Callable[[NDArray[np.float64], NDArray[np.uint8]], list[int]]"
"""From efficiencies (n,) and packed masks (n, bytes) of the accepted designs, in order, to the
indices of candidates for the final design."""
PLATEAU_TOLERANCE = 0.005
"""Relative change of the efficiency up to which an accepted step stays on a plateau."""
PLATEAU_LENGTH = 4
"""Smallest number of accepted changes in a plateau."""
CANDIDATES = 60
"""Largest number of candidates of each chain."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """A design that a chain accepted.

    Parameters
    ----------
    score
        As recorded by the chain: the efficiency, or the score by a specification.
    chain, step
        Chain and step at which it was found.
    mask
        Its packed mask.
    """

    score: float
    chain: int
    step: int
    mask: bytes


@dataclass(frozen=True, slots=True, eq=False)
class Finalist:
    """A cleaned candidate that can be built.

    Parameters
    ----------
    found
        The candidate before cleaning.
    design
        The cleaned design: one piece, all beams carry load.
    response
        Its response from rest.
    items
        Items of the specification, as the model of the search has them.
    verification
        Its verification as a frame, if there is one.
    """

    found: Candidate
    design: Design
    response: Response
    items: tuple[ItemResult, ...] = ()
    verification: Verification | None = None


Refusals: TypeAlias = "list[tuple[float, str]]"
"""Scores of rejected designs, with the reasons."""


class Chosen(NamedTuple):
    """The chosen finalist, and others that were considered."""

    finalist: Finalist
    refusals: Sequence[tuple[float, str]] = ()
    """Scores of rejected finalists, with the reasons."""
    nearest: Sequence[Finalist] = ()
    """The nearest ones to a specification that none meets."""
    others: Sequence[Finalist] = ()
    """For a problem with a specification: further ones that may be refined, the best first."""
    reserve: Sequence[Finalist] = ()
    """Those that are refined if no result of the others meets all items."""


Choice: TypeAlias = "Callable[[Sequence[Finalist]], Chosen]"
"""From finalists, the best first, to one of them."""


@dataclass(frozen=True, slots=True, eq=False)
class Selection:
    """The selected design and its origin.

    Parameters
    ----------
    design
        The cleaned design: one piece, all beams carry load.
    response
        Its response from rest.
    found
        The candidate before cleaning.
    efficiency_before, efficiency_after
        Efficiency before and after cleaning, both from rest, with all beams kept.
    refused
        Number of rejected candidates of higher efficiency, by reason.
    verification
        Verification of a frame with several elements in each beam.
    items
        Items of the specification, as the model of the search has them.
    nearest
        Where no design meets the specification: verified designs of which none is better in every
        item.
    others
        For a problem with a specification: further designs that may be refined, the best first.
    reserve
        Designs that are refined if no result of the others meets all items; not verified.
    """

    design: Design
    response: Response
    found: Candidate
    efficiency_before: float
    efficiency_after: float
    refused: dict[str, int]
    verification: Verification | None = None
    items: tuple[ItemResult, ...] = ()
    nearest: tuple[Finalist, ...] = ()
    others: tuple[Finalist, ...] = ()
    reserve: tuple[Finalist, ...] = ()


def plateaus(
    efficiency: NDArray[np.float64],
    tolerance: float = PLATEAU_TOLERANCE,
    length: int = PLATEAU_LENGTH,
) -> list[tuple[int, int]]:
    """Find the ranges over which accepted changes leave the efficiency nearly constant.

    Parameters
    ----------
    efficiency : (n,)
        Efficiencies of the accepted designs, in order.
    tolerance
        Largest relative deviation from the first efficiency of a plateau.
    length
        Smallest number of accepted changes in a plateau.

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
    """Return the last index of each plateau; all indices if there is no plateau.

    The changes along a plateau remove beams that do no work.

    Examples
    --------
    >>> plateau_ends(np.array([0.1, 0.5, 0.5, 0.501, 0.5, 0.5, 0.9]), np.empty((7, 1), np.uint8))
    [5]
    """
    return [last - 1 for _, last in plateaus(efficiency)] or list(range(len(efficiency)))


def peaks(efficiency: NDArray[np.float64], _masks: NDArray[np.uint8]) -> list[int]:
    """Return the indices after which the efficiency decreases, and the last index.

    Examples
    --------
    >>> peaks(np.array([0.1, 0.5, 0.4, 0.7, 0.7]), np.empty((5, 1), np.uint8))
    [1, 4]
    """
    falls = np.append(efficiency[1:] < efficiency[:-1], True)[: len(efficiency)]
    return np.flatnonzero(falls).tolist()


def confirmed(efficiency: NDArray[np.float64], masks: NDArray[np.uint8]) -> list[int]:
    """Return verified designs, and the peaks that are no better than the best of them.

    Basin hopping records a verified design twice in a row. Designs with a higher efficiency
    failed the verification, and there may be many of them.

    Examples
    --------
    >>> masks = np.array([[1], [2], [2], [3]], np.uint8)
    >>> confirmed(np.array([0.1, 0.5, 0.5, 0.7]), masks)
    [2]
    """
    verified = np.flatnonzero((masks[1:] == masks[:-1]).all(axis=1)) + 1
    limit = efficiency[verified].max() if len(verified) else np.inf
    below = [index for index in peaks(efficiency, masks) if efficiency[index] <= limit]
    return sorted({*verified.tolist(), *below})


def candidates_of(
    chain: int,
    step: NDArray[np.int64],
    mask: NDArray[np.uint8],
    efficiency: NDArray[np.float64],
    rule: CandidateRule = plateau_ends,
    count: int = CANDIDATES,
) -> list[Candidate]:
    """Return the most efficient candidates of a chain, best first.

    Parameters
    ----------
    step, mask, efficiency
        (n,), (n, bytes) and (n,) of the accepted proposals, in order.
    rule
        From efficiencies and masks to the indices of candidates.
    count
        Largest number of candidates.
    """
    ranked = [(float(efficiency[index]), index) for index in rule(efficiency, mask)]
    return [
        Candidate(value, chain, int(step[index]), mask[index].tobytes())
        for value, index in heapq.nlargest(count, ranked)
    ]


def _cleaned(
    problem: Problem,
    candidates: Iterable[Candidate],
    plain: ModelEvaluator,
    evaluator: Evaluator,
) -> Iterator[tuple[Candidate, Design]]:
    """Yield each candidate with its cleaned design, each cleaned design once."""
    seen: set[bytes] = set()
    for candidate in candidates:
        cleaned = clean(Design(problem, _bits(problem, candidate)), plain)
        if isinstance(evaluator, ConstrainedEvaluator | SpecificationEvaluator):
            cleaned = cleaned.with_mask(evaluator.groups.with_images(cleaned.mask))
        key = np.packbits(cleaned.mask).tobytes()
        if key not in seen:
            seen.add(key)
            yield candidate, cleaned


def _bits(problem: Problem, candidate: Candidate) -> NDArray[np.bool_]:
    bits = np.unpackbits(np.frombuffer(candidate.mask, np.uint8))
    return bits[: problem.lattice.beam_count].astype(bool)


def _reason_against(evaluator: Evaluator, design: Design, response: Response) -> str | None:
    """Return the reason to reject a cleaned design, if there is one."""
    if response.status is Verdict.UNMET and isinstance(evaluator, ConstrainedEvaluator):
        return f"violates {', '.join(evaluator.violated(design.mask))}"
    if not response.is_admissible:
        return response.status.label
    return "in several pieces" if pieces(design.problem, design.mask) > 1 else None


def most_efficient(finalists: Sequence[Finalist]) -> Chosen:
    """Return the first finalist."""
    return Chosen(finalists[0])


def select(
    problem: Problem,
    candidates: Iterable[Candidate],
    objective: str | None = None,
    evaluator: Evaluator | None = None,
    choose: Choice = most_efficient,
) -> Selection:
    """Clean the candidates and select the most efficient one.

    Only designs in one piece with a unique, stable response from rest that satisfy all
    constraints qualify. With the constraint ``mirror``, the mirror images of the cleaned design
    are kept.

    Parameters
    ----------
    evaluator
        Evaluator with the constraints and strokes of the search, with all beams kept; that of
        the problem's mechanical model by default.
    choose
        Selects one of the qualified designs; the most efficient by default.

    Raises
    ------
    NoDesignFound
        If no candidate qualifies.
    """
    candidates = list(candidates)
    # The design keeps the objective of its search, so that any reader computes the same figure.
    problem = replace(problem, objective=objective or problem.objective)
    plain = model_evaluator(problem)
    evaluator = evaluator or plain
    finalists: list[Finalist] = []
    refused: Refusals = []
    for candidate, design in _cleaned(problem, candidates, plain, evaluator):
        response = evaluator.evaluate(design.mask, largest_increment=VERIFICATION_INCREMENT)
        if (reason := _reason_against(evaluator, design, response)) is not None:
            refused.append((response.score, reason))
        else:
            items: tuple[ItemResult, ...] = ()
            if isinstance(evaluator, SpecificationEvaluator):
                items = tuple(evaluator.results())
            finalists.append(Finalist(candidate, design, response, items))
    if not finalists:
        raise NoDesignFound(_no_candidate(problem, len(candidates), refused, evaluator))
    finalists.sort(key=lambda each: each.response.score, reverse=True)
    chosen, passed_over, nearest, others, reserve = choose(finalists)
    best = chosen.response.score
    reasons = [reason for value, reason in (*refused, *passed_over) if value > best]
    return Selection(
        design=chosen.design,
        response=chosen.response,
        found=chosen.found,
        efficiency_before=evaluator.evaluate(_bits(problem, chosen.found)).efficiency,
        efficiency_after=chosen.response.efficiency,
        refused={reason: reasons.count(reason) for reason in sorted(set(reasons))},
        verification=chosen.verification,
        items=chosen.items,
        nearest=tuple(nearest),
        others=tuple(others),
        reserve=tuple(reserve),
    )


def _no_candidate(problem: Problem, count: int, refused: Refusals, evaluator: Evaluator) -> str:
    """Return the message that explains why no candidate qualifies."""
    goals = evaluator.goals if isinstance(evaluator, ConstrainedEvaluator) else ()
    if goals and not count:
        return (
            f"problem {problem.name!r}: the search accepted no design that satisfies its "
            f"goals ({', '.join(goals)}); relax them, or use more steps (--steps)"
        )
    if not count:
        return (
            f"problem {problem.name!r}: the search accepted no design; use more steps "
            "(--steps), or start from another design (--from)"
        )
    reasons = Counter(reason for _, reason in refused)
    listed = ", ".join(f"{number} {reason}" for reason, number in reasons.most_common(3))
    return (
        f"problem {problem.name!r}: none of {count} accepted designs is one stable "
        f"piece{' that satisfies the goals' if goals else ''} ({listed}); "
        "use more steps (--steps) or more chains (--chains)"
    )
