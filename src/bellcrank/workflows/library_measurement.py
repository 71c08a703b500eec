"""Measurement of an entry: two-port, frame analyses, figures of the part."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from bellcrank.errors import InvalidSettings
from bellcrank.fem import FemSettings
from bellcrank.machines.characterisation import characterise
from bellcrank.machines.library.entry import (
    FIGURES,
    OWN,
    Entry,
    FrameResult,
    direction_of,
)
from bellcrank.mechanics import VERIFICATION_INCREMENT, Status, model_evaluator
from bellcrank.part import PartSpec, models
from bellcrank.provenance import provenance
from bellcrank.workflows import spec_for, validate
from bellcrank.workflows.part_figures import part_figures

if TYPE_CHECKING:
    from bellcrank.model import Design

MIN_INPUT_STIFFNESS = 1e-6
"""Input stiffness below which a design is a mechanism without resistance."""


def measure(
    design: Design,
    direction: str | None = None,
    columns: int | None = None,
    kind: str = OWN,
    *,
    points: int = 20,
    notes: dict[str, Any] | None = None,
) -> Entry:
    """Return the entry of a design, with all its results.

    Parameters
    ----------
    design
        Actuator; with a section it is measured as a frame.
    direction, columns, kind
        Properties of its task; by default those of a design of the user.
    points
        Number of points of the curves of the two-port.
    notes
        Additional items of the provenance.

    Raises
    ------
    InvalidSettings
        If the design snaps, has no input or output stiffness, or cannot be built.

    Examples
    --------
    >>> from bellcrank.model import human_design
    >>> entry = measure(human_design("crane"), points=2)
    >>> entry.direction, round(entry.efficiency, 3), round(entry.validation.efficiency, 2)
    ('left', 1.01, 1.18)
    """
    problem = design.problem
    response = model_evaluator(problem).evaluate(design.mask, VERIFICATION_INCREMENT)
    if response.status is not Status.CONVERGED:
        raise InvalidSettings(f"{problem.name}: not a usable actuator: {response.status.message}")
    found = characterise(design, points=points)
    if not found.rest.connected or found.rest.input_stiffness < MIN_INPUT_STIFFNESS:
        port = "input" if found.rest.connected else "output"
        raise InvalidSettings(f"{problem.name}: not a usable actuator: nothing resists its {port}")
    origin = dict(design.provenance)
    return Entry(
        design=replace(design, efficiency=response.efficiency, provenance={}),
        direction=direction or direction_of(problem.output),
        columns=columns,
        kind=kind,
        characterisation=replace(found, provenance={}),
        validation=frame_result(design, spec_for(design)),
        provenance={**provenance(**(notes or {})), **({"design": origin} if origin else {})},
        figures=entry_figures(design),
    )


def entry_figures(design: Design) -> dict[str, float | None]:
    """Return the figures of a design as a part, with 8 elements in each strut; empty for springs.

    Names and units are those of `bellcrank.machines.library.entry.FIGURES`.
    """
    if design.problem.section is None:
        return {}
    (row, *_) = part_figures(design, spec_for(design))
    return {name: row.get(name) for name in FIGURES}


def measure_again(entry: Entry, points: int = 20) -> Entry:
    """Return an entry with all its results measured again, as frames of the default part.

    Its search and its origin are kept.

    Raises
    ------
    InvalidSettings
        As `measure`.
    """
    design = replace(entry.design, problem=models["frames"](entry.design.problem, PartSpec()))
    origin = {key: value for key, value in entry.provenance.items() if key not in provenance()}
    return measure(design, entry.direction, entry.columns, entry.kind, points=points, notes=origin)


def frame_result(design: Design, spec: PartSpec) -> FrameResult:
    """Analyse the part of a design as a frame, nonlinear and linear.

    Raises
    ------
    InvalidSettings, UnknownName
    """
    plan = [("frame", FemSettings()), ("frame", FemSettings(linear=True))]
    found = validate(design, spec, plan)
    large, small = found.analyses
    return FrameResult(
        status=large.status.value,
        reached=float(large.last.load),
        efficiency=float(large.efficiency),
        linear_efficiency=float(small.efficiency),
        stress=float(large.last.stress),
        strain=float(large.last.strain),
        force=float(large.last.push),
        theory=large.theory,
        material=large.part.material.name,
        width=spec.width,
        thickness=spec.thickness,
        scale=spec.scale,
        warnings=(*found.doubts, *large.warnings),
    )
