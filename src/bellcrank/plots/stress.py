"""Stress of parts: the model of the design, the finite elements, and curves along the stroke.

One column for each design; below them efficiency and force along the stroke.
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
from bellcrank.plots.legend import BAR, ROW_HEIGHT, add_colour_bar, add_legend
from bellcrank.plots.marks import Panel, add_arrows, add_panel, add_supports
from bellcrank.plots.motion import (
    COLUMNS,
    GAP,
    MARGIN,
    MAX_HEIGHT,
    WIDE,
    WIDTH,
    Drawing,
    add_drawing,
    drawing_frames,
    legend_entries,
)
from bellcrank.plots.saving import check_target, save_figure
from bellcrank.plots.scene import Motion, input_arrows, output_arrows
from bellcrank.plots.strokes import StrokeCurve, StrokeLabels, draw_strokes

if TYPE_CHECKING:
    import os
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

STRESS = LinearSegmentedColormap.from_list(
    "stress", ["#cfd6dd", "#9db4c8", "#f0b35a", "#d55e00", "#6b1400"]
)
"""Grey for low, dark for high stress; monotonic in brightness."""
TOP_QUANTILE = 0.998
"""Quantile of the stress at the end of the colour scale; values above it share one colour."""
CURVES = 1.9
"""Height of the curves, inches."""


@dataclass(frozen=True, slots=True, eq=False)
class StressedPart:
    """A part in its last state, and its curve along the stroke.

    Parameters
    ----------
    rest, displacement : (n, 2)
        Positions and displacements of the vertices, lattice units.
    cells : (c, 2) or (c, 3) int64
        Vertices of beam elements or of triangles.
    stress : (c,) or (n,)
        Von Mises stress of elements or vertices, MPa.
    widths : (c,)
        Widths of the beam elements, lattice units; empty for triangles.
    note
        Text above the drawing.
    curve
        Efficiency and force along the stroke.
    """

    rest: NDArray[np.float64]
    displacement: NDArray[np.float64]
    cells: NDArray[np.int64]
    stress: NDArray[np.float64]
    widths: NDArray[np.float64]
    note: str
    curve: StrokeCurve


def draw_stress(
    columns: Sequence[tuple[Motion, StressedPart]],
    path: str | os.PathLike[str],
    labels: StrokeLabels | None = None,
    *,
    overwrite: bool = False,
) -> None:
    """Draw designs in their model and as parts with their stress, one column each.

    Parameters
    ----------
    columns
        At most two designs.
    path
        Output file; the suffix png, svg or pdf selects the format.
    labels
        Axis labels of the curves.
    overwrite
        Whether an existing file is replaced.

    Raises
    ------
    InvalidSettings
        If the suffix is unknown.
    OutputExists, StorageError
        If the file exists or cannot be written.
    """
    check_target(path, overwrite=overwrite)
    drawings = [
        Drawing(motion.name or motion.design.problem.name, motion.caption, motion, displaced=True)
        for motion, _ in columns
    ]
    save_figure(
        _layout(drawings, [part for _, part in columns], labels or StrokeLabels()),
        path,
        overwrite=overwrite,
    )


def _layout(drawings: list[Drawing], parts: list[StressedPart], labels: StrokeLabels) -> Figure:
    """Lay out two rows of drawings, a colour bar and curves."""
    frames = drawing_frames(drawings, [part.rest + part.displacement for part in parts])
    width = WIDTH if len(drawings) == 1 else WIDE
    sizes = np.array([high - low for low, high in frames])
    room = width - 2 * MARGIN - GAP * (len(drawings) - 1)
    scale = float(min(room / sizes[:, 0].sum(), 0.75 * MAX_HEIGHT / sizes[:, 1].max()))
    entries = legend_entries(drawings)
    tall = scale * float(sizes[:, 1].max())
    heading = max(style.heading_height(d.title, d.note) for d in drawings) + 0.12
    legend = ROW_HEIGHT * math.ceil(len(entries) / COLUMNS)
    bar_at = MARGIN + legend + 0.25 + CURVES + 0.85
    lower = bar_at + BAR + 0.2
    upper = lower + tall + heading + 0.12
    figure = style.new_figure(width, upper + tall + heading + MARGIN)
    top = float(figure.get_size_inches()[1])
    colours = ScalarMappable(Normalize(0.0, _top_stress(parts)), STRESS)
    left = 0.5 * (width - scale * float(sizes[:, 0].sum()) - GAP * (len(drawings) - 1))
    for drawing, part, (low, high), size in zip(drawings, parts, frames, sizes, strict=True):
        at = MARGIN if len(drawings) == 1 else left
        problem = drawing.motion.design.problem
        style.add_heading(figure, drawing.title, drawing.note, at, MARGIN)
        add_drawing(add_panel(figure, problem, (left, upper), scale, low, high), drawing)
        style.add_heading(figure, "", part.note, at, top - upper + 0.18)
        panel = add_panel(figure, problem, (left, lower), scale, low, high)
        _add_stressed(panel, part, colours, drawing)
        left += scale * float(size[0]) + GAP
    add_colour_bar(figure, colours, "von Mises stress, MPa", bar_at)
    _add_curves(figure, drawings, parts, labels, MARGIN + legend + 0.25)
    add_legend(figure, entries, MARGIN, COLUMNS)
    return figure


def _top_stress(parts: list[StressedPart]) -> float:
    """Return the stress at the end of the colour scale."""
    return max(float(np.quantile(part.stress, TOP_QUANTILE)) for part in parts) or 1.0


def _add_stressed(
    panel: Panel, part: StressedPart, colours: ScalarMappable, drawing: Drawing
) -> None:
    """Draw the displaced part, coloured by its stress."""
    problem = panel.problem
    add_supports(panel)
    points = part.rest + drawing.motion.magnify * part.displacement
    options: dict[str, Any] = {"cmap": colours.cmap, "norm": colours.norm, "zorder": 3.0}
    if part.cells.shape[1] == 2:
        lines = LineCollection(
            list(points[part.cells]),
            linewidths=part.widths * panel.points,
            capstyle="round",
            **options,
        )
        lines.set_array(part.stress)
        panel.axes.add_collection(lines, autolim=False)
    else:
        window = panel.axes.axis()
        mesh = Triangulation(points[:, 0], points[:, 1], part.cells)
        panel.axes.tripcolor(mesh, part.stress, shading="gouraud", rasterized=True, **options)
        panel.axes.axis(window)
    add_arrows(panel, input_arrows(problem), style.INPUT, bold=True)
    add_arrows(panel, output_arrows(problem, drawing.motion.moved), style.WANTED, bold=True)


def _add_curves(
    figure: Figure,
    drawings: list[Drawing],
    parts: list[StressedPart],
    labels: StrokeLabels,
    at: float,
) -> None:
    """Add the curves of efficiency and force along the stroke."""
    across, up = figure.get_size_inches()
    wide = (across - 2 * MARGIN - 1.5) / 2.0
    pair: list[Axes] = []
    for index in range(2):
        left = MARGIN + 0.5 + index * (wide + 0.9)
        place_of = (left / across, (at + 0.35) / up, wide / across, (CURVES - 0.35) / up)
        pair.append(figure.add_axes(place_of))
    names = [drawing.title for drawing in drawings]
    draw_strokes((pair[0], pair[1]), [part.curve for part in parts], labels, names)
