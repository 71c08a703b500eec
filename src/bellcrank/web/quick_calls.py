"""Quick computations for the page, in a process that stays loaded.

Arguments and results are plain data. A problem comes as JSON text, which is also the key under
which its evaluator is cached.
"""

from __future__ import annotations

import json
import math
from collections import OrderedDict
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.mechanics import VERIFICATION_INCREMENT, ModelEvaluator, Status, model_evaluator
from bellcrank.model import Design, human_design, unpack_mask
from bellcrank.part import PartSpec, frame_problem
from bellcrank.web.task_files import problem_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.model import Problem

CACHED = 24
"""Number of cached evaluators, a few hundred kilobytes each."""
STATES = 41
"""Number of states of a motion, from rest to the full stroke."""
DIGITS = 5


@dataclass(frozen=True, slots=True, eq=False)
class CachedProblem:
    """A problem with its evaluator."""

    problem: Problem
    evaluator: ModelEvaluator


_cache: OrderedDict[str, CachedProblem] = OrderedDict()


def cached(text: str) -> CachedProblem:
    """Return the problem of a JSON text with its evaluator, from the cache if possible."""
    if text in _cache:
        _cache.move_to_end(text)
        return _cache[text]
    problem = problem_of(json.loads(text))
    _cache[text] = CachedProblem(problem, model_evaluator(problem))
    while len(_cache) > CACHED:
        _cache.popitem(last=False)
    return _cache[text]


def design_of(text: str, mask: str) -> Design:
    """Return the design of a mask in hexadecimal."""
    problem = cached(text).problem
    return Design(problem, unpack_mask(mask, problem.lattice.beam_count))


def load_kernels() -> bool:
    """Load the kernels that the page needs, or compile them."""
    design = human_design("crane")
    assert design is not None
    for problem in (design.problem, frame_problem(design.problem, PartSpec())):
        evaluator = model_evaluator(problem)
        evaluator.evaluate(design.mask, VERIFICATION_INCREMENT)
        evaluator.predict_flips(design.mask)
    return True


def evaluate(text: str, mask: str) -> dict[str, Any]:
    """Return the response of a design, followed from rest to the full stroke in small steps."""
    entry = cached(text)
    response = entry.evaluator.evaluate(
        unpack_mask(mask, entry.problem.lattice.beam_count), VERIFICATION_INCREMENT
    )
    result: dict[str, Any] = {
        "status": response.status.label,
        "message": response.status.message,
        "efficiency": finite(response.efficiency),
        "displacement": None,
    }
    if response.status in {Status.CONVERGED, Status.SNAPPED}:
        result["displacement"] = flat(response.displacement)
    return result


def check(text: str, goals: tuple[str, ...]) -> dict[str, Any]:
    """Check that a task can be searched; return its size and the response of its initial design."""
    from bellcrank.search.constraints import parse_goal

    entry = cached(text)
    problem = entry.problem
    for goal in goals:
        parse_goal(goal).constraint(problem)
    response = evaluate(text, np.packbits(problem.initial).tobytes().hex())
    return {
        "hash": problem.hash,
        "nodes": problem.lattice.node_count,
        "beams": problem.lattice.beam_count,
        "designable": len(problem.designable),
        "response": response,
    }


def motion(text: str, mask: str) -> dict[str, Any]:
    """Return the states of a design along its loading path, each computed from rest."""
    from bellcrank.workflows.loading import loading_path

    path = loading_path(design_of(text, mask), np.linspace(0.0, 1.0, STATES))
    peak = float(path.energy.max(initial=0.0)) or 1.0
    return {
        "part": path.fraction.round(DIGITS).tolist(),
        "displacement": [flat(each) for each in path.displacement],
        "energy": [(each / peak).round(4).tolist() for each in path.energy],
        "efficiency": [finite(each) for each in path.efficiency],
        "force": [finite(each) for each in path.input_force],
        "snapped": path.snapped.tolist(),
    }


def sensitivity(text: str, mask: str) -> dict[str, Any]:
    """Return the exact change of the efficiency by flipping each designable beam.

    Each flipped design is evaluated from rest.
    """
    entry = cached(text)
    bits = unpack_mask(mask, entry.problem.lattice.beam_count).copy()
    base = entry.evaluator.evaluate(bits)
    if base.status is not Status.CONVERGED:
        raise InvalidSettings(f"no sensitivity: {base.status.message}")
    change: list[float | None] = []
    for beam in entry.problem.designable.tolist():
        bits[beam] ^= True
        flipped = entry.evaluator.evaluate(bits)
        bits[beam] ^= True
        # A design that snaps or is a mechanism has no comparable efficiency.
        known_change = flipped.efficiency - base.efficiency
        change.append(finite(known_change) if flipped.status is Status.CONVERGED else None)
    return {
        "efficiency": finite(base.efficiency),
        "beams": entry.problem.designable.tolist(),
        "change": change,
    }


def finite(value: float) -> float | None:
    """Return a number, or None for NaN and infinities, which JSON does not have."""
    value = float(value)
    return value if math.isfinite(value) else None


def flat(displacement: NDArray[np.float64]) -> list[float]:
    """Return x and y of all nodes in turn, rounded for drawing."""
    rounded: list[float] = displacement.round(DIGITS).ravel().tolist()
    return rounded
