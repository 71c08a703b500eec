"""Printable pages at true size: the sheet of reference markers, and the markers to cut out."""

from __future__ import annotations

from io import BytesIO
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.measure.corners import marker_modules
from bellcrank.measure.layout import MODULES
from bellcrank.plots import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from bellcrank.measure import Marker, MarkerLayout
    from bellcrank.part import Part

    Values = NDArray[np.float64]

INCH = 25.4
PART, PATH = "#8f98a1", "#7fc0ea"
ARROW = (8.0, 14.0)
"""Distance of an arrow from the middle of its nodes, and its length, mm."""


def sheet_figure(layout: MarkerLayout, part: Part, positions: Values) -> Figure:
    """Return the page of the reference markers, with the outline of the part at rest.

    Parameters
    ----------
    layout
        The markers.
    part
        The part.
    positions : (K, N, 2) float64, mm
        Nodes along the stroke, for the paths of the markers.
    """
    figure, axes = new_page(layout.extent, layout.corner)
    for marker in layout.reference:
        _add_marker(axes, marker.id, marker.centre, marker.size)
    _add_part(axes, part)
    for marker in layout.on_part:
        middle = positions[:, marker.nodes].mean(axis=1)
        axes.plot(*middle.T, color=PATH, linewidth=0.6, zorder=1)
        _add_square(axes, marker, PATH)
    wide, high = layout.frame_size
    first = (
        f"{part.design.problem.name} · print at 100 % (actual size) on {layout.page}; measure "
        f"over the outer edges of the corner markers: {wide:.1f} mm across, {high:.1f} mm up"
    )
    second = "lay the part on its outline, clamp its supports, keep all black squares visible"
    low = min(float(marker.corners[:, 1].min()) for marker in layout.reference)
    gap = low - float(layout.corner[1])
    # Below the markers, or in the middle of the sheet where the margin is narrow.
    at = low - min(4.0, 0.45 * gap)
    _add_text(axes, layout.corner[0] + 0.5 * layout.extent[0], at, first, ha="center")
    _add_text(axes, layout.corner[0] + 0.5 * layout.extent[0], at - 3.2, second, ha="center")
    return figure


def cards_figure(layout: MarkerLayout, part: Part) -> Figure:
    """Return a page of the same size with the markers of the part to cut out, and where they go."""
    figure, axes = new_page(layout.extent, np.zeros(2))
    wide, high = layout.extent.tolist()
    left, top = 12.0, high - 12.0
    _add_text(
        axes, left, top, "Cut along the dashed squares and glue each marker flat to the part, the "
        "top of the marker up, where the drawing shows its number.", size=9.0,
    )  # fmt: skip
    x, y, row = left, top - 8.0, 0.0
    for marker in layout.on_part:
        card = marker.size * (MODULES + 2) / MODULES
        if x + card > wide - 12.0:
            x, y = left, y - row - 9.0
        centre = np.array([x + 0.5 * card, y - 0.5 * card])
        _add_marker(axes, marker.id, centre, marker.size)
        corners = centre + 0.5 * card * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]])
        axes.plot(*corners.T, color=style.NOTE, linewidth=0.5, linestyle=(0, (4, 3)))
        _add_text(axes, centre[0], y - card - 1.5, f"{marker.id} {marker.role}", ha="center")
        x, row = x + card + 8.0, max(row, card)
    add_drawing(axes, layout, part, np.array([left, 12.0]), np.array([wide - 12.0, y - row - 12.0]))
    return figure


def page_bytes(figures: list[Figure], suffix: str) -> bytes:
    """Return pages as a PDF, or the only page as an SVG."""
    content = BytesIO()
    if suffix == ".svg":
        (figure,) = figures
        figure.savefig(content, format="svg", metadata={"Date": None})
        return content.getvalue()
    from matplotlib.backends.backend_pdf import PdfPages

    with PdfPages(content, metadata={"CreationDate": None}) as pages:
        for figure in figures:
            pages.savefig(figure)
    return content.getvalue()


def new_page(extent: Values, corner: Values) -> tuple[Figure, Axes]:
    """Return a page with axes in mm at true size."""
    figure = style.new_figure(*(extent / INCH).tolist())
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_xlim(corner[0], corner[0] + extent[0])
    axes.set_ylim(corner[1], corner[1] + extent[1])
    axes.set_axis_off()
    return figure, axes


def _add_marker(axes: Axes, number: int, centre: Values, size: float) -> None:
    """Add the black modules of a marker: one square with white modules on it."""
    from matplotlib.patches import Rectangle

    (left, low), step = (centre - 0.5 * size).tolist(), size / MODULES
    options: dict[str, Any] = {"linewidth": 0.0, "antialiased": False}
    axes.add_patch(Rectangle((left, low), size, size, facecolor="black", zorder=3, **options))
    for row, column in np.argwhere(marker_modules(number)).tolist():
        corner = left + step * column, low + step * (MODULES - 1 - row)
        axes.add_patch(Rectangle(corner, step, step, facecolor="white", zorder=4, **options))


def _add_square(axes: Axes, marker: Marker, colour: str) -> None:
    corners = np.vstack([marker.corners, marker.corners[:1]])
    axes.plot(*corners.T, color=colour, linewidth=0.6, zorder=2)


def _add_part(axes: Axes, part: Part, scale: float = 1.0, shift: Any = 0.0) -> None:
    """Add the outline of a part at rest."""
    for loop in part.outline().loops:
        points = loop.flattened(0.02)
        closed = scale * np.vstack([points, points[:1]]) + shift
        axes.plot(*closed.T, color=PART, linewidth=0.6, zorder=1)


def add_drawing(axes: Axes, layout: MarkerLayout, part: Part, low: Values, high: Values) -> None:
    """Add the part with its markers between two corners of the page."""
    cards = np.concatenate([marker.corners for marker in layout.on_part])
    points = np.vstack([part.positions[np.unique(part.struts)], cards])
    first, last = points.min(axis=0) - 2.0, points.max(axis=0) + 2.0
    scale = float(min(1.0, *((high - low) / (last - first))))
    shift = 0.5 * (low + high) - scale * 0.5 * (first + last)
    _add_part(axes, part, scale, shift)
    _add_directions(axes, part, scale, shift)
    for marker in layout.on_part:
        corners = scale * np.vstack([marker.corners, marker.corners[:1]]) + shift
        axes.fill(*corners.T, facecolor="white", edgecolor=style.OUTPUT, linewidth=0.8, zorder=2)
        centre = scale * marker.centre + shift
        _add_text(axes, centre[0], centre[1], str(marker.id), ha="center", va="center")


def _add_directions(axes: Axes, part: Part, scale: float, shift: Values) -> None:
    """Add arrows along the directions of input and output."""
    problem = part.design.problem
    for given, colour in ((problem.input, style.INPUT), (problem.output, style.OUTPUT)):
        for way in np.unique(given.direction.round(6), axis=0):
            own = given.nodes[(np.abs(given.direction - way) < 1e-5).all(axis=1)]
            start = part.positions[own].mean(axis=0) + ARROW[0] * way
            ends = scale * np.stack([start, start + ARROW[1] * way]) + shift
            axes.annotate(
                "", ends[1].tolist(), ends[0].tolist(),
                arrowprops={"arrowstyle": "-|>", "color": colour, "linewidth": 2.0}, zorder=6,
            )  # fmt: skip


def _add_text(axes: Axes, x: float, y: float, text: str, size: float = 6.5, **options: Any) -> None:
    options = {"ha": "left", "va": "top"} | options
    axes.text(
        x, y, text, size=size, color=style.INK, family=style.FONT, parse_math=False, zorder=5,
        **options,
    )  # fmt: skip
