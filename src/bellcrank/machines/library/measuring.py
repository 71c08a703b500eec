"""From a design to an entry: two-port, finite elements, plain lever."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from bellcrank.errors import InvalidSettings
from bellcrank.fem import FemSettings
from bellcrank.machines.characterise import characterise
from bellcrank.machines.library.entry import Entry, FrameCheck, LeverCheck, direction_of
from bellcrank.machines.library.kinds import OWN, kinds
from bellcrank.machines.library.lever import plain_lever
from bellcrank.mechanics import VERIFICATION_INCREMENT, SpringEvaluator, Status
from bellcrank.provenance import provenance
from bellcrank.workflows import spec_for, validate

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bellcrank.model import Design, Problem
    from bellcrank.part import PartSpec

LEAST_STIFFNESS = 1e-6
"""Of an input: below it an actuator is a mechanism that follows its input and resists nothing."""


def measure(
    design: Design,
    direction: str | None = None,
    columns: int | None = None,
    kind: str = OWN,
    *,
    points: int = 20,
    notes: dict[str, Any] | None = None,
) -> Entry:
    """Find out what an entry says of a design.

    Parameters
    ----------
    direction, columns, kind
        Of its task; by default those of somebody's own design.
    points
        Along the curves of the two-port.
    notes
        More to be kept in the provenance.

    Raises
    ------
    InvalidSettings
        If the design snaps, is a mechanism or cannot be built.

    Examples
    --------
    >>> from bellcrank.model import human_design
    >>> entry = measure(human_design("crane"), points=2)
    >>> entry.direction, round(entry.efficiency, 3), round(entry.validation.efficiency, 2)
    ('left', 1.01, 1.21)
    """
    problem = design.problem
    response = SpringEvaluator(problem).evaluate(design.mask, VERIFICATION_INCREMENT)
    if response.status is not Status.CONVERGED:
        raise InvalidSettings(f"{problem.name}: no actuator to rely on: {response.status.message}")
    found = characterise(design, points=points)
    if not found.rest.connected or found.rest.input_stiffness < LEAST_STIFFNESS:
        what = "input" if found.rest.connected else "output"
        raise InvalidSettings(f"{problem.name}: no actuator, for nothing resists its {what}")
    origin = dict(design.provenance)
    return Entry(
        design=replace(design, efficiency=response.efficiency, provenance={}),
        direction=direction or direction_of(problem.output),
        columns=columns,
        kind=kind,
        characterisation=replace(found, provenance={}),
        validation=frame_check(design, spec_for(design)),
        lever=lever_check(problem, () if kind == OWN else kinds[kind].goals),
        provenance={**provenance(**(notes or {})), **({"design": origin} if origin else {})},
    )


def frame_check(design: Design, spec: PartSpec) -> FrameCheck:
    """Analyse the part that a design becomes as frames, for large and for small motions.

    Raises
    ------
    InvalidSettings, UnknownName
    """
    plan = [("frame", FemSettings()), ("frame", FemSettings(linear=True))]
    found = validate(design, spec, plan)
    large, small = found.analyses
    return FrameCheck(
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


def lever_check(problem: Problem, goals: Sequence[str] = ()) -> LeverCheck:
    """Return how well the plain lever does, with the goals of a kind and without."""
    bound, unbound = _lever(problem, goals), _lever(problem, ()) if goals else None
    if bound is None:
        return LeverCheck(math.nan, _efficiency(unbound))
    return LeverCheck(
        efficiency=_efficiency(bound),
        unbound_efficiency=_efficiency(unbound if goals else bound),
        shape=str(bound.provenance["origin"]),
        mask=bound.mask_hex,
    )


def _lever(problem: Problem, goals: Sequence[str]) -> Design | None:
    try:
        return plain_lever(problem, goals)
    except InvalidSettings:
        return None


def _efficiency(lever: Design | None) -> float:
    return math.nan if lever is None or lever.efficiency is None else lever.efficiency
