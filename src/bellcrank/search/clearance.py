"""Gaps between the struts of a frame along its stroke."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.fem.contact import find_contacts
from bellcrank.mechanics import bent_pieces, near_pairs
from bellcrank.mechanics.frames.analysis import centre_lines
from bellcrank.mechanics.stroke import STATES
from bellcrank.search.stroke_states import SEARCH_STATES

if TYPE_CHECKING:
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
    problem = case.problem
    beams = np.flatnonzero(printed_beams(problem, design, case.frame.structure.present != 0))
    least, worst = float(problem.beam_widths.max()) + bound, 0.0
    for fraction in (np.arange(1, SEARCH_STATES + 1) / SEARCH_STATES).tolist():
        if (found := case.state(fraction)) is not None:
            points, pieces = bent_pieces(problem, beams, found.state.u)
            _, distance = near_pairs(points, pieces, least)
            worst = max(worst, float(np.sum(least - distance)))
    return bound - worst


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
