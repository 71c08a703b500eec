"""The figure of a movie: layout, fixed parts, and drawing of states."""

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
from bellcrank.plots.movies.curves import Curves, power_of_ten, unit_label
from bellcrank.plots.movies.lattice_artist import (
    ENERGY,
    LatticeArtist,
    energy_scale,
    frame_of,
)
from bellcrank.plots.movies.space_artist import SpaceArtist, whole_frame
from bellcrank.plots.scene import aligned_frames, of_one_height

if TYPE_CHECKING:
    from matplotlib.colors import PowerNorm
    from matplotlib.text import Text
    from numpy.typing import NDArray

    from bellcrank.plots.movies.records import Movie, StateSequence

BASE = ((9.6, 5.4), (12.0, 6.75))
"""Smallest size of the figure for one and for two lattices, inches. The resolution follows from
it, so that text has the same relative size in all wide movies."""
MARGIN = 0.28
GAP = 0.35
LINE = 0.24
COLUMN = 2.9
"""Width of graphs beside the lattice, inches."""
ROW = 1.55
"""Height of graphs below the lattice, inches."""
LEGEND_COLUMNS = 7
MAX_TITLE = 44
"""Characters of a title."""
BAR, BAR_WIDTH = 0.09, 2.4


@dataclass(frozen=True, slots=True)
class Layout:
    """Positions of lattices and graphs.

    Parameters
    ----------
    scale
        Inches per lattice unit.
    room
        Left, bottom, width and height of the area of the lattices, inches.
    boxes
        Left, bottom, width and height of each graph, inches.
    """

    scale: float
    room: tuple[float, float, float, float]
    boxes: tuple[tuple[float, float, float, float], ...]


class MovieFigure:
    """A figure that draws the states of a movie.

    The fixed parts are drawn once; each state adds the moving parts to a copy.

    Parameters
    ----------
    movie
        Content.
    size
        Width and height in pixels.

    Attributes
    ----------
    size
        Width and height in pixels.
    order : (F,) int64
        State that each frame shows.
    """

    def __init__(self, movie: Movie, size: tuple[int, int]) -> None:
        self.size, self.order = size, movie.order
        base = BASE[len(movie.sequences) - 1]
        dpi = min(size[0] / base[0], size[1] / base[1])
        # Slightly more than whole pixels, because matplotlib rounds down.
        inches = ((size[0] + 1e-3) / dpi, (size[1] + 1e-3) / dpi)
        self._figure = Figure(figsize=inches, dpi=dpi, facecolor="white")
        # The methods of the canvas have no type annotations.
        self._canvas = cast("Any", FigureCanvasAgg(self._figure))
        self._sequences = movie.sequences
        scale = energy_scale(movie.sequences)
        colours = (style.HUMAN, style.OUTPUT) if len(movie.sequences) > 1 else (style.OUTPUT,)
        heading = MARGIN + 0.27 + LINE + LINE * self._has_alarms + 0.1
        entries = _legend_entries(movie.sequences)
        rows = math.ceil(len(entries) / LEGEND_COLUMNS)
        foot = MARGIN + ROW_HEIGHT * rows + 0.56
        frames = _frames(movie.sequences)
        layout = _layout(inches, frames, len(movie.graphs), heading, foot)
        self._curves = [
            Curves(self._figure, graph, box, colours, legend=len(colours) > 1 and number == 0)
            for number, (graph, box) in enumerate(zip(movie.graphs, layout.boxes, strict=True))
        ]
        self._texts: list[tuple[Text, Text | None]] = []
        self._artists = self._add_actors(layout, frames, scale)
        _add_colour_bar(self._figure, scale, MARGIN + ROW_HEIGHT * rows + 0.32)
        add_legend(self._figure, entries, MARGIN, columns=math.ceil(len(entries) / rows))
        self._parts: list[LatticeArtist | SpaceArtist | Curves] = [*self._artists, *self._curves]
        self._canvas.draw()
        self._background = self._canvas.copy_from_bbox(self._figure.bbox)

    @property
    def _has_alarms(self) -> bool:
        return any(any(sequence.alarms) for sequence in self._sequences)

    def _add_actors(
        self, layout: Layout, frames: list[tuple[Any, Any]], scale: PowerNorm
    ) -> list[LatticeArtist | SpaceArtist]:
        """Add the lattices side by side, each with a heading."""
        left, bottom, width, height = layout.room
        sizes = [layout.scale * (high - low) for low, high in frames]
        share = (width - sum(float(size[0]) for size in sizes)) / len(sizes)
        lift = bottom + 0.5 * (height - float(sizes[0][1]))
        artists: list[LatticeArtist | SpaceArtist] = []
        for sequence, (low, high), size in zip(self._sequences, frames, sizes, strict=True):
            self._add_heading(sequence, left)
            corner = (left + 0.5 * share, lift)
            panel = add_panel(self._figure, sequence.problem, corner, layout.scale, low, high)
            kind = SpaceArtist if sequence.problem.lattice.dimension == 3 else LatticeArtist
            artists.append(kind(panel, sequence, scale))
            left += float(size[0]) + share
        return artists

    def _add_heading(self, sequence: StateSequence, left: float) -> None:
        """Add the heading of a lattice; its notes are redrawn for each frame."""
        _, note = style.add_heading(
            self._figure, _shortened(sequence.title), " ", max(left, MARGIN), MARGIN
        )
        alarm = None
        if self._has_alarms:
            (alarm,) = style.add_heading(
                self._figure, "", " ", max(left, MARGIN), MARGIN + 0.27 + LINE
            )
            alarm.set(color=style.INPUT, animated=True)
        note.set_animated(True)
        self._texts.append((note, alarm))

    def draw(self, state: int) -> NDArray[np.uint8]:
        """Return (height, width, 4) red, green, blue and opacity of a state."""
        self._canvas.restore_region(self._background)
        renderer = self._canvas.get_renderer()
        for part in self._parts:
            part.update(state)
            for artist in part.artists:
                artist.draw(renderer)
        for sequence, (note, alarm) in zip(self._sequences, self._texts, strict=True):
            note.set_text(sequence.notes[state])
            note.draw(renderer)
            if alarm is not None:
                alarm.set_text(sequence.alarms[state])
                alarm.draw(renderer)
        return np.array(self._canvas.buffer_rgba(), dtype=np.uint8)


def _frames(
    sequences: tuple[StateSequence, ...],
) -> list[tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """Return the corners of the visible area of each lattice, of one height."""
    problems = [sequence.problem for sequence in sequences]
    if any(problem.lattice.dimension == 3 for problem in problems):
        return of_one_height([whole_frame(sequence) for sequence in sequences])
    return aligned_frames([frame_of(sequence) for sequence in sequences], problems)


def _shortened(title: str) -> str:
    """Return the end of a title that is too long."""
    return title if len(title) <= MAX_TITLE else "…" + title[1 - MAX_TITLE :]


def _layout(
    inches: tuple[float, float],
    frames: list[tuple[NDArray[np.float64], NDArray[np.float64]]],
    graphs: int,
    heading: float,
    foot: float,
) -> Layout:
    """Place graphs beside or below the lattices, whichever makes the lattices larger."""
    wide, tall = inches[0] - 2 * MARGIN, inches[1] - heading - foot
    right_column = (MARGIN, foot, wide - COLUMN - GAP, tall)
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
    for room, boxes in ((right_column, stacked), (above, abreast)):
        scale = min((room[2] - GAP * (len(frames) - 1)) / across, room[3] / up)
        found.append(Layout(scale, room, tuple(boxes)))
    return max(found, key=lambda layout: layout.scale)


def _legend_entries(sequences: tuple[StateSequence, ...]) -> list[tuple[str, Any]]:
    """Return legend entries for the elements that the movie contains."""
    problems = [sequence.problem for sequence in sequences]
    entries: list[tuple[str, Any]] = [("at rest", strut_entry(style.IDLE_REST))]
    if any((sequence.present & ~sequence.load_bearing).any() for sequence in sequences):
        entries.append(("unloaded", strut_entry(style.IDLE, 2.2)))
    entries += support_entries(problems)
    entries.append(("input", arrow_entry(style.INPUT)))
    entries.append(("output, wanted direction", arrow_entry(style.WANTED)))
    entries.append(("output, path", strut_entry(style.OUTPUT, 1.2)))
    return entries


def _add_colour_bar(figure: Figure, scale: PowerNorm, bottom: float) -> None:
    """Add the colour bar with its label on the left."""
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
        "strain energy of a beam" + unit_label(unit),
        family=style.FONT,
        size=style.SMALL_SIZE,
        color=style.INK,
        ha="right",
        va="center",
    )
