"""One step of a Markov chain over designs, by any move and with any evaluator."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.model import unpack_mask
from bellcrank.search.costs import costs
from bellcrank.search.place import Place, accepts, flipped
from bellcrank.search.verdict import Verdict

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from bellcrank.model import Problem
    from bellcrank.search.blocks import Rows
    from bellcrank.search.evaluator import Evaluator
    from bellcrank.search.moves import Move


def place_of(evaluator: Evaluator, cost: str, temperature: float, mask: str) -> Place:
    """Return where a chain stands, evaluated from rest and remembered."""
    bits = unpack_mask(mask, evaluator.problem.lattice.beam_count).copy()
    response = evaluator.evaluate(bits)
    evaluator.set_reference()
    return Place(evaluator, costs[cost], temperature, bits, response)


def step(
    here: Place, move: Move, rng: np.random.Generator, rows: Rows, minimum_degree: int = 0
) -> Place:
    """Make one proposal, note it, and return where the chain is then.

    A design without a unique, stable response is refused whatever the temperature.
    """
    beams = move.propose(here, rng)
    uniform = rng.random()
    if beams is None:
        rows.add(here.mask, math.nan, math.nan, here.temperature, False, Verdict.REJECTED_EARLY)
        return here
    mask = flipped(here.mask, beams)
    if minimum_degree and _is_forbidden(here.problem, minimum_degree, mask, beams):
        rows.add(mask, math.nan, math.nan, here.temperature, False, Verdict.FORBIDDEN)
        return here

    def log_ratio(there: Place, gain: float) -> float:
        return gain + (move.log_chance(there, beams) - move.log_chance(here, beams))

    return consider(here, mask, log_ratio, uniform, rows)


def consider(
    here: Place,
    mask: NDArray[np.bool_],
    log_ratio: Callable[[Place, float], float],
    uniform: float,
    rows: Rows,
) -> Place:
    """Ask for the response of a proposed design, decide, note it, and return where the chain is.

    Parameters
    ----------
    mask : (M,) bool
        The proposed design.
    log_ratio
        From the proposed design, with its response, and from the log of the ratio of the two
        designs' probabilities to the log of the ratio that decides.
    uniform
        Random number in [0, 1).
    """
    response = here.evaluator.evaluate(mask, warm_start=True)
    here.is_last = False
    there = Place(here.evaluator, here.cost_function, here.temperature, mask, response)
    accepted = False
    if there.is_admissible:
        gain = (here.cost - there.cost) / here.temperature
        accepted = accepts(log_ratio(there, gain), uniform)
    rows.add(
        mask, response.efficiency, there.cost, here.temperature, accepted, int(response.status)
    )
    if accepted:
        here.evaluator.set_reference()
        return there
    return here


def _is_forbidden(
    problem: Problem, minimum_degree: int, mask: NDArray[np.bool_], beams: NDArray[np.int64]
) -> bool:
    """Whether removing beams has left a free end with too few."""
    removed = beams[~mask[beams]]
    if not len(removed):
        return False
    held = set(problem.supports.fixed.tolist())
    if problem.input.drive == "displacement":
        held.update(problem.input.nodes.tolist())
    degree = np.bincount(problem.lattice.beams[mask].ravel(), minlength=problem.lattice.node_count)
    ends = problem.lattice.beams[removed].ravel().tolist()
    return any(degree[node] < minimum_degree and node not in held for node in ends)
