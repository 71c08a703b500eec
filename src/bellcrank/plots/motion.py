"""Pictures of designs: at rest, displaced, two side by side."""

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
    add_arrows,
    add_nodes,
    add_panel,
    add_path,
    add_struts,
    add_supports,
)
from bellcrank.plots.saving import check_target, save_figure
from bellcrank.plots.scene import (
    Arrow,
    Motion,
    aligned_frames,
    beam_kinds,
    displacement_arrows,
    extent,
    input_arrows,
    of_one_height,
    outline_around,
    output_arrows,
    output_displacements,
    spacing,
)
from bellcrank.plots.space import add_drawing_in_space, frame_in_space

if TYPE_CHECKING:
    import os
    from collections.abc import Sequence

    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from bellcrank.model import Design

    Frame = tuple[NDArray[np.float64], NDArray[np.float64]]

WIDTH = 7.0
"""Width of a picture with one drawing, inches."""
WIDE = 11.0
"""Width of a picture with two drawings, inches."""
MAX_HEIGHT = 7.5
MARGIN = 0.25
GAP = 0.35
COLUMNS = 4


@dataclass(frozen=True, slots=True)
class Drawing:
    """One drawing of a picture with its heading."""

    title: str
    note: str
    motion: Motion
    displaced: bool

    @property
    def arrows(self) -> list[Arrow]:
        """Arrows of the input and of the wanted output direction."""
        problem = self.motion.design.problem
        return [*input_arrows(problem), *output_arrows(problem, self.motion.moved)]


def draw_motion(
    motion: Motion, path: str | os.PathLike[str], *, title: str = "", overwrite: bool = False
) -> None:
    """Draw a design at rest in grey and displaced in black.

    Parameters
    ----------
    motion
        Design and displacement.
    path
        Output file; the suffix png, svg or pdf selects the format.
    title
        Heading; by default the name of the problem.
    overwrite
        Whether an existing file is replaced.

    Raises
    ------
    InvalidSettings
        If the suffix is unknown.
    OutputExists, StorageError
        If the file exists or cannot be written.

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
    part = Drawing(title or motion.design.problem.name, motion.caption, motion, displaced=True)
    save_figure(_picture([part], WIDTH), path, overwrite=overwrite)


def draw_comparison(
    left: Motion,
    right: Motion,
    path: str | os.PathLike[str],
    *,
    overwrite: bool = False,
) -> None:
    """Draw two designs side by side at one scale, for example a human and a machine design.

    The `name` of each is its heading. Other parameters and errors are those of `draw_motion`.
    """
    draw_cases([left, right], path, overwrite=overwrite)


def draw_cases(
    motions: Sequence[Motion], path: str | os.PathLike[str], *, overwrite: bool = False
) -> None:
    """Draw a design in several load cases side by side at one scale.

    The `name` of each motion is its heading. Other parameters and errors are those of
    `draw_motion`.
    """
    check_target(path, overwrite=overwrite)
    parts = [
        Drawing(motion.name or motion.design.problem.name, motion.caption, motion, displaced=True)
        for motion in motions
    ]
    save_figure(_picture(parts, WIDTH if len(parts) == 1 else WIDE), path, overwrite=overwrite)


def draw_design(
    design: Design, path: str | os.PathLike[str], *, title: str = "", overwrite: bool = False
) -> None:
    """Draw a design at rest with its designable beams, supports, input and output.

    Parameters and errors are those of `draw_motion`.
    """
    check_target(path, overwrite=overwrite)
    problem = design.problem
    at_rest = Motion(design, np.zeros(problem.lattice.positions.shape))
    count = np.count_nonzero(design.mask[problem.designable])
    note = f"{design.beam_count} beams · {count} of {len(problem.designable)} designable beams"
    part = Drawing(title or problem.name, note, at_rest, displaced=False)
    save_figure(_picture([part], WIDTH), path, overwrite=overwrite)


def _picture(parts: list[Drawing], width: float) -> Figure:
    """Lay out drawings at one scale, with headings and a common legend."""
    frames = drawing_frames(parts)
    sizes = np.array([high - low for low, high in frames])
    room = width - 2 * MARGIN - GAP * (len(parts) - 1)
    scale = float(min(room / sizes[:, 0].sum(), MAX_HEIGHT / sizes[:, 1].max()))
    entries = legend_entries(parts)
    legend_height = ROW_HEIGHT * math.ceil(len(entries) / COLUMNS)
    top = MARGIN + max(style.heading_height(part.title, part.note) for part in parts)
    below = MARGIN + legend_height + 0.2
    height = below + scale * float(sizes[:, 1].max()) + 0.12 + top
    figure = style.new_figure(width, height)
    left = 0.5 * (width - scale * float(sizes[:, 0].sum()) - GAP * (len(parts) - 1))
    for part, (low, high), size in zip(parts, frames, sizes, strict=True):
        heading = MARGIN if len(parts) == 1 else left
        style.add_heading(figure, part.title, part.note, heading, MARGIN)
        panel = add_panel(figure, part.motion.design.problem, (left, below), scale, low, high)
        add_drawing(panel, part)
        left += scale * float(size[0]) + GAP
    add_legend(figure, entries, MARGIN, COLUMNS)
    return figure


def _frame(part: Drawing) -> Frame:
    """Return the lower left and upper right corner of a drawing, lattice units."""
    problem = part.motion.design.problem
    if problem.lattice.dimension == 3:
        return frame_in_space(part.motion)
    positions, step = problem.lattice.positions, spacing(problem)
    points = [positions, part.motion.moved]
    held = problem.supports.nodes
    if len(held):
        points.append(outline_around(positions[held], 0.35 * step))
    return extent(points, part.arrows, 0.15 * step)


def drawing_frames(
    parts: list[Drawing], more: list[NDArray[np.float64]] | None = None
) -> list[Frame]:
    """Return the frames of drawings with one height and aligned lower edges of the lattices.

    Parameters
    ----------
    more
        For each drawing, (n, 2) other points that must be visible.
    """
    frames = [_frame(part) for part in parts]
    if more is not None:
        frames = [
            (np.minimum(low, seen.min(axis=0)), np.maximum(high, seen.max(axis=0)))
            for (low, high), seen in zip(frames, more, strict=True)
        ]
    problems = [part.motion.design.problem for part in parts]
    if any(problem.lattice.dimension == 3 for problem in problems):
        return of_one_height(frames)
    return aligned_frames(frames, problems)


def add_drawing(panel: Panel, part: Drawing) -> None:
    """Draw a design on a panel."""
    problem = panel.problem
    if problem.lattice.dimension == 3:
        add_drawing_in_space(panel, part.motion, displaced=part.displaced)
        return
    add_supports(panel)
    if part.displaced:
        _add_displaced_struts(panel, part.motion)
    else:
        _add_struts_at_rest(panel, part.motion.design)
    rest, moved = problem.lattice.positions, part.motion.moved
    ends = [(problem.input.nodes, style.INPUT)]
    ends += [(output.nodes, style.OUTPUT) for output in problem.outputs.values()]
    for nodes, colour in ends:
        if part.displaced:
            add_nodes(panel, rest[nodes], colour, hollow=True)
        add_nodes(panel, moved[nodes], colour)
    add_arrows(panel, input_arrows(problem), style.INPUT, bold=True)
    add_arrows(panel, output_arrows(problem, moved), style.WANTED, bold=True)
    if part.displaced and not part.motion.paths:
        add_arrows(panel, displacement_arrows(part.motion), style.OUTPUT, level=5.5)
    if part.displaced:
        for path in part.motion.drawn_paths(wanted=True):
            add_path(panel, path, style.WANTED, wanted=True)
        for path in part.motion.drawn_paths():
            add_path(panel, path, style.OUTPUT)


def _add_displaced_struts(panel: Panel, motion: Motion) -> None:
    kinds = beam_kinds(motion.design)
    rest, moved = panel.problem.lattice.positions, motion.moved
    add_struts(panel, rest, kinds.ground, style.GROUND, width=0.6, level=1.0)
    add_struts(panel, rest, kinds.unloaded, style.IDLE_REST, width=0.6, level=2.0)
    add_struts(panel, rest, kinds.load_bearing, style.REST, level=2.1)
    add_struts(panel, moved, kinds.unloaded, style.IDLE, width=0.55, level=3.0)
    add_struts(panel, moved, kinds.load_bearing, style.INK, level=3.1)


def _add_struts_at_rest(panel: Panel, design: Design) -> None:
    kinds = beam_kinds(design)
    rest = panel.problem.lattice.positions
    free = np.isin(kinds.load_bearing, panel.problem.designable)
    add_struts(panel, rest, kinds.ground, style.GROUND, width=0.6, level=1.0)
    add_struts(panel, rest, kinds.unloaded, style.IDLE, width=0.55, level=2.0)
    add_struts(panel, rest, kinds.load_bearing[~free], style.NOT_DESIGNABLE, level=2.1)
    add_struts(panel, rest, kinds.load_bearing[free], style.INK, level=2.2)


def legend_entries(parts: list[Drawing]) -> list[tuple[str, Any]]:
    """Return legend entries for the elements that the drawings contain."""
    motions = [part.motion for part in parts]
    problems = [motion.design.problem for motion in motions]
    entries: list[tuple[str, Any]]
    if parts[0].displaced:
        entries = [("at rest", strut_entry(style.REST)), ("displaced", strut_entry(style.INK))]
    else:
        entries = [
            ("designable", strut_entry(style.INK)),
            ("not designable", strut_entry(style.NOT_DESIGNABLE)),
        ]
    if any(len(beam_kinds(motion.design).unloaded) for motion in motions):
        entries.append(("unloaded", strut_entry(style.IDLE, 2.2)))
    entries += support_entries(problems)
    entries.append(("input", arrow_entry(style.INPUT)))
    entries.append(("output, wanted direction", arrow_entry(style.WANTED)))
    if any(motion.paths for motion in motions):
        entries.append(("output, path", strut_entry(style.OUTPUT, 1.6)))
    if any(len(path) for motion in motions for path in motion.wanted_paths):
        entries.append(("output, wanted path", strut_entry(style.WANTED, 3.2)))
    without = [part for part in parts if not part.motion.paths]
    if any(part.displaced and len(output_displacements(part.motion)) for part in without):
        entries.append(("output, displacement", arrow_entry(style.OUTPUT)))
    return entries
