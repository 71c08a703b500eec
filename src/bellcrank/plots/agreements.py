"""Charts of changes that were foreseen against those that came."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.plots import style

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from numpy.typing import NDArray

SHADES = (style.BUILT, style.BEST, style.HUMAN)
"""Of measures that are drawn as points."""
SIGNS = (("Pearson", "o", style.INK), ("Spearman", "D", style.BEST), ("top 30", "|", style.HUMAN))


@dataclass(frozen=True, slots=True, eq=False)
class Measure:
    """A way of asking which flips matter, and how well it agrees with the exact one.

    Parameters
    ----------
    name
        What to call it.
    pearson, spearman, recall
        Correlations, and the fraction of the best flips that are among as many foreseen to be;
        nan where there is none.
    foreseen : (n,) or None
        Changes to be drawn as points; None if they are not.
    """

    name: str
    pearson: float
    spearman: float
    recall: float
    foreseen: NDArray[np.float64] | None = None


def ticks_up_to(largest: float, least: float) -> list[float]:
    """Return powers of ten on both sides of zero, from `least` to `largest`, at most 3 a side.

    Examples
    --------
    >>> ticks_up_to(2.0, 0.02)
    [-1.0, -0.1, 0.0, 0.1, 1.0]
    """
    top = math.floor(math.log10(largest))
    powers = [10.0**power for power in range(top - 2, top + 1) if 10.0**power >= least]
    return [*(-power for power in reversed(powers)), 0.0, *powers]


def add_scatter(
    axes: Axes,
    exact: NDArray[np.float64],
    measures: Sequence[Measure],
    largest: float,
    linear: float,
) -> None:
    """Draw a point for each flip and measure: right is what it changes, up what was foreseen.

    Parameters
    ----------
    exact : (n,)
    largest, linear
        Ends of the axes, and where they turn from linear to logarithmic.
    """
    reach = 1.25 * largest
    axes.plot([-reach, reach], [-reach, reach], color=style.IDLE, linewidth=1.0, zorder=1.0)
    drawn = [measure for measure in measures if measure.foreseen is not None]
    for measure, colour in zip(drawn, SHADES, strict=False):
        foreseen = np.clip(np.asarray(measure.foreseen), -1.1 * largest, 1.1 * largest)
        axes.plot(
            exact, foreseen, linestyle="none", marker="o", markersize=3.4, color=colour,
            markeredgecolor="white", markeredgewidth=0.3, alpha=0.85, label=measure.name,
        )  # fmt: skip
    for scale, limits, place in (
        (axes.set_xscale, axes.set_xlim, axes.set_xticks),
        (axes.set_yscale, axes.set_ylim, axes.set_yticks),
    ):
        scale("asinh", linear_width=linear)
        limits(-reach, reach)
        ticks = ticks_up_to(largest, linear)
        place(ticks, labels=[f"{tick:g}" for tick in ticks])
        place([], minor=True)
    style.label_axes(axes, "change by mechanics", "change foreseen", style.SMALL_SIZE)
    axes.legend(loc="lower right", **_legend_looks())
    style.style_axes(axes)


def add_agreement(axes: Axes, measures: Sequence[Measure]) -> None:
    """Draw a row for each measure, with a sign for each kind of agreement."""
    rows = np.arange(len(measures))[::-1]
    for name, sign, colour in SIGNS:
        attribute = {"Pearson": "pearson", "Spearman": "spearman", "top 30": "recall"}[name]
        values = [getattr(measure, attribute) for measure in measures]
        axes.plot(
            values, rows, linestyle="none", marker=sign, color=colour, label=name,
            markersize=9.0 if sign == "|" else 5.5, markeredgewidth=2.2 if sign == "|" else 0.4,
            markeredgecolor=colour if sign == "|" else "white",
        )  # fmt: skip
    least = np.nanmin([[each.pearson, each.spearman, 0.0] for each in measures])
    axes.set_xlim(min(0.0, float(least)) - 0.05, 1.05)
    axes.set_ylim(-0.6, len(measures) - 0.4)
    axes.axvline(0.0, color=style.IDLE, linewidth=1.0, zorder=0.5)
    style.label_axes(axes, "", "", style.SMALL_SIZE)
    style.style_axes(axes)
    axes.grid(axis="x", color=style.IDLE_REST, linewidth=0.8)
    axes.set_yticks(rows, labels=[measure.name for measure in measures])
    axes.tick_params(axis="y", length=0.0, labelcolor=style.INK)
    axes.legend(
        loc="upper center", bbox_to_anchor=(0.4, -0.09), ncols=3, columnspacing=0.9,
        **_legend_looks(),
    )  # fmt: skip


def _legend_looks() -> dict[str, Any]:
    return {
        "frameon": False,
        "prop": {"family": style.FONT, "size": style.SMALL_SIZE},
        "labelcolor": style.INK,
        "handletextpad": 0.1,
        "borderaxespad": 0.1,
    }
