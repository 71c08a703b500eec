"""Elements of a drawing: struts, supports, nodes, arrows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.patches import FancyArrow, Polygon

from bellcrank.plots import style
from bellcrank.plots.scene import Arrow, arrow_length, outline_around, spacing, support_groups

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from bellcrank.model import Problem

STRUT = 0.13
"""Width of a drawn strut, as a fraction of the lattice spacing."""


@dataclass(frozen=True, slots=True, eq=False)
class Panel:
    """Axes for the drawing of a lattice, with equal scales.

    Parameters
    ----------
    axes
        Axes without frame, with equal scales.
    problem
        Problem that is drawn.
    points
        Points (1/72 inch) per lattice unit, for line widths in lattice units.
    """

    axes: Axes
    problem: Problem
    points: float

    @property
    def strut(self) -> float:
        """Width of a strut, points."""
        return max(STRUT * spacing(self.problem) * self.points, 0.6)

    def struts(self, beams: NDArray[np.int64], multiple: float = 1.0) -> NDArray[np.float64]:
        """Return (n,) widths of the struts of beams, points, in the ratios of the problem."""
        points = np.full(len(beams), multiple * self.strut)
        if self.problem.widths is not None and self.problem.section is not None:
            points *= self.problem.widths[beams] / self.problem.section.width
        points[points < 0.6] = 0.6
        return points


def add_panel(
    figure: Figure,
    problem: Problem,
    corner: tuple[float, float],
    scale: float,
    low: NDArray[np.float64],
    high: NDArray[np.float64],
) -> Panel:
    """Add a panel to a figure.

    Parameters
    ----------
    corner
        Lower left corner, inches.
    scale
        Inches per lattice unit.
    low, high : (2,) lattice units
        Lower left and upper right corner of the visible area.
    """
    across, up = scale * (high - low)
    width, height = figure.get_size_inches()
    axes = figure.add_axes(
        (corner[0] / width, corner[1] / height, float(across / width), float(up / height))
    )
    axes.set_xlim(float(low[0]), float(high[0]))
    axes.set_ylim(float(low[1]), float(high[1]))
    axes.set_axis_off()
    return Panel(axes, problem, 72.0 * scale)


def add_struts(
    panel: Panel,
    positions: NDArray[np.float64],
    beams: NDArray[np.int64],
    colour: str,
    *,
    width: float = 1.0,
    level: float = 2.0,
) -> None:
    """Draw beams as struts with round ends.

    Parameters
    ----------
    positions : (N, 2) lattice units
    beams : (n,) int64
        Indices of the beams to draw.
    width
        Multiple of the strut width.
    level
        Drawing order; higher levels cover lower ones.
    """
    if len(beams):
        panel.axes.add_collection(
            LineCollection(
                list(positions[panel.problem.lattice.beams[beams]]),
                colors=colour,
                linewidths=panel.struts(beams, width),
                capstyle="round",
                zorder=level,
            ),
            autolim=False,
        )


def add_nodes(
    panel: Panel, points: NDArray[np.float64], colour: str, *, hollow: bool = False
) -> None:
    """Mark nodes by dots."""
    panel.axes.plot(
        points[:, 0],
        points[:, 1],
        linestyle="none",
        marker="o",
        markersize=float(np.clip(1.75 * panel.strut, 3.0, 9.0)),
        markerfacecolor="white" if hollow else colour,
        markeredgecolor=colour if hollow else "white",
        markeredgewidth=float(np.clip(0.25 * panel.strut, 0.5, 1.2)),
        zorder=5 if hollow else 6,
        clip_on=False,
    )


def add_path(
    panel: Panel, points: NDArray[np.float64], colour: str, *, wanted: bool = False
) -> None:
    """Draw a path (k, 2), lattice units; a wanted one is wide, below the others."""
    panel.axes.plot(
        points[:, 0], points[:, 1],
        color=colour, linewidth=3.2 if wanted else 1.6, solid_capstyle="round",
        zorder=6.4 if wanted else 6.6, clip_on=False,
    )  # fmt: skip


def add_supports(panel: Panel) -> None:
    """Draw fixed supports as hatched areas and rollers as wheels."""
    problem = panel.problem
    positions, step = problem.lattice.positions, spacing(problem)
    for group in support_groups(problem):
        reach = (0.3 if len(group) > 1 else 0.45) * step
        panel.axes.add_patch(support_area(outline_around(positions[group], reach)))
    for nodes, offset in (
        (problem.supports.fixed_y, np.array([0.0, -0.26])),
        (problem.supports.fixed_x, np.array([-0.26, 0.0])),
    ):
        _add_wheels(panel, positions[nodes], offset * step)


def support_area(outline: NDArray[np.float64]) -> Polygon:
    """Return the hatched area (k, 2) of a support."""
    return Polygon(
        outline, facecolor=style.GROUND_FILL, edgecolor=style.GROUND, linewidth=1.0, hatch="////",
        zorder=0.5,
    )  # fmt: skip


def _add_wheels(panel: Panel, points: NDArray[np.float64], offset: NDArray[np.float64]) -> None:
    """Draw wheels beside nodes, with their rails."""
    if len(points) == 0:
        return
    radius = float(np.hypot(*offset)) / 2.0
    centres = points + offset
    panel.axes.plot(
        *centres.T,
        linestyle="none",
        marker="o",
        markersize=2.0 * radius * panel.points,
        markerfacecolor="white",
        markeredgecolor=style.NOTE,
        markeredgewidth=0.9,
        zorder=1.5,
        clip_on=False,
    )
    along = 1.6 * radius * np.array([abs(offset[1]), abs(offset[0])]) / np.hypot(*offset)
    rails = centres + offset / 2.0
    panel.axes.add_collection(
        LineCollection(
            list(np.stack([rails - along, rails + along], axis=1)),
            colors=style.NOTE,
            linewidths=0.9,
            zorder=1.5,
            clip_on=False,
        ),
        autolim=False,
    )


def add_arrows(
    panel: Panel, arrows: list[Arrow], colour: str, *, bold: bool = False, level: float = 7.0
) -> None:
    """Draw arrows; bold arrows mark a region, thin ones a displacement."""
    step = spacing(panel.problem)
    body = 0.13 * arrow_length(panel.problem) if bold else 0.065 * step
    for arrow in arrows:
        dx, dy = np.subtract(arrow.tip, arrow.tail)
        length = float(np.hypot(dx, dy))
        head = min(3.2 * body if bold else 4.5 * body, 0.6 * length)
        panel.axes.add_patch(
            FancyArrow(
                *arrow.tail,
                dx,
                dy,
                width=body,
                length_includes_head=True,
                head_width=(2.9 if bold else 3.6) * body,
                head_length=head,
                facecolor=colour,
                edgecolor="white",
                linewidth=0.7 if bold else 0.4,
                zorder=level,
                clip_on=False,
            )
        )
