"""Sheets: a row of drawings of designs above a row of charts."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.plots import style
from bellcrank.plots.legend import ROW_HEIGHT, add_legend
from bellcrank.plots.marks import add_panel
from bellcrank.plots.motion import (
    GAP,
    MARGIN,
    WIDE,
    WIDTH,
    Drawing,
    add_drawing,
    drawing_frames,
    legend_entries,
)
from bellcrank.plots.saving import check_target, save_figure
from reproduction.pictures.charts import add_chart

if TYPE_CHECKING:
    import os
    from collections.abc import Sequence

    from matplotlib.figure import Figure

    from bellcrank.plots.scene import Motion
    from reproduction.pictures.charts import Chart

MAX_HEIGHT = 4.4
"""Height of the largest drawing, inches."""
LEFT, BETWEEN, BELOW, ABOVE = 0.66, 0.78, 0.56, 0.34
"""Margins of charts, inches."""
COLUMNS = 8
LONG_NOTE = 78
"""Number of characters of a note from which the sheet is wide."""


@dataclass(frozen=True, slots=True, eq=False)
class Sheet:
    """The content of one picture.

    Parameters
    ----------
    title, note
        Heading.
    motions
        Designs in a row at one scale; the `name` of each is its title.
    charts
        Charts in a row below.
    at_rest
        Indices of the designs that are drawn at rest.
    height
        Height of the charts, inches.
    """

    title: str
    note: str
    motions: Sequence[Motion] = ()
    charts: Sequence[Chart] = ()
    at_rest: frozenset[int] = frozenset()
    height: float = 2.9


def draw_sheet(sheet: Sheet, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Draw a sheet.

    Parameters
    ----------
    path
        Output file; the suffix png, svg or pdf selects the format.
    overwrite
        Whether an existing file is replaced.

    Raises
    ------
    InvalidSettings, OutputExists, StorageError
        As `save_figure`.
    """
    target = check_target(path, overwrite=overwrite)
    save_figure(_figure(sheet), target, overwrite=overwrite)


def _caption(motion: Motion) -> str:
    """Return a short caption of a drawing."""
    known = motion.efficiency is not None and np.isfinite(motion.efficiency)
    efficiency = f"efficiency {motion.efficiency:.2f}" if known else "no efficiency"
    magnified = "" if motion.magnify == 1.0 else f"motion × {motion.magnify:g}"
    texts = [efficiency, motion.note, magnified or f"{motion.design.beam_count} beams"]
    return " · ".join(text for text in texts if text)


def _figure(sheet: Sheet) -> Figure:
    wide = len(sheet.motions) > 1 or len(sheet.charts) > 1 or len(sheet.note) > LONG_NOTE
    width = WIDE if wide else WIDTH
    heading = MARGIN + style.heading_height(sheet.title, sheet.note) + 0.14
    drawings = _Drawings.of(sheet, width)
    charts = sheet.height + BELOW + ABOVE + 0.1 if sheet.charts else 0.0
    figure = style.new_figure(width, heading + drawings.height + charts + MARGIN)
    style.add_heading(figure, sheet.title, sheet.note, MARGIN, MARGIN)
    if sheet.motions:
        drawings.add_to(figure, heading)
    if sheet.charts:
        _add_charts(figure, sheet)
    return figure


@dataclass(frozen=True, slots=True, eq=False)
class _Drawings:
    """The row of drawings with their frames and scale."""

    parts: list[Drawing]
    frames: list[tuple[np.ndarray, np.ndarray]]
    scale: float

    @classmethod
    def of(cls, sheet: Sheet, width: float) -> _Drawings:
        parts = [
            Drawing(motion.name, motion.note if at_rest else _caption(motion), motion, not at_rest)
            for k, motion in enumerate(sheet.motions)
            for at_rest in (k in sheet.at_rest,)
        ]
        if not parts:
            return cls([], [], 1.0)
        frames = drawing_frames(parts)
        sizes = np.array([high - low for low, high in frames])
        room = width - 2 * MARGIN - GAP * (len(parts) - 1)
        scale = float(min(room / sizes[:, 0].sum(), MAX_HEIGHT / sizes[:, 1].max()))
        return cls(parts, frames, scale)

    @property
    def heading(self) -> float:
        """Height of the headings, inches."""
        return max(style.heading_height(part.title, part.note) for part in self.parts) + 0.1

    @property
    def tallest(self) -> float:
        """Height of the highest drawing, inches."""
        return self.scale * max(float((high - low)[1]) for low, high in self.frames)

    @property
    def height(self) -> float:
        """Height of the row with its legend, inches."""
        if not self.parts:
            return 0.0
        rows = math.ceil(len(self.entries()) / COLUMNS)
        return self.heading + self.tallest + 0.12 + ROW_HEIGHT * rows + 0.12

    def entries(self) -> list[tuple[str, object]]:
        """Return the legend entries of all drawings without duplicates."""
        found: dict[str, object] = {}
        for displaced in (False, True):
            chosen = [part for part in self.parts if part.displaced is displaced]
            if chosen:
                found |= dict(legend_entries(chosen))
        return list(found.items())

    def add_to(self, figure: Figure, top: float) -> None:
        """Draw the row `top` inches below the upper edge."""
        width, height = figure.get_size_inches()
        across = [self.scale * float((high - low)[0]) for low, high in self.frames]
        gap = min((width - 2 * MARGIN - sum(across)) / max(len(across), 1), 1.2)
        left = 0.5 * (width - sum(across) - gap * (len(across) - 1))
        bottom = height - top - self.heading - self.tallest
        for part, (low, high), size in zip(self.parts, self.frames, across, strict=True):
            style.add_heading(figure, part.title, part.note, left, top)
            corner = (left, bottom)
            add_drawing(
                add_panel(figure, part.motion.design.problem, corner, self.scale, low, high), part
            )
            left += size + gap
        entries = self.entries()
        rows = math.ceil(len(entries) / COLUMNS)
        foot = bottom - 0.12 - ROW_HEIGHT * rows
        add_legend(figure, entries, foot, min(COLUMNS, len(entries)))


def _add_charts(figure: Figure, sheet: Sheet) -> None:
    width, height = figure.get_size_inches()
    count = len(sheet.charts)
    room = (width - 2 * MARGIN - LEFT - BETWEEN * (count - 1)) / count
    for index, chart in enumerate(sheet.charts):
        left = MARGIN + LEFT - 0.06 + index * (room + BETWEEN)
        axes = figure.add_axes(
            (left / width, (MARGIN + BELOW) / height, room / width, sheet.height / height)
        )
        add_chart(axes, chart)
