"""STL: triangles for slicers. The format is binary and has no unit; slicers assume mm."""

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
    # Collinear corners have no normal: it is 0, as STL permits.
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    facets = np.zeros(len(corners), dtype=_FACET)
    facets["normal"] = normal / np.where(length > 0.0, length, 1.0)
    facets["corners"] = corners
    # A header that begins with "solid" would indicate the text format.
    readable = re.sub(r"[^ -~]", "_", name)
    header = f"bellcrank {readable}, lengths in mm"[:80].ljust(80).encode("ascii")
    return header + struct.pack("<I", len(facets)) + facets.tobytes()


exporters.register("stl")(Exporter((".stl",), to_bytes))
