"""Picture of an attribution: flips and regions by mechanics and by the network, occlusion maps."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import AsinhNorm, LinearSegmentedColormap, to_rgba

from bellcrank.plots import style
from bellcrank.plots.legend import ROW_HEIGHT, add_legend, strut_entry, support_entries
from bellcrank.plots.marks import Panel, add_arrows, add_panel, add_struts, add_supports
from bellcrank.plots.motion import MARGIN, WIDE
from bellcrank.plots.saving import check_target, save_figure
from bellcrank.plots.scene import extent, input_arrows, outline_around, output_arrows, spacing
from reproduction.networks.attribution import Region, overlap_of_regions

if TYPE_CHECKING:
    import os
    from collections.abc import Callable

    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from reproduction.networks.attribution import Attribution

GAP, TITLE, BAR_ROOM = 0.3, 0.52, 0.72
"""Inches between columns, above a panel for its heading, and below the panels for the bar."""
LINEAR = 0.01
"""Share of the largest change below which colours are linear, above it logarithmic."""
CHANGE = LinearSegmentedColormap.from_list(
    "change", ["#5e2000", "#d55e00", "#f2b988", "#e3e6e9", "#86bde0", "#0072b2", "#012c48"]
)
"""Orange for lower, blue for higher efficiency."""
UNSTABLE = "#cc79a7"
"""Colour of flips without a unique response."""
REGIONS = {
    Region.VITAL: ("removal destroys the function", "#e07b3a"),
    Region.USEFUL: ("removal lowers the efficiency", "#f8d3b4"),
    Region.ADVERSE: ("removal raises the efficiency", "#9fcdeb"),
    Region.UNSTABLE: ("removal is unstable", "#dfa8c6"),
}
"""Label and colour of regions."""
HALO = 3.6
"""Width of a region around its beams in strut widths."""


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
    """Lay out two rows of panels: changes above, regions below, maps on the right."""
    problem = found.design.problem
    largest = _largest(found)
    norm = AsinhNorm(linear_width=LINEAR * largest, vmin=-largest, vmax=largest)
    rows = _panels(found, norm)
    low, high = _window(found)
    scale = float((WIDE - 2 * MARGIN - 2 * GAP) / 3.0 / (high - low)[0])
    scale = min(scale, float(4.2 / (high - low)[1]))
    width, height = (scale * (high - low)).tolist()
    title = f"{problem.name}: attribution by {found.architecture} and by mechanics"
    note = (
        f"efficiency {found.efficiency:.3f} by mechanics, {found.predicted:.3f} predicted · "
        f"{found.design.beam_count} beams · {len(found.beams)} flips"
    )
    below = MARGIN + ROW_HEIGHT + 0.15 + BAR_ROOM
    top = style.heading_height(title, note) + 0.2 + MARGIN
    total = below + len(rows) * (height + TITLE) + 0.2 + top
    figure = style.new_figure(WIDE, total)
    count = len(rows[0])
    left = 0.5 * (WIDE - count * width - (count - 1) * GAP)
    style.add_heading(figure, title, note, left, MARGIN)
    for number, row in enumerate(reversed(rows)):
        bottom = below + number * (height + TITLE + 0.2)
        for column, (heading, caption, draw) in enumerate(row):
            corner = (left + column * (width + GAP), bottom)
            style.add_heading(
                figure, heading, caption, corner[0], total - bottom - height - TITLE + 0.02
            )
            panel = add_panel(figure, problem, corner, scale, low, high)
            add_arrows(panel, input_arrows(problem), style.INPUT, bold=True)
            wanted = output_arrows(problem, problem.lattice.positions)
            add_arrows(panel, wanted, style.WANTED, bold=True)
            draw(panel)
    _add_bar(figure, norm, largest, below - 0.32)
    entries = _entries(found)
    add_legend(figure, entries, MARGIN, len(entries))
    return figure


def _panels(
    found: Attribution, norm: AsinhNorm
) -> list[list[tuple[str, str, Callable[[Panel], None]]]]:
    """Return heading, caption and drawing of each panel, row by row."""
    exact, network = found.regions()
    overlap = overlap_of_regions(exact[found.present], network[found.present])["vital"]
    shared = "" if overlap is None else f"{100 * overlap:.0f} % of the vital beams shared"
    rho = found.correlations()["network"]["all"].spearman
    first: list[tuple[str, str, Callable[[Panel], None]]] = [
        ("Flips, by mechanics", "exact change", lambda p: _add_change(p, found, found.exact, norm)),
        (
            "Flips, by the network",
            f"predicted change, rank correlation {rho:.2f}",
            lambda p: _add_change(p, found, found.network, norm),
        ),
    ]
    second: list[tuple[str, str, Callable[[Panel], None]]] = [
        ("Regions, by mechanics", "present beams", lambda p: _add_regions(p, found, exact)),
        ("Regions, by the network", shared, lambda p: _add_regions(p, found, network)),
    ]
    if (seen := found.occlusion) is not None:
        size = f"{seen.block.size} x {seen.block.size} pixels"
        first.append(
            ("White block", f"{size}, covers beams", lambda p: _add_map(p, found, seen.white, norm))
        )
        second.append(
            ("Black block", f"{size}, covers gaps", lambda p: _add_map(p, found, seen.black, norm))
        )
    return [first, second]


def _largest(found: Attribution) -> float:
    """Return the change with the darkest colour."""
    drawn = [found.exact, found.network]
    if found.occlusion is not None:
        drawn += [found.occlusion.white, found.occlusion.black]
    sizes = [np.abs(values[np.isfinite(values)]) for values in drawn]
    return max([float(np.quantile(each, 0.998)) for each in sizes if each.size] or [0.0]) or 1.0


def _window(found: Attribution) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the corners of the part of the plane that is drawn."""
    problem = found.design.problem
    places = [problem.lattice.positions]
    if len(problem.supports.nodes):
        held = problem.lattice.positions[problem.supports.nodes]
        places.append(outline_around(held, 0.35 * spacing(problem)))
    arrows = [*input_arrows(problem), *output_arrows(problem, problem.lattice.positions)]
    low, high = extent(places, arrows, 0.2 * spacing(problem))
    return np.asarray(low), np.asarray(high)


def _add_change(
    panel: Panel, found: Attribution, values: NDArray[np.float64], norm: AsinhNorm
) -> None:
    """Draw beams in the colours of their changes; absent beams are thin."""
    _add_fixed(panel, found, style.REST)
    lattice = panel.problem.lattice
    paint = CHANGE(norm(np.nan_to_num(values)))
    paint[~np.isfinite(values)] = to_rgba(UNSTABLE)
    order = np.argsort(np.abs(np.nan_to_num(values, nan=np.inf)), kind="stable")
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


def _add_regions(panel: Panel, found: Attribution, regions: NDArray[np.int64]) -> None:
    """Draw present beams, and the regions around them."""
    rest = panel.problem.lattice.positions
    _add_fixed(panel, found, style.IDLE)
    for number, (region, (_, colour)) in enumerate(REGIONS.items()):
        chosen = found.beams[found.present & (regions == region)]
        add_struts(panel, rest, chosen, colour, width=HALO, level=0.9 - 0.05 * number)
    add_struts(panel, rest, found.beams[found.present], style.INK, width=0.75, level=3.0)


def _add_map(
    panel: Panel, found: Attribution, values: NDArray[np.float64], norm: AsinhNorm
) -> None:
    """Draw an occlusion map, and the design over it."""
    seen = found.occlusion
    if seen is None:
        return
    window = panel.axes.axis()
    panel.axes.imshow(
        values, cmap=CHANGE, norm=norm, interpolation="bilinear",
        extent=(seen.low[0], seen.high[0], seen.low[1], seen.high[1]), zorder=0.2,
    )  # fmt: skip
    panel.axes.set_aspect("auto")
    panel.axes.axis(window)
    rest, present = panel.problem.lattice.positions, np.flatnonzero(found.design.mask)
    add_struts(panel, rest, present, style.INK, width=0.4, level=3.0)


def _add_fixed(panel: Panel, found: Attribution, colour: str) -> None:
    """Draw the supports, and the beams that are not designable."""
    problem, mask = panel.problem, found.design.mask
    add_supports(panel)
    held = np.isin(problem.lattice.beams, problem.supports.fixed).all(axis=1)
    kept = mask & ~held
    kept[found.beams] = False
    rest = problem.lattice.positions
    add_struts(panel, rest, np.flatnonzero(mask & held), style.GROUND, width=0.6, level=1.0)
    add_struts(panel, rest, np.flatnonzero(kept), colour, width=0.9, level=1.5)


def _add_bar(figure: Figure, norm: AsinhNorm, largest: float, bottom: float) -> None:
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
    ticks = symmetric_ticks(largest, LINEAR * largest)
    bar.set_ticks(ticks, labels=[f"{tick:g}" for tick in ticks])
    bar.minorticks_off()
    bar.outline.set_visible(False)
    axes.tick_params(labelsize=style.SMALL_SIZE, colors=style.NOTE, labelfontfamily=style.FONT)


def symmetric_ticks(largest: float, least: float) -> list[float]:
    """Return powers of ten on both sides of zero, from `least` to `largest`, at most 3 a side.

    Examples
    --------
    >>> symmetric_ticks(2.0, 0.02)
    [-1.0, -0.1, 0.0, 0.1, 1.0]
    """
    top = int(np.floor(np.log10(largest)))
    powers = [10.0**power for power in range(top - 2, top + 1) if 10.0**power >= least]
    return [*(-power for power in reversed(powers)), 0.0, *powers]


def _entries(found: Attribution) -> list[tuple[str, Any]]:
    """Return the legend entries of the regions and marks that are drawn."""
    drawn = {int(each) for regions in found.regions() for each in regions[found.present]}
    entries: list[tuple[str, Any]] = [
        (label, strut_entry(colour, 7.0))
        for region, (label, colour) in REGIONS.items()
        if region in drawn
    ]
    if not np.isfinite(found.exact).all():
        entries.append(("flip without a unique response", strut_entry(UNSTABLE)))
    return entries + support_entries([found.design.problem])
