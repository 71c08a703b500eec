"""All that a movie shows on one sheet: laid out once, drawn frame by frame."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.figure import Figure

from bellcrank.plots import style
from bellcrank.plots.legend import (
    ROW_HEIGHT,
    add_legend,
    arrow_entry,
    strut_entry,
    support_entries,
)
from bellcrank.plots.marks import add_panel
from bellcrank.plots.movies.actors import CAME, ENERGY, GONE, Actor, energy_scale, frame_of
from bellcrank.plots.movies.curves import Curves, in_words, power_of_ten
from bellcrank.plots.scene import level_with

if TYPE_CHECKING:
    from matplotlib.colors import PowerNorm
    from matplotlib.text import Text
    from numpy.typing import NDArray

    from bellcrank.plots.movies.records import Course, Movie

BASE = ((9.6, 5.4), (12.0, 6.75))
"""Least inches of the sheet for one and for two lattices: pixels are shared out from these, so
that letters have one size in all wide pictures."""
MARGIN = 0.28
GAP = 0.35
LINE = 0.24
COLUMN = 2.9
"""Inches of width of graphs beside the lattice."""
ROW = 1.55
"""Inches of height of graphs under it."""
ENTRIES = 7
"""Of a row of the legend."""
LONGEST = 44
"""Letters of a title."""
BAR, BAR_WIDTH = 0.09, 2.4


@dataclass(frozen=True, slots=True)
class Layout:
    """Where lattices and graphs stand.

    Parameters
    ----------
    scale
        Inches per lattice unit.
    room
        Left, bottom, width and height in inches for all lattices.
    boxes
        The same for each graph.
    """

    scale: float
    room: tuple[float, float, float, float]
    boxes: tuple[tuple[float, float, float, float], ...]


class Stage:
    """Draws the frames of a movie.

    The sheet is drawn once without what moves; for each state that is drawn over a copy.

    Parameters
    ----------
    movie
        What to show.
    size
        Pixels across and up.

    Attributes
    ----------
    size
        Pixels across and up.
    order : (F,) int64
        The state that each frame shows.
    """

    def __init__(self, movie: Movie, size: tuple[int, int]) -> None:
        self.size, self.order = size, movie.order
        base = BASE[len(movie.courses) - 1]
        dpi = min(size[0] / base[0], size[1] / base[1])
        # A breath more than whole pixels, which matplotlib rounds down.
        inches = ((size[0] + 1e-3) / dpi, (size[1] + 1e-3) / dpi)
        self._figure = Figure(figsize=inches, dpi=dpi, facecolor="white")
        # Matplotlib gives the methods of its canvas no types.
        self._canvas = cast("Any", FigureCanvasAgg(self._figure))
        self._courses = movie.courses
        scale = energy_scale(movie.courses)
        shades = (style.HUMAN, style.OUTPUT) if len(movie.courses) > 1 else (style.OUTPUT,)
        heading = MARGIN + 0.27 + LINE + LINE * self._has_alarms + 0.1
        entries = _entries(movie.courses)
        rows = math.ceil(len(entries) / ENTRIES)
        foot = MARGIN + ROW_HEIGHT * rows + 0.1 + (0.0 if scale is None else 0.46)
        frames = level_with(
            [frame_of(course) for course in movie.courses],
            [course.problem for course in movie.courses],
        )
        layout = _layout(inches, frames, len(movie.graphs), heading, foot)
        self._curves = [
            Curves(self._figure, graph, box, shades, legend=len(shades) > 1 and number == 0)
            for number, (graph, box) in enumerate(zip(movie.graphs, layout.boxes, strict=True))
        ]
        self._texts: list[tuple[Text, Text | None]] = []
        self._actors = self._put_actors(layout, frames, scale)
        if scale is not None:
            _put_bar(self._figure, scale, MARGIN + ROW_HEIGHT * rows + 0.32)
        add_legend(self._figure, entries, MARGIN, columns=math.ceil(len(entries) / rows))
        self._parts: list[Actor | Curves] = [*self._actors, *self._curves]
        self._canvas.draw()
        self._ground = self._canvas.copy_from_bbox(self._figure.bbox)

    @property
    def _has_alarms(self) -> bool:
        return any(any(course.alarms) for course in self._courses)

    def _put_actors(
        self, layout: Layout, frames: list[tuple[Any, Any]], scale: PowerNorm | None
    ) -> list[Actor]:
        """Put the lattices side by side, with words over each."""
        left, bottom, width, height = layout.room
        sizes = [layout.scale * (high - low) for low, high in frames]
        share = (width - sum(float(size[0]) for size in sizes)) / len(sizes)
        lift = bottom + 0.5 * (height - float(sizes[0][1]))
        actors = []
        for course, (low, high), size in zip(self._courses, frames, sizes, strict=True):
            self._write(course, left)
            corner = (left + 0.5 * share, lift)
            panel = add_panel(self._figure, course.problem, corner, layout.scale, low, high)
            actors.append(Actor(panel, course, scale))
            left += float(size[0]) + share
        return actors

    def _write(self, course: Course, left: float) -> None:
        """Write the words over a lattice; those that change are drawn with each frame."""
        _, note = style.write_heading(
            self._figure, _short(course.title), " ", max(left, MARGIN), MARGIN
        )
        alarm = None
        if self._has_alarms:
            (alarm,) = style.write_heading(
                self._figure, "", " ", max(left, MARGIN), MARGIN + 0.27 + LINE
            )
            alarm.set(color=style.INPUT, animated=True)
        note.set_animated(True)
        self._texts.append((note, alarm))

    def draw(self, state: int) -> NDArray[np.uint8]:
        """Return (height, width, 4) red, green, blue and opacity of a state."""
        self._canvas.restore_region(self._ground)
        renderer = self._canvas.get_renderer()
        for part in self._parts:
            part.place(state)
            for artist in part.artists:
                artist.draw(renderer)
        for course, (note, alarm) in zip(self._courses, self._texts, strict=True):
            note.set_text(course.notes[state])
            note.draw(renderer)
            if alarm is not None:
                alarm.set_text(course.alarms[state])
                alarm.draw(renderer)
        return np.array(self._canvas.buffer_rgba(), dtype=np.uint8)


def _short(title: str) -> str:
    """Leave the end of a title that would not fit."""
    return title if len(title) <= LONGEST else "…" + title[1 - LONGEST :]


def _layout(
    inches: tuple[float, float],
    frames: list[tuple[NDArray[np.float64], NDArray[np.float64]]],
    graphs: int,
    heading: float,
    foot: float,
) -> Layout:
    """Put graphs beside or under the lattices, whichever leaves these larger."""
    wide, tall = inches[0] - 2 * MARGIN, inches[1] - heading - foot
    beside = (MARGIN, foot, wide - COLUMN - GAP, tall)
    each = (inches[1] - MARGIN - foot - GAP * (graphs - 1)) / graphs
    stacked = [
        (inches[0] - MARGIN - COLUMN, foot + k * (each + GAP), COLUMN, each)
        for k in reversed(range(graphs))
    ]
    below = max(ROW, 0.32 * tall)
    above = (MARGIN, foot + below + 0.15, wide, tall - below - 0.15)
    part = (wide - GAP * (graphs - 1)) / graphs
    abreast = [(MARGIN + k * (part + GAP), foot, part, below) for k in range(graphs)]
    across = sum(float(high[0] - low[0]) for low, high in frames)
    up = float(frames[0][1][1] - frames[0][0][1])
    found = []
    for room, boxes in ((beside, stacked), (above, abreast)):
        scale = min((room[2] - GAP * (len(frames) - 1)) / across, room[3] / up)
        found.append(Layout(scale, room, tuple(boxes)))
    return max(found, key=lambda layout: layout.scale)


def _entries(courses: tuple[Course, ...]) -> list[tuple[str, Any]]:
    """Legend entries for what the movie holds, and for nothing else."""
    problems = [course.problem for course in courses]
    entries: list[tuple[str, Any]] = [("at rest", strut_entry(style.IDLE_REST))]
    changing = not all(course.is_one_design for course in courses)
    if changing:
        entries += [("removed", strut_entry(GONE, 2.2)), ("added", strut_entry(CAME))]
    if any((course.present & ~course.bearing).any() for course in courses):
        entries.append(("bears no load", strut_entry(style.IDLE, 2.2)))
    entries += support_entries(problems)
    entries.append(("input", arrow_entry(style.INPUT)))
    entries.append(("output, wanted", arrow_entry(style.WANTED)))
    entries.append(
        ("output, motion" if changing else "output, path", strut_entry(style.OUTPUT, 1.2))
    )
    return entries


def _put_bar(figure: Figure, scale: PowerNorm, bottom: float) -> None:
    """Draw the colour bar, its words on its left."""
    across, up = figure.get_size_inches()
    left = 0.5 * across - 0.15
    axes = figure.add_axes((left / across, bottom / up, BAR_WIDTH / across, BAR / up))
    bar = figure.colorbar(
        ScalarMappable(scale, ENERGY), cax=axes, orientation="horizontal", extend="max"
    )
    top = float(scale.vmax or 1.0)
    unit = power_of_ten(top)
    labels = [f"{share * top / unit:.3g}" for share in (0.0, 0.25, 1.0)]
    bar.set_ticks([0.0, 0.25 * top, top], labels=labels)
    bar.outline.set_visible(False)
    axes.tick_params(
        labelsize=style.SMALL_SIZE, colors=style.NOTE, labelfontfamily=style.FONT, length=2.5
    )
    figure.text(
        (left - 0.12) / across,
        (bottom + 0.5 * BAR) / up,
        "strain energy of a beam" + in_words(unit),
        family=style.FONT,
        size=style.SMALL_SIZE,
        color=style.INK,
        ha="right",
        va="center",
    )
