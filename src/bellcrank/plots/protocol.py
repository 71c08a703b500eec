"""A page that describes how to film a part for `bellcrank measure`."""

from __future__ import annotations

import textwrap
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.measure.films import needed_picture, picture_scale
from bellcrank.plots import style
from bellcrank.plots.marker_sheet import add_drawing, new_page

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from bellcrank.measure import MarkerLayout
    from bellcrank.part import Part

WIDTH, HEIGHT = 210.0, 297.0
"""A4 in portrait format, mm."""
MARGIN = 15.0
LINE, GAP = 4.6, 2.2
"""Height of a line of text and space between paragraphs, mm."""
COLUMNS = 108
"""Characters in a line."""
DISTANCE = 1.6
"""Distance of the camera over the longer side of the sheet."""


@dataclass(frozen=True, slots=True, eq=False)
class Protocol:
    """Content of the page.

    Parameters
    ----------
    layout
        Markers of the part.
    part
        The part.
    stroke
        Full motion of the input, mm.
    travel
        Motion of the output along its wanted direction at the full stroke, mm.
    name
        Name by which commands find the design.
    """

    layout: MarkerLayout
    part: Part
    stroke: float
    travel: float
    name: str


def protocol_steps(protocol: Protocol) -> list[tuple[str, str]]:
    """Return the steps as pairs of a heading and a paragraph."""
    layout, name = protocol.layout, protocol.name
    wide, high = layout.frame_size
    far = DISTANCE * float(layout.extent.max())
    picture = needed_picture(layout.frame_size, protocol.stroke)
    pixels = picture_scale(picture, layout.frame_size)
    size = layout.on_part[0].size
    return [
        ("1  Print the part and its markers",
         (f"bellcrank export {name} part.stl --markers writes the part with pads for the markers, "
         f"and part.markers.pdf. Print the part in a matt colour. Print both pages of the PDF on "
         f"white, matt {layout.page} paper at 100 % (actual size, no fitting to the page).")),
        ("2  Check the scale",
         ("Measure the printed sheet with a ruler over the outer edges of the corner markers: "
         f"{wide:.1f} mm across and {high:.1f} mm up. If it differs by more than 0.3 mm, give the "
         "measured size to the command: --sheet WIDTHxHEIGHT.")),
        ("3  Glue the markers",
         (f"Cut out the {len(layout.on_part)} markers of the second page with their white margin "
         f"and glue each one ({size:g} mm) flat to its place in the drawing below, within 0.3 mm. "
         "Each must touch only its own block of struts, and must not bend.")),
        ("4  Set up",
         ("Tape the sheet flat on a board. Lay the part on its outline and clamp or screw its "
         "supports; they must not move. Everything else must slide freely: a little talcum powder "
         "helps. No hand, clamp or tool may cover a marker of the part or of the sheet.")),
        ("5  Camera and light",
         (f"Put the camera on a stand, at least {far:.0f} mm from the sheet, tilted by at most 20 "
         "degrees, with the whole sheet in the picture and little around it. Use the main camera, "
         f"no wide angle, no zoom; at least {picture[0]} x {picture[1]} pixels ({pixels:.1f} in a "
         "mm), better more; fixed focus and exposure. Use even, diffuse light from two sides: no "
         "reflections on the markers, no hard shadows.")),
        ("6  Film",
         ("Begin with the part at rest for one second. Push the input slowly and steadily along "
         f"its direction, in 5 to 10 seconds, to {protocol.stroke:.2f} mm, with a screw or a "
         f"caliper if you can. The output then moves about {abs(protocol.travel):.1f} mm. Hold for "
         "one second. The way back is not needed. Photographs at ten or more strokes, the first "
         "at rest, do as well.")),
        ("7  Measure",
         (f"bellcrank measure film.mp4 --design {name} --markers part.markers.json --overlay "
         "overlay.mp4 prints efficiency, off-axis motion, rotation and path with 95 % intervals, "
         "beside the computed motion. Look at the overlay: drawn struts and part must agree at "
         "rest. Film three times, and clamp the part anew each time.")),
        ("Without markers",
         ("Lay the part on a plain background that is much lighter or darker, keep the camera "
         "still, begin at rest, and add --outline. The efficiency is less accurate.")),
    ]  # fmt: skip


def protocol_figure(protocol: Protocol) -> Figure:
    """Return the page, A4."""
    figure, axes = new_page(np.array([WIDTH, HEIGHT]), np.zeros(2))
    top = HEIGHT - MARGIN
    title = f"How to film {protocol.name}"
    _add_text(axes, top, title, size=style.TITLE_SIZE, weight="bold")
    top -= 9.0
    for heading, paragraph in protocol_steps(protocol):
        _add_text(axes, top, heading, size=9.0, weight="bold")
        top -= LINE
        for line in textwrap.wrap(paragraph, COLUMNS):
            _add_text(axes, top, line, size=8.0)
            top -= LINE
        top -= GAP
    low = np.array([MARGIN, MARGIN])
    high = np.array([WIDTH - MARGIN, top - 2.0])
    add_drawing(axes, protocol.layout, protocol.part, low, high)
    return figure


def _add_text(axes: Axes, y: float, text: str, **options: Any) -> None:
    axes.text(
        MARGIN, y, text, va="top", color=style.INK, family=style.FONT, parse_math=False, **options
    )
