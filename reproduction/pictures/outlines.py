"""Outlines of parts at rest and displaced, at one scale."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.patches import FancyArrow, PathPatch
from matplotlib.path import Path as Curve

from bellcrank.plots import style
from bellcrank.plots.legend import add_legend, arrow_entry, strut_entry
from bellcrank.plots.saving import check_target, save_figure

if TYPE_CHECKING:
    import os
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from numpy.typing import NDArray

WIDTH, MARGIN, GAP, HEADING, FOOT = 11.0, 0.25, 0.3, 0.78, 0.55


@dataclass(frozen=True, slots=True, eq=False)
class Shape:
    """An outline and its displacement.

    Parameters
    ----------
    title, notes
        Heading; at most two lines of notes.
    curves
        Closed curves, (n, 4) each: x and y at rest, x and y displaced. Outer curves are
        counter-clockwise, holes clockwise.
    inputs, outputs
        (x, y, direction x, direction y) of each port.
    fixed
        (x, y) of each support.
    """

    title: str
    notes: Sequence[str]
    curves: Sequence[NDArray[np.float64]]
    inputs: Sequence[tuple[float, float, float, float]]
    outputs: Sequence[tuple[float, float, float, float]]
    fixed: Sequence[tuple[float, float]]


def draw_shapes(
    shapes: Sequence[Shape],
    path: str | os.PathLike[str],
    columns: int,
    *,
    title: str = "",
    note: str = "",
    overwrite: bool = False,
) -> None:
    """Draw outlines at one scale, some in each row.

    Raises
    ------
    InvalidSettings, OutputExists, StorageError
        As `save_figure`.
    """
    check_target(path, overwrite=overwrite)
    points = np.concatenate(
        [np.concatenate([c[:, :2], c[:, 2:]]) for shape in shapes for c in shape.curves]
    )
    low, high = points.min(axis=0), points.max(axis=0)
    arrow = 0.13 * float((high - low)[0])
    room = np.array([arrow, 2.0])
    low, high = low - room, high + room
    count = min(len(shapes), columns)
    rows = -(-len(shapes) // columns)
    scale = (WIDTH - 2 * MARGIN - GAP * (count - 1)) / count / float((high - low)[0])
    across, up = scale * (high - low)
    top = MARGIN + style.heading_height(title, note) + 0.14
    tall = HEADING + up + GAP
    figure = style.new_figure(WIDTH, top + rows * tall - GAP + FOOT)
    height = float(figure.get_size_inches()[1])
    style.add_heading(figure, title, note, MARGIN, MARGIN)
    for index, shape in enumerate(shapes):
        row, column = divmod(index, columns)
        left, above = MARGIN + column * (across + GAP), top + row * tall
        style.add_heading(figure, shape.title, shape.notes[0], left, above)
        for line, text in enumerate(shape.notes[1:], start=1):
            style.add_heading(figure, "", text, left, above + 0.27 + 0.2 * line)
        below = FOOT + (rows - 1 - row) * tall
        axes = figure.add_axes((left / WIDTH, below / height, across / WIDTH, up / height))
        axes.set_xlim(low[0], high[0])
        axes.set_ylim(low[1], high[1])
        axes.set_axis_off()
        _add_shape(axes, shape, arrow)
    entries = [
        ("at rest", strut_entry(style.REST)), ("displaced", strut_entry(style.INK)),
        ("support", strut_entry(style.GROUND, 6.0)), ("input", arrow_entry(style.INPUT)),
        ("output, wanted direction", arrow_entry(style.WANTED)),
    ]  # fmt: skip
    add_legend(figure, entries, 0.2, len(entries))
    save_figure(figure, path, overwrite=overwrite)


def _add_shape(axes: Axes, shape: Shape, arrow: float) -> None:
    for first, colour, level in ((0, style.REST, 1.0), (2, style.INK, 2.0)):
        corners, codes = [], []
        for curve in shape.curves:
            ring = curve[:, first : first + 2]
            corners.append(np.vstack([ring, ring[:1]]))
            codes += [Curve.MOVETO, *[Curve.LINETO] * (len(ring) - 1), Curve.CLOSEPOLY]
        whole = Curve(np.concatenate(corners), codes)
        axes.add_patch(PathPatch(whole, facecolor=colour, edgecolor="none", zorder=level))
    for x, y in shape.fixed:
        axes.plot(
            [x], [y], marker="s", markersize=7.0, color=style.GROUND, markeredgecolor="white",
            zorder=4,
        )  # fmt: skip
    for x, y, dx, dy in shape.inputs:
        _add_arrow(axes, (x - arrow * dx, y - arrow * dy), (dx, dy), arrow, style.INPUT)
    reach = (0.9 if len(shape.outputs) == 1 else 0.45) * arrow
    for x, y, dx, dy in shape.outputs:
        _add_arrow(axes, (x, y), (dx, dy), reach, style.WANTED)


def _add_arrow(
    axes: Axes,
    tail: tuple[float, float],
    direction: tuple[float, float],
    length: float,
    colour: str,
) -> None:
    axes.add_patch(
        FancyArrow(
            *tail, length * direction[0], length * direction[1], width=0.14 * length,
            head_width=0.42 * length, head_length=0.4 * length, length_includes_head=True,
            facecolor=colour, edgecolor="white", linewidth=0.6, zorder=6,
        )
    )  # fmt: skip
