"""The legend under a drawing."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from matplotlib.legend_handler import HandlerPatch
from matplotlib.lines import Line2D
from matplotlib.patches import FancyArrow, Patch

from bellcrank.plots import style

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.figure import Figure
    from matplotlib.legend import Legend

    from bellcrank.model import Problem

ROW_HEIGHT = 0.24
"""Inches that a row of the legend takes."""


def strut_entry(colour: str, width: float = 4.0) -> Line2D:
    """Sample of a strut."""
    return Line2D([], [], color=colour, linewidth=width, solid_capstyle="round")


def arrow_entry(colour: str) -> FancyArrow:
    """Sample of an arrow."""
    return FancyArrow(0, 0, 1, 0, facecolor=colour, edgecolor="none")


def ground_entry() -> Patch:
    """Sample of the hatched ground."""
    return Patch(facecolor=style.GROUND_FILL, edgecolor=style.GROUND, hatch="//////", linewidth=0.8)


def wheel_entry() -> Line2D:
    """Sample of a wheel under a node that may roll."""
    return Line2D(
        [], [], linestyle="none", marker="o", markersize=6.0,
        markerfacecolor="white", markeredgecolor=style.NOTE,
    )  # fmt: skip


def support_entries(problems: list[Problem]) -> list[tuple[str, Any]]:
    """Entries for the supports and rollers that any of some problems has."""
    entries: list[tuple[str, Any]] = []
    if any(len(problem.supports.fixed) for problem in problems):
        entries.append(("support", ground_entry()))
    if any(len(p.supports.fixed_x) + len(p.supports.fixed_y) for p in problems):
        entries.append(("roller", wheel_entry()))
    return entries


def _draw_arrow(
    legend: Legend, orig_handle: Artist, xdescent: float, ydescent: float,
    width: float, height: float, fontsize: float,
) -> FancyArrow:  # fmt: skip
    """Draw an arrow as long as its place in the legend."""
    del legend, orig_handle, fontsize
    return FancyArrow(
        -xdescent, -ydescent + 0.5 * height, width, 0.0,
        width=0.28 * height, head_width=0.95 * height, head_length=0.9 * height,
        length_includes_head=True,
    )  # fmt: skip


def add_legend(
    figure: Figure,
    entries: list[tuple[str, Any]],
    at: float,
    columns: int,
    *,
    left: float | None = None,
    size: float = style.SMALL_SIZE,
) -> None:
    """Write a legend.

    Parameters
    ----------
    at
        Inches above the lower edge: of its foot, or of its head if `left` is given.
    left
        Inches from the left edge; by default it stands in the middle.
    """
    width, height = figure.get_size_inches()
    across = 0.5 if left is None else left / width
    figure.legend(
        [handle for _, handle in entries],
        [label for label, _ in entries],
        handler_map={FancyArrow: HandlerPatch(patch_func=_draw_arrow)},
        loc="lower center" if left is None else "upper left",
        bbox_to_anchor=(across, at / height),
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
