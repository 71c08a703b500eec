"""After the search: from what the chains saw to one design that can be built.

The paper takes the design from a plateau of the efficiency. What looks best in the
model is not always best in the hand: dead-end beams soften joints there and nowhere
else. So candidates from all chains are cleaned first and compared after.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.mechanics import CAREFUL, Evaluator, Response, Status
from bellcrank.model import Design, Problem
from bellcrank.search.cleaning import clean

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from numpy.typing import NDArray

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


def plateau_ends(efficiency: NDArray[np.float64]) -> list[int]:
    """Return where the plateaus end, what their changes have shed by then having done no work.

    A chain without plateaus offers all its designs.

    Examples
    --------
    >>> plateau_ends(np.array([0.1, 0.5, 0.5, 0.501, 0.5, 0.5, 0.9]))
    [5]
    """
    return [last - 1 for _, last in plateaus(efficiency)] or list(range(len(efficiency)))


def peaks(efficiency: NDArray[np.float64]) -> list[int]:
    """Return where the efficiency falls next, or is at its end.

    Examples
    --------
    >>> peaks(np.array([0.1, 0.5, 0.4, 0.7, 0.7]))
    [1, 4]
    """
    falls = np.append(efficiency[1:] < efficiency[:-1], True)[: len(efficiency)]
    return np.flatnonzero(falls).tolist()


def candidates_of(
    chain: int,
    step: NDArray[np.int64],
    mask: NDArray[np.uint8],
    efficiency: NDArray[np.float64],
    offers: Callable[[NDArray[np.float64]], list[int]] = plateau_ends,
    count: int = CANDIDATES,
) -> list[Candidate]:
    """Pick the most efficient of the designs that a chain offers, best first.

    Parameters
    ----------
    step, mask, efficiency
        (n,), (n, bytes) and (n,) of the accepted proposals, in order.
    offers
        From the efficiencies to the indices of the designs worth building.
    count
        How many at most.
    """
    ranked = [(float(efficiency[index]), index) for index in offers(efficiency)]
    return [
        Candidate(value, chain, int(step[index]), mask[index].tobytes())
        for value, index in heapq.nlargest(count, ranked)
    ]


def pieces(problem: Problem, mask: NDArray[np.bool_]) -> int:
    """Count the separate pieces a design would print as."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    beams = problem.lattice.beams[mask]
    used, local = np.unique(beams, return_inverse=True)
    local = local.reshape(beams.shape)
    graph = coo_matrix((np.ones(len(beams)), local.T), shape=(len(used), len(used)))
    return int(connected_components(graph, directed=False)[0])


def _cleaned(
    problem: Problem, candidates: Iterable[Candidate], evaluator: Evaluator
) -> Iterator[tuple[Candidate, Design]]:
    """Yield each candidate cleaned, each cleaned design once."""
    seen: set[bytes] = set()
    for candidate in candidates:
        bits = np.unpackbits(np.frombuffer(candidate.mask, np.uint8))
        raw = Design(problem, bits[: problem.lattice.beam_count].astype(bool))
        cleaned = clean(raw, evaluator)
        key = np.packbits(cleaned.mask).tobytes()
        if key not in seen:
            seen.add(key)
            yield candidate, cleaned


def select(
    problem: Problem, candidates: Iterable[Candidate], objective: str | None = None
) -> Selection:
    """Clean the candidates and choose the one that is most efficient afterwards.

    Only designs in one piece with a unique, stable response from rest are considered.

    Raises
    ------
    InvalidSettings
        If no candidate qualifies.
    """
    candidates = list(candidates)
    evaluator = Evaluator(problem, objective)
    best: tuple[Candidate, Design, Response] | None = None
    refused: list[tuple[float, str]] = []
    for candidate, design in _cleaned(problem, candidates, evaluator):
        response = evaluator.respond(design.mask, largest_increment=CAREFUL)
        if response.status is not Status.CONVERGED:
            refused.append((response.efficiency, response.status.label))
        elif pieces(problem, design.mask) > 1:
            refused.append((response.efficiency, "in several pieces"))
        elif best is None or response.efficiency > best[2].efficiency:
            best = candidate, design, response
    if best is None:
        raise InvalidSettings(
            f"problem {problem.name!r}: none of {len(candidates)} accepted designs is one stable "
            "piece; search longer (--steps) or with more chains (--chains)"
        )
    candidate, design, response = best
    bits = np.unpackbits(np.frombuffer(candidate.mask, np.uint8))[: len(design.mask)]
    reasons = [reason for value, reason in refused if value > response.efficiency]
    return Selection(
        design=design,
        response=response,
        found=candidate,
        efficiency_before=evaluator.respond(bits.astype(bool)).efficiency,
        efficiency_after=response.efficiency,
        refused={reason: reasons.count(reason) for reason in sorted(set(reasons))},
    )
