"""Report of a design job as tables of texts, and its files in the result folder."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any

from bellcrank.mechanics import objective_name
from bellcrank.model.storage import write_text
from bellcrank.workflows.figures import figure_text, model_words
from bellcrank.workflows.report import summary_data
from bellcrank.workflows.specification import item_rows
from bellcrank.workflows.tolerance import tolerance_rows, tolerance_sentence

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from bellcrank.storage import RunFolder
    from bellcrank.workflows.report import DesignReport


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
            verified = f"{number.format(found.response.efficiency)} ({report.difference:+.1%})"
        efficiencies.append(verified)
    rows = [["", *models], [f"efficiency ({objective_name(problem)})", *efficiencies]]
    for name, key, form in (
        ("off-axis motion at full stroke", "off_axis", "{:.1%}"),
        ("rotation at full stroke", "output_rotation_deg", "{:.1f} deg"),
    ):
        rows.append([name, *(figure_text(each[key], form) for each in report.figures)])
    if not report.part_figures:  # they have the force along the input
        forces = (_force(report, each["input_force"]) for each in report.figures)
        rows.append(["input force", *forces])
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
    ("deformation of the output", ("output_deformation_mm",), "{:.2g}", "mm"),
    ("input force, largest along the stroke", ("largest_input_force_N",), "{:.3g}", "N"),
    ("output stiffness", ("output_stiffness_N_per_mm",), "{:.3g}", "N/mm"),
    ("payload that halves the travel", ("payload_N",), "{:.3g}", "N"),
    ("dead load that halves the travel", ("dead_load_N",), "{:.3g}", "N"),
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
        is_known = any(value is not None for value in values)
        rows.append((label, f"{', '.join(known)} {unit}".rstrip() if is_known else "-"))
    return rows


def figure_table_by_model(figures: Mapping[str, Sequence[Mapping[str, Any]]]) -> list[list[str]]:
    """Return figures of a part as rows of texts, a column for each output in each model.

    Parameters
    ----------
    figures
        Rows of `bellcrank.workflows.part_figures` by model.
    """
    rows = list(figures.values())
    several = len(rows[0]) > 1
    names = [
        f"{row['case']}, {row['output']}, {model}" if several else model
        for model, found in figures.items()
        for row in found
    ]
    texts_of = [dict(figure_texts(row)) for found in rows for row in found]
    return [["as a part", *names]] + [
        [label, *(texts[label] for texts in texts_of)] for label, *_ in FIGURES
    ]


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
    texts = [
        f"at {', '.join(f'{point:.0%}' for point in each)} of the stroke" if each else "none"
        for each in points
    ]
    cycles = [_cycle_text(report, row.get("strain_amplitude")) for row in found]
    return [
        *rows, ["extremes of the input force", *texts], ["strain amplitude in cycles", *cycles]
    ]  # fmt: skip


def _cycle_text(report: DesignReport, amplitude: float | None) -> str:
    """Return the amplitude of the strain beside what the material endures."""
    if amplitude is None or report.part is None:
        return "-"
    limit = report.part.registered_material.fatigue_strain
    endured = "fatigue limit unknown" if math.isnan(limit) else f"{limit:.1%} endured"
    return f"{amplitude:.1%}, {endured}"


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

{_markdown(item_table(report))}{_markdown(nearest_table(report))}{_tolerance_text(report)}\
{figures_table}

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


def _tolerance_text(report: DesignReport) -> str:
    """Return the items over the tolerances as a Markdown table with its heading."""
    if report.tolerance is None:
        return ""
    return f"{tolerance_sentence(report.tolerance)}:\n\n" + _markdown(
        tolerance_rows(report.tolerance)
    )


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
