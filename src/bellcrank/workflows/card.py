"""A card that says all about a design as a part, on one page."""

from __future__ import annotations

import hashlib
import math
from typing import TYPE_CHECKING, Any

from bellcrank.export import Export, check_print
from bellcrank.fem import FemSettings
from bellcrank.model.parsing import read_json
from bellcrank.plots.card import Card, draw_card
from bellcrank.plots.saving import check_target
from bellcrank.plots.scene import Motion
from bellcrank.provenance import provenance
from bellcrank.workflows.fabricate import profile_for
from bellcrank.workflows.pictures import stressed_part, stroke_labels
from bellcrank.workflows.record import check_record
from bellcrank.workflows.validate import identity, validate

if TYPE_CHECKING:
    from pathlib import Path

    from bellcrank.export.profiles import PrintProfile
    from bellcrank.model import Design
    from bellcrank.part import Part, PartSpec
    from bellcrank.plots.card import Table
    from bellcrank.workflows.validate import Validation

VALIDATED = 6
"""Most rows of the table of validations."""


def design_hash(design: Design) -> str:
    """Return what names a design: problem, stroke included, and beams.

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
    spec
        Size and material.
    path
        A pdf, png or svg.
    record
        Of its validations, if there is one.
    title
        By default the name of the problem.

    Raises
    ------
    InvalidSettings, InvalidFile, OutputExists, StorageError
    """
    check_target(path, overwrite=overwrite)
    kept: list[dict[str, Any]] = []
    if record is not None and record.exists():
        check_record(record, identity(design), design.mask_hex)
        kept = read_json(record)["results"]
    validation = validate(design, spec, [("frame", FemSettings())])
    bundle = Export(part=spec.of(design))
    profile = profile_for(None, spec)
    part = bundle.part
    response = validation.response
    name = title or design.problem.name
    card = Card(
        title=name,
        note=f"efficiency {response.efficiency:.3f} by the discrete model · "
        f"{design.beam_count} beams · {design_hash(design)}",
        motion=Motion(design, response.displacement, response.efficiency),
        curve=stressed_part(validation.analyses[0]).curve,
        labels=stroke_labels(validation),
        tables=[
            _part_table(bundle, part),
            _print_table(bundle, profile),
            _fem_table(validation, kept),
            _origin_table(design),
        ],
        footer=_foot(design),
    )
    draw_card(card, path, overwrite=overwrite)


def _part_table(bundle: Export, part: Part) -> Table:
    outline = bundle.outline()
    left, bottom, right, top = outline.bounds
    volume = outline.area * bundle.thickness
    mass = volume * part.material.density / 1000.0
    rows = [
        ("size", f"{right - left:.1f} x {top - bottom:.1f} x {bundle.thickness:.2f} mm"),
        ("struts", f"{part.section.width:g} mm wide, fillets {part.fillet_radius:.2f} mm"),
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
    found = check_print(bundle, profile.rules)
    rows = [
        ("nozzle", f"{profile.nozzle:g} mm"),
        ("layers", f"{round(bundle.thickness / profile.layer)} of {profile.layer:g} mm"),
        ("lines", f"{profile.bead_width:g} mm wide"),
        ("heat", f"{profile.temperature} C, bed {profile.bed_temperature} C"),
        ("speed", f"{profile.speed:g} mm/s"),
        ("remarks", ", ".join(finding.kind for finding in found) or "none"),
    ]
    return "Printing", rows


def _fem_table(validation: Validation, kept: list[dict[str, Any]]) -> Table:
    """Return efficiencies by level: those on record, or the frame computed for this card."""
    entries = kept or validation.to_dict()["results"]
    rows = []
    for entry in entries[:VALIDATED]:
        value = entry["efficiency"]
        figure = f"{value:.3f}" if value is not None else entry["status"]
        stress, strain = entry["von_mises_MPa"], entry["principal_strain"]
        more = f", {stress:.2g} MPa, {strain:.0%}" if stress is not None else ""
        kind = f"{entry['level']}, linear" if entry["linear"] else entry["level"]
        rows.append((kind, f"{figure}{more}"))
    return "Finite elements", rows


def _origin_table(design: Design) -> Table:
    origin = design.provenance
    settings = origin.get("settings") or {}
    rows = [
        ("kind", str(origin.get("kind", "unknown"))),
        ("problem", design.problem.name),
        ("search", str(settings.get("search", settings.get("name", "-")))),
        ("seed", str(settings.get("seed", "-"))),
        ("version", f"{origin.get('version', '-')} {str(origin.get('commit') or '')[:9]}"),
        ("made", str(origin.get("time", "-"))),
    ]
    return "Origin", [(name, value) for name, value in rows if value.strip(" -")]


def _foot(design: Design) -> str:
    now = provenance()
    commit = str(now["commit"] or "")[:9]
    return f"bellcrank {now['version']} {commit} · {now['time']} · {design.mask_hex[:96]}"
