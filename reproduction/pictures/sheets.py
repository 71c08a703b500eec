"""Sheets: drawings of designs in a row, and charts below."""

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

TALLEST = 4.4
"""Inches of the largest drawing."""
LEFT, BETWEEN, BELOW, ABOVE = 0.66, 0.78, 0.56, 0.34
"""Inches around charts: for numbers and words at their left, below and over them."""
COLUMNS = 8
LONG_NOTE = 78
"""Letters of a note from which on a sheet must be wide."""


@dataclass(frozen=True, slots=True, eq=False)
class Sheet:
    """What one picture shows.

    Parameters
    ----------
    title, note
        What stands over it.
    motions
        Designs in a row, to one scale; their `name` stands over each.
    charts
        In a row below.
    still
        Which of the designs are drawn as they are, without motion, by place.
    height
        Of the charts, inches.
    """

    title: str
    note: str
    motions: Sequence[Motion] = ()
    charts: Sequence[Chart] = ()
    still: frozenset[int] = frozenset()
    height: float = 2.9


def draw_sheet(sheet: Sheet, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Draw a sheet.

    Parameters
    ----------
    path
        Where to; the suffix png, svg or pdf chooses the format.
    overwrite
        Whether to replace what is there.

    Raises
    ------
    InvalidSettings, OutputExists, StorageError
        As `save_figure`.
    """
    target = check_target(path, overwrite=overwrite)
    save_figure(_figure(sheet), target, overwrite=overwrite)


def _caption(motion: Motion) -> str:
    """Return what stands over a drawing, in few words."""
    known = motion.efficiency is not None and np.isfinite(motion.efficiency)
    efficiency = f"efficiency {motion.efficiency:.2f}" if known else "no efficiency"
    magnified = "" if motion.magnify == 1.0 else f"motion × {motion.magnify:g}"
    words = [efficiency, motion.note, magnified or f"{motion.design.beam_count} beams"]
    return " · ".join(word for word in words if word)


def _figure(sheet: Sheet) -> Figure:
    wide = len(sheet.motions) > 1 or len(sheet.charts) > 1 or len(sheet.note) > LONG_NOTE
    width = WIDE if wide else WIDTH
    heading = MARGIN + style.heading_height(sheet.title, sheet.note) + 0.14
    drawings = _Drawings.of(sheet, width)
    charts = sheet.height + BELOW + ABOVE + 0.1 if sheet.charts else 0.0
    figure = style.new_figure(width, heading + drawings.height + charts + MARGIN)
    style.add_heading(figure, sheet.title, sheet.note, MARGIN, MARGIN)
    if sheet.motions:
        drawings.put(figure, heading)
    if sheet.charts:
        _add_charts(figure, sheet)
    return figure


@dataclass(frozen=True, slots=True, eq=False)
class _Drawings:
    """The row of drawings: what, which part of the plane, how large."""

    parts: list[Drawing]
    frames: list[tuple[np.ndarray, np.ndarray]]
    scale: float

    @classmethod
    def of(cls, sheet: Sheet, width: float) -> _Drawings:
        parts = [
            Drawing(motion.name, _caption(motion) if k not in sheet.still else motion.note, motion,
                    displaced=k not in sheet.still)
            for k, motion in enumerate(sheet.motions)
        ]  # fmt: skip
        if not parts:
            return cls([], [], 1.0)
        frames = drawing_frames(parts)
        sizes = np.array([high - low for low, high in frames])
        room = width - 2 * MARGIN - GAP * (len(parts) - 1)
        scale = float(min(room / sizes[:, 0].sum(), TALLEST / sizes[:, 1].max()))
        return cls(parts, frames, scale)

    @property
    def words(self) -> float:
        """Inches over the drawings for their headings."""
        return max(style.heading_height(part.title, part.note) for part in self.parts) + 0.1

    @property
    def tallest(self) -> float:
        """Inches of the drawings."""
        return self.scale * max(float((high - low)[1]) for low, high in self.frames)

    @property
    def height(self) -> float:
        """Inches of the whole row with its legend."""
        if not self.parts:
            return 0.0
        rows = math.ceil(len(self.entries()) / COLUMNS)
        return self.words + self.tallest + 0.12 + ROW_HEIGHT * rows + 0.12

    def entries(self) -> list[tuple[str, object]]:
        """Legend entries of displaced and of still drawings, each once."""
        found: dict[str, object] = {}
        for displaced in (False, True):
            chosen = [part for part in self.parts if part.displaced is displaced]
            if chosen:
                found |= dict(legend_entries(chosen))
        return list(found.items())

    def put(self, figure: Figure, top: float) -> None:
        """Draw the row, `top` inches below the upper edge."""
        width, height = figure.get_size_inches()
        across = [self.scale * float((high - low)[0]) for low, high in self.frames]
        gap = min((width - 2 * MARGIN - sum(across)) / max(len(across), 1), 1.2)
        left = 0.5 * (width - sum(across) - gap * (len(across) - 1))
        bottom = height - top - self.words - self.tallest
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
    for place, chart in enumerate(sheet.charts):
        left = MARGIN + LEFT - 0.06 + place * (room + BETWEEN)
        axes = figure.add_axes(
            (left / width, (MARGIN + BELOW) / height, room / width, sheet.height / height)
        )
        add_chart(axes, chart)
