"""Pictures of runs, designs and validated parts, and the export of stress fields."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.export.formats.vtu import mesh_to_bytes
from bellcrank.mechanics import VERIFICATION_INCREMENT, Status, model_evaluator
from bellcrank.model.storage import already_exists, check_folder, write_bytes
from bellcrank.plots import (
    ChainPath,
    Motion,
    PathOptions,
    StressedPart,
    StrokeCurve,
    StrokeLabels,
    draw_cases,
    draw_comparison,
    draw_motion,
    draw_paths,
    draw_stress,
)
from bellcrank.plots.saving import check_target
from bellcrank.search import (
    MetropolisSettings,
    SearchSettings,
    Verdict,
    read_settings,
    searches,
    specified,
)
from bellcrank.search.verification import ELEMENTS
from bellcrank.storage import RunFolder
from bellcrank.workflows.figures import model_words
from bellcrank.workflows.part_figures import part_figures

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from bellcrank.fem import Analysis
    from bellcrank.model import Design
    from bellcrank.part import PartSpec
    from bellcrank.workflows.report import DesignReport
    from bellcrank.workflows.validation import Validation


def chain_paths(folder: RunFolder, settings: SearchSettings) -> list[ChainPath]:
    """Read the accepted efficiencies of each chain of a run.

    For a search that accepts losses, the largest efficiency so far is returned; for a problem with
    a specification, that of the design with the best score so far.
    """
    paths = []
    for chain in range(settings.chains):
        columns = folder.read(chain, ["step", "efficiency", "cost", "accepted", "status"])
        met = columns["status"] == Status.CONVERGED
        if folder.problem.is_specified:
            met |= columns["status"] == Verdict.UNMET
        taken = columns["accepted"] & met
        efficiency = columns["efficiency"][taken]
        if searches[settings.name].plot_running_best:
            cost = columns["cost"][taken] if folder.problem.is_specified else -efficiency
            efficiency = efficiency[_running_best(cost)]
        paths.append(ChainPath(efficiency, columns["step"][taken]))
    return paths


def _running_best(cost: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return (n,) the index of the lowest cost so far at each place."""
    lowest = np.fmin.accumulate(cost)
    new = np.concatenate([[True], lowest[1:] < lowest[:-1]])[: len(cost)]
    return np.maximum.accumulate(np.where(new, np.arange(len(cost)), 0))


def path_options(folder: RunFolder, settings: SearchSettings) -> PathOptions:
    """Return options for drawing the chains of a run."""
    if searches[settings.name].plot_running_best:
        return PathOptions(
            title=folder.problem.name, axis="proposals", measure="best efficiency so far"
        )
    annealing = settings.annealing if isinstance(settings, MetropolisSettings) else 0
    return PathOptions(title=folder.problem.name, annealing_steps=annealing)


def draw_run(path: Path, target: Path, *, overwrite: bool = False) -> None:
    """Draw the efficiency along the chains of the run in a folder, finished or not.

    Raises
    ------
    InvalidFile, CorruptRun
        If the folder is not that of a run, or is damaged.
    """
    folder = RunFolder.open(path)
    settings = read_settings(folder.settings)
    paths = chain_paths(folder, settings)
    draw_paths(paths, target, path_options(folder, settings), overwrite=overwrite)


def motion_of(
    design: Design, objective: str | None = None, *, name: str = "", magnify: float = 1.0
) -> Motion:
    """Compute the response of a design and return it for drawing."""
    response = model_evaluator(design.problem, objective).evaluate(design.mask)
    note = "" if response.status is Status.CONVERGED else response.status.label
    return Motion(
        design, response.displacement, response.efficiency, name=name, note=note, magnify=magnify
    )


def draw_report(report: DesignReport, folder: RunFolder) -> None:
    """Draw ``efficiency.png``, ``motion.png`` and, with a human design, ``comparison.png``."""
    selection = report.selection
    paths = chain_paths(folder, report.settings)
    found = selection.found
    steps = paths[found.chain].step
    assert steps is not None
    human = report.human_response
    draw_paths(
        paths,
        folder.path / "efficiency.png",
        replace(
            path_options(folder, report.settings),
            human_efficiency=human.efficiency if human else None,
            final_efficiency=selection.efficiency_after,
            is_refined=report.refinement is not None and report.refinement.improved,
            best=(found.chain, int(np.searchsorted(steps, found.step))),
        ),
        overwrite=True,
    )
    machine = Motion(
        selection.design,
        selection.response.displacement,
        selection.efficiency_after,
        name="machine",
    )
    if selection.design.problem.is_specified and report.part is not None:
        motions = case_motions(selection.design, report.part, report.part_figures)
        draw_cases(motions, folder.path / "motion.png", overwrite=True)
    else:
        draw_motion(machine, folder.path / "motion.png", overwrite=True)
    if report.human is not None and human is not None:
        of_model = replace(report.human, problem=folder.problem)
        drawn = Motion(of_model, human.displacement, human.efficiency, name="human")
        draw_comparison(drawn, machine, folder.path / "comparison.png", overwrite=True)


def case_motions(
    design: Design, spec: PartSpec, figures: Sequence[Mapping[str, Any]]
) -> list[Motion]:
    """Return the motion of a design in each load case, with the paths of its outputs.

    By frames with eight elements in each strut.

    Parameters
    ----------
    design
        Design of a problem with a specification.
    spec
        Size and material of the part.
    figures
        Figures of the part (`bellcrank.workflows.part_figures`), with the paths.
    """
    wanted = design.problem.specification
    assert wanted is not None
    cases, motions = design.problem.cases, []
    for name, case in cases.items():
        found = {
            row["output"]: np.array(row.get("path_mm", [])) / spec.scale
            for row in figures
            if row["case"] == name
        }
        asked = {
            item.output: item.path
            for item in wanted.items
            if item.case == name and item.path is not None
        }
        evaluator = model_evaluator(case, elements=ELEMENTS)
        response = evaluator.evaluate(design.mask, VERIFICATION_INCREMENT)
        motions.append(
            Motion(
                replace(design, problem=case),
                response.displacement,
                response.efficiency,
                name=design.problem.name if len(cases) == 1 else f"{design.problem.name}: {name}",
                note=f"frames, {ELEMENTS} elements",
                paths=tuple(found.get(output, np.empty((0, 2))) for output in case.outputs),
                wanted_paths=tuple(asked.get(output, np.empty((0, 2))) for output in case.outputs),
            )
        )
    return motions


def draw_before_and_after(
    before: Design, after: Design, spec: PartSpec, path: Path, *, overwrite: bool = False
) -> None:
    """Draw the motions of a design before and after its refinement, side by side at one scale.

    Raises
    ------
    InvalidSettings, OutputExists, StorageError
        As `bellcrank.plots.draw_motion`.
    """
    limit = spec.registered_material.strain_limit
    motions: list[Motion] = []
    for title, design in (("before", before), ("after", after)):
        wanted = replace(design, problem=replace(specified(design.problem, limit), name=title))
        motions += case_motions(wanted, spec, part_figures(wanted, spec))
    draw_cases(motions, path, overwrite=overwrite)


def check_targets(picture: Path | None, vtu: Path | None, *, overwrite: bool) -> None:
    """Check before any computation that the outputs of a validation can be written.

    Raises
    ------
    InvalidSettings
        If a suffix is unknown.
    OutputExists
        If a file exists and `overwrite` is not set.
    StorageError
        If a folder does not exist or is not writable.
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
    """Draw validated designs in columns, with the result of their last and finest analysis.

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
            note=model_words(validation.design.problem)
            + ("" if status == "converged" else f", {status}"),
        )
        columns.append((motion, stressed_part(validation.analyses[-1])))
    draw_stress(columns, path, stroke_labels(validations[0]), overwrite=overwrite)


def stroke_labels(validation: Validation) -> StrokeLabels:
    """Return the axis labels of the curves of the last analysis of a design."""
    efficiency = f"efficiency ({validation.analyses[-1].level})"
    if validation.design.problem.input.drive == "displacement":
        return StrokeLabels(efficiency=efficiency)
    return StrokeLabels("input force, N", "output displacement, mm", efficiency)


def stressed_part(analysis: Analysis) -> StressedPart:
    """Return an analysis for drawing."""
    part, points = analysis.part, analysis.points
    load = np.array([0.0, *(point.load for point in points)])
    force = np.array([0.0, *(point.push for point in points)])
    output = np.array([0.0, *(np.linalg.norm(point.output) for point in points)])
    by_motion = part.design.problem.input.drive == "displacement"
    known = f"efficiency {analysis.last.efficiency:.3f}"
    if np.isnan(analysis.efficiency):
        known += f", {analysis.status.value} at {analysis.last.load:.0%} of the stroke"
    theory = analysis.theory + (", linear" if analysis.linear else "")
    field = analysis.field
    widths = np.empty(0)
    if field.cells.shape[1] == 2:
        widths = np.repeat(part.widths, len(field.cells) // len(part.widths))
    return StressedPart(
        rest=field.rest[:, :2] / part.scale,
        displacement=field.displacement[:, :2] / part.scale,
        cells=field.cells,
        stress=field.stress,
        widths=widths / part.scale,
        note=f"{known} · {analysis.level}, {theory}",
        curve=StrokeCurve(
            stroke=load * part.stroke if by_motion else force,
            efficiency=np.array([np.nan, *(point.efficiency for point in points)]),
            force=force if by_motion else output,
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
