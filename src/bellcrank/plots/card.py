"""Design cards: one page that says all about a part."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from bellcrank.plots import style
from bellcrank.plots.legend import add_legend
from bellcrank.plots.marks import add_panel
from bellcrank.plots.motion import Drawing, entries_of, fill, level_frames
from bellcrank.plots.saving import check_target, save_figure
from bellcrank.plots.strokes import draw_strokes

if TYPE_CHECKING:
    import os

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from bellcrank.plots.scene import Motion
    from bellcrank.plots.strokes import StrokeAxes, StrokeCurve

WIDTH, HEIGHT = 11.69, 8.27
"""Inches: A4, lying."""
MARGIN = 0.45
DRAWING = (6.9, 5.2)
"""Inches that the drawing may take."""
CURVES = (3.2, 1.45)
LEGEND_COLUMNS = 3

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
    curve, axes
        How efficiency and force grow along the stroke, and the words on the axes.
    tables
        Left to right, top to bottom.
    foot
        At the bottom, small: where all this comes from.
    """

    title: str
    note: str
    motion: Motion
    curve: StrokeCurve
    axes: StrokeAxes
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
    legend_top = corner[1] - 0.02
    add_legend(figure, entries_of([drawing]), legend_top, LEGEND_COLUMNS, left=MARGIN, size=7.5)


def _put_curves(figure: Figure, card: Card) -> None:
    """Draw efficiency and force along the stroke, upper right."""
    left = WIDTH - MARGIN - CURVES[0]
    pair: list[Axes] = []
    for place in range(2):
        bottom = HEIGHT - MARGIN - 0.75 - CURVES[1] - place * (CURVES[1] + 0.7)
        place_of = (left / WIDTH, bottom / HEIGHT, CURVES[0] / WIDTH, CURVES[1] / HEIGHT)
        pair.append(figure.add_axes(place_of))
    draw_strokes((pair[0], pair[1]), [card.curve], card.axes)


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
