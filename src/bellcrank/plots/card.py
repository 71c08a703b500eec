"""Design cards: one page that says all about a part."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from bellcrank.plots import style
from bellcrank.plots.marks import add_panel
from bellcrank.plots.motion import Drawing, entries_of, fill, level_frames
from bellcrank.plots.saving import check_target, save_figure
from bellcrank.plots.stress import dress

if TYPE_CHECKING:
    import os

    import numpy as np
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from bellcrank.plots.scene import Motion

WIDTH, HEIGHT = 11.69, 8.27
"""Inches: A4, lying."""
MARGIN = 0.45
ROW = 0.235
DRAWING = (6.9, 5.2)
"""Inches that the drawing may take."""
CURVES = (3.2, 1.45)

Table = tuple[str, list[tuple[str, str]]]
"""A heading and rows of a name and a value."""


@dataclass(frozen=True, slots=True, eq=False)
class Card:
    """What stands on a card.

    Parameters
    ----------
    title, note
        At the top.
    motion
        The design at rest and moved.
    stroke, efficiency, force : (p,)
        Along the stroke; the words of the axes are `axes`.
    axes
        Of the stroke and of the force.
    tables
        Left to right, top to bottom.
    foot
        At the bottom, small: where all this comes from.
    """

    title: str
    note: str
    motion: Motion
    stroke: NDArray[np.float64]
    efficiency: NDArray[np.float64]
    force: NDArray[np.float64]
    axes: tuple[str, str]
    tables: list[Table]
    foot: str


def draw_card(card: Card, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Draw a card on a page.

    Parameters
    ----------
    path
        Where to; the suffix pdf, png or svg chooses the format.
    overwrite
        Whether to replace what is there.

    Raises
    ------
    InvalidSettings
        If the suffix names no format.
    OutputExists, StorageError
        If there is such a file, or it cannot be written.
    """
    check_target(path, overwrite=overwrite)
    figure = style.new_figure(WIDTH, HEIGHT)
    style.write_heading(figure, card.title, card.note, MARGIN, MARGIN)
    _put_drawing(figure, card)
    _put_curves(figure, card)
    _put_tables(figure, card.tables)
    figure.text(
        MARGIN / WIDTH, 0.25 / HEIGHT, card.foot,
        size=6.5, color=style.NOTE, family=style.FONT, parse_math=False,
    )  # fmt: skip
    save_figure(figure, path, overwrite=overwrite)


def _put_drawing(figure: Figure, card: Card) -> None:
    """Draw the design at rest and moved, upper left."""
    drawing = Drawing("", "", card.motion, moving=True)
    ((low, high),) = level_frames([drawing])
    size = high - low
    scale = float(min(DRAWING[0] / size[0], DRAWING[1] / size[1]))
    top = HEIGHT - MARGIN - 0.65
    corner = (MARGIN, top - scale * float(size[1]))
    fill(add_panel(figure, card.motion.design.problem, corner, scale, low, high), drawing)
    entries = entries_of([drawing])
    legend = figure.legend(
        [handle for _, handle in entries if not hasattr(handle, "_head_length")],
        [label for label, handle in entries if not hasattr(handle, "_head_length")],
        loc="upper left", bbox_to_anchor=(MARGIN / WIDTH, (corner[1] - 0.02) / HEIGHT),
        ncols=3, frameon=False, prop={"family": style.FONT, "size": 7.5}, borderpad=0.0,
    )  # fmt: skip
    legend.set_in_layout(False)


def _put_curves(figure: Figure, card: Card) -> None:
    """Draw efficiency and force along the stroke, upper right."""
    left = WIDTH - MARGIN - CURVES[0]
    for place, (values, words) in enumerate(
        ((card.efficiency, "efficiency"), (card.force, card.axes[1]))
    ):
        bottom = HEIGHT - MARGIN - 0.75 - CURVES[1] - place * (CURVES[1] + 0.7)
        axes = figure.add_axes(
            (left / WIDTH, bottom / HEIGHT, CURVES[0] / WIDTH, CURVES[1] / HEIGHT)
        )
        axes.plot(
            card.stroke, values, color=style.OUTPUT, marker="o", markersize=3.0, linewidth=1.4
        )
        dress(axes, card.axes[0], words)


def _put_tables(figure: Figure, tables: list[Table]) -> None:
    """Write the tables below, in columns of equal width."""
    wide = (WIDTH - 2.0 * MARGIN) / max(len(tables), 1)
    for place, (heading, rows) in enumerate(tables):
        left, top = MARGIN + place * wide, 2.05
        words: dict[str, Any] = {"family": style.FONT, "parse_math": False, "va": "top"}
        figure.text(
            left / WIDTH, top / HEIGHT, heading,
            size=9.5, weight="bold", color=style.INK, **words,
        )  # fmt: skip
        for row, (name, value) in enumerate(rows, start=1):
            height = (top - 0.07 - 0.185 * row) / HEIGHT
            figure.text(left / WIDTH, height, name, size=8.0, color=style.NOTE, **words)
            figure.text(
                (left + 0.33 * wide) / WIDTH, height, value, size=8.0, color=style.INK, **words
            )
