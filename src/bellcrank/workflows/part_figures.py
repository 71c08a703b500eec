"""Figures of a part that are always reported beside its specification."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.fem.results import finite
from bellcrank.mechanics import (
    VERIFICATION_INCREMENT,
    CaseEvaluator,
    Channel,
    Status,
    StrokeRecord,
)
from bellcrank.mechanics.frames.analysis import strain_amplitude
from bellcrank.mechanics.frames.output_loads import with_output
from bellcrank.mechanics.frames.quantities.motion import rotation_vector
from bellcrank.mechanics.output import deformation_of
from bellcrank.task import units_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from bellcrank.model import Design, Problem
    from bellcrank.part import PartSpec
    from bellcrank.task import ProblemUnits

    Values = NDArray[np.float64]

SHEET_QUANTITIES = ("gain", "off_axis", "rotation", "input_force", "strain", "stiffness")
"""Quantities of the figures in the sheet."""
LEAST_ROTATION = 0.05
"""Rotation below which its axis is not reported, degrees."""
STATES = 16
"""Number of states along the stroke."""
LOAD_TRIALS = 12
"""Largest number of responses in the search for a load that halves the motion."""
LOAD_TOLERANCE = 0.01
"""Relative accuracy of this load."""


def part_figures(design: Design, spec: PartSpec, elements: int | None = 8) -> list[dict[str, Any]]:
    """Return figures of a design as a part, for each output of each load case.

    Parameters
    ----------
    design
        Design of a frame; it stands upright under its own weight.
    spec
        Size and material of the part.
    elements
        As in `bellcrank.mechanics.FrameEvaluator`.

    Returns
    -------
    list of dict
        Plain data with units in the keys; None where a figure does not exist. ``path_mm`` are the
        displacements of the output at equal fractions of the stroke. ``rotation_deg`` is the size
        of the largest rotation along the stroke, ``rotation_axis`` its axis in space, about which
        it is right-handed. ``curve`` has the motion of the input, that of the output along its
        direction, its rotation and the input force from rest to the full stroke.

    Examples
    --------
    >>> from dataclasses import replace
    >>> from bellcrank.model import human_design
    >>> from bellcrank.part import PartSpec, frame_problem
    >>> spec, design = PartSpec(), human_design("crane")
    >>> design = replace(design, problem=frame_problem(design.problem, spec))
    >>> (row,) = part_figures(design, spec, elements=None)
    >>> round(row["efficiency"], 2), round(row["efficiency_half"], 2), row["limit_points"]
    (1.17, 1.38, [])
    """
    units = units_of(design.problem, spec)
    upright = None
    if not math.isnan(units.density):
        upright = np.zeros(design.problem.lattice.dimension)
        upright[-1] = -units.weight
    rows = []
    for name, case in design.problem.cases.items():
        evaluator = CaseEvaluator(case, elements, upright)
        response = evaluator.respond(design.mask, VERIFICATION_INCREMENT)
        about = {"case": name, "status": response.status.label, "stable_to": response.reached}
        for output in case.outputs:
            row: dict[str, Any] = {**about, "output": output}
            if response.status is Status.CONVERGED:
                row |= _motion(evaluator, output, units)
                stiffness = row["output_stiffness_N_per_mm"] or 0.0
                wanted = with_output(case, output)
                nodes = wanted.output.nodes
                rest, moved = case.lattice.positions[nodes], response.displacement[nodes]
                deformation = units.in_part("length", deformation_of(rest, moved))
                row["output_deformation_mm"] = finite(deformation)
                travel = row["travel_mm"] / units.length
                first = 0.5 * travel * units.in_problem("stiffness", stiffness)
                payload = _halving_load(wanted, design.mask, elements, travel, first, dead=False)
                first = first if payload is None else payload
                dead = _halving_load(wanted, design.mask, elements, travel, first, dead=True)
                for key, load in (("payload_N", payload), ("dead_load_N", dead)):
                    row[key] = None if load is None else units.in_part("force", load)
            rows.append(row)
    return rows


def sheet_figures(
    problem: Problem, spec: PartSpec, records: Mapping[str, StrokeRecord]
) -> list[dict[str, Any]]:
    """Return figures of a part in the sheet, for each output of each load case.

    Parameters
    ----------
    problem
        Problem with a specification.
    spec
        Size and material of the part.
    records
        Channels of `SHEET_QUANTITIES` in the sheet by load case
        (`bellcrank.fem.specification.sheet_records`).

    Returns
    -------
    list of dict
        Those of `part_figures` that follow from one path: motion, off-axis motion, rotation, input
        force, strain and stiffness; ``sag_mm`` where the specification bounds the sag.
    """
    units = units_of(problem, spec)
    return [
        {"case": name, "output": output, **_along(records[name], output, units)}
        for name, case in problem.cases.items()
        for output in case.outputs
    ]


def _along(record: StrokeRecord, output: str, units: ProblemUnits) -> dict[str, Any]:
    """Return the figures that follow from the channels along a stroke."""
    motion, moved = record.of("motion", output), record.of("input_motion")
    travel, force = motion[:, 0], record.of("input_force")
    with np.errstate(divide="ignore", invalid="ignore"):
        gain = travel / moved
        off_axis = np.linalg.norm(motion[:, 1:], axis=1).max() / abs(travel[-1])
    sag = record.channels.get(Channel("sag", output), np.array([math.nan]))[0]
    return {
        "efficiency": finite(gain[-1]),
        "travel_mm": finite(units.in_part("length", travel[-1])),
        "input_mm": finite(units.in_part("length", moved[-1])),
        "off_axis": finite(off_axis),
        "rotation_deg": finite(float(np.abs(record.of("rotation", output)).max())),
        "rotation_axis": _axis(record.channels.get(Channel("rotation_vector", output))),
        "input_force_N": finite(units.in_part("force", force[-1])),
        "largest_input_force_N": finite(units.in_part("force", force.max())),
        "strain": finite(record.of("strain").max()),
        "output_stiffness_N_per_mm": finite(
            units.in_part("stiffness", record.of("stiffness", output)[0])
        ),
        "sag_mm": finite(units.in_part("length", sag)),
        "curve": {
            "input_mm": _from_rest(units.in_part("length", 1.0) * moved),
            "output_mm": _from_rest(units.in_part("length", 1.0) * travel),
            "rotation_deg": _from_rest(record.of("rotation", output)),
            "input_force_N": _from_rest(units.in_part("force", 1.0) * force),
        },
    }


def _from_rest(values: Values) -> list[float | None]:
    """Return values along the stroke after 0 at rest."""
    return [finite(float(f"{value:.5g}")) for value in (0.0, *values.tolist())]


def _axis(vectors: Values | None) -> list[float] | None:
    """Return the unit vector of the largest of (F, 3) rotation vectors; None if all are small."""
    if vectors is None:  # in the plane
        return None
    sizes = np.linalg.norm(vectors, axis=1)
    if not np.isfinite(sizes).all() or sizes.max() < LEAST_ROTATION:
        return None
    axis: list[float] = (vectors[sizes.argmax()] / sizes.max()).round(3).tolist()
    return axis


def _motion(evaluator: CaseEvaluator, output: str, units: ProblemUnits) -> dict[str, Any]:
    """Return the figures that follow from one response."""
    fractions = np.arange(1, STATES + 1) / STATES
    names = ["motion", "displacement", "rotation", "stiffness", "blocked_force"]
    if units.density == units.density:
        names.append("sag")
    own = [Channel(name, output) for name in names]
    shared = [Channel("input_motion"), Channel("input_force"), Channel("strain")]
    found = evaluator.values([*own, *shared], fractions.tolist())
    if evaluator.problem.lattice.dimension == 3:
        found[Channel("rotation_vector", output)] = _rotation_vectors(evaluator, output, fractions)
    motion, moved = found[Channel("motion", output)], found[Channel("input_motion")]
    half = STATES // 2 - 1
    with np.errstate(divide="ignore", invalid="ignore"):
        half_gain = motion[half, 0] / moved[half]
    path = units.in_part("length", 1.0) * found[Channel("displacement", output)]
    force = found[Channel("input_force")]
    return {
        **_along(StrokeRecord(fractions, found), output, units),
        "efficiency_half": finite(half_gain),
        "strain_amplitude": finite(_amplitude(evaluator, fractions)),
        "blocked_force_N": finite(
            units.in_part("force", found[Channel("blocked_force", output)][0])
        ),
        "limit_points": limit_points(fractions, force),
        "path_mm": np.vstack([np.zeros(path.shape[1]), path]).round(4).tolist(),
    }


def _rotation_vectors(evaluator: CaseEvaluator, output: str, fractions: Values) -> Values:
    """Return (F, 3) the rotation vector of an output, degrees; nan where a state is unknown."""
    problem = with_output(evaluator.problem, output)
    states = [evaluator.state(fraction) for fraction in fractions.tolist()]
    found = [
        np.full(3, math.nan) if state is None else rotation_vector(replace(state, problem=problem))
        for state in states
    ]
    return np.array(found)


def _amplitude(evaluator: CaseEvaluator, fractions: Values) -> float:
    """Return the amplitude of the strain in a cycle of the stroke; nan if a state is unknown."""
    states = [evaluator.state(fraction) for fraction in fractions.tolist()]
    known = [state for state in states if state is not None]
    return strain_amplitude(known) if len(known) == len(states) else math.nan


def limit_points(fractions: Values, force: Values) -> list[float]:
    """Return the fractions of the stroke at which the input force is largest or smallest.

    Parameters
    ----------
    fractions, force : (F,)
        Force along the stroke, which begins with zero at rest.

    Examples
    --------
    >>> limit_points(np.array([0.25, 0.5, 0.75, 1.0]), np.array([2.0, 3.0, 1.0, 2.0]))
    [0.5, 0.75]
    """
    whole = np.concatenate([[0.0], force])
    turns = np.diff(np.sign(np.diff(whole)))
    return [float(fractions[index]) for index in np.flatnonzero(turns)]


def _halving_load(
    problem: Problem,
    mask: NDArray[np.bool_],
    elements: int | None,
    travel: float,
    first: float,
    *,
    dead: bool,
) -> float | None:
    """Return the force against the direction of the output that halves its travel.

    None if the motion is lost before. Found by bisection, from a first estimate.

    Parameters
    ----------
    dead
        Whether the force acts before the input, and not in proportion to it.
    """
    if travel <= 0.0 or first <= 0.0:
        return None
    loaded = Channel("carried_motion" if dead else "loaded_motion", next(iter(problem.outputs)))

    def travel_under(force: float) -> float:
        (evaluator,) = CaseEvaluator(problem, elements, forces={loaded: force}).loaded
        response = evaluator.evaluate(mask, VERIFICATION_INCREMENT)
        if response.status is not Status.CONVERGED:
            return -math.inf
        moved = response.displacement[problem.output.nodes]
        return float((moved * problem.output.direction).sum(axis=1).mean())

    low, high = 0.0, first
    for _ in range(LOAD_TRIALS):
        if high - low <= LOAD_TOLERANCE * high and low > 0.0:
            break
        middle = high if low == 0.0 else 0.5 * (low + high)
        if travel_under(middle) >= 0.5 * travel:
            low = middle
            if middle == high:
                high *= 2.0
        else:
            high = middle
            low = low or 1e-12 * middle
    return low if low > 1e-9 * high else None
