"""How well a network has learnt: predicted against actual, and accuracy along the training."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.plots import style
from bellcrank.plots.saving import check_target, save_figure

if TYPE_CHECKING:
    import os

    from matplotlib.axes import Axes
    from numpy.typing import NDArray

BINS = 120
SIZE = (9.8, 4.9)
"""Of the figure, in inches."""
LEFT = 0.95
"""Inches left of it: for numbers with three decimals too."""


@dataclass(frozen=True, slots=True, eq=False)
class Learnt:
    """What a network made of designs that it had not seen.

    Parameters
    ----------
    name
        Of the network and its problem.
    note
        In a line: what it was trained with.
    predicted, actual : (n,) float64
        Efficiencies of held-out designs.
    r_squared, determination
        Of all that was held out.
    designs : (e,)
        Seen after each epoch.
    accuracy : (e,)
        R squared on held-out designs after each epoch.
    """

    name: str
    note: str
    predicted: NDArray[np.float64]
    actual: NDArray[np.float64]
    r_squared: float
    determination: float
    designs: NDArray[np.float64]
    accuracy: NDArray[np.float64]


def draw_learnt(learnt: Learnt, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Draw predicted against actual efficiencies, and the accuracy along the training.

    Parameters
    ----------
    path
        Where to; the suffix png, svg or pdf chooses the format.

    Raises
    ------
    InvalidSettings, OutputExists, StorageError
        As `save_figure`.
    """
    target = check_target(path, overwrite=overwrite)
    width, height = SIZE
    figure = style.new_figure(width, height)
    style.write_heading(figure, learnt.name, learnt.note, LEFT, 0.25)
    top = height - 0.95
    side = top - 0.6
    scatter = figure.add_axes((LEFT / width, 0.6 / height, side / width, side / height))
    left = LEFT + side + 1.15
    curve = figure.add_axes(
        (left / width, 0.6 / height, (width - left - 0.3) / width, side / height)
    )
    _draw_density(scatter, learnt)
    _draw_curve(curve, learnt)
    save_figure(figure, target, overwrite=overwrite)


def _draw_density(axes: Axes, learnt: Learnt) -> None:
    """Draw how many designs lie where, on a logarithmic scale, and the diagonal."""
    from matplotlib.colors import LinearSegmentedColormap, LogNorm

    both = np.concatenate([learnt.actual, learnt.predicted])
    low, high = float(both.min()), float(both.max())
    room = 0.03 * (high - low)
    extent = (low - room, high + room)
    count, _, _ = np.histogram2d(learnt.actual, learnt.predicted, bins=BINS, range=(extent, extent))
    colours = LinearSegmentedColormap.from_list("count", ["#d6e6f2", style.BEST, "#0b2239"])
    picture: Any = np.ma.masked_less(count.T, 1.0)
    axes.imshow(
        picture, origin="lower", extent=(*extent, *extent), cmap=colours,
        norm=LogNorm(1.0, max(float(count.max()), 2.0)), interpolation="nearest", aspect="equal",
        zorder=2,
    )  # fmt: skip
    axes.plot(extent, extent, color=style.INPUT, linewidth=1.0, zorder=3)
    style.quieten(axes)
    axes.grid(axis="x", color=style.IDLE_REST, linewidth=0.8)
    style.label(axes, "efficiency by the mechanics", "efficiency predicted")
    axes.text(
        0.04, 0.96,
        f"R² {learnt.r_squared:.4f}\ndetermination {learnt.determination:.4f}",
        transform=axes.transAxes, va="top", ha="left", size=style.SMALL_SIZE, color=style.INK,
        family=style.FONT, linespacing=1.5,
    )  # fmt: skip


def _draw_curve(axes: Axes, learnt: Learnt) -> None:
    """Draw the accuracy after each epoch; near 1, what is missing is what matters."""
    known = np.isfinite(learnt.accuracy)
    style.label(axes, "designs seen", "R² on held-out runs")
    style.quieten(axes)
    if not known.any():  # a network that says the same of all designs
        return
    missing = np.maximum(1.0 - learnt.accuracy[known], 1e-6)
    axes.plot(learnt.designs[known], missing, "o-", color=style.BEST, markersize=4.0, linewidth=1.6)
    axes.set_yscale("log")
    levels = [
        level for level in _LEVELS if missing.min() * 0.6 <= 1.0 - level <= missing.max() * 1.6
    ]
    axes.set_yticks([1.0 - level for level in levels], [f"{level:g}" for level in levels])
    axes.yaxis.set_minor_locator(_nothing())
    axes.set_ylim(max(missing.max() * 1.3, 1e-5), missing.min() * 0.75)
    axes.set_xlim(0.0, float(learnt.designs.max()) * 1.04)
    axes.xaxis.set_major_formatter(lambda value, _: _short(value))


_LEVELS = (0.0, 0.5, 0.7, 0.8, 0.85, 0.9, 0.93, 0.95, 0.96, 0.97, 0.98, 0.985, 0.99, 0.995, 0.998)


def _nothing() -> Any:
    from matplotlib.ticker import NullLocator

    return NullLocator()


def _short(value: float) -> str:
    """Write a count as people do.

    Examples
    --------
    >>> _short(0.0), _short(250_000.0), _short(1.5e6)
    ('0', '250k', '1.5M')
    """
    if value >= 1e6:
        return f"{value / 1e6:g}M"
    return f"{value / 1e3:g}k" if value >= 1e3 else f"{value:g}"
