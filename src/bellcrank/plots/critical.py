"""Map of critical struts: what the loss of each strut of a design costs."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize

from bellcrank.model import require_plane
from bellcrank.plots import style
from bellcrank.plots.legend import (
    BAR,
    ROW_HEIGHT,
    add_colour_bar,
    add_legend,
    arrow_entry,
    strut_entry,
    support_entries,
)
from bellcrank.plots.marks import add_arrows, add_nodes, add_panel, add_struts, add_supports
from bellcrank.plots.motion import COLUMNS, MARGIN, MAX_HEIGHT, WIDTH, Drawing, drawing_frames
from bellcrank.plots.saving import check_target, save_figure
from bellcrank.plots.scene import Motion, input_arrows, output_arrows
from bellcrank.plots.stress import STRESS

if TYPE_CHECKING:
    import os
    from collections.abc import Mapping

    from bellcrank.model import Design

NEEDED = "#7b3294"
"""Colour of struts without which the full stroke is not reached."""
LABEL = 0.45
"""Height of the labels below the colour bar, inches."""


def draw_critical_struts(
    design: Design,
    losses: Mapping[int, float],
    path: str | os.PathLike[str],
    *,
    overwrite: bool = False,
) -> None:
    """Draw the struts of a design at rest, coloured by what the loss of each costs.

    Parameters
    ----------
    design
        Design in the plane.
    losses
        Part of the efficiency that the loss of a beam costs; infinite where the full stroke is
        not reached, above 1 where the motion is reversed.
    path
        Output file; the suffix png, svg or pdf selects the format.
    overwrite
        Whether an existing file is replaced.

    Raises
    ------
    InvalidSettings
        If the design is in space, or the suffix is unknown.
    OutputExists, StorageError
        If the file exists or cannot be written.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from bellcrank.model import human_design
    >>> with TemporaryDirectory() as folder:
    ...     draw_critical_struts(human_design("crane"), {100: 0.3}, f"{folder}/struts.png")
    """
    check_target(path, overwrite=overwrite)
    problem = design.problem
    require_plane(problem, "the map of critical struts")
    lost = [beam for beam, loss in losses.items() if math.isinf(loss)]
    known = np.array([beam for beam in losses if beam not in lost], dtype=np.int64)
    motion = Motion(design, np.zeros(problem.lattice.positions.shape))
    half = sum(0.5 < loss < math.inf for loss in losses.values())
    note = (
        f"of {len(losses)} struts, {len(lost)} are needed for the full stroke, {half} others for "
        "half of the efficiency"
    )
    drawing = Drawing(f"{problem.name}: without one strut", note, motion, displaced=False)
    ((low, high),) = drawing_frames([drawing])
    across, up = (high - low).tolist()
    scale = min((WIDTH - 2 * MARGIN) / across, MAX_HEIGHT / up)
    entries = [("full stroke not reached", strut_entry(NEEDED)), *support_entries([problem])]
    entries += [
        ("input", arrow_entry(style.INPUT)),
        ("output, wanted direction", arrow_entry(style.WANTED)),
    ]
    legend = ROW_HEIGHT * math.ceil(len(entries) / COLUMNS)
    bar_at = MARGIN + legend + LABEL
    below = bar_at + BAR + 0.2
    heading = style.heading_height(drawing.title, note)
    figure = style.new_figure(WIDTH, below + scale * up + heading + MARGIN + 0.12)
    style.add_heading(figure, drawing.title, note, MARGIN, MARGIN)
    panel = add_panel(figure, problem, (0.5 * (WIDTH - scale * across), below), scale, low, high)
    add_supports(panel)
    rest = problem.lattice.positions
    others = np.setdiff1d(np.flatnonzero(design.mask), list(losses))
    add_struts(panel, rest, others, style.GROUND, width=0.6, level=1.0)
    colours = ScalarMappable(Normalize(0.0, 1.0), STRESS)
    lines = LineCollection(
        list(rest[problem.lattice.beams[known]]), linewidths=panel.struts(known),
        capstyle="round", cmap=colours.cmap, norm=colours.norm, zorder=2.1,
    )  # fmt: skip
    lines.set_array(np.array([losses[beam] for beam in known.tolist()]))
    panel.axes.add_collection(lines, autolim=False)
    add_struts(panel, rest, np.array(lost, dtype=np.int64), NEEDED, level=2.2)
    add_nodes(panel, rest[problem.input.nodes], style.INPUT)
    for output in problem.outputs.values():
        add_nodes(panel, rest[output.nodes], style.OUTPUT)
    add_arrows(panel, input_arrows(problem), style.INPUT, bold=True)
    add_arrows(panel, output_arrows(problem, motion.moved), style.WANTED, bold=True)
    add_colour_bar(figure, colours, "part of the efficiency lost", bar_at)
    add_legend(figure, entries, MARGIN, COLUMNS)
    save_figure(figure, path, overwrite=overwrite)
