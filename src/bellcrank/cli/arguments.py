"""Arguments and options shared by several commands."""

from __future__ import annotations

import json
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from bellcrank.errors import InvalidSettings

if TYPE_CHECKING:
    from collections.abc import Iterable

    from bellcrank.model import Design
    from bellcrank.part import PartSpec

DesignName = Annotated[
    str,
    typer.Argument(
        help="Design file, result folder, human:NAME, machine:NAME, library entry, or problem."
    ),
]
ModelName = Annotated[
    str | None,
    typer.Option(
        "--model",
        help="Mechanical model: springs, or frames (of the default part where the problem has no "
        "section). \\[frames if the problem has a section]",
    ),
]
PartFile = Annotated[
    Path | None,
    typer.Option(
        "--part", help="TOML file with width, thickness, scale, material, fillet and joint."
    ),
]
UNLOADED_BEAMS = "Beams that carry no load: keep, prune_dead_ends, or prune_all."
Width = Annotated[str | None, typer.Option(help="Strut width (for example 2mm). \\[2mm]")]
Thickness = Annotated[str | None, typer.Option(help="Part thickness. \\[5mm]")]
Scale = Annotated[str | None, typer.Option(help="Length of a lattice unit. \\[10mm]")]
Fillet = Annotated[
    str | None, typer.Option(help="Fillet radius between struts. \\[a quarter of the width]")
]
Joint = Annotated[
    str | None,
    typer.Option(
        help="Length of the ends of struts that do not bend in frames. \\[0.3 of the width]"
    ),
]
MaterialName = Annotated[
    str | None, typer.Option(help="Material: ninjaflex, tpu-95a, pla or petg. \\[ninjaflex]")
]


def design_named(text: str) -> Design:
    """Return the design that an argument names.

    Prints a note if a result folder takes precedence over the bundled problem of that name.

    Raises
    ------
    UnknownName, InvalidFile, InvalidProblem, InvalidSettings
    """
    from bellcrank.cli.console import notes, plain
    from bellcrank.workflows.find import find_design, hides_problem

    if hides_problem(text):
        notes.print(
            f"[yellow]note:[/] {plain(text)} is the design in the result folder {plain(text)}/, "
            "not the bundled problem of that name"
        )
    return find_design(text)


def design_in_model(design: Design, model: str | None) -> Design:
    """Return a design with its problem in a mechanical model; unchanged without one.

    Raises
    ------
    UnknownName
        If there is no such model.
    """
    if model is None:
        return design
    from dataclasses import replace

    from bellcrank.part import models
    from bellcrank.workflows import spec_for

    return replace(design, problem=models[model](design.problem, spec_for(design)))


def part_of(
    base: PartSpec,
    path: Path | None,
    lengths: dict[str, str | None],
    material: str | None,
    young: float | None = None,
    poisson: float | None = None,
) -> PartSpec:
    """Return a part specification from a base, a file and options, with increasing precedence.

    Raises
    ------
    InvalidFile, InvalidSettings, UnknownName
    """
    from bellcrank.part import Material, materials, read_part

    spec = base if path is None else read_part(path, base)
    changes: dict[str, Any] = {key: value for key, value in lengths.items() if value is not None}
    if (young is None) != (poisson is None):
        raise InvalidSettings("give --young and --poisson together, or --material")
    if young is not None and poisson is not None:
        if material is not None:
            raise InvalidSettings("give either --material or --young and --poisson")
        changes["material"] = Material(name="custom", young=young, poisson=poisson)
    elif material is not None:
        changes["material"] = materials[material].name
    return spec.changed(changes)


def settings_of(option: str, texts: Iterable[str] | None) -> dict[str, Any]:
    """Parse the ``KEY=VALUE`` arguments of an option; values are JSON or text.

    Raises
    ------
    InvalidSettings
        If an argument does not have this form.

    Examples
    --------
    >>> settings_of("--set", ["depth=12", "moves=[1]", "schedule=linear"])
    {'depth': 12, 'moves': [1], 'schedule': 'linear'}
    """
    found: dict[str, Any] = {}
    for text in texts or ():
        key, equals, value = text.partition("=")
        if not (key and equals):
            raise InvalidSettings(f"{option} {text}: expected KEY=VALUE")
        found[key] = value
        with suppress(ValueError):
            found[key] = json.loads(value)
    return found
