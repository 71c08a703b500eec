"""Outlines of domains from DXF and SVG files."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import shapely
from shapely.geometry import LineString
from shapely.ops import polygonize, unary_union

from bellcrank.errors import InvalidFile
from bellcrank.model.storage import read_text

if TYPE_CHECKING:
    from pathlib import Path

    from shapely.geometry.base import BaseGeometry

SAGITTA = 0.02
"""Largest distance of a curve from the is_line pieces that replace it, mm."""
GAP = 0.01
"""Gap between the ends of curves that is closed, mm."""
DXF_UNITS = {0: 1.0, 1: 25.4, 4: 1.0, 5: 10.0, 6: 1000.0, 13: 1e-3}
"""Length of the units of a DXF file ($INSUNITS), mm; files without units are in mm."""
CURVES = "LINE ARC CIRCLE ELLIPSE SPLINE LWPOLYLINE POLYLINE"
"""Entities of a DXF file that are read."""


def read_outline(path: Path) -> BaseGeometry:
    """Return the region inside the closed curves of a DXF or SVG file, mm.

    A curve inside another one bounds a hole. In SVG files y points down; it is turned up, so that
    the lowest point is at the height of the bottom of the drawing.

    Raises
    ------
    InvalidFile
        If the file cannot be read, or contains no closed curve.
    InvalidSettings
        If a library is missing.
    """
    readers = {".dxf": _dxf_curves, ".svg": _svg_curves}
    suffix = path.suffix.lower()
    if suffix not in readers:
        raise InvalidFile(
            f"{path}: expected an outline ending in {' or '.join(readers)}, got "
            f"{suffix or 'no suffix'}"
        )
    read_text(path)  # raises InvalidFile
    curves = [LineString(points) for points in readers[suffix](path) if len(points) > 1]
    curves = [curve for curve in curves if curve.length > 0.0]
    lines = shapely.set_precision(unary_union(curves), GAP) if curves else LineString()
    faces = list(polygonize(unary_union(lines)))
    if not faces:
        raise InvalidFile(f"{path}: no closed curve found; expected the outline of a domain")
    # A face belongs to the region if an odd number of closed loops surround it.
    loops = [shapely.Polygon(face.exterior) for face in faces]
    region = loops[0]
    for loop in loops[1:]:
        region = region.symmetric_difference(loop)
    return region.buffer(0.0)


def _dxf_curves(path: Path) -> list[list[tuple[float, float]]]:
    try:
        import ezdxf
        from ezdxf.path import make_path
    except ImportError as error:
        from bellcrank.errors import InvalidSettings

        raise InvalidSettings(
            f"{path}: reading DXF files needs ezdxf; install bellcrank[files]"
        ) from error
    try:
        document = ezdxf.readfile(path)  # type: ignore[attr-defined]
    except (ezdxf.DXFError, OSError, ValueError) as error:  # type: ignore[attr-defined]
        raise InvalidFile(f"{path}: not a valid DXF file: {error}") from None
    unit = DXF_UNITS.get(document.header.get("$INSUNITS", 0))
    if unit is None:
        raise InvalidFile(f"{path}: unknown unit of length; expected mm, cm, m or inches")
    curves = []
    for entity in document.modelspace().query(CURVES):
        points: Any = make_path(entity).flattening(SAGITTA / unit)
        curves.append([(unit * point.x, unit * point.y) for point in points])
    return curves


def _svg_curves(path: Path) -> list[list[tuple[float, float]]]:
    try:
        import svgelements
    except ImportError as error:
        from bellcrank.errors import InvalidSettings

        raise InvalidSettings(
            f"{path}: reading SVG files needs svgelements; install bellcrank[files]"
        ) from error
    import math

    try:
        # With 25.4 pixels in an inch, a pixel is a millimetre.
        drawing = svgelements.SVG.parse(str(path), ppi=25.4, reify=True)
    except Exception as error:  # the parser raises errors of many kinds
        raise InvalidFile(f"{path}: not a valid SVG file: {error}") from None
    height = float(drawing.height) if drawing.height else 0.0
    curves = []
    for element in drawing.elements():
        if not isinstance(element, svgelements.Shape):
            continue
        for piece in svgelements.Path(element).as_subpaths():
            part = svgelements.Path(piece)
            points: list[tuple[float, float]] = []
            for segment in part:
                if isinstance(segment, svgelements.Move):
                    continue
                is_line = isinstance(segment, svgelements.Line | svgelements.Close)
                length = segment.length(error=1e-3) if not is_line else 0.0
                count = 1 if is_line else max(8, math.ceil(length / 0.5))
                points += [
                    (each.x, height - each.y)
                    for each in (segment.point(k / count) for k in range(count + 1))
                ]
            curves.append(points)
    return curves
