"""`bellcrank validate`: analysis of a design as a part by finite elements."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.box import SIMPLE
from rich.table import Table

from bellcrank.cli.app import FAILED, app
from bellcrank.cli.arguments import (
    DesignName,
    Fillet,
    Joint,
    MaterialName,
    PartFile,
    Scale,
    Thickness,
    Width,
    design_named,
    part_of,
)
from bellcrank.cli.console import (
    announce_compilation,
    notes,
    plain,
    print_json,
    results,
    text_grid,
)
from bellcrank.cli.live import Live
from bellcrank.errors import InvalidSettings, StorageError

if TYPE_CHECKING:
    from bellcrank.fem import Analysis, FemSettings
    from bellcrank.model import Design
    from bellcrank.registry import Registry
    from bellcrank.workflows import Validation


class StrokeProgress(Live):
    """Progress of a validation: current analysis and fraction of it that is done.

    Parameters
    ----------
    names
        Names of the analyses, and of the items of a specification if they are computed.
    """

    def __init__(self, names: Sequence[str]) -> None:
        super().__init__("validating", 100 * len(names))
        self._names = names

    def __call__(self, index: int, load: float) -> None:
        """Show the fraction of an analysis that is done."""
        name = self._names[index]
        line = f"{name}: {load:.0%}"
        self._show(int(100 * (index + load)), 100 * len(self._names), name, line)


@app.command()
def validate(
    design: DesignName,
    level: Annotated[
        str, typer.Option(help="Levels of analysis: frame, plane, solid, separated by commas.")
    ] = "frame",
    theory: Annotated[
        str, typer.Option(help="Beam theory of frames: euler-bernoulli, timoshenko or both.")
    ] = "euler-bernoulli",
    law: Annotated[
        str,
        typer.Option(
            help="Material law of plane and solid: neo-hookean, st-venant-kirchhoff, both."
        ),
    ] = "neo-hookean",
    linear: Annotated[bool, typer.Option("--linear", help="Assume small displacements.")] = False,
    elements: Annotated[int, typer.Option(help="Number of beam elements of each strut.")] = 8,
    size: Annotated[
        str | None,
        typer.Option(
            help="Largest edge of plane and solid elements, such as 0.7mm; default in the plane: "
            "half of the strut width."
        ),
    ] = None,
    part: PartFile = None,
    width: Width = None,
    thickness: Thickness = None,
    scale: Scale = None,
    fillet: Fillet = None,
    joint: Joint = None,
    stroke: Annotated[
        str | None,
        typer.Option(help="Input displacement (for example 4mm); default: that of the problem."),
    ] = None,
    material: MaterialName = None,
    young: Annotated[float | None, typer.Option(help="Young's modulus in MPa.")] = None,
    poisson: Annotated[float | None, typer.Option(help="Poisson's ratio.")] = None,
    picture: Annotated[
        Path | None, typer.Option(help="Draw the deformed part coloured by stress (png, svg, pdf).")
    ] = None,
    compare: Annotated[
        str | None, typer.Option(help="Second design for the picture (for example human:crane).")
    ] = None,
    vtu: Annotated[
        Path | None, typer.Option(help="Write the deformed part for ParaView (vtu).")
    ] = None,
    record: Annotated[
        Path | None,
        typer.Option(help="File of the record; default: validation.json beside the design."),
    ] = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace an existing picture or VTU file.")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Analyse a design as a part by finite elements."""
    chosen = design_named(design)
    from bellcrank.workflows import (
        check_plan,
        spec_for,
        validate,
        with_stroke,
        without_missing_levels,
    )
    from bellcrank.workflows.pictures import check_targets, draw_validations, write_vtu
    from bellcrank.workflows.validation import has_items

    check_targets(picture, vtu, overwrite=overwrite)
    target = record or record_of(design)
    _check_record(target, chosen, required=record is not None)
    lengths = {
        "width": width, "thickness": thickness, "scale": scale, "fillet": fillet, "joint": joint,
    }  # fmt: skip
    spec = part_of(spec_for(chosen), part, lengths, material, young, poisson)
    others = _compared(chosen, design, compare, picture)
    plan, missing = without_missing_levels(
        _plan(level, theory, law, linear=linear, elements=elements, size=size)
    )
    strokes = [
        one if stroke is None else with_stroke(one, stroke, spec.scale) for one in (chosen, *others)
    ]
    for one in strokes:
        check_plan(one, spec, plan)
    announce_compilation()
    savers: list[Callable[[Validation], None]] = [
        _saver(target, required=record is not None),
        lambda _validation: None,
    ]
    validations = []
    names = [f"{name} {_model(name, settings)}" for name, settings in plan]
    for one, save in zip(strokes, savers, strict=False):
        last = ["items of the specification"] if has_items(one, spec) else []
        with StrokeProgress([*names, *last]) as progress:
            validations.append(validate(one, spec, plan, progress, save))
    validation = validations[0]
    if as_json:
        print_json(json.dumps(validation.to_dict(), indent=1))
    else:
        _print(validation)
    if picture is not None:
        draw_validations(
            validations, [design, *([compare] if compare else [])], picture, overwrite=overwrite
        )
    if vtu is not None:
        write_vtu(validation.analyses[-1], vtu, overwrite=overwrite)
    for path in (picture, vtu):
        if path is not None:
            notes.print(f"wrote {plain(path)}")
    for line in missing:
        notes.print(f"[bold red]error:[/] {plain(line)}")
    if missing or any(
        analysis.status.value in ("mechanism", "unconverged") for analysis in validation.analyses
    ):
        raise typer.Exit(FAILED)


def _compared(
    chosen: Design, design: str, compare: str | None, picture: Path | None
) -> list[Design]:
    """Return the second design of the picture, if there is one; refuse what it cannot show."""
    from bellcrank.model import require_plane

    if picture is not None:
        require_plane(chosen.problem, "--picture")
    if compare is None:
        return []
    if picture is None:
        raise InvalidSettings("--compare is for the picture; give --picture FILE too")
    other = design_named(compare)
    if other.problem.input.drive != chosen.problem.input.drive:
        raise InvalidSettings(
            f"--compare: {compare} and {design} are not driven alike, by a displacement or a force"
        )
    return [other]


def _plan(
    level: str, theory: str, law: str, *, linear: bool, elements: int, size: str | None
) -> list[tuple[str, FemSettings]]:
    """Return each level with each of its theories or laws, in order."""
    from bellcrank.fem import FemSettings, levels
    from bellcrank.fem.continuum.laws import laws
    from bellcrank.mechanics.frames.beams import theories
    from bellcrank.part import read_length

    longest = None if size is None else read_length("size", size)
    common = FemSettings(linear=linear, elements=elements, size=longest)
    theories_, laws_ = _names("--theory", theory, theories), _names("--law", law, laws)
    plan = []
    for name in _names("--level", level, levels):
        if name == "frame":
            plan += [(name, replace(common, theory=one)) for one in theories_]
        else:
            plan += [(name, replace(common, law=one)) for one in laws_[: 1 if linear else None]]
    return plan


def _names(option: str, text: str, known: Registry[Any]) -> list[str]:
    """Return the names in a list separated by commas, each once."""
    names = list(dict.fromkeys(name.strip() for name in text.split(",")))
    if "" in names:
        raise InvalidSettings(f"{option} {text!r}: expected names separated by commas")
    for name in names:
        known[name]
    return names


def _model(level: str, settings: FemSettings) -> str:
    return settings.theory if level == "frame" else settings.law


def record_of(design: str) -> Path | None:
    """Return the path of the record of a design in a file or folder, None for a bundled design."""
    from bellcrank.model import builtin
    from bellcrank.workflows.find import hides_problem

    path = Path(design)
    bundled = design in builtin and not hides_problem(design)
    if bundled or design.startswith(("human:", "machine:")) or not path.exists():
        return None
    if path.is_dir():
        return path / "validation.json"
    name = "" if path.name == "design.json" else f"{path.name}."
    return path.with_name(f"{name}validation.json")


def _check_record(path: Path | None, design: Design, *, required: bool) -> None:
    """Check before any computation that the record can be written."""
    from bellcrank.model.storage import check_folder
    from bellcrank.workflows import problem_identity, read_record

    if path is not None:
        read_record(path, problem_identity(design), design.mask_hex)
        if required:
            check_folder(path)


def _saver(path: Path | None, *, required: bool) -> Callable[[Validation], None]:
    """Return a function that adds a validation to the record.

    A failure is an error only if `required`, which is whether the user has named the file.
    """
    from bellcrank.workflows import add_to_record

    def save(validation: Validation) -> None:
        if path is None:
            return
        try:
            add_to_record(validation, path)
        except StorageError as error:
            if required:
                raise
            notes.print(f"[yellow]record not written:[/] {plain(error)}")
            return
        complete = len(validation.analyses) == len(validation.plan)
        if complete and bool(validation.figures) == validation.has_items:
            notes.print(f"wrote {plain(path)}")

    return save


def _print(validation: Validation) -> None:
    """Print the figures of each level in a table, one column for each."""
    from bellcrank.mechanics import objective_name
    from bellcrank.workflows.figures import figure_text, model_words
    from bellcrank.workflows.report_tables import figure_table_by_model
    from bellcrank.workflows.specification import item_rows

    problem = validation.design.problem
    table = Table(box=SIMPLE)
    table.add_column("")
    table.add_column(model_words(problem), justify="right")
    columns = [_column(analysis) for analysis in validation.analyses]
    for analysis in validation.analyses:
        table.add_column(_heading(analysis), justify="right")
    response, searched = validation.response, validation.searched
    first = [
        f"{response.efficiency:.4f}",
        "",
        figure_text(searched["off_axis"], "{:.1%}"),
        figure_text(searched["output_rotation_deg"], "{:.2g} deg"),
        "",
        "",
        "",
        response.status.label,
    ]
    names = (
        f"efficiency ({objective_name(problem)})",
        "output, mm",
        "off-axis motion at full stroke",
        "rotation at full stroke",
        "force at full stroke, N",
        "stress, MPa",
        "strain",
        "status",
    )
    for row, name in enumerate(names):
        table.add_row(name, first[row], *(column[row] for column in columns))
    results.print(table)
    if validation.items:
        rows = item_rows(problem, validation.spec, validation.items)
        results.print(text_grid(rows))
        results.print(text_grid(figure_table_by_model(validation.figures)))
    for doubt in validation.doubts:
        notes.print(f"[yellow]design:[/] {plain(doubt)}")
    for analysis in validation.analyses:
        for warning in analysis.warnings:
            notes.print(f"[yellow]{analysis.level}:[/] {plain(warning)}")


def _heading(analysis: Analysis) -> str:
    """Return the heading of the column of an analysis."""
    kind = f"{analysis.level}, linear" if analysis.linear else analysis.level
    return f"{kind}\n{analysis.theory}"


def _column(analysis: Analysis) -> list[str]:
    """Return the figures of an analysis as text."""
    from bellcrank.fem.results import finite
    from bellcrank.workflows.figures import figure_text

    point = analysis.last
    known = math.isfinite(analysis.efficiency)
    status = analysis.status.value
    return [
        f"{analysis.efficiency:.4f}" if known else "-",
        ", ".join(f"{value:.3f}" for value in point.output),
        figure_text(finite(point.off_axis), "{:.1%}"),
        f"{point.rotation:.2g} deg",
        f"{point.push:.3f}",
        f"{point.stress:.3f}",
        f"{point.strain:.1%}",
        status if known else f"{status} at {point.load:.1%}",
    ]
