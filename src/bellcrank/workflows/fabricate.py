"""Prepare designs for export and printing."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.export import Export, check_print, exporters
from bellcrank.export.profiles import check_printed_width, profiles
from bellcrank.export.slicer import find_slicer, slice_solid
from bellcrank.fem.contact import centre_lines, find_contacts
from bellcrank.mechanics import StrokeEvaluator, model_evaluator
from bellcrank.model import require_plane
from bellcrank.model.storage import already_exists, check_folder, write_bytes
from bellcrank.part.outline import strut_outline
from bellcrank.part.outline.grips import filled, with_pointer
from bellcrank.part.outline.outer_rows import with_outer_rows
from bellcrank.part.outline.screws import drilled, screw_positions
from bellcrank.part.pieces import check_supported, connection_warnings
from bellcrank.workflows.loading import loading_path

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from numpy.typing import NDArray

    from bellcrank.export.profiles import PrintProfile
    from bellcrank.export.slicer import Sliced
    from bellcrank.fem.contact import Contacts
    from bellcrank.model import Design
    from bellcrank.part import Part, PartSpec
    from bellcrank.part.outline import Outline


ROW = 1.8
"""Largest distance of neighbours in a row of nodes, spacings: along a side of a triangular lattice
it is 1 or the square root of 3."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Grips:
    """Additions to a part for clamping, pushing and measuring.

    Parameters
    ----------
    plate
        Whether to fill the holes between supports to a plate. A single row of supports at the
        boundary gets a plate outside of the part, wide enough for the screws; a single row of
        input or output nodes a pad likewise.
    screws
        Number of screw holes in the plate.
    screw_diameter, wall
        Diameter of the holes, and smallest thickness of material around them, mm.
    pad
        Whether to fill the holes between input nodes to a pad.
    pointer
        Length of an additional strut at the output, mm; 0 for none.
    output_pad
        Whether to fill the holes between the nodes of each output to a pad, for a marker or for
        mounting.
    strict
        Whether a part without holes between these nodes is refused.
    """

    plate: bool = False
    screws: int = 0
    screw_diameter: float = 3.4
    wall: float = 1.5
    pad: bool = False
    pointer: float = 0.0
    output_pad: bool = False
    strict: bool = True

    def __post_init__(self) -> None:
        if self.screws < 0:
            raise InvalidSettings(f"screws: expected a number of holes, got {self.screws}")
        if self.screws and not self.plate:
            raise InvalidSettings("screws: expected a plate as well (--plate)")
        if not 0.0 <= self.pointer < float("inf"):
            raise InvalidSettings(f"pointer: expected a length, got {self.pointer!r} mm")

    def applied(self, part: Part) -> Outline | None:
        """Return the outline of a part with these additions; None for a part in space.

        Raises
        ------
        InvalidProblem
            If there are some for a part in space.
        InvalidSettings
            If there is nothing to fill, no room for screws, or the output has no beam.
        """
        problem = part.design.problem
        if part.dimension == 3:
            if self.plate or self.pad or self.pointer or self.output_pad:
                require_plane(problem, "plate, pad and pointer")
            return None
        positions, beams = part.positions, part.struts
        width, fillet = part.widths, part.fillet_radius
        shown, drawn = positions, beams
        if self.pointer:
            node = self._outermost(part)
            direction = problem.output.direction[problem.output.nodes.tolist().index(node)]
            shown, drawn = with_pointer(positions, beams, node, direction, self.pointer)
            width = np.append(width, part.section.width)
        blocks = {
            name: nodes
            for name, wanted, nodes in (
                ("plate", self.plate, problem.supports.nodes),
                ("pad", self.pad, problem.input.nodes),
                *(
                    (f"pad of {name}", self.output_pad, output.nodes)
                    for name, output in problem.outputs.items()
                ),
            )
            if wanted
        }
        depth = max(self.screw_diameter + 2.0 * self.wall, part.section.width)
        for name, nodes in blocks.items():
            shown, drawn, blocks[name] = with_outer_rows(
                shown,
                drawn,
                nodes,
                depth + part.section.width,
                ROW * part.scale,
                margin=float(width.max()),
            )
            more = np.full(len(drawn) - len(width), part.section.width)
            width = np.append(width, more)
        outline = strut_outline(shown, drawn, width, fillet)
        for name, nodes in blocks.items():
            solid = filled(outline, shown, drawn, nodes, width)
            if self.strict and solid.hole_count == outline.hole_count:
                raise InvalidSettings(
                    f"{name}: there is nothing to fill: its nodes enclose no hole, and they are "
                    "no row at a side of the part; in the task, select nodes of two neighbouring "
                    "rows, or of the whole row at a side"
                )
            outline = solid
        if self.screws:
            points = screw_positions(
                outline, shown, blocks["plate"], self.screws, self.screw_diameter, self.wall
            )
            outline = drilled(outline, points, self.screw_diameter, self.wall)
        return outline

    @staticmethod
    def _outermost(part: Part) -> int:
        """Return the output node with beams that is farthest in its wanted direction."""
        output = part.design.problem.output
        present = np.isin(output.nodes, part.struts)
        if not present.any():
            raise InvalidSettings("pointer: no beam touches the output")
        reach = (part.positions[output.nodes] * output.direction).sum(axis=1)
        return int(output.nodes[np.argmax(np.where(present, reach, -np.inf))])


def bundle_of(
    design: Design,
    spec: PartSpec,
    grips: Grips,
    *,
    layer: float | None,
    moved: bool = False,
    whole: bool = True,
    printed_width: float = 1.0,
) -> Export:
    """Return the export of a design.

    Parameters
    ----------
    design
        The design.
    spec
        Size and material of the part.
    grips
        Plate, pad and pointer.
    layer
        Layer height, to which the thickness is rounded; None for no rounding.
    moved
        Whether to compute the motion.
    whole
        Whether to refuse designs with unsupported pieces, which cannot be printed or cut.
    printed_width
        Width of a printed strut over that of the drawn one. Struts are drawn wider by its inverse,
        so that the printed part has the widths of the design.

    Raises
    ------
    InvalidSettings, UnknownName
        If the part is not valid.
    """
    check_printed_width(printed_width)
    part = replace(spec, width=spec.width / printed_width, joint=None).of(design)
    if whole:
        check_supported(design)
    positions = None
    if moved:
        path = loading_path(design, np.array([0.0, 1.0]))
        positions = design.problem.lattice.positions + path.displacement[-1]
    return Export(
        part=part,
        shape=grips.applied(part),
        layer=layer,
        moved=positions,
    )


def size_and_volume(bundle: Export) -> tuple[tuple[float, float, float], float]:
    """Return width, depth and height of a part, mm, and its volume, mm^3."""
    if bundle.part.dimension == 3:
        solid = bundle.solid()
        wide, deep, high = np.ptp(solid.vertices, axis=0).tolist()
        return (wide, deep, high), float(solid.volume)
    outline = bundle.outline()
    left, bottom, right, top = outline.bounds
    return (right - left, top - bottom, bundle.thickness), outline.area * bundle.thickness


def stroke_of(part: Part) -> list[tuple[float, NDArray[np.float64]]]:
    """Return fractions of the full input and (N, d) positions of the nodes of a part, mm."""
    evaluator = StrokeEvaluator(model_evaluator(part.design.problem))
    return [
        (load, part.positions + part.scale * displacement)
        for load, displacement in evaluator.displacements(part.design.mask)
    ]


def swept_size(bundle: Export, stroke: list[tuple[float, NDArray[np.float64]]]) -> list[float]:
    """Return the lengths of the smallest box along the axes that holds a part on its stroke, mm.

    In the plane without the thickness. Plate and pads are those at rest.
    """
    part = bundle.part
    half = 0.5 * part.widths[:, None, None]
    states = [part.positions, *(positions for _, positions in stroke)]
    ends = np.stack([positions[part.struts] for positions in states])
    low, high = (ends - half).min(axis=(0, 1, 2)), (ends + half).max(axis=(0, 1, 2))
    if part.dimension == 2:
        bounds = np.reshape(bundle.outline().bounds, (2, 2))
    else:
        vertices = bundle.solid().vertices
        bounds = np.stack([vertices.min(axis=0), vertices.max(axis=0)])
    low, high = np.minimum(low, bounds[0]), np.maximum(high, bounds[1])
    return [float(length) for length in high - low]


def contacts_of(
    part: Part, stroke: Iterable[tuple[float, NDArray[np.float64]]] | None = None
) -> Contacts:
    """Return the struts of a part that touch or cross along its stroke."""
    struts = part.struts
    states = stroke_of(part) if stroke is None else stroke
    lines = ((load, centre_lines(positions[struts])) for load, positions in states)
    beams, rest = np.flatnonzero(part.design.mask), centre_lines(part.positions[struts])
    return find_contacts(beams, rest, lines, part.widths)


def print_warnings(
    bundle: Export, profile: PrintProfile, contacts: Contacts | None = None
) -> list[str]:
    """Return warnings about printing and motion of a part, as sentences.

    Parameters
    ----------
    bundle, profile
        The part, and settings of printer and filament.
    contacts
        Struts that touch, if they are known.
    """
    part = bundle.part
    sentences = [warning.sentence for warning in check_print(bundle, profile.rules)]
    sentences += connection_warnings(part.design)
    contacts = contacts_of(part) if contacts is None else contacts
    if len(contacts.pairs):
        sentences.append(contacts.message)
    return sentences


@dataclass(frozen=True, slots=True, eq=False)
class PrintJob:
    """A sliced part.

    Parameters
    ----------
    sliced
        Result of the slicer.
    volume
        Volume of the solid, mm^3.
    mass
        Mass, g; nan if the density is unknown.
    profile
        Settings of printer and filament.
    """

    sliced: Sliced
    volume: float
    mass: float
    profile: PrintProfile


def profile_for(name: str | None, spec: PartSpec, **changes: Any) -> PrintProfile:
    """Return a profile by name or, by default, that of the material, with changed values.

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
    """Slice a part and write its G-code; overhangs of a part in space are supported.

    Raises
    ------
    InvalidSettings
        If there is no slicer, or the part is not valid.
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
    solid = bundle.solid()
    content = exporters.for_path("part.3mf").to_bytes(bundle)
    wide, deep, _ = np.ptp(solid.vertices, axis=0).tolist()
    in_space = bundle.part.dimension == 3
    sliced = slice_solid(
        content, ".3mf", profile, (wide, deep), solid.volume, program, supports=in_space
    )
    write_bytes(path, sliced.gcode, overwrite=overwrite)
    mass = solid.volume * bundle.part.material.density / 1000.0
    return PrintJob(sliced, solid.volume, mass, profile)
