"""The legend and the colour bar of a drawing."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from matplotlib.legend_handler import HandlerPatch
from matplotlib.lines import Line2D
from matplotlib.patches import FancyArrow, Patch

from bellcrank.plots import style

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.cm import ScalarMappable
    from matplotlib.figure import Figure
    from matplotlib.legend import Legend

    from bellcrank.model import Problem

ROW_HEIGHT = 0.24
"""Height of a row of the legend, inches."""
BAR = 0.12
"""Height of a colour bar, inches."""


def strut_entry(colour: str, width: float = 4.0) -> Line2D:
    """Return the legend handle of a strut."""
    return Line2D([], [], color=colour, linewidth=width, solid_capstyle="round")


def arrow_entry(colour: str) -> FancyArrow:
    """Return the legend handle of an arrow."""
    return FancyArrow(0, 0, 1, 0, facecolor=colour, edgecolor="none")


def support_entry() -> Patch:
    """Return the legend handle of a support."""
    return Patch(facecolor=style.GROUND_FILL, edgecolor=style.GROUND, hatch="//////", linewidth=0.8)


def roller_entry() -> Line2D:
    """Return the legend handle of a roller."""
    return Line2D(
        [], [], linestyle="none", marker="o", markersize=6.0,
        markerfacecolor="white", markeredgecolor=style.NOTE,
    )  # fmt: skip


def support_entries(problems: list[Problem]) -> list[tuple[str, Any]]:
    """Return legend entries for the supports and rollers of problems."""
    entries: list[tuple[str, Any]] = []
    if any(len(problem.supports.fixed) for problem in problems):
        entries.append(("support", support_entry()))
    rollers = ("fixed_x", "fixed_y", "fixed_z")
    if any(len(getattr(p.supports, name)) for p in problems for name in rollers):
        entries.append(("roller", roller_entry()))
    return entries


def add_colour_bar(figure: Figure, colours: ScalarMappable, label: str, bottom: float) -> None:
    """Add a colour bar in the middle, `bottom` inches above the lower edge of the figure."""
    up = float(figure.get_size_inches()[1])
    axes = figure.add_axes((0.25, bottom / up, 0.5, BAR / up))
    bar = figure.colorbar(colours, cax=axes, orientation="horizontal", extend="max")
    bar.set_label(label, family=style.FONT, size=style.SMALL_SIZE, color=style.INK)
    bar.outline.set_visible(False)
    axes.tick_params(labelsize=style.SMALL_SIZE, colors=style.NOTE, labelfontfamily=style.FONT)


def _draw_arrow(
    legend: Legend, orig_handle: Artist, xdescent: float, ydescent: float,
    width: float, height: float, fontsize: float,
) -> FancyArrow:  # fmt: skip
    """Return an arrow that fills the width of a legend handle."""
    del legend, orig_handle, fontsize
    return FancyArrow(
        -xdescent, -ydescent + 0.5 * height, width, 0.0,
        width=0.28 * height, head_width=0.95 * height, head_length=0.9 * height,
        length_includes_head=True,
    )  # fmt: skip


def add_legend(
    figure: Figure,
    entries: list[tuple[str, Any]],
    bottom: float,
    columns: int,
    *,
    left: float | None = None,
    size: float = style.SMALL_SIZE,
) -> None:
    """Add a legend.

    Parameters
    ----------
    bottom
        Distance of its lower edge (of its upper edge if `left` is given) from the lower edge of
        the figure, inches.
    columns
        Number of columns.
    left
        Distance from the left edge of the figure, inches; by default the legend is centred.
    size
        Font size.
    """
    width, height = figure.get_size_inches()
    across = 0.5 if left is None else left / width
    figure.legend(
        [handle for _, handle in entries],
        [label for label, _ in entries],
        handler_map={FancyArrow: HandlerPatch(patch_func=_draw_arrow)},
        loc="lower center" if left is None else "upper left",
        bbox_to_anchor=(across, bottom / height),
        ncols=columns,
        frameon=False,
        prop={"family": style.FONT, "size": size},
        labelcolor=style.INK,
        handlelength=1.9,
        handletextpad=0.6,
        columnspacing=1.5,
        labelspacing=0.45,
        borderaxespad=0.0,
        borderpad=0.0,
    )
