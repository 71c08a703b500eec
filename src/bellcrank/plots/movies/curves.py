"""Graphs of a movie: curves with a marker that moves along them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.ticker import FuncFormatter, MaxNLocator

from bellcrank.plots import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D
    from numpy.typing import NDArray

    from bellcrank.plots.movies.records import Graph, Line

    Box = tuple[float, float, float, float]

LABEL_LEFT, LABEL_BELOW = 0.62, 0.46
"""Inches for labels and numbers beside and below a graph."""
HEADROOM = 0.08
SMALL = 0.05
"""Numbers below this are written in units of a power of ten."""
SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


class Curves:
    """The artists of one graph.

    Parameters
    ----------
    figure
        Figure to draw on.
    graph
        Content.
    box
        Left, bottom, width and height in inches, labels included.
    colours
        Colour of each line.
    legend
        Whether a legend is added.

    Attributes
    ----------
    artists
        Matplotlib artists that are redrawn for each state.
    """

    def __init__(
        self, figure: Figure, graph: Graph, box: Box, colours: tuple[str, ...], *, legend: bool
    ) -> None:
        width, height = figure.get_size_inches()
        left, bottom = box[0] + LABEL_LEFT, box[1] + LABEL_BELOW
        across, up = box[2] - LABEL_LEFT, box[3] - LABEL_BELOW
        axes = figure.add_axes((left / width, bottom / height, across / width, up / height))
        self._lines = graph.lines
        _style(axes, graph, up)
        self._grown: list[tuple[Line2D, Line2D]] = []
        for line, colour in zip(graph.lines, colours, strict=False):
            axes.plot(line.x, line.y, color=colour, linewidth=1.4, alpha=0.28)
            options: dict[str, Any] = {"color": colour, "clip_on": False, "animated": True}
            (grown,) = axes.plot(
                [], [], linewidth=1.9, solid_capstyle="round", label=line.label, **options
            )
            (dot,) = axes.plot(
                [], [], marker="o", markersize=6.5, markeredgecolor="white",
                markeredgewidth=1.0, **options,
            )  # fmt: skip
            self._grown.append((grown, dot))
        if legend:
            axes.legend(
                handles=[grown for grown, _ in self._grown],
                frameon=False,
                prop={"family": style.FONT, "size": style.SMALL_SIZE},
                labelcolor=style.INK,
            )
        self.artists: list[Line2D] = [one for both in self._grown for one in both]

    def update(self, state: int) -> None:
        """Update the curves and markers to a state."""
        for line, (grown, dot) in zip(self._lines, self._grown, strict=True):
            end = int(line.at[state]) + 1
            grown.set_data(line.x[:end], line.y[:end])
            dot.set_data(line.x[end - 1 : end], line.y[end - 1 : end])


def _style(axes: Axes, graph: Graph, height: float) -> None:
    """Set limits, labels and ticks."""
    x_limits = 0.0, 1.03 * max(float(line.x.max()) for line in graph.lines) or 1.0
    y_limits = _y_limits(graph.lines)
    for axis, text, limits in (
        (axes.xaxis, graph.x_label, x_limits),
        (axes.yaxis, graph.y_label, y_limits),
    ):
        unit = power_of_ten(max(map(abs, limits)))
        axis.set_label_text(
            text + unit_label(unit), family=style.FONT, size=style.SMALL_SIZE, color=style.INK
        )
        axis.set_major_formatter(FuncFormatter(lambda x, _position, u=unit: _number(x / u)))
    axes.xaxis.labelpad = 2.0
    axes.set_ylim(*y_limits)
    axes.yaxis.set_major_locator(MaxNLocator(max(2, min(5, int(height / 0.3)))))
    axes.xaxis.set_major_locator(MaxNLocator(5))
    axes.set_xlim(*x_limits)
    axes.yaxis.set_label_coords(-0.52 / axes.get_position().width / _figure_width(axes), 0.5)
    style.style_axes(axes)


def _figure_width(axes: Axes) -> float:
    """Return the width of the figure of axes, inches."""
    figure = axes.get_figure(root=True)
    assert figure is not None
    return float(figure.get_size_inches()[0])


def power_of_ten(largest: float) -> float:
    """Return a power of ten in which numbers up to `largest` have few digits.

    Examples
    --------
    >>> power_of_ten(0.4), power_of_ten(0.004), power_of_ten(20000.0)
    (1.0, 0.001, 1.0)
    """
    if not 0.0 < largest < SMALL:
        return 1.0
    return float(10.0 ** (3 * math.floor(math.log10(largest) / 3)))


def unit_label(unit: float) -> str:
    """Return the text that is appended to an axis label for a unit.

    Examples
    --------
    >>> unit_label(1e-6), unit_label(1.0)
    (' (10⁻⁶)', '')
    """
    power = str(round(math.log10(unit))).translate(SUPERSCRIPTS)
    return "" if unit == 1.0 else f" (10{power})"


def _number(x: float) -> str:
    """Format the number of a tick."""
    return f"{x:,.0f}".replace(",", "\u202f") if abs(x) >= 1000.0 else f"{x:.4g}"


def _y_limits(lines: tuple[Line, ...]) -> tuple[float, float]:
    """Return limits of the vertical axis that include all values and zero."""
    seen: NDArray[np.float64] = np.concatenate([line.y for line in lines])
    seen = seen[np.isfinite(seen)]
    low, high = min(0.0, seen.min(initial=0.0)), max(0.0, seen.max(initial=0.0))
    room = HEADROOM * (high - low) or 1.0
    return low - room * (low < 0.0), high + room
