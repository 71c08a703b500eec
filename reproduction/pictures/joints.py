"""Sketches of a node with its beams and the angular springs between them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.patches import Arc

from bellcrank.plots import style
from bellcrank.plots.saving import check_target, save_figure

if TYPE_CHECKING:
    import os
    from collections.abc import Sequence

    from matplotlib.axes import Axes

SIDE = 2.55
"""Width of a sketch, inches."""
MARGIN, GAP, HEADING = 0.25, 0.2, 0.62
CUT = 0.22
"""Reduction of the height of a sketch, beam lengths."""
RADIUS, STEP = 0.34, 0.075
"""Radius of arcs and difference between neighbours, beam lengths."""


@dataclass(frozen=True, slots=True)
class Joint:
    """A node with its beams.

    Parameters
    ----------
    title, note
        Heading.
    angles
        Directions of the beams, degrees.
    dead
        Indices of the beams that are dead ends.
    removed
        Directions of removed beams, degrees.
    merged
        Merged springs, by the index of the first of their two beams, counter-clockwise.
    """

    title: str
    note: str
    angles: Sequence[float]
    dead: frozenset[int] = frozenset()
    removed: Sequence[float] = ()
    merged: frozenset[int] = frozenset()


def draw_joints(
    joints: Sequence[Joint],
    path: str | os.PathLike[str],
    *,
    title: str = "",
    note: str = "",
    overwrite: bool = False,
) -> None:
    """Draw sketches of joints in a row.

    Parameters
    ----------
    path
        Output file; the suffix png, svg or pdf selects the format.

    Raises
    ------
    InvalidSettings, OutputExists, StorageError
        As `save_figure`.
    """
    check_target(path, overwrite=overwrite)
    count = len(joints)
    width = 2 * MARGIN + count * SIDE + (count - 1) * GAP
    top = MARGIN + style.heading_height(title, note) + 0.16
    height = top + HEADING + SIDE * (1.0 - CUT / 2.56) + 0.1
    figure = style.new_figure(width, height)
    style.add_heading(figure, title, note, MARGIN, MARGIN)
    for index, joint in enumerate(joints):
        left = MARGIN + index * (SIDE + GAP)
        style.add_heading(figure, joint.title, joint.note, left, top)
        axes = figure.add_axes(
            (left / width, 0.08 / height, SIDE / width, SIDE * (1.0 - CUT / 2.56) / height)
        )
        axes.set_xlim(-1.28, 1.28)
        axes.set_ylim(-1.28, 1.28 - CUT)
        axes.set_axis_off()
        _add_joint(axes, joint)
    save_figure(figure, path, overwrite=overwrite)


def _add_joint(axes: Axes, joint: Joint) -> None:
    for angle in joint.removed:
        _add_beam(axes, angle, style.REST, 2.2, dashed=True)
    for index, angle in enumerate(joint.angles):
        dead = index in joint.dead
        _add_beam(axes, angle, style.IDLE if dead else style.INK, 3.0 if dead else 5.0)
        x, y = _at(angle, 1.0)
        axes.plot(
            [x], [y], marker="o", markersize=8.0, markerfacecolor="white" if dead else style.GROUND,
            markeredgecolor=style.IDLE if dead else style.INK, markeredgewidth=1.4, zorder=5,
        )  # fmt: skip
    axes.plot([0], [0], marker="o", markersize=9.0, color=style.INK, zorder=6)
    count = len(joint.angles)
    if count < 2:
        return
    for index, start in enumerate(joint.angles):
        end = joint.angles[(index + 1) % count]
        opening = (end - start) % 360.0
        _add_spring(axes, start, opening, RADIUS + STEP * (index % 2), merged=index in joint.merged)


def _at(angle: float, radius: float) -> tuple[float, float]:
    turned = np.radians(angle)
    return float(radius * np.cos(turned)), float(radius * np.sin(turned))


def _add_beam(axes: Axes, angle: float, colour: str, width: float, *, dashed: bool = False) -> None:
    x, y = _at(angle, 1.0)
    axes.plot(
        [0, x], [0, y], color=colour, linewidth=width, zorder=2.0 if dashed else 3.0,
        linestyle=(0, (2.2, 1.8)) if dashed else "-", solid_capstyle="round",
    )  # fmt: skip


def _add_spring(axes: Axes, start: float, opening: float, radius: float, *, merged: bool) -> None:
    """Draw an arc between two beams with its rest angle."""
    colour = style.INPUT if merged else style.BEST
    room = min(7.0, 0.14 * opening)
    axes.add_patch(
        Arc(
            (0.0, 0.0), 2 * radius, 2 * radius, theta1=start + room, theta2=start + opening - room,
            color=colour, linewidth=2.4, zorder=4, capstyle="round",
        )
    )  # fmt: skip
    x, y = _at(start + 0.5 * opening, radius + 0.2)
    axes.text(
        x, y, f"{opening:.0f}°", ha="center", va="center", size=style.SMALL_SIZE - 0.5,
        color=colour, family=style.FONT, zorder=7,
        bbox={"boxstyle": "round,pad=0.12", "facecolor": "white", "edgecolor": "none"},
    )  # fmt: skip
