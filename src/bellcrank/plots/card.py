"""Design cards: a one-page summary of a part."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from bellcrank.plots import style
from bellcrank.plots.legend import add_legend
from bellcrank.plots.marks import add_panel
from bellcrank.plots.motion import Drawing, add_drawing, drawing_frames, legend_entries
from bellcrank.plots.saving import check_target, save_figure
from bellcrank.plots.strokes import draw_strokes

if TYPE_CHECKING:
    import os

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from bellcrank.plots.scene import Motion
    from bellcrank.plots.strokes import StrokeCurve, StrokeLabels

WIDTH, HEIGHT = 11.69, 8.27
"""A4 in landscape format, inches."""
MARGIN = 0.45
DRAWING = (6.9, 4.8)
"""Largest size of the drawing, inches."""
CURVES = (3.2, 1.45)
"""Size of each of the two diagrams, inches."""
TABLES_TOP = 2.05
"""Height of the headings of the tables above the lower edge, inches."""
LEGEND_TOP = 2.85
"""Height of the legend, which is below the diagrams, inches."""
LEGEND_COLUMNS = 3

Table = tuple[str, list[tuple[str, str]]]
"""A heading and rows of a name and a value."""


@dataclass(frozen=True, slots=True, eq=False)
class Card:
    """The content of a card.

    Parameters
    ----------
    title, note
        Heading.
    motion
        Design at rest and displaced.
    curve, labels
        Efficiency and force along the stroke, and the axis labels.
    tables
        Tables in columns, from left to right.
    footer
        Small text at the bottom: provenance.
    """

    title: str
    note: str
    motion: Motion
    curve: StrokeCurve
    labels: StrokeLabels
    tables: list[Table]
    footer: str


def draw_card(card: Card, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Draw a card.

    Parameters
    ----------
    path
        Output file; the suffix pdf, png or svg selects the format.
    overwrite
        Whether an existing file is replaced.

    Raises
    ------
    InvalidSettings
        If the suffix is unknown.
    OutputExists, StorageError
        If the file exists or cannot be written.
    """
    check_target(path, overwrite=overwrite)
    save_figure(card_figure(card), path, overwrite=overwrite)


def card_figure(card: Card) -> Figure:
    """Return the figure of a card."""
    figure = style.new_figure(WIDTH, HEIGHT)
    style.add_heading(figure, card.title, card.note, MARGIN, MARGIN)
    _add_drawing(figure, card)
    _add_curves(figure, card)
    _add_tables(figure, card.tables)
    figure.text(
        MARGIN / WIDTH, 0.25 / HEIGHT, card.footer,
        size=6.5, color=style.NOTE, family=style.FONT, parse_math=False,
    )  # fmt: skip
    return figure


def _add_drawing(figure: Figure, card: Card) -> None:
    """Add the design at rest and displaced, upper left, and its legend below the diagrams."""
    drawing = Drawing("", "", card.motion, displaced=True)
    ((low, high),) = drawing_frames([drawing])
    size = high - low
    scale = float(min(DRAWING[0] / size[0], DRAWING[1] / size[1]))
    top = HEIGHT - MARGIN - 0.65
    corner = (MARGIN, top - scale * float(size[1]))
    add_drawing(add_panel(figure, card.motion.design.problem, corner, scale, low, high), drawing)
    left = WIDTH - MARGIN - CURVES[0] - 0.5
    add_legend(figure, legend_entries([drawing]), LEGEND_TOP, LEGEND_COLUMNS, left=left, size=7.5)


def _add_curves(figure: Figure, card: Card) -> None:
    """Add efficiency and force along the stroke, upper right."""
    left = WIDTH - MARGIN - CURVES[0]
    pair: list[Axes] = []
    for row in range(2):
        bottom = HEIGHT - MARGIN - 0.75 - CURVES[1] - row * (CURVES[1] + 0.7)
        box = (left / WIDTH, bottom / HEIGHT, CURVES[0] / WIDTH, CURVES[1] / HEIGHT)
        pair.append(figure.add_axes(box))
    draw_strokes((pair[0], pair[1]), [card.curve], card.labels)


def _add_tables(figure: Figure, tables: list[Table]) -> None:
    """Add the tables at the bottom, in columns of equal width."""
    wide = (WIDTH - 2.0 * MARGIN) / max(len(tables), 1)
    for column, (heading, rows) in enumerate(tables):
        left, top = MARGIN + column * wide, TABLES_TOP
        options: dict[str, Any] = {"family": style.FONT, "parse_math": False, "va": "top"}
        figure.text(
            left / WIDTH, top / HEIGHT, heading,
            size=9.5, weight="bold", color=style.INK, **options,
        )  # fmt: skip
        for row, (name, value) in enumerate(rows, start=1):
            height = (top - 0.07 - 0.185 * row) / HEIGHT
            figure.text(left / WIDTH, height, name, size=8.0, color=style.NOTE, **options)
            figure.text(
                (left + 0.33 * wide) / WIDTH, height, value, size=8.0, color=style.INK, **options
            )
