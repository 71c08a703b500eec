"""SVG: exact lines and arcs in mm, for laser cutters and for drawings."""

from __future__ import annotations

from typing import TYPE_CHECKING
from xml.sax.saxutils import escape

import numpy as np

from bellcrank.export.formats.base import Export, Exporter, exporters

if TYPE_CHECKING:
    from bellcrank.part.outline import Loop, Outline

HAIRLINE = 0.025
"""Width of lines, mm: what programs of laser cutters take for a cut."""


def to_bytes(export: Export) -> bytes:
    """Return the outline as an SVG file."""
    return outline_to_bytes(export.outline(), export.name)


def outline_to_bytes(outline: Outline, name: str) -> bytes:
    """Return an outline as an SVG file: one path, a closed subpath for each loop, arcs as such.

    Since y runs downwards there, it is turned round within the bounds of the outline.
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
    """Return a loop in the words of SVG, measured from a corner at the upper left."""
    places = np.column_stack([loop.points[:, 0] - left, top - loop.points[:, 1]]).tolist()
    words = ["M{!r} {!r}".format(*places[0])]
    ends = [*places[1:], places[0]]
    for (x, y), bulge, radius in zip(ends, loop.bulge.tolist(), loop.radii.tolist(), strict=True):
        if bulge == 0.0:
            words.append(f"L{x!r} {y!r}")
        else:
            # What turns counterclockwise does so with y downwards, too, if one looks at it, but
            # SVG counts angles the other way round.
            words.append(f"A{radius!r} {radius!r} 0 0 {0 if bulge > 0.0 else 1} {x!r} {y!r}")
    return " ".join([*words, "Z"])


exporters.register("svg")(Exporter((".svg",), to_bytes))
