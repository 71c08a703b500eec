"""Charts in the common style: curves, points, bars, histograms, densities."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from matplotlib.ticker import FuncFormatter, MaxNLocator, NullFormatter, NullLocator

from bellcrank.plots import style

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from numpy.typing import NDArray

Kind = Literal["line", "steps", "points", "both", "bars", "histogram"]
LEGEND_ROW = 0.11
"""Height of a legend row above histograms, as a fraction of the highest bar."""


@dataclass(frozen=True, slots=True, eq=False)
class Series:
    """A data series.

    Parameters
    ----------
    x, y : (n,) float64
        Coordinates. For a histogram, `x` are the (b + 1,) bin edges and `y` the values.
    name
        Legend entry; none if empty.
    kind
        Type of drawing.
    colour
        Colour in a form that matplotlib accepts.
    low, high : (n,) float64 or None
        Limits of a band around a curve, or of error bars.
    dashed
        Whether the curve is dashed.
    width
        Line width in points; for bars, width in units of `x`.
    level
        Drawing order; higher levels cover lower ones.
    labels
        Text above bars or beside points.
    """

    x: NDArray[np.float64]
    y: NDArray[np.float64]
    name: str = ""
    kind: Kind = "line"
    colour: str = style.BEST
    low: NDArray[np.float64] | None = None
    high: NDArray[np.float64] | None = None
    dashed: bool = False
    width: float = 1.6
    level: float = 3.0
    labels: Sequence[str] = ()


@dataclass(frozen=True, slots=True)
class Level:
    """A horizontal or vertical reference line.

    Parameters
    ----------
    value
        Coordinate.
    name
        Legend entry.
    colour
        Colour in a form that matplotlib accepts.
    vertical
        Whether the line is vertical.
    """

    value: float
    name: str = ""
    colour: str = style.HUMAN
    vertical: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Density:
    """Numbers of points in the cells of a square grid.

    Parameters
    ----------
    count : (b, b)
        First index along y, second along x.
    low, high
        Limits of both axes.
    """

    count: NDArray[np.float64]
    low: float
    high: float


@dataclass(frozen=True, slots=True, eq=False)
class Chart:
    """The content of one pair of axes.

    Parameters
    ----------
    title
        Title.
    x_label, y_label
        Axis labels.
    series, levels
        Data series and reference lines.
    log_x, log_y
        Whether the axes are logarithmic.
    limits_x, limits_y
        Limits of the axes; None for automatic limits.
    names
        Tick labels at x = 0, 1, 2, ...
    density
        Density below all other elements.
    legend
        Location of the legend as in matplotlib; None for no legend.
    note
        Lines of text in the upper left corner.
    """

    title: str
    x_label: str
    y_label: str
    series: Sequence[Series] = ()
    levels: Sequence[Level] = ()
    log_x: bool = False
    log_y: bool = False
    limits_x: tuple[float | None, float | None] = (None, None)
    limits_y: tuple[float | None, float | None] = (None, None)
    names: Sequence[str] = ()
    density: Density | None = None
    legend: str | None = "best"
    note: Sequence[str] = field(default=())


def add_chart(axes: Axes, chart: Chart) -> None:
    """Draw a chart on axes."""
    if chart.log_x:
        axes.set_xscale("log")
    if chart.log_y:
        axes.set_yscale("log")
    if chart.density is not None:
        _add_density(axes, chart.density)
    for series in chart.series:
        _DRAWERS[series.kind](axes, series)
    for level in chart.levels:
        draw = axes.axvline if level.vertical else axes.axhline
        draw(
            level.value, color=level.colour, linewidth=1.5, linestyle=(0, (5, 2.5)),
            label=level.name or None, zorder=4,
        )  # fmt: skip
    axes.set_xlim(*chart.limits_x)
    axes.set_ylim(*chart.limits_y)
    if chart.legend is not None and any(each.kind == "histogram" for each in chart.series):
        axes.set_ylim(0.0, axes.get_ylim()[1] * (1.0 + LEGEND_ROW * _legend_rows(chart)))
    _finish(axes, chart)


def _legend_rows(chart: Chart) -> int:
    """Return the number of legend entries."""
    names = [each.name for each in chart.series] + [each.name for each in chart.levels]
    return sum(map(bool, names))


def _add_line(axes: Axes, series: Series) -> None:
    options: dict[str, Any] = {"color": series.colour, "zorder": series.level}
    if series.low is not None and series.high is not None:
        axes.fill_between(
            series.x, series.low, series.high, color=series.colour, alpha=0.18, linewidth=0,
            zorder=series.level - 0.5,
        )  # fmt: skip
    if series.kind == "both":
        options |= {"marker": "o", "markersize": 4.2, "markeredgecolor": "white"}
        options |= {"markeredgewidth": 0.6}
    axes.plot(
        series.x, series.y, linewidth=series.width, label=series.name or None,
        linestyle=(0, (4, 2)) if series.dashed else "-",
        drawstyle="steps-post" if series.kind == "steps" else "default",
        solid_joinstyle="round", **options,
    )  # fmt: skip


def _add_points(axes: Axes, series: Series) -> None:
    if series.low is not None and series.high is not None:
        reach = np.abs(np.array([series.y - series.low, series.high - series.y]))
        axes.errorbar(
            series.x, series.y, yerr=reach, fmt="none", ecolor=series.colour, elinewidth=1.3,
            alpha=0.55, zorder=series.level - 0.1,
        )  # fmt: skip
    axes.plot(
        series.x, series.y, linestyle="none", marker="o", markersize=3.4 * series.width,
        color=series.colour, markeredgecolor="white", markeredgewidth=0.5,
        label=series.name or None, zorder=series.level, clip_on=False,
    )  # fmt: skip
    for x, y, text in zip(series.x, series.y, series.labels, strict=False):
        _annotate(axes, text, (float(x), float(y)), offset=(6.0, 0.0), ha="left", va="center")


def _add_bars(axes: Axes, series: Series) -> None:
    axes.bar(
        series.x, series.y, width=series.width, color=series.colour, label=series.name or None,
        zorder=series.level, linewidth=0,
    )  # fmt: skip
    for x, y, text in zip(series.x, series.y, series.labels, strict=False):
        up = float(y) if np.isfinite(y) else 0.0
        _annotate(axes, text, (float(x), up), offset=(0.0, 3.0), ha="center", va="bottom")


def _add_histogram(axes: Axes, series: Series) -> None:
    share = np.full(len(series.y), 100.0 / max(len(series.y), 1))
    options: dict[str, Any] = {"bins": series.x, "weights": share, "color": series.colour}
    axes.hist(series.y, **options, alpha=0.18, zorder=series.level)
    axes.hist(
        series.y, **options, histtype="step", linewidth=1.6, label=series.name or None,
        zorder=series.level + 0.1,
    )  # fmt: skip


_DRAWERS = {
    "line": _add_line,
    "steps": _add_line,
    "both": _add_line,
    "points": _add_points,
    "bars": _add_bars,
    "histogram": _add_histogram,
}


def _add_density(axes: Axes, density: Density) -> None:
    """Draw counts with a logarithmic colour scale."""
    from matplotlib.colors import LinearSegmentedColormap, LogNorm

    colours = LinearSegmentedColormap.from_list("count", ["#d6e6f2", style.BEST, "#0b2239"])
    ends = (density.low, density.high)
    picture: Any = np.ma.masked_less(density.count, 1.0)
    axes.imshow(
        picture, origin="lower", extent=(*ends, *ends), cmap=colours, interpolation="nearest",
        norm=LogNorm(1.0, max(float(density.count.max()), 2.0)), aspect="auto", zorder=2,
    )  # fmt: skip
    axes.grid(axis="x", color=style.IDLE_REST, linewidth=0.8)


def _annotate(axes: Axes, text: str, position: tuple[float, float], **options: Any) -> None:
    axes.annotate(
        text, position, xytext=options.pop("offset"), textcoords="offset points",
        size=style.SMALL_SIZE - 1.0, color=style.INK, family=style.FONT, zorder=7,
        annotation_clip=False, **options,
    )  # fmt: skip


def _finish(axes: Axes, chart: Chart) -> None:
    """Add title, axis labels and legend."""
    axes.set_title(
        chart.title, size=style.LABEL_SIZE, weight="bold", loc="left", pad=9.0,
        family=style.FONT, color=style.INK,
    )  # fmt: skip
    style.label_axes(axes, chart.x_label, chart.y_label, style.LABEL_SIZE - 0.5)
    style.style_axes(axes)
    for axis, logarithmic in ((axes.xaxis, chart.log_x), (axes.yaxis, chart.log_y)):
        if logarithmic:
            axis.set_major_formatter(FuncFormatter(plain_number))
            axis.set_minor_formatter(NullFormatter())
        else:
            axis.set_major_locator(MaxNLocator(6, steps=[1, 2, 2.5, 5, 10]))
    if chart.log_x:
        add_decimal_ticks(axes)
    if chart.names:
        axes.set_xticks(range(len(chart.names)), chart.names, family=style.FONT)
        axes.tick_params(axis="x", length=0.0, labelcolor=style.INK)
    for index, line in enumerate(chart.note):
        axes.text(
            0.035, 0.955 - 0.075 * index, line, transform=axes.transAxes, va="top", ha="left",
            size=style.SMALL_SIZE, color=style.INK, family=style.FONT, zorder=8,
        )  # fmt: skip
    if chart.legend is not None and axes.get_legend_handles_labels()[1]:
        where: Any = chart.legend
        axes.legend(
            loc=where, frameon=False, labelcolor=style.INK, handlelength=1.7,
            prop={"family": style.FONT, "size": style.SMALL_SIZE}, labelspacing=0.35,
        ).set_zorder(9)  # fmt: skip


MANY = 1.0e5
"""Number from which labels of powers of ten have an exponent."""


def plain_number(value: float, _position: int = 0) -> str:
    r"""Format a tick label.

    Examples
    --------
    >>> plain_number(20000.0), plain_number(0.05), plain_number(1e6), plain_number(2e5)
    ('20\u202f000', '0.05', '10⁶', '200\u202f000')
    """
    size = abs(value)
    power = round(float(np.log10(size))) if size else 0
    has_exponent = size >= MANY or 0.0 < size < 1e-3
    if has_exponent and np.isclose(size, 10.0**power):
        return "10" + str(power).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
    return f"{value:,.0f}".replace(",", "\u202f") if size >= 1000 else f"{value:g}"


def add_decimal_ticks(axes: Axes) -> None:
    """Set ticks at 1, 2 and 5 times powers of ten if the x axis spans less than 1.5 decades."""
    low, high = axes.get_xlim()
    if high > 32.0 * low:
        return
    powers = np.arange(np.floor(np.log10(low)), np.ceil(np.log10(high)) + 1.0)
    ticks = [k * 10.0**p for p in powers for k in (1, 2, 5) if low <= k * 10.0**p <= high]
    axes.set_xticks(ticks, [plain_number(tick) for tick in ticks])
    axes.xaxis.set_minor_locator(NullLocator())
