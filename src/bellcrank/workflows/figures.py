"""Pictures and files of validated parts."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.export.formats.vtu import mesh_to_bytes
from bellcrank.model.storage import already_exists, check_folder, write_bytes
from bellcrank.plots import Motion, Stressed, StrokeAxes, StrokeCurve, draw_stress
from bellcrank.plots.saving import check_target

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from bellcrank.fem import Analysis
    from bellcrank.workflows.validate import Validation


def prepare_targets(picture: Path | None, vtu: Path | None, *, overwrite: bool) -> None:
    """Refuse files that could not be written anyway, before anything is computed.

    Raises
    ------
    InvalidSettings
        If a suffix names no format.
    OutputExists
        If there is something of a name already.
    StorageError
        If a folder is not there or cannot be written.
    """
    if picture is not None:
        check_target(picture, overwrite=overwrite)
        check_folder(picture)
    if vtu is not None:
        if vtu.suffix != ".vtu":
            raise InvalidSettings(f"{vtu}: expected a name ending in .vtu")
        if vtu.exists() and not overwrite:
            raise already_exists(vtu)
        check_folder(vtu)


def draw_validations(
    validations: Sequence[Validation], names: Sequence[str], path: Path, *, overwrite: bool = False
) -> None:
    """Draw validated designs, one column each, by their last and finest analysis.

    Raises
    ------
    InvalidSettings, OutputExists, StorageError
    """
    columns = []
    for validation, name in zip(validations, names, strict=True):
        status = validation.response.status.label
        motion = Motion(
            validation.design,
            validation.response.displacement,
            validation.response.efficiency,
            name=name,
            note="discrete model" + ("" if status == "converged" else f", {status}"),
        )
        columns.append((motion, stressed(validation.analyses[-1])))
    draw_stress(columns, path, stroke_axes(validations[0]), overwrite=overwrite)


def stroke_axes(validation: Validation) -> StrokeAxes:
    """Return what the curves of a design are about."""
    if validation.design.problem.input.drive == "displacement":
        return StrokeAxes()
    return StrokeAxes(stroke="input force, N", force="mean output motion, mm")


def stressed(analysis: Analysis) -> Stressed:
    """Return an analysis ready to be drawn."""
    part, points = analysis.part, analysis.points
    given = part.design.problem.input
    load = np.array([0.0, *(point.load for point in points)])
    force = np.array([0.0, *(point.push for point in points)])
    output = np.array([0.0, *(np.hypot(*point.output) for point in points)])
    moved = given.drive == "displacement"
    efficiency = np.array([np.nan, *(point.efficiency for point in points)])
    known = f"efficiency {analysis.last.efficiency:.3f}"
    if np.isnan(analysis.efficiency):
        known += f", {analysis.status.value} at {analysis.last.load:.0%} of the stroke"
    theory = analysis.theory + (", linear" if analysis.linear else "")
    field = analysis.field
    return Stressed(
        rest=field.rest[:, :2] / part.scale,
        displacement=field.displacement[:, :2] / part.scale,
        cells=field.cells,
        stress=field.stress,
        width=part.section.width / part.scale,
        note=f"{known} · {analysis.level}, {theory}",
        curve=StrokeCurve(
            stroke=load * part.stroke if moved else force,
            efficiency=efficiency,
            force=force if moved else output,
        ),
    )


def write_vtu(analysis: Analysis, path: Path, *, overwrite: bool = False) -> None:
    """Write the last state of an analysis for ParaView: vertices, displacement and stress.

    Raises
    ------
    OutputExists, StorageError
    """
    field = analysis.field
    stress = {"von_mises_MPa": field.stress}
    by_cell = len(field.stress) == len(field.cells)
    content = mesh_to_bytes(
        field.rest,
        field.cells,
        {"displacement_mm": field.displacement, **({} if by_cell else stress)},
        stress if by_cell else {},
    )
    write_bytes(path, content, overwrite=overwrite)
