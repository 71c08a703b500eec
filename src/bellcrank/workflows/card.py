"""Design cards: a one-page summary of a design as a part."""

from __future__ import annotations

import hashlib
import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from bellcrank.export import Export, check_print
from bellcrank.fem import FemSettings
from bellcrank.mechanics import VERIFICATION_INCREMENT, model_evaluator, objective_name
from bellcrank.part import frame_problem
from bellcrank.plots.card import Card, draw_card
from bellcrank.plots.saving import check_target
from bellcrank.plots.scene import Motion
from bellcrank.provenance import provenance
from bellcrank.search.verification import ELEMENTS
from bellcrank.workflows.fabricate import profile_for, size_and_volume
from bellcrank.workflows.figures import figure_text, figures_of, model_words
from bellcrank.workflows.pictures import stressed_part, stroke_labels
from bellcrank.workflows.specification import item_rows
from bellcrank.workflows.validation import problem_identity, validate
from bellcrank.workflows.validation_record import read_record

if TYPE_CHECKING:
    from pathlib import Path

    from bellcrank.export.profiles import PrintProfile
    from bellcrank.model import Design
    from bellcrank.part import Part, PartSpec
    from bellcrank.plots.card import Table
    from bellcrank.workflows.validation import Validation

ANALYSES = 3
"""Largest number of analyses in the table."""


def design_hash(design: Design) -> str:
    """Return a hash of a design: its problem, stroke included, and its beams.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> len(design_hash(find_problem("crane").full_design()))
    16
    """
    text = f"{design.problem.hash} {design.mask_hex}"
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def make_card(
    design: Design,
    spec: PartSpec,
    path: Path,
    *,
    record: Path | None = None,
    title: str = "",
    overwrite: bool = False,
) -> None:
    """Draw the card of a design.

    Parameters
    ----------
    design
        Design to be drawn.
    spec
        Size and material of the part.
    path
        Output file; the suffix pdf, png or svg selects the format.
    record
        Record of the design's validations, if there is one.
    title
        Title of the card; the name of the problem by default.
    overwrite
        Whether an existing file is replaced.

    Raises
    ------
    InvalidSettings, InvalidFile
        If the suffix is unknown, the part cannot be built or the record is not valid.
    OutputExists, StorageError
        If the file exists or cannot be written.
    """
    check_target(path, overwrite=overwrite)
    recorded: list[dict[str, Any]] = []
    if record is not None:
        recorded = read_record(record, problem_identity(design), design.mask_hex)
    card = card_of(design, spec, recorded, title)
    draw_card(card, path, overwrite=overwrite)


def card_of(
    design: Design, spec: PartSpec, recorded: list[dict[str, Any]], title: str = ""
) -> Card:
    """Return the content of the card of a design, with its frame analysis."""
    validation = validate(design, spec, [("frame", FemSettings())])
    bundle = Export(part=spec.of(design))
    response = validation.response
    frame = replace(design, problem=frame_problem(design.problem, spec))
    evaluator = model_evaluator(frame.problem, elements=ELEMENTS)
    found = figures_of(evaluator, evaluator.evaluate(design.mask, VERIFICATION_INCREMENT))
    efficiency = f"{response.efficiency:.3f}, spring model"
    if design.problem.section is not None:
        efficiency = figure_text(found["efficiency"], "{:.3f}, ")
        efficiency += model_words(design.problem, ELEMENTS)
    return Card(
        title=title or design.problem.name,
        note=f"efficiency ({objective_name(design.problem)}) {efficiency} · "
        f"{design.beam_count} beams · {design_hash(design)}",
        motion=Motion(design, response.displacement, response.efficiency),
        curve=stressed_part(validation.analyses[0]).curve,
        labels=stroke_labels(validation),
        tables=[
            _part_table(bundle, bundle.part),
            _print_table(bundle, profile_for(None, spec)),
            _fem_table(validation, recorded, _motion_rows(spec.of(frame), found)),
            _specification_table(validation) if validation.items else _origin_table(design),
        ],
        footer=_footer(design),
    )


def _part_table(bundle: Export, part: Part) -> Table:
    (wide, deep, high), volume = size_and_volume(bundle)
    if part.dimension == 3:
        struts = f"diameter {_widths(part)} mm"
    else:
        struts = f"{_widths(part)} mm wide, fillets {part.fillet_radius:.2f} mm"
    mass = volume * part.material.density / 1000.0
    rows = [
        ("size", f"{wide:.1f} x {deep:.1f} x {high:.2f} mm"),
        ("struts", struts),
        ("spacing", f"{part.scale:g} mm"),
        ("material", f"{part.material.name}, E {part.material.young:g} MPa"),
        ("volume", f"{volume / 1000.0:.2f} cm3"),
    ]
    if math.isfinite(mass):
        rows.append(("mass", f"{mass:.1f} g"))
    if math.isfinite(part.stroke):
        rows.append(("stroke", f"{part.stroke:.2f} mm"))
    return "Part", rows


def _print_table(bundle: Export, profile: PrintProfile) -> Table:
    findings = check_print(bundle, profile.rules)
    rows = [
        ("nozzle", f"{profile.nozzle:g} mm"),
        ("layers", f"{round(bundle.thickness / profile.layer)} of {profile.layer:g} mm"),
        ("lines", f"{profile.bead_width:g} mm wide"),
        ("temperature", f"{profile.temperature} C, bed {profile.bed_temperature} C"),
        ("speed", f"{profile.speed:g} mm/s"),
        ("warnings", ", ".join(warning.kind for warning in findings) or "none"),
    ]
    return "Printing", rows


def _fem_table(
    validation: Validation, recorded: list[dict[str, Any]], motion: list[tuple[str, str]]
) -> Table:
    """Return efficiencies by level, from the record or else from the frame analysis, and motion."""
    entries = recorded or validation.to_dict()["results"]
    rows = []
    for entry in entries[:ANALYSES]:
        value = entry["efficiency"]
        figure = f"{value:.3f}" if value is not None else entry["status"]
        stress, strain = entry["von_mises_MPa"], entry["principal_strain"]
        more = f", {stress:.2g} MPa, {strain:.0%}" if stress is not None else ""
        level = f"{entry['level']}, linear" if entry["linear"] else entry["level"]
        rows.append((level, f"{figure}{more}"))
    contacts = validation.analyses[0].contacts
    if contacts.first is not None:
        rows.append(("contact", f"frame, from {contacts.first:.0%} of the stroke"))
    return "As a part, by finite elements", [*rows, *motion]


def _motion_rows(part: Part, found: dict[str, Any]) -> list[tuple[str, str]]:
    """Return the motion of the output and the input force of a part."""
    force, unit = found["input_force"], part.stiffness_unit * part.scale
    return [
        ("off-axis", figure_text(found["off_axis"], "{:.0%} of the motion")),
        ("rotation", figure_text(found["output_rotation_deg"], "{:.1f} deg")),
        ("force", figure_text(force and [unit * each for each in force], "{:.3g} N")),
    ]


def _specification_table(validation: Validation) -> Table:
    """Return the items of the specification: reached in the best model, wanted."""
    _, *rows = item_rows(validation.design.problem, validation.spec, validation.items)
    model = list(validation.items)[-1]
    shown = [
        (label, f"{reached[-1]} ({wanted.split(',')[0]})" + ("" if met == "yes" else ", missed"))
        for label, wanted, *reached, _margin, met in rows
    ]
    return f"Specification, {model}", shown


def _origin_table(design: Design) -> Table:
    origin = design.provenance
    settings = origin.get("settings") or {}
    rows = [
        ("kind", str(origin.get("kind", "unknown"))),
        ("problem", design.problem.name),
        ("search", str(settings.get("search", settings.get("name", "-")))),
        ("seed", str(settings.get("seed", "-"))),
        ("version", f"{origin.get('version', '-')} {str(origin.get('commit') or '')[:9]}"),
        ("date", str(origin.get("time", "-"))),
    ]
    return "Origin", [(name, value) for name, value in rows if value.strip(" -")]


def _footer(design: Design) -> str:
    now = provenance()
    commit = str(now["commit"] or "")[:9]
    return f"bellcrank {now['version']} {commit} · {now['time']} · {design.mask_hex[:96]}"


def _widths(part: Part) -> str:
    """Return the width of the struts, or the least and the largest one, as text."""
    low, high = float(part.widths.min()), float(part.widths.max())
    return f"{low:g}" if high - low < 1e-9 * high else f"{low:.2f} to {high:.2f}"
