"""Picture of an attribution: exact effect of each beam, and both occlusion maps."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import AsinhNorm, LinearSegmentedColormap, to_rgba

from bellcrank.plots import style
from bellcrank.plots.marks import Panel, add_arrows, add_panel, add_struts, add_supports
from bellcrank.plots.motion import MARGIN, WIDE, Drawing, drawing_frames
from bellcrank.plots.saving import check_target, save_figure
from bellcrank.plots.scene import Motion, input_arrows, output_arrows

if TYPE_CHECKING:
    import os

    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from reproduction.networks.attribution import Attribution

GAP, TITLE, BAR_ROOM = 0.3, 0.52, 0.72
"""Inches between panels, above a panel for its heading, and below the panels for the bar."""
LINEAR = 0.01
"""Share of the largest change below which colours are linear, above it logarithmic."""
CHANGE = LinearSegmentedColormap.from_list(
    "change", ["#5e2000", "#d55e00", "#f2b988", "#e3e6e9", "#86bde0", "#0072b2", "#012c48"]
)
"""Orange for lower, blue for higher efficiency."""
UNSTABLE = "#cc79a7"
"""Colour (pink) of flips without a unique response."""


def draw_attribution(
    found: Attribution, path: str | os.PathLike[str], *, overwrite: bool = False
) -> None:
    """Draw an attribution.

    Parameters
    ----------
    path
        File; the suffix png, svg or pdf determines the format.
    overwrite
        Whether to replace an existing file.

    Raises
    ------
    InvalidSettings
        If the suffix is unknown.
    OutputExists, StorageError
    """
    check_target(path, overwrite=overwrite)
    save_figure(_figure(found), path, overwrite=overwrite)


def _figure(found: Attribution) -> Figure:
    """Lay out the three panels in a row above the colour bar."""
    problem, rho = found.design.problem, found.correlations()
    exact = found.changes["exact"]
    drawn = [exact[np.isfinite(exact)], *found.maps.values()]
    largest = max((float(np.quantile(np.abs(x), 0.998)) for x in drawn if x.size), default=0.0)
    largest = largest or 1.0
    norm = AsinhNorm(linear_width=LINEAR * largest, vmin=-largest, vmax=largest)
    at_rest = Motion(found.design, np.zeros((problem.lattice.node_count, 2)))
    ((low, high),) = drawing_frames([Drawing("", "", at_rest, displaced=False)])
    scale = min((WIDE - 2 * MARGIN - 2 * GAP) / 3.0 / (high - low)[0], 4.2 / (high - low)[1])
    width, height = (scale * (high - low)).tolist()
    title = f"{problem.name}: effect of beams by mechanics and by {found.architecture}"
    note = f"efficiency {found.efficiency:.3f} by mechanics, {found.predicted:.3f} predicted"
    below = MARGIN + BAR_ROOM
    total = below + height + TITLE + style.heading_height(title, note) + 0.4 + MARGIN
    figure = style.new_figure(WIDE, total)
    left = 0.5 * (WIDE - 3 * width - 2 * GAP)
    style.add_heading(figure, title, note, left, MARGIN)
    headings = (
        ("Flips, by mechanics", "exact change (pink: no unique response)"),
        ("White block", f"covers beams, rank correlation {rho['white']:.2f}"),
        ("Black block", f"covers gaps, rank correlation {rho['black']:.2f}"),
    )
    for (heading, caption), values in zip(
        headings, (None, found.maps["white"], found.maps["black"]), strict=True
    ):
        style.add_heading(figure, heading, caption, left, total - below - height - TITLE + 0.02)
        panel = add_panel(figure, problem, (left, below), float(scale), low, high)
        add_arrows(panel, input_arrows(problem), style.INPUT, bold=True)
        wanted = output_arrows(problem, problem.lattice.positions)
        add_arrows(panel, wanted, style.WANTED, bold=True)
        if values is None:
            _add_change(panel, found, norm)
        else:
            _add_map(panel, found, values, norm)
        left += width + GAP
    _add_bar(figure, norm, below - 0.32)
    return figure


def _add_change(panel: Panel, found: Attribution, norm: AsinhNorm) -> None:
    """Draw beams in the colours of their changes; absent beams are thin."""
    add_supports(panel)
    lattice, fixed = panel.problem.lattice, found.design.mask.copy()
    fixed[found.beams] = False
    add_struts(panel, lattice.positions, np.flatnonzero(fixed), style.REST, width=0.6, level=1.0)
    exact = found.changes["exact"]
    paint = CHANGE(norm(np.nan_to_num(exact)))
    paint[~np.isfinite(exact)] = to_rgba(UNSTABLE)
    order = np.argsort(np.abs(np.nan_to_num(exact, nan=np.inf)), kind="stable")
    for present, width, level in ((False, 0.42, 2.0), (True, 1.35, 3.0)):
        chosen = order[found.present[order] == present]
        lines = list(lattice.positions[lattice.beams[found.beams[chosen]]])
        panel.axes.add_collection(
            LineCollection(
                lines, colors=paint[chosen], linewidths=width * panel.strut, capstyle="round",
                zorder=level,
            ),
            autolim=False,
        )  # fmt: skip


def _add_map(
    panel: Panel, found: Attribution, values: NDArray[np.float64], norm: AsinhNorm
) -> None:
    """Draw an occlusion map, and the design over it."""
    window = panel.axes.axis()
    panel.axes.imshow(
        values, cmap=CHANGE, norm=norm, interpolation="bilinear",
        extent=(found.low[0], found.high[0], found.low[1], found.high[1]), zorder=0.2,
    )  # fmt: skip
    panel.axes.set_aspect("auto")
    panel.axes.axis(window)
    rest, present = panel.problem.lattice.positions, np.flatnonzero(found.design.mask)
    add_struts(panel, rest, present, style.INK, width=0.4, level=3.0)


def _add_bar(figure: Figure, norm: AsinhNorm, bottom: float) -> None:
    """Draw the colour bar, `bottom` inches above the lower edge."""
    up = float(figure.get_size_inches()[1])
    axes = figure.add_axes((0.25, bottom / up, 0.5, 0.11 / up))
    bar = figure.colorbar(
        ScalarMappable(norm, CHANGE), cax=axes, orientation="horizontal", extend="both"
    )
    bar.set_label(
        "change of efficiency by the flip of a beam (thick: present, thin: absent) or by a block",
        family=style.FONT, size=style.SMALL_SIZE, color=style.INK,
    )  # fmt: skip
    ticks = [factor * float(norm.vmax or 1.0) for factor in (-1.0, -0.1, 0.0, 0.1, 1.0)]
    bar.set_ticks(ticks, labels=[f"{tick:.2g}" for tick in ticks])
    bar.minorticks_off()
    bar.outline.set_visible(False)
    axes.tick_params(labelsize=style.SMALL_SIZE, colors=style.NOTE, labelfontfamily=style.FONT)
