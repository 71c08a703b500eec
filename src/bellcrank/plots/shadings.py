"""Lattices in the colours of what flipping each beam changes, and maps of changes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import LinearSegmentedColormap, to_rgba

from bellcrank.plots import style
from bellcrank.plots.agreements import ticks_up_to
from bellcrank.plots.marks import Panel, add_struts, add_supports

if TYPE_CHECKING:
    from matplotlib.colors import Normalize
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

CHANGE = LinearSegmentedColormap.from_list(
    "change", ["#5e2000", "#d55e00", "#f2b988", "#e3e6e9", "#86bde0", "#0072b2", "#012c48"]
)
"""Orange where efficiency is lost, blue where it is gained, grey where nothing happens."""
HIDDEN = LinearSegmentedColormap.from_list(
    "hidden", ["#5e2000", "#d55e00", "#f2b988", "#fafbfc", "#86bde0", "#0072b2", "#012c48"]
)
"""The same on paper: white where nothing happens."""
UNKNOWN = "#cc79a7"
"""Of beams whose flip leaves no unique response."""
REGIONS = (
    ("removal destroys", "#e07b3a"),
    ("removal costs", "#f8d3b4"),
    ("does not matter", ""),
    ("removal helps", "#9fcdeb"),
    ("removal unstable", "#dfa8c6"),
)
"""Names and colours, in the order of the numbers of regions."""
HALO = 3.6
"""Width of a region around its beams, in widths of a strut."""
BAR = 0.11
"""Inches that the colour bar is high."""


@dataclass(frozen=True, slots=True, eq=False)
class Shading:
    """A number for each designable beam, and the words over it.

    Parameters
    ----------
    values : (n,)
        Changes of the efficiency, or numbers of `REGIONS`.
    """

    title: str
    note: str
    values: NDArray[np.float64] | NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class HeatMap:
    """Changes of the efficiency over the plane, and the words over them.

    Parameters
    ----------
    values : (rows, columns)
        The uppermost row first.
    low, high : (2,)
        Lower left and upper right corner, lattice units.
    """

    title: str
    note: str
    values: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]


def add_change(
    panel: Panel,
    mask: NDArray[np.bool_],
    beams: NDArray[np.int64],
    shading: Shading,
    norm: Normalize,
) -> None:
    """Draw beams in the colours of what their flip changes: thin ones are absent."""
    _put_rest(panel, mask, beams, style.REST)
    lattice = panel.problem.lattice
    paint = CHANGE(norm(np.nan_to_num(shading.values)))
    paint[~np.isfinite(shading.values)] = to_rgba(UNKNOWN)
    order = np.argsort(np.abs(np.nan_to_num(shading.values, nan=np.inf)), kind="stable")
    for there, width, level in ((False, 0.42, 2.0), (True, 1.35, 3.0)):
        chosen = order[mask[beams[order]] == there]
        panel.axes.add_collection(
            LineCollection(
                list(lattice.positions[lattice.beams[beams[chosen]]]),
                colors=paint[chosen],
                linewidths=width * panel.strut,
                capstyle="round",
                zorder=level,
            ),
            autolim=False,
        )


def _put_rest(panel: Panel, mask: NDArray[np.bool_], beams: NDArray[np.int64], colour: str) -> None:
    """Draw the ground, and beams that are not designable."""
    problem = panel.problem
    add_supports(panel)
    held = np.isin(problem.lattice.beams, problem.supports.fixed).all(axis=1)
    kept = mask & ~held
    kept[beams] = False
    rest = problem.lattice.positions
    add_struts(panel, rest, np.flatnonzero(mask & held), style.GROUND, width=0.6, level=1.0)
    add_struts(panel, rest, np.flatnonzero(kept), colour, width=0.9, level=1.5)


def add_regions(
    panel: Panel, mask: NDArray[np.bool_], beams: NDArray[np.int64], shading: Shading
) -> None:
    """Draw the design, and around its beams the regions that they belong to."""
    rest, there = panel.problem.lattice.positions, mask[beams]
    _put_rest(panel, mask, beams, style.IDLE)
    for number, (_, colour) in enumerate(REGIONS):
        chosen = beams[there & (shading.values == number)]
        if colour:  # what matters most lies on top where regions meet
            add_struts(panel, rest, chosen, colour, width=HALO, level=0.9 - 0.05 * number)
    add_struts(panel, rest, beams[there], style.INK, width=0.75, level=3.0)


def add_map(panel: Panel, mask: NDArray[np.bool_], heat: HeatMap, norm: Normalize) -> None:
    """Draw a map of changes, and the design over it."""
    window = panel.axes.axis()
    panel.axes.imshow(
        heat.values, cmap=HIDDEN, norm=norm, interpolation="bilinear",
        extent=(heat.low[0], heat.high[0], heat.low[1], heat.high[1]), zorder=0.2,
    )  # fmt: skip
    panel.axes.set_aspect("auto")
    panel.axes.axis(window)
    rest = panel.problem.lattice.positions
    present = np.flatnonzero(mask)
    add_struts(panel, rest, present, style.INK, width=0.4, level=3.0)


def add_bar(figure: Figure, norm: Normalize, largest: float, linear: float, bottom: float) -> None:
    """Draw the colour bar of all changes, `bottom` inches above the lower edge."""
    up = float(figure.get_size_inches()[1])
    axes = figure.add_axes((0.25, bottom / up, 0.5, BAR / up))
    colours = ScalarMappable(norm, CHANGE)
    bar = figure.colorbar(colours, cax=axes, orientation="horizontal", extend="both")
    bar.set_label(
        "change of the efficiency by flipping a beam (thick: there, thin: absent), "
        "or by hiding a part of the picture",
        family=style.FONT, size=style.SMALL_SIZE, color=style.INK,
    )  # fmt: skip
    ticks = ticks_up_to(largest, linear)
    bar.set_ticks(ticks, labels=[f"{tick:g}" for tick in ticks])
    bar.minorticks_off()
    bar.outline.set_visible(False)
    axes.tick_params(labelsize=style.SMALL_SIZE, colors=style.NOTE, labelfontfamily=style.FONT)
