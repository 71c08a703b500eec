"""SVG: exact lines and arcs in mm, for laser cutters and for drawings."""

from __future__ import annotations

from typing import TYPE_CHECKING
from xml.sax.saxutils import escape

import numpy as np

from bellcrank.export.formats.base import Export, Exporter, exporters

if TYPE_CHECKING:
    from bellcrank.part.outline import Loop, Outline

HAIRLINE = 0.025
"""Width of lines, mm, which programs of laser cutters interpret as a cut."""


def to_bytes(export: Export) -> bytes:
    """Return the outline as an SVG file."""
    return outline_to_bytes(export.outline(), export.name)


def outline_to_bytes(outline: Outline, name: str) -> bytes:
    """Return an outline as an SVG file: one path with a closed subpath of exact arcs for each loop.

    The y axis points down in SVG. The outline is mirrored within its bounds accordingly.
    """
    low_x, low_y, high_x, high_y = outline.bounds
    width, height = high_x - low_x, high_y - low_y
    paths = "\n".join(_subpath(loop, low_x, high_y) for loop in outline.loops)
    readable = "".join(letter if letter.isprintable() else " " for letter in name)
    text = (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        f'<svg xmlns="http://www.w3.org/2000/svg" version="1.1" width="{width!r}mm" '
        f'height="{height!r}mm" viewBox="0 0 {width!r} {height!r}">\n'
        f"<title>{escape(readable)}</title>\n"
        f'<path id="part" fill="none" fill-rule="evenodd" stroke="#000000" '
        f'stroke-width="{HAIRLINE}" d="{paths}"/>\n</svg>\n'
    )
    return text.encode("utf-8")


def _subpath(loop: Loop, left: float, top: float) -> str:
    """Return a loop as SVG path commands, relative to the upper left corner."""
    corners = np.column_stack([loop.points[:, 0] - left, top - loop.points[:, 1]]).tolist()
    commands = ["M{!r} {!r}".format(*corners[0])]
    ends = [*corners[1:], corners[0]]
    for (x, y), bulge, radius in zip(ends, loop.bulge.tolist(), loop.radii.tolist(), strict=True):
        if bulge == 0.0:
            commands.append(f"L{x!r} {y!r}")
        else:
            # A counterclockwise arc remains so in the picture. SVG counts angles clockwise, so
            # that its sweep flag is 0.
            commands.append(f"A{radius!r} {radius!r} 0 0 {0 if bulge > 0.0 else 1} {x!r} {y!r}")
    return " ".join([*commands, "Z"])


exporters.register("svg")(Exporter((".svg",), to_bytes))
