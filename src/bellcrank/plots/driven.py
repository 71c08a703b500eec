"""What a network-driven search is worth: its designs in truth, as foretold, and how new they are.

Three panels, after figures 6 b and c of the paper: true efficiencies of designs made by networks
and by mechanics; what was predicted of the former against the truth; in how many beams they
differ from the nearest design of the dataset.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.ticker import MaxNLocator
from matplotlib.transforms import blended_transform_factory

from bellcrank.plots import style
from bellcrank.plots.saving import check_target, save_figure

if TYPE_CHECKING:
    import os

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

NETWORK = style.BEST
MECHANICS = style.INPUT
PANEL = 3.35
"""Inches of width and height of a panel."""
LEFT, RIGHT, GAP, BOTTOM, TOP = 0.78, 0.3, 0.95, 0.62, 0.42
"""Inches: around and between panels; TOP is for the panel's own heading."""
MARGIN = 0.28
MOST_BINS = 16


@dataclass(frozen=True, slots=True, eq=False)
class DrivenSearch:
    """Designs that networks made, one a chain, and those of the mechanics beside them.

    Parameters
    ----------
    title, note
        What stands over the picture.
    true : (n,) float64
        Efficiencies of the designs made by networks; nan for those that have none.
    predicted : (n,) float64
        What the networks say of the same.
    mechanics : (m,) float64
        Efficiencies of designs made by the mechanics; empty if there are none.
    distance : (n,) int64 or None
        In how many beams each differs from the nearest design of the dataset.
    exact
        Whether networks only screened, and the mechanics decided.
    """

    title: str
    note: str
    true: NDArray[np.float64]
    predicted: NDArray[np.float64]
    mechanics: NDArray[np.float64]
    distance: NDArray[np.int64] | None = None
    exact: bool = False


def draw_driven(
    search: DrivenSearch, path: str | os.PathLike[str], *, overwrite: bool = False
) -> None:
    """Draw what a network-driven search has made.

    Parameters
    ----------
    path
        Where to; the suffix png, svg or pdf chooses the format.

    Raises
    ------
    InvalidSettings
        If the suffix names no format.
    OutputExists, StorageError
        If there is such a file, or it cannot be written.
    """
    target = check_target(path, overwrite=overwrite)
    panels = 2 if search.distance is None else 3
    width = LEFT + panels * PANEL + (panels - 1) * GAP + RIGHT
    heading = style.heading_height(search.title, search.note) + MARGIN
    height = BOTTOM + PANEL + TOP + heading
    figure = style.new_figure(width, height)
    style.write_heading(figure, search.title, search.note, LEFT - 0.42, MARGIN)
    _put_efficiencies(_add_panel(figure, 0), search)
    _put_predictions(_add_panel(figure, 1), search)
    if search.distance is not None:
        _put_distances(_add_panel(figure, 2), search.distance)
    save_figure(figure, target, overwrite=overwrite)


def _add_panel(figure: Figure, number: int) -> Axes:
    width, height = figure.get_size_inches()
    left = LEFT + number * (PANEL + GAP)
    return figure.add_axes((left / width, BOTTOM / height, PANEL / width, PANEL / height))


def _put_efficiencies(axes: Axes, search: DrivenSearch) -> None:
    """Draw how efficiencies are spread, with a mark at each median."""
    groups = [
        (values, count, colour, name)
        for values, colour, name in (
            (search.mechanics, MECHANICS, "mechanics"),
            (search.true, NETWORK, "screened" if search.exact else "network"),
        )
        if (count := int(np.isfinite(values).sum()))
    ]
    edges = _edges(np.concatenate([search.mechanics, search.true]))
    for values, count, colour, _ in groups:
        sound = values[np.isfinite(values)]
        looks: dict[str, Any] = {"bins": edges, "weights": np.full(count, 100.0 / len(values))}
        axes.hist(sound, **looks, color=colour, alpha=0.16, zorder=2)
        axes.hist(sound, **looks, color=colour, histtype="step", linewidth=1.5, zorder=3)
    axes.set_xlim(edges[0], edges[-1])
    low, high = axes.get_ylim()
    axes.set_ylim(low, high * (1.08 + 0.12 * len(groups)))
    _dress(axes, "true efficiency", "designs, %", "Are they as good?")
    for place, (values, _, colour, name) in enumerate(reversed(groups)):
        middle = float(np.median(np.where(np.isfinite(values), values, -np.inf)))
        told = f"{name}, median {middle:.2f}" if np.isfinite(middle) else f"{name}, most fail"
        _put_key(axes, place, told, colour)
        if np.isfinite(middle):
            mixed = blended_transform_factory(axes.transData, axes.transAxes)
            axes.plot(
                [middle], [0.0], marker="^", markersize=8.0, color=colour, transform=mixed,
                markeredgecolor="white", markeredgewidth=0.9, clip_on=False, zorder=6,
            )  # fmt: skip


def _put_predictions(axes: Axes, search: DrivenSearch) -> None:
    """Draw what was predicted against what is true."""
    sound = np.isfinite(search.true)
    true, predicted = search.true[sound], search.predicted[sound]
    both = np.concatenate([true, predicted]) if len(true) else np.zeros(1)
    room = 0.06 * float(np.ptp(both)) or 1.0
    low, high = float(both.min()) - room, float(both.max()) + room
    axes.plot([low, high], [low, high], color=style.IDLE, linewidth=1.1, zorder=2)
    axes.scatter(
        true, predicted, s=22.0, color=NETWORK, alpha=0.65, linewidths=0.6, edgecolors="white",
        zorder=3,
    )  # fmt: skip
    axes.set_xlim(low, high)
    axes.set_ylim(low, high)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MaxNLocator(6))
    asked = "Does the network know them?" if search.exact else "Are they what was promised?"
    _dress(axes, "true efficiency", "predicted efficiency", asked)
    axes.grid(axis="x", color=style.IDLE_REST, linewidth=0.8)
    lines = []
    if len(true):
        above = float(np.median(predicted - true))
        way = "too high" if above > 0.0 else "too low"
        lines.append(f"predicted {abs(above):.2g} {way}, median")
    if failed := int((~sound).sum()):
        lines.append(f"{failed} without a unique response")
    # Searches go where networks are too hopeful: above the diagonal. Below it there is room.
    axes.text(
        0.965, 0.045, "\n".join(lines), transform=axes.transAxes, va="bottom", ha="right",
        size=style.SMALL_SIZE, color=style.INK, family=style.FONT, linespacing=1.6, zorder=6,
    )  # fmt: skip


def _put_distances(axes: Axes, distance: NDArray[np.int64]) -> None:
    """Draw how far from all designs of a dataset the made ones are."""
    middle = float(np.median(distance))
    edges = _edges(distance.astype(np.float64), whole=True)
    looks: dict[str, Any] = {"bins": edges, "weights": np.full(len(distance), 100 / len(distance))}
    axes.hist(distance, **looks, color=style.BUILT, alpha=0.22, zorder=2)
    axes.hist(distance, **looks, color=style.BUILT, histtype="step", linewidth=1.5, zorder=3)
    axes.set_xlim(0.0, edges[-1])
    low, high = axes.get_ylim()
    axes.set_ylim(low, high * 1.2)
    _dress(axes, "beams unlike the nearest design of the dataset", "designs, %", "Are they new?")
    _put_key(axes, 0, f"median {middle:.0f} beams", style.BUILT)


def _edges(values: NDArray[np.float64], *, whole: bool = False) -> NDArray[np.float64]:
    """Return the edges of bins, as many as the number of values bears, and an empty one around."""
    sound = values[np.isfinite(values)]
    low, high = (float(sound.min()), float(sound.max())) if len(sound) else (0.0, 1.0)
    bins = int(np.clip(1.6 * np.sqrt(max(len(sound), 1)), 5, MOST_BINS))
    step = max((high - low) / bins, 1e-3)
    if whole:
        step = max(float(np.ceil(step)), 1.0)
    first, last = np.floor(low / step) - 1.0, np.floor(high / step) + 2.0
    return step * np.arange(max(first, 0.0) if whole else first, last + 0.5)


def _put_key(axes: Axes, place: int, text: str, colour: str) -> None:
    """Write a line of the panel's key, in its upper left corner."""
    up = 0.95 - 0.068 * place
    axes.plot(
        [0.035, 0.095], [up, up], color=colour, linewidth=2.4, transform=axes.transAxes,
        solid_capstyle="round", zorder=6,
    )  # fmt: skip
    axes.text(
        0.125, up, text, transform=axes.transAxes, va="center", ha="left",
        size=style.SMALL_SIZE, color=style.INK, family=style.FONT, zorder=6, parse_math=False,
    )  # fmt: skip


def _dress(axes: Axes, across: str, up: str, heading: str) -> None:
    looks: dict[str, Any] = {"family": style.FONT, "color": style.INK}
    style.label(axes, across, up)
    axes.set_title(heading, size=style.LABEL_SIZE, weight="bold", loc="left", pad=9.0, **looks)
    style.quieten(axes)
