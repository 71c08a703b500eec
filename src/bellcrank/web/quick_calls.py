"""Quick computations for the page, in a process that stays loaded.

Arguments and results are plain data. A problem comes as JSON text, which is also the key under
which its evaluator is cached.
"""

from __future__ import annotations

import json
from collections import OrderedDict
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.fem.results import finite
from bellcrank.mechanics import VERIFICATION_INCREMENT, ModelEvaluator, Status, model_evaluator
from bellcrank.mechanics.output import best_fit_rotation
from bellcrank.model import Design, human_design, unpack_mask
from bellcrank.model.stroke_ranges import share_at
from bellcrank.part import PartSpec, frame_problem
from bellcrank.search import SpecificationEvaluator
from bellcrank.search.clearance import gap_of_frame
from bellcrank.search.verdict import Verdict
from bellcrank.search.verification import ELEMENTS
from bellcrank.web.items import item_states, objective_states, wanted_of_prints
from bellcrank.web.task_files import problem_of
from bellcrank.workflows.condition_texts import condition_texts
from bellcrank.workflows.figures import model_words
from bellcrank.workflows.part_figures import LEAST_ROTATION, part_figures
from bellcrank.workflows.specification import evaluated

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.model import Problem

CACHED = 24
"""Number of cached evaluators, a few hundred kilobytes each."""
STATES = {2: 41, 3: 21}
"""Number of states of a motion, from rest to the full stroke, in the plane and in space."""
DIGITS = 5
TASK_IN_SPACE = "straight-orthogonal"
"""A bundled task that needs the kernels of frames in space."""


@dataclass(frozen=True, slots=True, eq=False)
class CachedProblem:
    """A problem with its evaluator, and that of its specification if it has one."""

    problem: Problem
    evaluator: ModelEvaluator
    specification: SpecificationEvaluator | None


_cache: OrderedDict[str, CachedProblem] = OrderedDict()


def cached(text: str) -> CachedProblem:
    """Return the problem of a JSON text with its evaluator, from the cache if possible."""
    if text in _cache:
        _cache.move_to_end(text)
        return _cache[text]
    problem = problem_of(json.loads(text))
    _cache[text] = CachedProblem(problem, model_evaluator(problem), specification_of(problem))
    while len(_cache) > CACHED:
        _cache.popitem(last=False)
    return _cache[text]


def specification_of(problem: Problem) -> SpecificationEvaluator | None:
    """Return the evaluator of the specification of a problem; None without one."""
    if problem.specification is None:
        return None
    # The design itself counts, not the symmetric one that a search would make of it.
    own = replace(problem.specification, symmetry=())
    # The gap of a search is less the sum of all overlaps, which is no length of the part.
    return SpecificationEvaluator(replace(problem, specification=own), gap=gap_of_frame)


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


def load_space_kernels() -> bool:
    """Load the kernels of frames in space, or compile them, which takes a minute."""
    from bellcrank.task import find_task

    task = find_task(TASK_IN_SPACE)
    assert task is not None
    evaluator = specification_of(task.problem)
    assert evaluator is not None
    evaluator.evaluate(task.problem.initial, VERIFICATION_INCREMENT)
    return True


def evaluate(
    text: str, mask: str, part: dict[str, Any] | None = None, *, verified: bool = True
) -> dict[str, Any]:
    """Return the response of a design, followed from rest to the full stroke.

    Parameters
    ----------
    part
        Size and material, for the items of a specification.
    verified
        Follow the path in small steps, and return the items of a specification, with contact and
        stability along the whole stroke.
    """
    entry = cached(text)
    bits = unpack_mask(mask, entry.problem.lattice.beam_count)
    specification = entry.specification if verified else None
    evaluator = specification or entry.evaluator
    response = evaluator.evaluate(bits, VERIFICATION_INCREMENT if verified else 1.0)
    result: dict[str, Any] = {
        "status": response.status.label,
        "message": response.status.message,
        "efficiency": finite(response.efficiency),
        "displacement": None,
        "items": None,
    }
    if response.status in {Status.CONVERGED, Status.SNAPPED, Verdict.UNMET}:
        result["displacement"] = flat(response.displacement)
    if specification is not None and response.is_admissible:
        spec = PartSpec.from_dict(part or {}, "part")
        result["items"] = item_states(entry.problem, spec, specification.results())
    return result


def part_report(text: str, mask: str, part: dict[str, Any]) -> dict[str, Any]:
    """Return what a design does as a part: the items of its specification, and its figures.

    A problem without a specification is computed for the given part; a specification is for the
    part that its problem has.

    The figures are those of frames with eight elements in each strut, for each output of each load
    case. Items are given in the model of the search and by eight elements; None for a path that is
    not stable. Objectives are by eight elements. Conditions are the inputs and loads in words.
    ``tolerance`` has what is wanted of random prints, None without tolerances.
    """
    spec = PartSpec.from_dict(part, "part")
    design = design_of(text, mask)
    if not design.problem.is_specified:
        design = replace(design, problem=frame_problem(design.problem, spec))
    problem = design.problem
    items, objectives = {}, []
    for model, elements in (("search", None), ("frames", ELEMENTS)):
        found = evaluated(problem, design.mask, elements)
        items[model] = None if found is None else item_states(problem, spec, found.results())
        objectives = [] if found is None else objective_states(problem, spec, found)
    return {
        "specified": problem.is_specified,
        "items": items,
        "objectives": objectives,
        "conditions": condition_texts(problem, spec),
        "tolerance": wanted_of_prints(problem),
        "figures": part_figures(design, spec, ELEMENTS),
    }


def motion(text: str, mask: str, case: str = "") -> dict[str, Any]:
    """Return the states of a design along its path in a load case, each computed from rest.

    Parameters
    ----------
    case
        Name of the load case; the first one by default.
    """
    from bellcrank.workflows.loading import loading_path

    design = design_of(text, mask)
    cases = design.problem.cases
    if case and case not in cases:
        raise InvalidSettings(f"case: expected one of {', '.join(cases)}, got {case!r}")
    problem = cases[case or next(iter(cases))]
    elements = None if problem.section is None else ELEMENTS
    fractions = np.linspace(0.0, 1.0, STATES[problem.lattice.dimension])
    path = loading_path(replace(design, problem=problem), fractions, elements=elements)
    peak = float(path.energy.max(initial=0.0)) or 1.0
    supports = problem.supports
    return {
        "cases": list(cases),
        "input": problem.input.nodes.tolist(),
        "outputs": {name: each.nodes.tolist() for name, each in problem.outputs.items()},
        "supports": np.concatenate([supports.fixed, supports.fixed_x, supports.fixed_y]).tolist(),
        "moved": _input_motion(problem, path.fraction),
        "part": path.fraction.round(DIGITS).tolist(),
        "displacement": [flat(each) for each in path.displacement],
        "energy": [(each / peak).round(4).tolist() for each in path.energy],
        "efficiency": [finite(each) for each in path.efficiency],
        "force": [finite(each) for each in path.input_force],
        "snapped": path.snapped.tolist(),
        **_rotations(problem, path.displacement),
        "model": model_words(problem, elements),
    }


def _input_motion(problem: Problem, fractions: NDArray[np.float64]) -> list[float] | None:
    """Return the mean motion of the input at fractions of the stroke; None for a force."""
    given = problem.input
    if given.drive == "force":
        return None
    shares = [float(share_at(given.ranges, each).mean()) for each in fractions.tolist()]
    return [round(given.amount * each, DIGITS) for each in shares]


def _rotations(problem: Problem, displacement: NDArray[np.float64]) -> dict[str, list[Any]]:
    """Return the rotation of the first output with several nodes, degrees; in space size and axis.

    None for each state without such an output, and for the axis of a small rotation.
    """
    wide = [each.nodes for each in problem.outputs.values() if len(each.nodes) > 1]
    if not wide:
        return {"rotation": [None] * len(displacement), "axis": [None] * len(displacement)}
    rest = problem.lattice.positions[wide[0]]
    found = [best_fit_rotation(rest, moved[wide[0]]) for moved in displacement]
    sizes = [float(np.linalg.norm(each) if each.ndim else each) for each in found]
    axes = [
        (each / size).round(3).tolist() if each.ndim and size >= LEAST_ROTATION else None
        for each, size in zip(found, sizes, strict=True)
    ]
    return {"rotation": [round(size, 2) for size in sizes], "axis": axes}


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


def flat(displacement: NDArray[np.float64]) -> list[float]:
    """Return x and y of all nodes in turn, rounded for drawing."""
    rounded: list[float] = displacement.round(DIGITS).ravel().tolist()
    return rounded
