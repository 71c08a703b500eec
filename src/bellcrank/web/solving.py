"""Responses for the page: from plain data to plain data, in a process that is kept warm.

Problems come as JSON text, which also names them: evaluators of the latest are kept.
"""

from __future__ import annotations

import json
import math
from collections import OrderedDict
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.mechanics import VERIFICATION_INCREMENT, SpringEvaluator, Status
from bellcrank.model import Design, human_design, unpack_mask
from bellcrank.web.texts import problem_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.model import Problem

KEPT = 24
"""Evaluators at hand, a few hundred kilobytes each."""
STATES = 41
"""Of a motion, from rest to the full stroke."""
DIGITS = 5


@dataclass(frozen=True, slots=True, eq=False)
class Known:
    """A problem that was asked about, with what answers for it."""

    problem: Problem
    evaluator: SpringEvaluator


_known: OrderedDict[str, Known] = OrderedDict()


def known(text: str) -> Known:
    """Return the problem of a JSON text with its evaluator, made anew or at hand."""
    if text in _known:
        _known.move_to_end(text)
        return _known[text]
    problem = problem_of(json.loads(text))
    _known[text] = Known(problem, SpringEvaluator(problem))
    while len(_known) > KEPT:
        _known.popitem(last=False)
    return _known[text]


def design_of(text: str, mask: str) -> Design:
    """Return the design of a mask in hexadecimal."""
    problem = known(text).problem
    return Design(problem, unpack_mask(mask, problem.lattice.beam_count))


def warm() -> bool:
    """Compile what the page needs, or load it from the cache."""
    design = human_design("crane")
    assert design is not None
    evaluator = SpringEvaluator(design.problem)
    evaluator.evaluate(design.mask, VERIFICATION_INCREMENT)
    evaluator.predict_flips(design.mask)
    return True


def respond(text: str, mask: str) -> dict[str, Any]:
    """Follow a design from rest to the full stroke in small steps, as a careful builder would."""
    at_hand = known(text)
    response = at_hand.evaluator.evaluate(
        unpack_mask(mask, at_hand.problem.lattice.beam_count), VERIFICATION_INCREMENT
    )
    answer: dict[str, Any] = {
        "status": response.status.label,
        "message": response.status.message,
        "efficiency": finite(response.efficiency),
        "displacement": None,
    }
    if response.status in {Status.CONVERGED, Status.SNAPPED}:
        answer["displacement"] = flat(response.displacement)
    return answer


def check(text: str, goals: tuple[str, ...]) -> dict[str, Any]:
    """Look whether a task can be searched, and say what it is."""
    from bellcrank.search.constraints import parse_goal

    at_hand = known(text)
    problem = at_hand.problem
    for goal in goals:
        parse_goal(goal).constraint(problem)
    answer = respond(text, np.packbits(problem.initial).tobytes().hex())
    return {
        "hash": problem.hash,
        "nodes": problem.lattice.node_count,
        "beams": problem.lattice.beam_count,
        "designable": len(problem.designable),
        "response": answer,
    }


def motion(text: str, mask: str) -> dict[str, Any]:
    """Compute the states of a design along its true path, each from rest."""
    from bellcrank.workflows.loading import loading_path

    way = loading_path(design_of(text, mask), np.linspace(0.0, 1.0, STATES))
    peak = float(way.energy.max(initial=0.0)) or 1.0
    return {
        "part": way.fraction.round(DIGITS).tolist(),
        "displacement": [flat(each) for each in way.displacement],
        "energy": [(each / peak).round(4).tolist() for each in way.energy],
        "efficiency": [finite(each) for each in way.efficiency],
        "force": [finite(each) for each in way.input_force],
        "snapped": way.snapped.tolist(),
    }


def sensitivity(text: str, mask: str) -> dict[str, Any]:
    """Compute what each designable beam does for the efficiency, by flipping it and looking.

    Exact and from rest, one response for each beam, not a prediction.
    """
    at_hand = known(text)
    bits = unpack_mask(mask, at_hand.problem.lattice.beam_count).copy()
    base = at_hand.evaluator.evaluate(bits)
    if base.status is not Status.CONVERGED:
        raise InvalidSettings(f"no sensitivity: {base.status.message}")
    change: list[float | None] = []
    for beam in at_hand.problem.designable.tolist():
        bits[beam] ^= True
        flipped = at_hand.evaluator.evaluate(bits)
        bits[beam] ^= True
        # What snaps or falls to a mechanism has no efficiency to compare with.
        known_change = flipped.efficiency - base.efficiency
        change.append(finite(known_change) if flipped.status is Status.CONVERGED else None)
    return {
        "efficiency": finite(base.efficiency),
        "beams": at_hand.problem.designable.tolist(),
        "change": change,
    }


def finite(value: float) -> float | None:
    """Return a number that JSON knows, or None."""
    value = float(value)
    return value if math.isfinite(value) else None


def flat(displacement: NDArray[np.float64]) -> list[float]:
    """Return x and y of all nodes in turn, as short as a picture needs them."""
    rounded: list[float] = displacement.round(DIGITS).ravel().tolist()
    return rounded
