"""STL: triangles for any slicer. Binary; it has no unit, and slicers take it to be mm."""

from __future__ import annotations

import re
import struct
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.export.formats.base import Export, Exporter, exporters

if TYPE_CHECKING:
    from bellcrank.export.solid import Solid

_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def to_bytes(export: Export) -> bytes:
    """Return the part as a binary STL file."""
    return solid_to_bytes(export.solid(), export.name)


def solid_to_bytes(solid: Solid, name: str) -> bytes:
    """Return a closed surface as a binary STL file."""
    corners = solid.vertices[solid.triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    # Three corners in one line have no normal; they read 0 then, as STL permits.
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    facets = np.zeros(len(corners), dtype=_FACET)
    facets["normal"] = normal / np.where(length > 0.0, length, 1.0)
    facets["corners"] = corners
    # A header must not begin with "solid", which would make readers expect text.
    readable = re.sub(r"[^ -~]", "_", name)
    header = f"bellcrank {readable}, lengths in mm"[:80].ljust(80).encode("ascii")
    return header + struct.pack("<I", len(facets)) + facets.tobytes()


exporters.register("stl")(Exporter((".stl",), to_bytes))
