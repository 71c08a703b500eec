"""What a network sees in a design, beside what is there, on one sheet.

Above, each beam in the colour of what flipping it changes: by mechanics, as the network
predicts it, and to first order. In the middle, the regions of the design that these make. Below,
what blocks that hide a part of the picture change, and how well each way of asking agrees.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.colors import AsinhNorm

from bellcrank.plots import style
from bellcrank.plots.agreements import Measure, add_agreement, add_scatter
from bellcrank.plots.legend import ROW_HEIGHT, add_legend, strut_entry, support_entries
from bellcrank.plots.marks import Panel, add_arrows, add_panel
from bellcrank.plots.motion import MARGIN, WIDE
from bellcrank.plots.saving import check_target, save_figure
from bellcrank.plots.scene import extent, input_arrows, outline_around, output_arrows, spacing
from bellcrank.plots.shadings import (
    REGIONS,
    UNKNOWN,
    HeatMap,
    Shading,
    add_bar,
    add_change,
    add_map,
    add_regions,
)

if TYPE_CHECKING:
    import os
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from bellcrank.model import Design

COLUMN_GAP, ROW_GAP = 0.3, 0.2
TITLE = 0.52
"""Inches over a panel for its words."""
BAR_ROOM = 0.72
LINEAR = 0.01
"""Of the largest change: below, colours are linear; above, as its logarithm."""


@dataclass(frozen=True, slots=True, eq=False)
class Explained:
    """A design, and what several ways of asking say of its beams.

    Parameters
    ----------
    design
        Whose beams are drawn.
    title, note
        What stands over the sheet.
    beams : (n,) int64
        The designable ones, of which the rest tells.
    exact : (n,)
        Change of the efficiency by flipping each; nan where there is none.
    changes
        Three drawings of the lattice in the colours of a change.
    regions
        Two drawings of the lattice with its regions.
    maps
        Two maps of changes, or none.
    measures
        What is compared with `exact`; those with values are points of the scatter too.
    """

    design: Design
    title: str
    note: str
    beams: NDArray[np.int64]
    exact: NDArray[np.float64]
    changes: Sequence[Shading]
    regions: Sequence[Shading]
    maps: Sequence[HeatMap]
    measures: Sequence[Measure]

    @property
    def largest(self) -> float:
        """Change that is drawn darkest."""
        drawn = [each.values for each in self.changes[:2]] + [each.values for each in self.maps]
        found = [np.abs(values[np.isfinite(values)]) for values in drawn]
        return max([float(np.quantile(each, 0.998)) for each in found if each.size] or [0.0]) or 1.0


def draw_explanation(
    explained: Explained, path: str | os.PathLike[str], *, overwrite: bool = False
) -> None:
    """Draw what a network sees in a design, beside what is there.

    Parameters
    ----------
    explained
        What is drawn.
    path
        Where to; the suffix png, svg or pdf chooses the format.
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
    save_figure(_sheet(explained), path, overwrite=overwrite)


@dataclass(frozen=True, slots=True, eq=False)
class _Grid:
    """Where panels stand, inches; and the part of the plane that each shows."""

    figure: Figure
    explained: Explained
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    scale: float
    bottoms: tuple[float, ...]

    @property
    def size(self) -> NDArray[np.float64]:
        """(2,) inches of a panel."""
        return self.scale * (self.high - self.low)

    def left(self, column: int) -> float:
        """Inches from the left edge to a column."""
        across = float(self.size[0])
        start = 0.5 * (WIDE - 3.0 * across - 2.0 * COLUMN_GAP)
        return start + column * (across + COLUMN_GAP)

    def panel(self, row: int, column: int, title: str, note: str) -> Panel:
        """Lay a panel of the lattice, with words over it and arrows in it."""
        corner = (self.left(column), self.bottoms[row])
        top = float(self.figure.get_size_inches()[1]) - corner[1] - float(self.size[1])
        style.add_heading(self.figure, title, note, corner[0], top - TITLE + 0.02)
        problem = self.explained.design.problem
        panel = add_panel(self.figure, problem, corner, self.scale, self.low, self.high)
        add_arrows(panel, input_arrows(problem), style.INPUT, bold=True)
        add_arrows(
            panel, output_arrows(problem, problem.lattice.positions), style.WANTED, bold=True
        )
        return panel

    def axes(self, row: int, column: int, title: str, note: str, room: tuple[float, float]) -> Axes:
        """Lay axes for a chart, with room for numbers at their left and below, inches."""
        left, bottom = self.left(column), self.bottoms[row]
        width, height = self.figure.get_size_inches()
        across, up = self.size
        style.add_heading(self.figure, title, note, left, height - bottom - up - TITLE + 0.02)
        return self.figure.add_axes((
            (left + room[0]) / width, (bottom + room[1]) / height,
            (across - room[0]) / width, (up - room[1] - 0.1) / height,
        ))  # fmt: skip


def _sheet(explained: Explained) -> Figure:
    """Lay out three rows of three panels, two if there are no maps."""
    problem = explained.design.problem
    places = [problem.lattice.positions]
    if len(problem.supports.nodes):
        held = problem.lattice.positions[problem.supports.nodes]
        places.append(outline_around(held, 0.35 * spacing(problem)))
    arrows = [*input_arrows(problem), *output_arrows(problem, problem.lattice.positions)]
    low, high = extent(places, arrows, 0.2 * spacing(problem))
    scale = float((WIDE - 2 * MARGIN - 2 * COLUMN_GAP) / 3.0 / (high - low)[0])
    scale = min(scale, float(4.2 / (high - low)[1]))
    up = scale * float((high - low)[1])
    rows = 3 if explained.maps else 2
    entries = _entries(explained)
    below = MARGIN + ROW_HEIGHT + 0.15 + BAR_ROOM
    bottoms = tuple(below + (rows - 1 - row) * (up + TITLE + ROW_GAP) for row in range(rows))
    heading = style.heading_height(explained.title, explained.note) + 0.2
    figure = style.new_figure(WIDE, bottoms[0] + up + TITLE + heading + MARGIN)
    largest = explained.largest
    norm = AsinhNorm(linear_width=LINEAR * largest, vmin=-largest, vmax=largest)
    grid = _Grid(figure, explained, low, high, scale, bottoms)
    style.add_heading(figure, explained.title, explained.note, grid.left(0), MARGIN)
    mask, beams = explained.design.mask, explained.beams
    for column, shading in enumerate(explained.changes):
        add_change(grid.panel(0, column, shading.title, shading.note), mask, beams, shading, norm)
    for column, shading in enumerate(explained.regions):
        add_regions(grid.panel(1, column, shading.title, shading.note), mask, beams, shading)
    for column, heat in enumerate(explained.maps):
        add_map(grid.panel(2, column, heat.title, heat.note), mask, heat, norm)
    _add_charts(grid)
    add_bar(figure, norm, largest, LINEAR * largest, below - 0.32)
    add_legend(figure, entries, MARGIN, len(entries))
    return figure


def _entries(explained: Explained) -> list[tuple[str, Any]]:
    """Legend entries for what is drawn, and for nothing else."""
    there = explained.design.mask[explained.beams]
    drawn = {int(each) for shading in explained.regions for each in shading.values[there]}
    entries: list[tuple[str, Any]] = [
        (name, strut_entry(colour, 7.0))
        for number, (name, colour) in enumerate(REGIONS)
        if colour and number in drawn
    ]
    if not np.isfinite(explained.exact).all():
        entries.append(("flip leaves no unique response", strut_entry(UNKNOWN)))
    return entries + support_entries([explained.design.problem])


def _add_charts(grid: _Grid) -> None:
    """Draw points and correlations at the right."""
    told = grid.explained
    words = "each flip, as foreseen and as it is"
    axes = grid.axes(1, 2, "One by one", words, (0.55, 0.45))
    add_scatter(axes, told.exact, told.measures, told.largest, LINEAR * told.largest)
    if told.maps:
        axes = grid.axes(2, 2, "All together", "agreement with the mechanics", (0.95, 0.62))
        add_agreement(axes, told.measures)
