"""STEP: a solid with exact planes, cylinders and spheres in mm, for CAD programs."""

from __future__ import annotations

import json
import subprocess
import sys
from contextlib import contextmanager
from io import BytesIO
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidSettings, RunFailed
from bellcrank.export.formats.base import Export, Exporter, exporters

if TYPE_CHECKING:
    from collections.abc import Iterator

    from bellcrank.part import Part
    from bellcrank.part.outline import Loop, Outline

_TOLERANCE = 1e-7
"""Points closer than this distance, mm, coincide in a STEP file."""
_JOINT = 1.001
"""Radius of a joint over that of its widest strut: the kernel loses surfaces that touch without
crossing each other."""


def to_bytes(export: Export) -> bytes:
    """Return the part as a STEP file (AP214).

    Raises
    ------
    RunFailed
        If the modelling kernel fails.
    """
    if export.part.dimension == 3:
        return struts_to_bytes(export.part, export.name)
    return solid_to_bytes(export.outline(), export.thickness, export.name)


def solid_to_bytes(outline: Outline, thickness: float, name: str) -> bytes:
    """Return the prism over an outline as a STEP file, one solid for each piece.

    Raises
    ------
    RunFailed
        If the kernel fails.
    """
    loops = [
        [[loop.points.tolist(), loop.bulge.tolist()] for loop in kind]
        for kind in (outline.outer, outline.holes)
    ]
    return _served({"loops": loops, "thickness": thickness, "name": name})


def struts_to_bytes(part: Part, name: str) -> bytes:
    """Return the union of the round struts of a part in space, and of their joints.

    Joints are spheres, wider by a thousandth than the widest strut that meets there.

    Raises
    ------
    RunFailed
        If the kernel fails.
    """
    radii, balls = 0.5 * part.widths, 0.5 * part.widest
    nodes = np.flatnonzero(balls)
    low = (part.positions - balls[:, None])[nodes].min(axis=0)
    first, second = (part.positions[part.struts] - low).transpose(1, 0, 2).tolist()
    return _served(
        {
            "struts": list(zip(first, second, radii.tolist(), strict=True)),
            "joints": list(
                zip((part.positions - low)[nodes].tolist(), balls[nodes].tolist(), strict=True)
            ),
            "name": name,
        }
    )


def _served(task: dict[str, Any]) -> bytes:
    """Return the STEP file of a task.

    The kernel runs in a separate process: NGSolve contains another version of it, and a process
    that loads both crashes.
    """
    command = [sys.executable, "-c", f"from {__name__} import serve; serve()"]
    content = json.dumps(task).encode()
    done = subprocess.run(command, input=content, capture_output=True, check=False)
    if done.returncode or not done.stdout:
        output = done.stderr.decode(errors="replace").strip().splitlines()
        raise RunFailed(
            f"Open CASCADE wrote no STEP file: {output[-1] if output else 'no message'}"
        )
    return done.stdout


def serve() -> None:
    """Read a task from standard input and write its STEP file to standard output."""
    from bellcrank.part.outline import Loop, Outline

    task = json.load(sys.stdin)
    if "struts" in task:
        shape = _united(task["struts"], task["joints"])
    else:
        outer, holes = (tuple(Loop(*loop) for loop in kind) for kind in task["loops"])
        shape = _prisms(Outline(outer, holes), task["thickness"])
    sys.stdout.buffer.write(_written(shape, task["name"]))


def _united(
    struts: list[tuple[list[float], list[float], float]], joints: list[tuple[list[float], float]]
) -> Any:
    """Return the union of cylinders, given by ends and radius, and of spheres in the joints."""
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Fuse
    from OCP.BRepCheck import BRepCheck_Analyzer
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeCylinder, BRepPrimAPI_MakeSphere
    from OCP.collections import List_TopoDS_Shape
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt

    shapes = []
    for first, second, radius in struts:
        chord = np.subtract(second, first)
        axis = gp_Ax2(gp_Pnt(*first), gp_Dir(*chord.tolist()))
        length = float(np.linalg.norm(chord))
        shapes.append(BRepPrimAPI_MakeCylinder(axis, radius, length).Shape())
    shapes += [
        BRepPrimAPI_MakeSphere(gp_Pnt(*centre), _JOINT * radius).Shape()
        for centre, radius in joints
    ]
    arguments, tools = List_TopoDS_Shape(), List_TopoDS_Shape()
    arguments.Append(shapes[0])
    for shape in shapes[1:]:
        tools.Append(shape)
    fuse = BRepAlgoAPI_Fuse()
    fuse.SetArguments(arguments)
    fuse.SetTools(tools)
    fuse.Build()
    if not (fuse.IsDone() and BRepCheck_Analyzer(fuse.Shape()).IsValid()):
        raise InvalidSettings("the modelling kernel could not unite the struts of this part")
    return fuse.Shape()


def _prisms(outline: Outline, thickness: float) -> Any:
    """Return one solid, or a compound of several."""
    from OCP.BRep import BRep_Builder
    from OCP.BRepPrimAPI import BRepPrimAPI_MakePrism
    from OCP.gp import gp_Vec
    from OCP.TopoDS import TopoDS_Compound

    up = gp_Vec(0.0, 0.0, thickness)
    solids = [
        BRepPrimAPI_MakePrism(_face(outer, holes), up).Shape() for outer, holes in _pieces(outline)
    ]
    if len(solids) == 1:
        return solids[0]
    builder, compound = BRep_Builder(), TopoDS_Compound()
    builder.MakeCompound(compound)
    for solid in solids:
        builder.Add(compound, solid)
    return compound


def _pieces(outline: Outline) -> list[tuple[Loop, list[Loop]]]:
    """Return each outer loop with the holes of its piece."""
    from shapely import Point, Polygon

    if outline.piece_count == 1:
        return [(outline.outer[0], list(outline.holes))]
    # Pieces may be inside holes of others: a hole belongs to the smallest loop around it.
    fine = 1e-3 * min(loop.length for loop in outline.loops)
    order = sorted(outline.outer, key=lambda loop: loop.area)
    pieces = [(outer, Polygon(outer.flattened(fine))) for outer in order]
    found: list[tuple[Loop, list[Loop]]] = [(outer, []) for outer in order]
    for hole in outline.holes:
        corner = Point(hole.points[0])
        around = next(k for k, (_, polygon) in enumerate(pieces) if polygon.contains(corner))
        found[around][1].append(hole)
    return found


def _face(outer: Loop, holes: list[Loop]) -> Any:
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
    from OCP.gp import gp_Dir, gp_Pln, gp_Pnt

    plane = gp_Pln(gp_Pnt(0.0, 0.0, 0.0), gp_Dir(0.0, 0.0, 1.0))
    made = BRepBuilderAPI_MakeFace(plane, _wire(outer), True)
    for hole in holes:
        made.Add(_wire(hole))
    return made.Face()


def _wire(loop: Loop) -> Any:
    from OCP.BRep import BRep_Builder
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeVertex
    from OCP.gp import gp_Pnt
    from OCP.TopoDS import TopoDS_Wire

    corners = [
        BRepBuilderAPI_MakeVertex(gp_Pnt(x, y, 0.0)).Vertex() for x, y in loop.points.tolist()
    ]
    builder, wire = BRep_Builder(), TopoDS_Wire()
    builder.MakeWire(wire)
    flat = 0.5 * np.abs(loop.bulge) * np.linalg.norm(loop.chords, axis=1) < _TOLERANCE
    centres, radii = loop.centres.tolist(), loop.radii.tolist()
    for k, corner in enumerate(corners):
        following = corners[(k + 1) % len(corners)]
        if flat[k]:
            edge = _line(corner, following)
        else:
            sense = 1.0 if loop.bulge[k] > 0.0 else -1.0
            edge = _arc(corner, following, centres[k], radii[k], sense)
        builder.Add(wire, edge)
    wire.Closed(True)
    return wire


def _line(start: Any, end: Any) -> Any:
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge

    return BRepBuilderAPI_MakeEdge(start, end).Edge()


def _arc(start: Any, end: Any, centre: list[float], radius: float, sense: float) -> Any:
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge
    from OCP.gp import gp_Ax2, gp_Circ, gp_Dir, gp_Pnt

    axis = gp_Ax2(gp_Pnt(*centre, 0.0), gp_Dir(0.0, 0.0, sense))
    return BRepBuilderAPI_MakeEdge(gp_Circ(axis, radius), start, end).Edge()


def _written(shape: Any, name: str) -> bytes:
    from OCP.IFSelect import IFSelect_ReturnStatus
    from OCP.STEPControl import STEPControl_StepModelType, STEPControl_Writer

    content = BytesIO()
    with _quiet(), _without_curves_in_surfaces():
        writer = STEPControl_Writer()
        done = writer.Transfer(shape, STEPControl_StepModelType.STEPControl_AsIs)
        if done == IFSelect_ReturnStatus.IFSelect_RetDone:
            _entitle(writer.Model(), "".join(x if x.isprintable() else " " for x in name))
            done = writer.WriteStream(content)
    if done != IFSelect_ReturnStatus.IFSelect_RetDone:
        raise InvalidSettings("the modelling kernel could not make a STEP file of this part")
    return content.getvalue()


def _entitle(model: Any, name: str) -> None:
    """Set the title of the product and constant dates, so that files of equal parts are equal."""
    from OCP.APIHeaderSection import APIHeaderSection_MakeHeader
    from OCP.StepBasic import StepBasic_Product
    from OCP.TCollection import TCollection_HAsciiString

    title = TCollection_HAsciiString(name)
    header = APIHeaderSection_MakeHeader(model)
    header.SetName(title)
    header.SetTimeStamp(TCollection_HAsciiString("1980-01-01T00:00:00"))
    header.SetOriginatingSystem(TCollection_HAsciiString("bellcrank"))
    for number in range(1, model.NbEntities() + 1):
        entity = model.Value(number)
        if isinstance(entity, StepBasic_Product):
            entity.SetId(title)
            entity.SetName(title)
            return


@contextmanager
def _quiet() -> Iterator[None]:
    """Suppress the output of the kernel."""
    from OCP.Message import Message

    messenger = Message.DefaultMessenger_s()
    printers = list(messenger.Printers())
    for printer in printers:
        messenger.RemovePrinter(printer)
    try:
        yield
    finally:
        for printer in printers:
            messenger.AddPrinter(printer)


@contextmanager
def _without_curves_in_surfaces() -> Iterator[None]:
    """Write edges without curves on surfaces, which are determined on planes and cylinders."""
    from OCP.Interface import Interface_Static
    from OCP.STEPControl import STEPControl_Controller

    mode = "write.surfacecurve.mode"
    STEPControl_Controller.Init_s()
    before = Interface_Static.IVal_s(mode)
    Interface_Static.SetIVal_s(mode, 0)
    try:
        yield
    finally:
        Interface_Static.SetIVal_s(mode, before)


exporters.register("step")(Exporter((".step", ".stp"), to_bytes, "OCP", "step"))
