"""Gaps between the struts of a frame along its stroke."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.fem.contact import find_contacts
from bellcrank.mechanics import BentStruts, near_pairs
from bellcrank.mechanics.frames.analysis import centre_lines
from bellcrank.mechanics.stroke import STATES
from bellcrank.search.stroke_states import SEARCH_STATES

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from bellcrank.mechanics import CaseEvaluator
    from bellcrank.model import Problem


def printed_beams(
    problem: Problem, design: NDArray[np.bool_], core: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Return (M,) the beams that carry load, `core`, or join two nodes that are held."""
    held = np.zeros(problem.lattice.node_count, dtype=bool)
    held[problem.supports.fixed] = True
    if problem.input.drive == "displacement":
        held[problem.input.nodes] = True
    between = design & held[problem.lattice.beams].all(axis=1)
    return np.asarray(core | between)


def gap_less_overlaps(case: CaseEvaluator, design: NDArray[np.bool_], bound: float) -> float:
    """Return a bound on the gap less the sum over pairs of struts of how far they are too near.

    At the state of the stroke where the sum is largest. Bent struts have two straight pieces.

    Parameters
    ----------
    case
        Evaluator, with one element in each beam, that computed the response of the design.
    design : (M,) bool
    bound
        Wanted gap, lattice units.
    """
    least, worst = float(case.problem.beam_widths.max()) + bound, 0.0
    for _, _, distance in _near_struts(case, design, least):
        worst = max(worst, float(np.sum(least - distance)))
    return bound - worst


def gap_of_frame(case: CaseEvaluator, design: NDArray[np.bool_], bound: float) -> float:
    """Return the smallest gap between bent struts along the stroke; infinite above the bound.

    Faster than `smallest_gap`, at fewer states. Struts that meet in a node do not count. The
    parameters are those of `gap_less_overlaps`.
    """
    widths, ends = case.problem.beam_widths, case.problem.lattice.beams
    gap = math.inf
    for first, second, distance in _near_struts(case, design, float(widths.max()) + bound):
        meet = (ends[first][:, :, None] == ends[second][:, None, :]).any(axis=(1, 2))
        apart = (distance - 0.5 * (widths[first] + widths[second]))[~meet]
        gap = min(gap, float(apart.min(initial=math.inf)))
    return gap if gap < bound else math.inf


def _near_struts(
    case: CaseEvaluator, design: NDArray[np.bool_], distance: float
) -> Iterator[tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]]:
    """Yield pairs of struts whose centre lines are near each other, at states of the stroke."""
    problem = case.problem
    beams = np.flatnonzero(printed_beams(problem, design, case.frame.structure.present != 0))
    struts = BentStruts(problem, beams)
    for fraction in (np.arange(1, SEARCH_STATES + 1) / SEARCH_STATES).tolist():
        if (found := case.state(fraction)) is not None:
            pairs, apart = near_pairs(struts.points(found.state.u), struts.pieces, distance)
            first, second = beams[pairs.T % len(beams)]
            yield first, second, apart


def smallest_gap(case: CaseEvaluator, design: NDArray[np.bool_], bound: float) -> float:
    """Return the smallest gap between struts along the stroke; infinite above the bound.

    Parameters are those of `gap_less_overlaps`, with any number of elements in each beam.
    """
    frame = case.frame
    rest, _ = centre_lines(frame, frame.state)
    chosen = design[frame.beams]
    stroke = [
        (fraction, centre_lines(frame, found.state)[1][chosen])
        for fraction in (np.arange(1, STATES + 1) / STATES).tolist()
        if (found := case.state(fraction)) is not None
    ]
    beams = frame.beams[chosen]
    least = case.problem.beam_widths[beams] + bound
    overlap = find_contacts(beams, rest[chosen], stroke, least).overlap
    return bound - float(overlap.max()) if len(overlap) else math.inf
