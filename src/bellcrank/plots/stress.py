"""A part under stress: the discrete model above, finite elements below, and the way along.

One column for each design, human beside machine; under them how efficiency and force grow
along the stroke.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.tri import Triangulation

from bellcrank.plots import style
from bellcrank.plots.legend import ROW_HEIGHT, add_legend
from bellcrank.plots.marks import Panel, add_panel, put_arrows, put_supports
from bellcrank.plots.motion import (
    COLUMNS,
    GAP,
    MARGIN,
    TALLEST,
    WIDE,
    WIDTH,
    Drawing,
    entries_of,
    fill,
    level_frames,
)
from bellcrank.plots.saving import check_target, save_figure
from bellcrank.plots.scene import Motion, input_arrows, wanted_arrows
from bellcrank.plots.strokes import StrokeAxes, StrokeCurve, draw_strokes

if TYPE_CHECKING:
    import os
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

STRESS = LinearSegmentedColormap.from_list(
    "stress", ["#cfd6dd", "#9db4c8", "#f0b35a", "#d55e00", "#6b1400"]
)
"""Grey where nothing happens, dark where it may break; readable without colours too."""
TOP_SHARE = 0.998
"""Part of the cells that the colours tell apart: the few worst ones share the darkest."""
BAR = 0.12
CURVES = 1.9
"""Inches of height of the colour bar and of the curves."""


@dataclass(frozen=True, slots=True, eq=False)
class Stressed:
    """A part in a state, and how it came there.

    Parameters
    ----------
    rest, displacement : (n, 2)
        Of vertices, in lattice units.
    cells : (c, 2) or (c, 3) int64
        Beam elements, drawn as wide as the struts, or triangles.
    stress : (c,) or (n,)
        MPa, of elements or vertices.
    width
        Of the struts, lattice units.
    note
        What stands over the drawing.
    curve
        How it came there.
    """

    rest: NDArray[np.float64]
    displacement: NDArray[np.float64]
    cells: NDArray[np.int64]
    stress: NDArray[np.float64]
    width: float
    note: str
    curve: StrokeCurve


def draw_stress(
    columns: Sequence[tuple[Motion, Stressed]],
    path: str | os.PathLike[str],
    axes: StrokeAxes | None = None,
    *,
    overwrite: bool = False,
) -> None:
    """Draw designs by the discrete model and as stressed parts, one column each.

    Parameters
    ----------
    columns
        At most two designs of problems of a size.
    path
        Where to; the suffix png, svg or pdf chooses the format.
    axes
        Words for the curves.
    overwrite
        Whether to replace what is there.

    Raises
    ------
    InvalidSettings
        If the suffix names no format.
    OutputExists, StorageError
        If there is such a file, or it cannot be written.
    """
    check_target(path, overwrite=overwrite)
    drawings = [
        Drawing(motion.name or motion.design.problem.name, motion.caption, motion, moving=True)
        for motion, _ in columns
    ]
    save_figure(
        _sheet(drawings, [part for _, part in columns], axes or StrokeAxes()),
        path,
        overwrite=overwrite,
    )


def _sheet(drawings: list[Drawing], parts: list[Stressed], words: StrokeAxes) -> Figure:
    """Lay out drawings in two rows, a colour bar and curves."""
    frames = level_frames(drawings, [part.rest + part.displacement for part in parts])
    width = WIDTH if len(drawings) == 1 else WIDE
    sizes = np.array([high - low for low, high in frames])
    room = width - 2 * MARGIN - GAP * (len(drawings) - 1)
    scale = float(min(room / sizes[:, 0].sum(), 0.75 * TALLEST / sizes[:, 1].max()))
    entries = entries_of(drawings)
    tall = scale * float(sizes[:, 1].max())
    heading = max(style.heading_height(d.title, d.note) for d in drawings) + 0.12
    legend = ROW_HEIGHT * math.ceil(len(entries) / COLUMNS)
    bar_at = MARGIN + legend + 0.25 + CURVES + 0.85
    lower = bar_at + BAR + 0.2
    upper = lower + tall + heading + 0.12
    figure = style.new_figure(width, upper + tall + heading + MARGIN)
    top = float(figure.get_size_inches()[1])
    colours = ScalarMappable(Normalize(0.0, _darkest(parts)), STRESS)
    left = 0.5 * (width - scale * float(sizes[:, 0].sum()) - GAP * (len(drawings) - 1))
    for drawing, part, (low, high), size in zip(drawings, parts, frames, sizes, strict=True):
        at = MARGIN if len(drawings) == 1 else left
        problem = drawing.motion.design.problem
        style.write_heading(figure, drawing.title, drawing.note, at, MARGIN)
        fill(add_panel(figure, problem, (left, upper), scale, low, high), drawing)
        style.write_heading(figure, "", part.note, at, top - upper + 0.18)
        panel = add_panel(figure, problem, (left, lower), scale, low, high)
        _put_stressed(panel, part, colours, drawing)
        left += scale * float(size[0]) + GAP
    _put_bar(figure, colours, bar_at, width)
    _put_curves(figure, drawings, parts, words, MARGIN + legend + 0.25)
    add_legend(figure, entries, MARGIN, COLUMNS)
    return figure


def _darkest(parts: list[Stressed]) -> float:
    """Return the stress that is drawn darkest."""
    return max(float(np.quantile(part.stress, TOP_SHARE)) for part in parts) or 1.0


def _put_stressed(panel: Panel, part: Stressed, colours: ScalarMappable, drawing: Drawing) -> None:
    """Draw the moved part in the colours of its stress."""
    problem = panel.problem
    put_supports(panel)
    places = part.rest + drawing.motion.magnify * part.displacement
    looks: dict[str, Any] = {"cmap": colours.cmap, "norm": colours.norm, "zorder": 3.0}
    if part.cells.shape[1] == 2:
        lines = LineCollection(
            list(places[part.cells]),
            linewidths=part.width * panel.points,
            capstyle="round",
            **looks,
        )
        lines.set_array(part.stress)
        panel.axes.add_collection(lines, autolim=False)
    else:
        window = panel.axes.axis()
        mesh = Triangulation(places[:, 0], places[:, 1], part.cells)
        panel.axes.tripcolor(mesh, part.stress, shading="gouraud", rasterized=True, **looks)
        panel.axes.axis(window)
    put_arrows(panel, input_arrows(problem), style.INPUT, bold=True)
    put_arrows(panel, wanted_arrows(problem, drawing.motion.moved), style.WANTED, bold=True)


def _put_bar(figure: Figure, colours: ScalarMappable, bottom: float, width: float) -> None:
    """Draw the colour bar."""
    across, up = figure.get_size_inches()
    long = 0.5 * width
    axes = figure.add_axes((0.5 * (width - long) / across, bottom / up, long / across, BAR / up))
    bar = figure.colorbar(colours, cax=axes, orientation="horizontal", extend="max")
    bar.set_label(
        "von Mises stress, MPa", family=style.FONT, size=style.SMALL_SIZE, color=style.INK
    )
    bar.outline.set_visible(False)
    axes.tick_params(labelsize=style.SMALL_SIZE, colors=style.NOTE, labelfontfamily=style.FONT)


def _put_curves(
    figure: Figure, drawings: list[Drawing], parts: list[Stressed], words: StrokeAxes, at: float
) -> None:
    """Draw efficiency and force along the stroke."""
    across, up = figure.get_size_inches()
    wide = (across - 2 * MARGIN - 1.5) / 2.0
    pair: list[Axes] = []
    for place in range(2):
        left = MARGIN + 0.5 + place * (wide + 0.9)
        place_of = (left / across, (at + 0.35) / up, wide / across, (CURVES - 0.35) / up)
        pair.append(figure.add_axes(place_of))
    names = [drawing.title for drawing in drawings]
    draw_strokes((pair[0], pair[1]), [part.curve for part in parts], words, names)
