"""From a design to files that are printed or cut, and to G-code."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.export import Export, check_print, exporter_for
from bellcrank.export.profiles import profiles
from bellcrank.export.slicer import find_slicer, slice_solid
from bellcrank.fem.contact import centre_lines, find_contacts
from bellcrank.mechanics import StrokeEvaluator
from bellcrank.model.storage import already_exists, check_folder, write_bytes
from bellcrank.part.outline import strut_outline
from bellcrank.part.outline.grips import filled, with_pointer
from bellcrank.part.outline.screws import drilled, screw_places
from bellcrank.part.pieces import doubts_about, require_held
from bellcrank.workflows.loading import loading_path

if TYPE_CHECKING:
    from pathlib import Path

    from bellcrank.export.profiles import PrintProfile
    from bellcrank.export.slicer import Sliced
    from bellcrank.model import Design
    from bellcrank.part import Part, PartSpec
    from bellcrank.part.outline import Outline

FRAMES = 25
"""Along a motion that is written to a file."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Grips:
    """What is added to a part so that it can be held, pushed and read.

    Parameters
    ----------
    plate
        Fill the holes between supports: a plate to clamp.
    screws
        Holes to drill into that plate.
    screw_diameter, wall
        Of the holes, and least thickness of material around, mm.
    pad
        Fill the holes between input nodes: a pad to push.
    pointer
        Length of a strut that points out from the output, mm; 0 for none.
    """

    plate: bool = False
    screws: int = 0
    screw_diameter: float = 3.4
    wall: float = 1.5
    pad: bool = False
    pointer: float = 0.0

    def __post_init__(self) -> None:
        if self.screws < 0:
            raise InvalidSettings(f"screws: expected a number of holes, got {self.screws}")
        if self.screws and not self.plate:
            raise InvalidSettings("screws need a plate to go through; ask for the plate too")
        if not 0.0 <= self.pointer < float("inf"):
            raise InvalidSettings(f"pointer: expected a length, got {self.pointer!r} mm")

    def applied(self, part: Part) -> Outline:
        """Return the outline of a part with these.

        Raises
        ------
        InvalidSettings
            If there is no room for them.
        """
        problem = part.design.problem
        positions, beams = part.positions, part.struts
        width, fillet = part.section.width, part.fillet_radius
        shown, drawn = positions, beams
        if self.pointer:
            node = self._outermost(part)
            direction = problem.output.direction[problem.output.nodes.tolist().index(node)]
            shown, drawn = with_pointer(positions, beams, node, direction, self.pointer)
        outline = strut_outline(shown, drawn, width, fillet)
        if self.plate:
            outline = filled(outline, shown, drawn, problem.supports.nodes)
        if self.pad:
            outline = filled(outline, shown, drawn, problem.input.nodes)
        if self.screws:
            places = screw_places(
                outline, shown, problem.supports.nodes, self.screws, self.screw_diameter, self.wall
            )
            outline = drilled(outline, places, self.screw_diameter, self.wall)
        return outline

    @staticmethod
    def _outermost(part: Part) -> int:
        """Return the output node that lies farthest along its wanted direction and has beams."""
        output = part.design.problem.output
        built = np.isin(output.nodes, part.struts)
        if not built.any():
            raise InvalidSettings("pointer: no beam touches the output")
        reach = (part.positions[output.nodes] * output.direction).sum(axis=1)
        return int(output.nodes[np.argmax(np.where(built, reach, -np.inf))])


def bundle_of(
    design: Design,
    spec: PartSpec,
    grips: Grips,
    *,
    layer: float | None,
    moved: bool = False,
    whole: bool = True,
) -> Export:
    """Return a design ready to be written.

    Parameters
    ----------
    spec
        Size and material.
    grips
        What is added.
    layer
        Height of layers, of which the part gets a whole number; None for its own thickness.
    moved
        Whether formats that can are to hold the motion.
    whole
        Whether to refuse designs of which a piece hangs on nothing: what is printed or cut.

    Raises
    ------
    InvalidSettings, UnknownName
        If there can be no such part.
    """
    part = spec.of(design)
    if whole:
        require_held(design)
    frames = None
    if moved:
        way = loading_path(design, np.linspace(0.0, 1.0, FRAMES))
        frames = design.problem.lattice.positions + way.displacement
    return Export(
        part=part,
        shape=grips.applied(part),
        layer=layer,
        moved=None if frames is None else frames[-1],
        frames=frames,
    )


def findings_about(bundle: Export, profile: PrintProfile) -> list[str]:
    """Return what is to be said about printing a part and moving it, as sentences."""
    part = bundle.part
    sentences = [finding.sentence for finding in check_print(bundle, profile.rules)]
    sentences += doubts_about(part.design)
    stroke = (
        (load, centre_lines((part.positions + part.scale * response.displacement)[part.struts]))
        for load, response in StrokeEvaluator(part.design.problem).evaluate(part.design.mask)
    )
    beams, rest = np.flatnonzero(part.design.mask), centre_lines(part.positions[part.struts])
    contacts = find_contacts(beams, rest, stroke, part.section.width)
    if len(contacts.pairs):
        sentences.append(contacts.message)
    return sentences


@dataclass(frozen=True, slots=True, eq=False)
class PrintJob:
    """A part in G-code, and what it takes.

    Parameters
    ----------
    sliced
        By the slicer.
    volume
        Of the solid, mm^3.
    mass
        g; nan where nobody says how dense the material is.
    profile
        Printer and filament.
    """

    sliced: Sliced
    volume: float
    mass: float
    profile: PrintProfile


def profile_for(name: str | None, spec: PartSpec, **changes: Any) -> PrintProfile:
    """Return the profile of that name, or that of the material; with some figures changed.

    Raises
    ------
    UnknownName, InvalidSettings
    """
    material = spec.material if isinstance(spec.material, str) else spec.material.name
    profile = profiles[name or material]
    return replace(profile, **{key: value for key, value in changes.items() if value is not None})


def print_design(
    bundle: Export,
    profile: PrintProfile,
    path: Path,
    *,
    slicer: str | None = None,
    overwrite: bool = False,
) -> PrintJob:
    """Slice a part and write its G-code.

    Raises
    ------
    InvalidSettings
        If there is no slicer, or can be no such part.
    OutputExists, StorageError
        If the file exists or cannot be written.
    RunFailed
        If the slicer fails.
    """
    program = find_slicer(slicer)
    if path.suffix.lower() not in (".gcode", ".g"):
        raise InvalidSettings(f"{path}: expected a name ending in .gcode")
    if path.exists() and not overwrite:
        raise already_exists(path)
    check_folder(path)
    left, bottom, right, top = bundle.outline().bounds
    solid = bundle.solid()
    content = exporter_for("part.3mf").to_bytes(bundle)
    size = (right - left, top - bottom)
    sliced = slice_solid(content, ".3mf", profile, size, solid.volume, program)
    write_bytes(path, sliced.gcode, overwrite=overwrite)
    mass = solid.volume * bundle.part.material.density / 1000.0
    return PrintJob(sliced, solid.volume, mass, profile)
