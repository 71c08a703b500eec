"""Does the part move as its design says? Finite elements, and a record of what they said."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from bellcrank.errors import InvalidSettings
from bellcrank.fem import FemSettings, levels
from bellcrank.fem.results import finite
from bellcrank.mechanics import (
    VERIFICATION_INCREMENT,
    Response,
    SpringEvaluator,
    objective_name,
)
from bellcrank.part import PartSpec, read_length
from bellcrank.part.pieces import doubts_about, require_held
from bellcrank.provenance import provenance
from bellcrank.workflows.record import SCHEMA

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from bellcrank.fem import Analysis
    from bellcrank.model import Design

TOP = (
    "level", "theory", "linear", "status", "reached", "efficiency",
    "mean_output_displacement_mm", "input_force_N", "input_push_N", "energy_N_mm",
    "von_mises_MPa", "principal_strain",
)  # fmt: skip
"""Figures of the first analysis that stand by themselves."""


@dataclass(frozen=True, slots=True, eq=False)
class Validation:
    """A design, its part, and what each analysis says.

    Parameters
    ----------
    design
        With the stroke that was asked for.
    spec
        Of the part.
    response
        Of the discrete model, with the stiffness that the design's problem gives.
    plan
        Levels and settings.
    analyses
        In the order of the plan, as far as they are done.
    """

    design: Design
    spec: PartSpec
    response: Response
    plan: Sequence[tuple[str, FemSettings]]
    analyses: list[Analysis]

    @property
    def doubts(self) -> list[str]:
        """What a builder should know of the design itself, as sentences."""
        return doubts_about(self.design)

    def to_dict(self) -> dict[str, Any]:
        """Return all as plain data; the figures of the first analysis stand at the top."""
        given = self.design.problem.input
        stroke = given.amount * self.spec.scale if given.drive == "displacement" else None
        part = {**self.spec.to_dict(), "stroke": stroke}
        stiffness = self.design.problem.stiffness
        discrete = {
            "efficiency": finite(self.response.efficiency),
            "status": self.response.status.label,
            "stiffness": {"bond": stiffness.bond, "angle": stiffness.angle},
        }
        results = [
            {
                **analysis.to_dict(),
                "settings": {"elements": settings.elements}
                if level == "frame"
                else {"size": settings.size},
                "part": part,
                "discrete_model": discrete,
            }
            for analysis, (level, settings) in zip(self.analyses, self.plan, strict=False)
        ]
        return {
            "schema": SCHEMA,
            "problem": self.design.problem.name,
            "problem_hash": identity(self.design),
            "mask": self.design.mask_hex,
            "objective": objective_name(self.design.problem),
            **{key: results[0][key] for key in TOP},
            "discrete_model": discrete,
            "doubts": self.doubts,
            "results": results,
            "provenance": provenance(),
        }


def identity(design: Design) -> str:
    """Return what tells the problem of a design from others, whatever the stroke."""
    problem = design.problem
    return replace(problem, input=replace(problem.input, amount=1.0)).hash


def spec_for(design: Design) -> PartSpec:
    """Return the part that a design was searched for, or the default one."""
    return PartSpec.from_dict(design.provenance.get("part") or {}, "provenance.part")


def with_stroke(design: Design, stroke: str | float, scale: float) -> Design:
    """Return a design whose input moves so far.

    Raises
    ------
    InvalidSettings
        If that is no length above 0, or a force drives the input.
    """
    length = read_length("stroke", stroke)
    given = design.problem.input
    if given.drive != "displacement":
        raise InvalidSettings(
            f"stroke: {design.problem.name!r} is driven by a force, not by a motion"
        )
    if length <= 0.0:
        raise InvalidSettings(f"stroke: expected a length above 0 mm, got {length:g}")
    driven = replace(given, amount=length / scale)
    return replace(design, problem=replace(design.problem, input=driven))


def check_plan(design: Design, spec: PartSpec, plan: Sequence[tuple[str, FemSettings]]) -> None:
    """Refuse what cannot be analysed, before anything is computed.

    Raises
    ------
    InvalidSettings, UnknownName
    """
    part = spec.of(design)
    require_held(design)
    for level, settings in plan:
        levels[level].check(part, settings)


def validate(
    design: Design,
    spec: PartSpec,
    plan: Sequence[tuple[str, FemSettings]],
    tell: Callable[[int, float], None] = lambda _index, _load: None,
    keep: Callable[[Validation], None] = lambda _so_far: None,
) -> Validation:
    """Analyse a design as a part.

    Parameters
    ----------
    spec
        Size and material.
    plan
        Levels with settings, in the order wanted.
    tell
        Called with the index in the plan and the part of the stroke that is reached.
    keep
        Called after each analysis with all so far, so that a kill during the next costs no more.

    Raises
    ------
    InvalidSettings, UnknownName
        If the part cannot be built or analysed.

    Examples
    --------
    >>> from bellcrank.model import human_design
    >>> crane = human_design("crane")
    >>> found = validate(crane, PartSpec(), [("frame", FemSettings())])
    >>> round(found.analyses[0].efficiency, 3)
    1.21
    """
    check_plan(design, spec, plan)
    part = spec.of(design)
    response = SpringEvaluator(design.problem).evaluate(design.mask, VERIFICATION_INCREMENT)
    found = Validation(design, spec, response, plan, [])
    for index, (level, settings) in enumerate(plan):
        analysis = levels[level].analyse(
            part, settings, lambda load, index=index: tell(index, load)
        )
        found = replace(found, analyses=[*found.analyses, analysis])
        keep(found)
    return found
