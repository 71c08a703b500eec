"""Validation of designs by finite elements, and the record of its results beside a design."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any

from bellcrank.errors import InvalidSettings
from bellcrank.fem import FemSettings, levels
from bellcrank.fem.results import finite
from bellcrank.mechanics import (
    VERIFICATION_INCREMENT,
    Response,
    item_results,
    model_evaluator,
    model_name,
    objective_name,
)
from bellcrank.part import PartSpec, read_length
from bellcrank.part.pieces import check_supported, connection_warnings
from bellcrank.provenance import provenance
from bellcrank.search.verification import ELEMENTS
from bellcrank.workflows.figures import figures_of, model_words
from bellcrank.workflows.part_figures import SHEET_QUANTITIES, part_figures, sheet_figures
from bellcrank.workflows.specification import item_data, results_for

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from bellcrank.fem import Analysis
    from bellcrank.machines.bundled.contact import ContactCheck
    from bellcrank.mechanics import ItemResult
    from bellcrank.model import Design

    Plan = Sequence[tuple[str, FemSettings]]

SCHEMA = "bellcrank/validation/1"
TOP = (
    "level", "theory", "linear", "status", "reached", "efficiency",
    "mean_output_displacement_mm", "off_axis", "output_rotation_deg", "input_force_N",
    "input_push_N", "energy_N_mm", "von_mises_MPa", "principal_strain",
)  # fmt: skip
"""Figures of the first analysis that are repeated at the top of the JSON result."""

BODY_LEVELS = {2: ("plane", "sheet"), 3: ("solid", "solid")}
"""Level of the printed body, in which items are computed, and its name, by dimension."""


@dataclass(frozen=True, slots=True, eq=False)
class Validation:
    """A design and the analyses of its part.

    Parameters
    ----------
    design
        Design with the stroke of the analyses.
    spec
        Size and material of the part.
    response
        Response in the model of searches: springs, or a frame with one element in each beam.
    searched
        Figures of this response (`bellcrank.workflows.figures.figures_of`).
    plan
        Levels and settings.
    analyses
        Results, in the order of the plan, as far as they are computed.
    items
        Items of the specification of the problem by model, if it has one: the model of the search,
        eight elements in each beam and, with the level ``plane``, the sheet; in space the solid
        with the level ``solid``. A model in which the part is not stable is left out.
    figures
        Figures of each output by model, beside these items; those of the frames are by eight
        elements (`bellcrank.workflows.part_figures`).
    """

    design: Design
    spec: PartSpec
    response: Response
    searched: dict[str, Any]
    plan: Plan
    analyses: list[Analysis]
    items: dict[str, list[ItemResult]] = field(default_factory=dict)
    figures: dict[str, list[dict[str, Any]]] = field(default_factory=dict)

    @property
    def has_items(self) -> bool:
        """Whether items are computed after the analyses."""
        return has_items(self.design, self.spec)

    @property
    def doubts(self) -> list[str]:
        """Defects of the design itself that a builder should know of, as sentences."""
        return connection_warnings(self.design)

    def _specification(self) -> dict[str, Any]:
        """Return the items of the specification as plain data, if there are any."""
        if not self.items:
            return {}
        items = item_data(self.design.problem, self.spec, self.items)
        return {"specification": items, "part_figures": self.figures}

    def to_dict(self) -> dict[str, Any]:
        """Return plain data; the figures of the first analysis are repeated at the top."""
        given = self.design.problem.input
        stroke = given.amount * self.spec.scale if given.drive == "displacement" else None
        problem = self.design.problem
        discrete: dict[str, Any] = {
            "model": model_name(problem),
            "efficiency": finite(self.response.efficiency),
            "status": self.response.status.label,
        }
        if problem.section is None:
            discrete["stiffness"] = {
                "bond": problem.stiffness.bond, "angle": problem.stiffness.angle
            }  # fmt: skip
        results = [
            {
                **analysis.to_dict(),
                "settings": {"elements": settings.elements}
                if level == "frame"
                else {"size": settings.size},
                "part": {**self.spec.to_dict(), "stroke": stroke},
                "discrete_model": discrete,
            }
            for analysis, (level, settings) in zip(self.analyses, self.plan, strict=False)
        ]
        return {
            "schema": SCHEMA,
            "problem": self.design.problem.name,
            "problem_hash": problem_identity(self.design),
            "mask": self.design.mask_hex,
            "objective": objective_name(self.design.problem),
            **{key: results[0][key] for key in TOP},
            "discrete_model": discrete,
            "doubts": self.doubts,
            **self._specification(),
            "results": results,
            "provenance": provenance(),
        }


def has_items(design: Design, spec: PartSpec) -> bool:
    """Return whether a design has a specification, which is for this part."""
    return design.problem.is_specified and spec == spec_for(design)


def with_specification(
    validation: Validation, report: Callable[[float], None] = lambda _share: None
) -> Validation:
    """Return a validation with the items of the specification and the figures of its outputs.

    Unchanged without a specification, and for another part than the one that it was written for.
    The sheet is computed if the plan has the level ``plane``, the solid of a part in space if it
    has the level ``solid``; `report` is called with the fraction of it that is done.
    """
    if not validation.has_items:
        return validation
    design, spec, problem = validation.design, validation.spec, validation.design.problem
    found = {
        model_words(problem, elements): results_for(problem, design.mask, elements)
        for elements in (None, ELEMENTS)
    }
    figures = {model_words(problem, ELEMENTS): part_figures(design, spec, ELEMENTS)}
    wanted, name = BODY_LEVELS[problem.lattice.dimension]
    sizes = [settings.size for level, settings in validation.plan if level == wanted]
    if sizes:
        from bellcrank.fem.specification import path_count, sheet_records

        assert problem.specification is not None
        names = list(problem.cases)
        counts = [path_count(problem, name) for name in names]

        def progress(name: str, share: float) -> None:
            k = names.index(name)
            report((sum(counts[:k]) + share * counts[k]) / sum(counts))

        records = sheet_records(spec.of(design), sizes[0], progress, quantities=SHEET_QUANTITIES)
        if records is not None:
            found[name] = item_results(problem.specification.items, records)
            figures[name] = sheet_figures(problem, spec, records)
    items = {model: each for model, each in found.items() if each is not None}
    return replace(validation, items=items, figures=figures)


def problem_identity(design: Design) -> str:
    """Return a hash of the problem of a design that does not depend on the stroke."""
    problem = design.problem
    return replace(problem, input=replace(problem.input, amount=1.0)).hash


def spec_for(design: Design) -> PartSpec:
    """Return the part for which a design was searched.

    By default the struts have the section of its problem on 10 mm, or without one that of the
    default part.
    """
    recorded = design.provenance.get("part")
    if recorded is None and design.problem.section is not None:
        return PartSpec.of_section(design.problem.section)
    return PartSpec.from_dict(recorded or {}, "provenance.part")


def with_stroke(design: Design, stroke: str | float, scale: float) -> Design:
    """Return a design with another stroke.

    Parameters
    ----------
    design
        Design whose input is driven by a displacement.
    stroke
        Displacement of the input; a number is in mm.
    scale
        Length of a lattice unit, mm.

    Raises
    ------
    InvalidSettings
        If the stroke is not a length above 0, or a force drives the input.
    """
    length = read_length("stroke", stroke)
    given = design.problem.input
    if given.drive != "displacement":
        raise InvalidSettings(
            f"stroke: {design.problem.name!r} is driven by a force, not by a displacement"
        )
    if length <= 0.0:
        raise InvalidSettings(f"stroke: expected a length above 0 mm, got {length:g}")
    changed = replace(given, amount=length / scale)
    return replace(design, problem=replace(design.problem, input=changed))


def check_plan(design: Design, spec: PartSpec, plan: Plan) -> None:
    """Raise an error for an analysis that is not possible, before anything is computed.

    Raises
    ------
    InvalidSettings, InvalidProblem
        If the part cannot be built, or analysed at a level; `plane` is for parts in the plane.
    UnknownName
        If there is no such level, theory or law.
    """
    part = spec.of(design)
    check_supported(design)
    for level, settings in plan:
        levels[level].check(part, settings)


def without_missing_levels(plan: Plan) -> tuple[Plan, list[str]]:
    """Return the part of a plan whose libraries are installed, and what is missing.

    Parameters
    ----------
    plan
        Levels and settings.

    Returns
    -------
    plan
        Analyses that can be computed.
    missing
        Names of the other levels with what to install, as sentences.

    Raises
    ------
    InvalidSettings
        If no analysis can be computed.
    """
    reasons = {level: levels[level].missing() for level, _ in plan}
    possible = [(level, settings) for level, settings in plan if reasons[level] is None]
    missing = [f"{level}: not computed; {why}" for level, why in reasons.items() if why]
    if missing and not possible:
        raise InvalidSettings("; ".join(missing))
    return possible, missing


def validate(
    design: Design,
    spec: PartSpec,
    plan: Plan,
    report: Callable[[int, float], None] = lambda _index, _load: None,
    save: Callable[[Validation], None] = lambda _validation: None,
) -> Validation:
    """Analyse a design as a part.

    Parameters
    ----------
    design
        Design to be analysed.
    spec
        Size and material of the part.
    plan
        Levels and settings, in order.
    report
        Called with the index in the plan and the fraction of the stroke reached; for the items of
        a specification, computed last, with the length of the plan and the fraction done.
    save
        Called after each analysis with all results so far, so that no result is lost if a later
        analysis is interrupted.

    Raises
    ------
    InvalidSettings, UnknownName
        If the part cannot be built or analysed.

    Examples
    --------
    >>> from bellcrank.model import human_design
    >>> crane = human_design("crane")
    >>> validation = validate(crane, PartSpec(), [("frame", FemSettings())])
    >>> round(validation.analyses[0].efficiency, 3)
    1.176
    """
    check_plan(design, spec, plan)
    part = spec.of(design)
    evaluator = model_evaluator(design.problem)
    response = evaluator.evaluate(design.mask, VERIFICATION_INCREMENT)
    searched = figures_of(evaluator, response)
    validation = Validation(design, spec, response, searched, plan, [])
    for index, (level, settings) in enumerate(plan):
        analysis = levels[level].analyse(
            part, settings, lambda load, index=index: report(index, load)
        )
        validation = replace(validation, analyses=[*validation.analyses, analysis])
        save(validation)
    if validation.has_items:
        validation = with_specification(validation, partial(report, len(plan)))
        save(validation)
    return validation


def check_contact(design: Design) -> ContactCheck:
    """Return the contact of the default part of a design, by nonlinear frame analysis.

    Raises
    ------
    InvalidSettings
        If the design cannot be built.
    """
    from bellcrank.machines.bundled.contact import ContactCheck

    found = validate(design, spec_for(design), [("frame", FemSettings())]).analyses[0].contacts
    return ContactCheck(len(found.pairs), found.first)
