"""Report of a design job: its figures, and the summary as plain data."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from bellcrank.fem.results import finite
from bellcrank.mechanics import model_name
from bellcrank.workflows.figures import model_words
from bellcrank.workflows.refinement import refinement_data
from bellcrank.workflows.refiners import second_model
from bellcrank.workflows.specification import binding, item_data

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from bellcrank.mechanics import ItemResult, Response
    from bellcrank.model import Design
    from bellcrank.part import PartSpec
    from bellcrank.refine import Refinement
    from bellcrank.search import SearchSettings, Selection
    from bellcrank.workflows.tolerance import ToleranceReport
    from bellcrank.workflows.validation import Validation


RESULTS = re.compile(
    r"(design|validation)\.json|summary\.(md|json)|(comparison|efficiency|motion)\.png"
)
"""Names of the result files of a design job."""


AGREEMENT = 1e-6
"""Largest difference between the efficiencies of two loading paths that verify each other, relative
to the efficiency, or to 1 where that is less."""


@dataclass(frozen=True, slots=True, eq=False)
class DesignReport:
    """Result of a design job.

    Parameters
    ----------
    folder
        Result folder.
    settings
        Settings of the search.
    selection
        Chosen design and its origin.
    checks
        Efficiency of the design from rest, by the load increments that it was computed in.
    initial_efficiency
        Efficiency of the initial design by the same objective; nan if it has none.
    human
        Human design of the same problem, if there is one.
    human_response
        Response of the human design by the same objective.
    proposals, best_by_chain
        Number of designs evaluated; best efficiency that each chain accepted.
    figures
        Figures of the design at full load (`figures_of`) by the model of the search, and for a
        frame also with the elements of its verification.
    part
        Part for which the design was searched, if any.
    refinement
        How the design was refined after the search, if it was.
    validation
        Frame analysis of that part, if it is in the plane and all its pieces are supported.
    tolerance
        The part over the tolerances of its task, if it has any.
    part_figures
        Figures of the part for each output of each load case (`bellcrank.workflows.part_figures`).
    """

    folder: Path
    settings: SearchSettings
    selection: Selection
    checks: dict[str, float]
    initial_efficiency: float
    human: Design | None
    human_response: Response | None
    proposals: int
    best_by_chain: list[float]
    figures: list[dict[str, Any]]
    part: PartSpec | None = None
    refinement: Refinement | None = None
    validation: Validation | None = None
    part_figures: list[dict[str, Any]] = field(default_factory=list)
    tolerance: ToleranceReport | None = None

    @property
    def items(self) -> dict[str, Sequence[ItemResult]]:
        """Items of the specification by model; empty without one."""
        found, problem = self.selection.verification, self.selection.design.problem
        if not self.selection.items:
            return {}
        known: dict[str, Sequence[ItemResult]] = {model_words(problem): self.selection.items}
        if found is not None and found.items:
            known[model_words(problem, found.elements)] = found.items
        return known

    @property
    def all_items(self) -> dict[str, Sequence[ItemResult]]:
        """The same, with those in the sheet (in space with imperfections) where they are known."""
        second = () if self.refinement is None else self.refinement.after.sheet
        name = second_model(self.selection.design.problem)
        return {**self.items, **({name: second} if second else {})}

    @property
    def missed(self) -> list[ItemResult]:
        """Items that the design misses in the best model, the binding one first."""
        return binding(list(self.items.values())[-1]) if self.items else []

    @property
    def low_yield(self) -> str:
        """By how many random prints the wanted yield is missed, in words; empty if it is not."""
        if self.tolerance is None:
            return ""
        from bellcrank.workflows.tolerance import met_words

        found = self.tolerance.tolerance.print_yield
        wanted = self.tolerance.deviations.tolerances.least_yield
        if found >= wanted:
            return ""
        return (
            f"{found:.1%} of random prints {met_words(self.tolerance)}, fewer than the "
            f"{wanted:.1%} asked for"
        )

    @property
    def failures(self) -> list[str]:
        """Reasons why the design does not work; empty if it does."""
        found = []
        if not self.items and self.selection.efficiency_after <= 0.0:
            found.append("the output does not move in the wanted direction")
        warnings = [] if self.validation is None else self.validation.analyses[0].warnings
        verification = self.selection.verification
        if verification is not None and verification.fault is not None and not warnings:
            found.append(verification.fault)
        return found + warnings

    @property
    def efficiency(self) -> float:
        """Efficiency to store with the design: the verified one of a frame if there is one."""
        found = self.selection.verification
        if found is None or not math.isfinite(found.response.efficiency):
            return self.selection.efficiency_after
        return found.response.efficiency

    @property
    def agreement(self) -> float:
        """Largest difference between the checks; infinite if the design is not stable in one."""
        values = self.checks.values()
        return max(values) - min(values) if all(map(math.isfinite, values)) else math.inf

    @property
    def difference(self) -> float:
        """Relative difference of the efficiency of a verified frame from that of the search."""
        found, searched = self.selection.verification, self.selection.efficiency_after
        assert found is not None
        return (found.response.efficiency - searched) / abs(searched) if searched else math.nan

    @property
    def verified(self) -> bool:
        """Whether the checks agree."""
        return self.agreement <= AGREEMENT * max(1.0, *map(abs, self.checks.values()))


def summary_data(report: DesignReport) -> dict[str, Any]:
    """Return the figures of a report as plain data (``summary.json``)."""
    selection = report.selection
    human = report.human_response
    return {
        "schema": "bellcrank/summary/1",
        "problem": selection.design.problem.name,
        "model": model_name(selection.design.problem),
        "efficiency": report.efficiency,
        "search_efficiency": selection.efficiency_after,
        "efficiency_before_cleaning": finite(selection.efficiency_before),
        "status": selection.response.status.label,
        "beams": selection.design.beam_count,
        "mask": selection.design.mask_hex,
        "checks": {name: finite(value) for name, value in report.checks.items()},
        "verified": report.verified,
        "initial_efficiency": finite(report.initial_efficiency),
        "human_efficiency": finite(human.efficiency) if human else None,
        "verification": _verification(report),
        "figures": report.figures,
        **_specification(report),
        "refinement": None if report.refinement is None else refinement_data(report.refinement),
        "part_figures": report.part_figures,
        "tolerance": None if report.tolerance is None else report.tolerance.to_dict(),
        "as_part": _as_part(report),
        "found": {
            "chain": selection.found.chain,
            "step": selection.found.step,
        },
        "refused_candidates": selection.refused,
        "proposals": report.proposals,
        "best_by_chain": [finite(best) for best in report.best_by_chain],
        "settings": report.settings.to_dict(),
    }


def _specification(report: DesignReport) -> dict[str, Any]:
    """Return the items of the specification, and the nearest designs if it is not met."""
    if not report.items or report.part is None:
        return {}
    problem, part = report.selection.design.problem, report.part
    data: dict[str, Any] = {
        "met": not report.missed and not report.low_yield,
        "binding": report.missed[0].item.name if report.missed else None,
        "items": item_data(problem, part, report.all_items),
    }
    if report.selection.nearest:
        data["nearest"] = [
            {
                "mask": each.design.mask_hex,
                "items": item_data(problem, part, {"": each.verification.items}),
            }
            for each in report.selection.nearest
            if each.verification is not None
        ]
    return {"specification": data}


def _as_part(report: DesignReport) -> dict[str, Any] | None:
    """Return the figures of the frame analysis as plain data."""
    if report.validation is None:
        return None
    data = report.validation.to_dict()["results"][0]
    figures = ("level", "theory", "status", "efficiency", "von_mises_MPa", "principal_strain")
    return {key: data[key] for key in (*figures, "contacts", "warnings", "part")}


def _verification(report: DesignReport) -> dict[str, Any] | None:
    """Return the verification of a frame as plain data."""
    found = report.selection.verification
    if found is None:
        return None
    return {
        "elements": found.elements,
        "efficiency": finite(found.response.efficiency),
        "difference": finite(report.difference),
        "status": found.response.status.label,
        "principal_strain": finite(found.strain),
        "fault": found.fault,
    }
