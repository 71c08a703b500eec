"""DXF: exact lines and arcs in mm, for laser and waterjet cutters and CAD programs."""

from __future__ import annotations

from contextlib import contextmanager
from io import StringIO
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.export.formats.base import Export, Exporter, exporters

if TYPE_CHECKING:
    from collections.abc import Iterator

    from bellcrank.part.outline import Outline

OUTER, HOLES = "outline", "holes"
"""Names of layers. Holes are cut before the outline, while the part is connected to the sheet."""


def to_bytes(export: Export) -> bytes:
    """Return the outline as a DXF file (R2010)."""
    return outline_to_bytes(export.outline())


def outline_to_bytes(outline: Outline) -> bytes:
    """Return an outline as a DXF file: a closed polyline for each loop, arcs as bulges."""
    from ezdxf.filemanagement import new
    from ezdxf.units import MM

    with _no_dates():
        drawing = new("R2010", units=MM)
        drawing.layers.add(OUTER, color=7)
        drawing.layers.add(HOLES, color=1)
        space = drawing.modelspace()
        for layer, loops in ((OUTER, outline.outer), (HOLES, outline.holes)):
            for loop in loops:
                corners = np.column_stack([loop.points, loop.bulge]).tolist()
                space.add_lwpolyline(corners, format="xyb", close=True, dxfattribs={"layer": layer})
        low_x, low_y, high_x, high_y = outline.bounds
        space.reset_extents((low_x, low_y, 0.0), (high_x, high_y, 0.0))
        text = StringIO()
        drawing.write(text)
    return drawing.encode(text.getvalue())


@contextmanager
def _no_dates() -> Iterator[None]:
    """Write no dates and random ids, so that files of equal outlines are equal."""
    import ezdxf

    options = ezdxf.options  # type: ignore[attr-defined]
    before = options.write_fixed_meta_data_for_testing
    options.write_fixed_meta_data_for_testing = True
    try:
        yield
    finally:
        options.write_fixed_meta_data_for_testing = before


exporters.register("dxf")(Exporter((".dxf",), to_bytes, "ezdxf", "files"))
