"""Pictures of designs: as they are, at rest and moved, two side by side."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.plots import style
from bellcrank.plots.legend import (
    ROW_HEIGHT,
    add_legend,
    arrow_entry,
    strut_entry,
    support_entries,
)
from bellcrank.plots.marks import (
    Panel,
    add_panel,
    put_arrows,
    put_nodes,
    put_struts,
    put_supports,
)
from bellcrank.plots.saving import check_target, save_figure
from bellcrank.plots.scene import (
    Arrow,
    Motion,
    beam_kinds,
    extent,
    input_arrows,
    level_with,
    motion_arrows,
    outline_around,
    spacing,
    wanted_arrows,
)

if TYPE_CHECKING:
    import os

    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from bellcrank.model import Design

    Frame = tuple[NDArray[np.float64], NDArray[np.float64]]

WIDTH = 7.0
"""Inches of a picture with one drawing."""
WIDE = 11.0
"""Inches of a picture with two drawings."""
TALLEST = 7.5
MARGIN = 0.25
GAP = 0.35
COLUMNS = 4


@dataclass(frozen=True, slots=True)
class Drawing:
    """One drawing of a picture, and the words over it."""

    title: str
    note: str
    motion: Motion
    moving: bool

    @property
    def arrows(self) -> list[Arrow]:
        """Of the input, and of what is wanted of the output."""
        problem = self.motion.design.problem
        return [*input_arrows(problem), *wanted_arrows(problem, self.motion.moved)]


def draw_motion(
    motion: Motion, path: str | os.PathLike[str], *, title: str = "", overwrite: bool = False
) -> None:
    """Draw a design at rest in grey and moved in black.

    Parameters
    ----------
    motion
        The design and the displacement of its nodes.
    path
        Where to; the suffix png, svg or pdf chooses the format.
    title
        By default the name of the problem.
    overwrite
        Whether to replace what is there.

    Raises
    ------
    InvalidSettings
        If the suffix names no format.
    OutputExists, StorageError
        If there is such a file, or it cannot be written.

    Examples
    --------
    >>> import os
    >>> from tempfile import TemporaryDirectory
    >>> from bellcrank.mechanics import SpringEvaluator
    >>> from bellcrank.model import find_problem
    >>> crane = find_problem("crane")
    >>> response = SpringEvaluator(crane).evaluate(crane.initial)
    >>> with TemporaryDirectory() as folder:
    ...     draw_motion(
    ...         Motion(crane.full_design(), response.displacement, response.efficiency),
    ...         f"{folder}/motion.png",
    ...     )
    ...     os.listdir(folder)
    ['motion.png']
    """
    check_target(path, overwrite=overwrite)
    part = Drawing(title or motion.design.problem.name, motion.caption, motion, moving=True)
    save_figure(_picture([part], WIDTH), path, overwrite=overwrite)


def draw_comparison(
    left: Motion,
    right: Motion,
    path: str | os.PathLike[str],
    *,
    overwrite: bool = False,
) -> None:
    """Draw two designs side by side, to one scale: the human one beside the machine's.

    Their `name` is written over each. Otherwise as `draw_motion`.
    """
    check_target(path, overwrite=overwrite)
    parts = [
        Drawing(motion.name or motion.design.problem.name, motion.caption, motion, moving=True)
        for motion in (left, right)
    ]
    save_figure(_picture(parts, WIDE), path, overwrite=overwrite)


def draw_design(
    design: Design, path: str | os.PathLike[str], *, title: str = "", overwrite: bool = False
) -> None:
    """Draw a design as it is: which beams may be designed, what is driven, held, watched.

    Parameters and errors are those of `draw_motion`.
    """
    check_target(path, overwrite=overwrite)
    problem = design.problem
    at_rest = Motion(design, np.zeros((problem.lattice.node_count, 2)))
    count = np.count_nonzero(design.mask[problem.designable])
    note = f"{design.beam_count} beams · {count} of {len(problem.designable)} designable ones"
    part = Drawing(title or problem.name, note, at_rest, moving=False)
    save_figure(_picture([part], WIDTH), path, overwrite=overwrite)


def _picture(parts: list[Drawing], width: float) -> Figure:
    """Lay out drawings to one scale, with words over them and a legend under all."""
    frames = level_frames(parts)
    sizes = np.array([high - low for low, high in frames])
    room = width - 2 * MARGIN - GAP * (len(parts) - 1)
    scale = float(min(room / sizes[:, 0].sum(), TALLEST / sizes[:, 1].max()))
    entries = entries_of(parts)
    legend_height = ROW_HEIGHT * math.ceil(len(entries) / COLUMNS)
    top = MARGIN + max(style.heading_height(part.title, part.note) for part in parts)
    below = MARGIN + legend_height + 0.2
    height = below + scale * float(sizes[:, 1].max()) + 0.12 + top
    figure = style.new_figure(width, height)
    left = 0.5 * (width - scale * float(sizes[:, 0].sum()) - GAP * (len(parts) - 1))
    for part, (low, high), size in zip(parts, frames, sizes, strict=True):
        heading = MARGIN if len(parts) == 1 else left
        style.write_heading(figure, part.title, part.note, heading, MARGIN)
        panel = add_panel(figure, part.motion.design.problem, (left, below), scale, low, high)
        fill(panel, part)
        left += scale * float(size[0]) + GAP
    add_legend(figure, entries, MARGIN, COLUMNS)
    return figure


def _frame(part: Drawing) -> Frame:
    """Lower left and upper right corner of what is drawn, lattice units."""
    problem = part.motion.design.problem
    positions, step = problem.lattice.positions, spacing(problem)
    places = [positions, part.motion.moved]
    held = problem.supports.nodes
    if len(held):
        places.append(outline_around(positions[held], 0.35 * step))
    return extent(places, part.arrows, 0.15 * step)


def level_frames(
    parts: list[Drawing], more: list[NDArray[np.float64]] | None = None
) -> list[Frame]:
    """Frames of equal height around the lattices' feet, so that drawings stand on one level.

    Parameters
    ----------
    more
        For each drawing (n, 2) other places that must be seen.
    """
    frames = [_frame(part) for part in parts]
    if more is not None:
        frames = [
            (np.minimum(low, seen.min(axis=0)), np.maximum(high, seen.max(axis=0)))
            for (low, high), seen in zip(frames, more, strict=True)
        ]
    return level_with(frames, [part.motion.design.problem for part in parts])


def fill(panel: Panel, part: Drawing) -> None:
    """Draw a design into its panel."""
    problem = panel.problem
    put_supports(panel)
    if part.moving:
        _put_moving_struts(panel, part.motion)
    else:
        _put_still_struts(panel, part.motion.design)
    rest, moved = problem.lattice.positions, part.motion.moved
    for nodes, colour in ((problem.input.nodes, style.INPUT), (problem.output.nodes, style.OUTPUT)):
        if part.moving:
            put_nodes(panel, rest[nodes], colour, hollow=True)
        put_nodes(panel, moved[nodes], colour)
    put_arrows(panel, input_arrows(problem), style.INPUT, bold=True)
    put_arrows(panel, wanted_arrows(problem, moved), style.WANTED, bold=True)
    if part.moving:
        put_arrows(panel, motion_arrows(part.motion), style.OUTPUT, level=5.5)


def _put_moving_struts(panel: Panel, motion: Motion) -> None:
    kinds = beam_kinds(motion.design)
    rest, moved = panel.problem.lattice.positions, motion.moved
    put_struts(panel, rest, kinds.ground, style.GROUND, width=0.6, level=1.0)
    put_struts(panel, rest, kinds.idle, style.IDLE_REST, width=0.6, level=2.0)
    put_struts(panel, rest, kinds.bearing, style.REST, level=2.1)
    put_struts(panel, moved, kinds.idle, style.IDLE, width=0.55, level=3.0)
    put_struts(panel, moved, kinds.bearing, style.INK, level=3.1)


def _put_still_struts(panel: Panel, design: Design) -> None:
    kinds = beam_kinds(design)
    rest = panel.problem.lattice.positions
    free = np.isin(kinds.bearing, panel.problem.designable)
    put_struts(panel, rest, kinds.ground, style.GROUND, width=0.6, level=1.0)
    put_struts(panel, rest, kinds.idle, style.IDLE, width=0.55, level=2.0)
    put_struts(panel, rest, kinds.bearing[~free], style.KEPT, level=2.1)
    put_struts(panel, rest, kinds.bearing[free], style.INK, level=2.2)


def entries_of(parts: list[Drawing]) -> list[tuple[str, Any]]:
    """Legend entries for what the drawings hold, and for nothing else."""
    motions = [part.motion for part in parts]
    problems = [motion.design.problem for motion in motions]
    entries: list[tuple[str, Any]]
    if parts[0].moving:
        entries = [("at rest", strut_entry(style.REST)), ("moved", strut_entry(style.INK))]
    else:
        entries = [("designable", strut_entry(style.INK)), ("always kept", strut_entry(style.KEPT))]
    if any(len(beam_kinds(motion.design).idle) for motion in motions):
        entries.append(("bears no load", strut_entry(style.IDLE, 2.2)))
    entries += support_entries(problems)
    entries.append(("input", arrow_entry(style.INPUT)))
    entries.append(("output, wanted", arrow_entry(style.WANTED)))
    if any(part.moving and motion_arrows(part.motion) for part in parts):
        entries.append(("output, motion", arrow_entry(style.OUTPUT)))
    return entries
