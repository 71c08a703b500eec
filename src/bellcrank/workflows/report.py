"""Report of a design job: its figures, summary and pictures in the result folder."""

from __future__ import annotations

import json
import math
import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from bellcrank.fem.results import finite
from bellcrank.mechanics import model_name, objective_name
from bellcrank.model.storage import write_text
from bellcrank.workflows.figures import figure_text, model_words
from bellcrank.workflows.refinement import refinement_data
from bellcrank.workflows.refiners import second_model
from bellcrank.workflows.specification import binding, item_data, item_rows

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from bellcrank.mechanics import ItemResult, Response
    from bellcrank.model import Design
    from bellcrank.part import PartSpec
    from bellcrank.refine import Refinement
    from bellcrank.search import SearchSettings, Selection
    from bellcrank.storage import RunFolder
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
        "met": not report.missed,
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
        "difference": finite(difference(report)),
        "status": found.response.status.label,
        "principal_strain": finite(found.strain),
        "fault": found.fault,
    }


def difference(report: DesignReport) -> float:
    """Return the relative difference of the efficiency of a verified frame from the search's."""
    found = report.selection.verification
    assert found is not None
    searched = report.selection.efficiency_after
    return (found.response.efficiency - searched) / abs(searched) if searched else math.nan


def figure_table(report: DesignReport, number: str = "{:.4f}") -> list[list[str]]:
    """Return the figures of the design as rows of texts, the first one with the models.

    A frame has the figures of the search and those of its verification.
    """
    problem, found = report.selection.design.problem, report.selection.verification
    efficiencies = [number.format(report.selection.efficiency_after)]
    models = [model_words(problem)]
    if found is not None:
        models.append(model_words(problem, found.elements))
        verified = found.response.status.label
        if found.is_stable:
            verified = f"{number.format(found.response.efficiency)} ({difference(report):+.1%})"
        efficiencies.append(verified)
    rows = [["", *models], [f"efficiency ({objective_name(problem)})", *efficiencies]]
    for name, key, form in (
        ("off-axis motion", "off_axis", "{:.1%}"),
        ("rotation of the output", "output_rotation_deg", "{:.1f} deg"),
    ):
        rows.append([name, *(figure_text(each[key], form) for each in report.figures)])
    rows.append(["input force", *(_force(report, each["input_force"]) for each in report.figures)])
    return [*rows, *_part_rows(report)]


def item_table(report: DesignReport) -> list[list[str]]:
    """Return the items of the specification as rows of texts; empty without one."""
    if not report.items or report.part is None:
        return []
    decisive = list(report.items)[-1]
    return item_rows(report.selection.design.problem, report.part, report.all_items, decisive)


def nearest_table(report: DesignReport) -> list[list[str]]:
    """Return the nearest designs as rows of texts: the items of each; empty if all is met."""
    nearest = [each for each in report.selection.nearest if each.verification is not None]
    if not nearest or report.part is None:
        return []
    columns = {
        f"nearest {number}": each.verification.items
        for number, each in enumerate(nearest, 1)
        if each.verification is not None
    }
    rows = item_rows(report.selection.design.problem, report.part, columns)
    return [row[:-2] for row in rows]


FIGURES = (
    ("efficiency at half and full stroke", ("efficiency_half", "efficiency"), "{:.3g}", ""),
    ("travel", ("travel_mm",), "{:.3g}", "mm"),
    ("off-axis motion", ("off_axis",), "{:.1%}", ""),
    ("rotation", ("rotation_deg",), "{:.2g}", "deg"),
    ("input force, largest along the stroke", ("largest_input_force_N",), "{:.3g}", "N"),
    ("output stiffness", ("output_stiffness_N_per_mm",), "{:.3g}", "N/mm"),
    ("payload that halves the travel", ("payload_N",), "{:.3g}", "N"),
    ("blocked force at full stroke", ("blocked_force_N",), "{:.3g}", "N"),
    ("sag under own weight, upright", ("sag_mm",), "{:.3g}", "mm"),
)
"""Figures of a part: name, keys, format and unit."""


def figure_texts(row: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return the figures of a part with their names as texts; a dash for unknown ones."""
    rows = []
    for label, keys, form, unit in FIGURES:
        values = [row.get(key) for key in keys]
        known = [form.format(value) if value is not None else "-" for value in values]
        rows.append((label, f"{', '.join(known)} {unit}".rstrip()))
    return rows


def part_figure_table(report: DesignReport) -> list[list[str]]:
    """Return the figures of the part as rows of texts, a column for each output."""
    found = report.part_figures
    if not found:
        return []
    several = len({row["case"] for row in found}) > 1
    names = [f"{row['case']}, {row['output']}" if several else row["output"] for row in found]
    rows = [["as a part, 8 elements", *names]]
    texts_of = [dict(figure_texts(row)) for row in found]
    rows += [[label, *(texts[label] for texts in texts_of)] for label, *_ in FIGURES]
    points = [row.get("limit_points") or [] for row in found]
    texts = [", ".join(f"{point:.0%}" for point in each) or "none" for each in points]
    return [*rows, ["limit points of the force", *texts]]


def _force(report: DesignReport, force: list[float] | None) -> str:
    """Return the size of the input force: of a part in N, else in lattice units."""
    design, part = report.selection.design, report.part
    if part is None:
        return figure_text(force, "{:.4g} lattice units")
    made = part.of(design)
    return figure_text(force and [x * made.stiffness_unit * made.scale for x in force], "{:.3g} N")


def _part_rows(report: DesignReport) -> list[list[str]]:
    """Return stress, strain and contact of the part with the elements of its verification."""
    if report.validation is None or not math.isfinite(report.validation.analyses[0].efficiency):
        return []
    analysis = report.validation.analyses[0]
    last, first = analysis.last, analysis.contacts.first
    contact = "none" if first is None else f"from {first:.0%} of the stroke"
    return [
        ["largest stress, strain", "", f"{last.stress:.2g} MPa, {last.strain:.0%}"],
        ["contact", "", contact],
    ]


def summary_text(report: DesignReport) -> str:
    """Return the summary as Markdown (``summary.md``)."""
    selection = report.selection
    initial = ("initial design", f"{report.initial_efficiency:.6f}")
    models, *figures = (" | ".join(row) for row in figure_table(report, "{:.6f}"))
    rule = "|---" * (1 + len(report.figures))
    figures_table = "\n".join([f"| {models} |", f"{rule}|", *(f"| {row} |" for row in figures)])
    rows = [
        ("before cleaning", f"{selection.efficiency_before:.6f}"),
        initial,
        *((f"from rest by {name}", f"{value:.9f}") for name, value in report.checks.items()),
        ("beams", str(selection.design.beam_count)),
        ("found by chain, at step", f"{selection.found.chain}, {selection.found.step}"),
        ("designs evaluated", str(report.proposals)),
    ]
    if report.settings.goals:
        rows.append(("goals satisfied", ", ".join(report.settings.goals).replace("|", "/")))
    if report.human_response is not None:
        human = ("human design", f"{report.human_response.efficiency:.6f}")
        rows.insert(rows.index(initial) + 1, human)
    table = "\n".join(f"| {name} | {value} |" for name, value in rows)
    refused = "".join(
        f"\nNot chosen, though more efficient in the model of the search: {count} ({reason})."
        for reason, count in selection.refused.items()
    )
    return f"""# {selection.design.problem.name}

{_markdown(item_table(report))}{_markdown(nearest_table(report))}{figures_table}

{_markdown(part_figure_table(report))}
| | |
|---|---|
{table}

Off-axis motion is the size of the mean output displacement normal to the wanted direction over
that along it. Cleaning removes beams without load: loose pieces, dead ends, and pieces that are
connected by a single node or to supports only. Dead ends soften joints in the spring model but not
in a real part, so the efficiency after cleaning is the one to expect.
{refused}
![the design at rest and displaced](motion.png)

![efficiency along the chains](efficiency.png)
"""


def _markdown(rows: list[list[str]]) -> str:
    """Return rows of texts as a Markdown table with an empty line after it; nothing for none."""
    if not rows:
        return ""
    head, *body = (" | ".join(row) for row in rows)
    rule = "|---" * len(rows[0])
    return "\n".join([f"| {head} |", f"{rule}|", *(f"| {row} |" for row in body)]) + "\n\n"


def write_report(report: DesignReport, folder: RunFolder) -> None:
    """Write ``summary.json`` and ``summary.md`` into the result folder."""
    path = folder.path
    write_text(path / "summary.json", json.dumps(summary_data(report), indent=1), overwrite=True)
    write_text(path / "summary.md", summary_text(report), overwrite=True)
