"""No two struts that cross or come near each other in the moved state."""

from __future__ import annotations

from typing import TYPE_CHECKING, get_args

import numpy as np

from bellcrank.mechanics import StrokeEvaluator, UnloadedBeams
from bellcrank.search.goals.terms import Kind, Moved, Term, counted, positive
from bellcrank.search.goals.terms import terms as registry

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.model import Problem


def read_width(rest: str) -> float:
    """Read an optional number."""
    return positive(rest) if rest else 0.0


def cross(u: NDArray[np.float64], v: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (n,) the cross products of (n, 2) vectors."""
    product: NDArray[np.float64] = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    return product


def distance_to_segment(
    point: NDArray[np.float64], start: NDArray[np.float64], end: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return (n,) the distances of (n, 2) points to segments."""
    along, offset = end - start, point - start
    square = np.maximum((along * along).sum(axis=1), 1e-300)
    part = np.clip((offset * along).sum(axis=1) / square, 0.0, 1.0)
    rest = offset - part[:, None] * along
    distance: NDArray[np.float64] = np.hypot(rest[:, 0], rest[:, 1])
    return distance


def segment_distances(
    first: NDArray[np.float64], second: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return (n,) the distances between pairs of segments, 0 where they cross.

    Parameters
    ----------
    first, second : (n, 2, 2)
        Ends of the segments.

    Examples
    --------
    >>> bar = np.array([[[0.0, 0.0], [2.0, 0.0]]])
    >>> segment_distances(bar, bar + [0.0, 0.5]), segment_distances(bar, bar[:, :, ::-1] + [1, -1])
    (array([0.5]), array([0.]))
    """
    a, b, c, d = first[:, 0], first[:, 1], second[:, 0], second[:, 1]
    apart = np.minimum.reduce(
        [
            distance_to_segment(a, c, d),
            distance_to_segment(b, c, d),
            distance_to_segment(c, a, b),
            distance_to_segment(d, a, b),
        ]
    )
    sides = cross(b - a, c - a) * cross(b - a, d - a)
    others = cross(d - c, a - c) * cross(d - c, b - c)
    distance: NDArray[np.float64] = np.where((sides < 0.0) & (others < 0.0), 0.0, apart)
    return distance


def near_pairs(
    positions: NDArray[np.float64], beams: NDArray[np.int64], width: float
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Find the pairs of struts without a common node that cross or are nearer than a width.

    Parameters
    ----------
    positions : (N, 2)
    beams : (n, 2)
    width
        0 for crossings alone.

    Returns
    -------
    pairs : (p, 2) int64
        Indices into `beams`.
    distance : (p,)
    """
    from scipy.spatial import cKDTree

    if len(beams) < 2:
        return np.empty((0, 2), np.int64), np.empty(0)
    ends = positions[beams]
    longest = float(np.hypot(*(ends[:, 1] - ends[:, 0]).T).max())
    pairs = cKDTree(ends.mean(axis=1)).query_pairs(longest + width, output_type="ndarray")
    one, other = beams[pairs[:, 0]], beams[pairs[:, 1]]
    pairs = pairs[~(one[:, :, None] == other[:, None, :]).any(axis=(1, 2))]
    distance = segment_distances(ends[pairs[:, 0]], ends[pairs[:, 1]])
    near = (distance < width) | (distance == 0.0)
    return np.asarray(pairs[near], dtype=np.int64), distance[near]


def struts_of(moved: Moved) -> NDArray[np.int64]:
    """Return (n, 2) the ends of the beams that are built: what carries load or joins held nodes."""
    problem = moved.evaluator.problem
    held = np.zeros(problem.lattice.node_count, dtype=bool)
    held[problem.supports.fixed] = True
    if problem.input.drive == "displacement":
        held[problem.input.nodes] = True
    between = moved.mask & held[problem.lattice.beams].all(axis=1)
    struts: NDArray[np.int64] = problem.lattice.beams[moved.core | between]
    return struts


def no_contact(_problem: Problem, width: float) -> Term:
    """No struts that cross and, with a width, none nearer to each other than that width.

    Each crossing counts as one fault, and two struts that are too near as the missing fraction of
    the width. Designs that are verified are checked along the whole stroke, where the state with
    most faults counts; others at full load only.
    """
    # Separate evaluators, because the one that holds the response must keep it.
    strokes: dict[tuple[float, int], StrokeEvaluator] = {}

    def faults(positions: NDArray[np.float64], struts: NDArray[np.int64]) -> float:
        _, distance = near_pairs(positions, struts, width)
        return float(np.sum(1.0 - distance / width)) if width else float(len(distance))

    def of_response(moved: Moved) -> float:
        struts = struts_of(moved)
        worst = faults(moved.positions, struts)
        if moved.verified:
            evaluator = moved.evaluator
            key = (evaluator.problem.input.amount, evaluator.core)
            if key not in strokes:
                unloaded_beams = get_args(UnloadedBeams)[evaluator.core]
                strokes[key] = StrokeEvaluator(evaluator.problem, unloaded_beams)
            rest = evaluator.problem.lattice.positions
            for _, response in strokes[key].evaluate(moved.mask):
                worst = max(worst, faults(rest + response.displacement, struts))
        return counted(worst)

    return Term(of_response=of_response, price=3)


registry.register("no-contact")(
    Kind("'no-contact', or 'no-contact NUMBER' with a width above 0", read_width, no_contact)
)
