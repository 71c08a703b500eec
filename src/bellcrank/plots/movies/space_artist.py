"""The drawing of one lattice in space in a movie, seen by a camera that turns along the stroke."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.patches import Polygon

from bellcrank.plots import style
from bellcrank.plots.marks import Panel, add_arrows, add_nodes
from bellcrank.plots.movies.lattice_artist import ENERGY, created
from bellcrank.plots.scene import Arrow, Motion, extent, outline_around, spacing, support_groups
from bellcrank.plots.space import View, input_arrows, margins, output_arrows, view_from

if TYPE_CHECKING:
    from matplotlib.colors import PowerNorm
    from numpy.typing import NDArray

    from bellcrank.plots.movies.records import StateSequence

    Points = NDArray[np.float64]

AZIMUTHS = (-50.0, -10.0)
"""Azimuth of the camera at rest and at full stroke, degrees."""
ELEVATION = 16.0
STRUTS, TRAIL, DOTS = 3.0, 4.0, 6.0
"""Levels of drawing."""


def view_at(sequence: StateSequence, state: int) -> View:
    """Return the view of a state."""
    share = state / max(len(sequence.notes) - 1, 1)
    first, last = AZIMUTHS
    positions = sequence.problem.lattice.positions
    middle = 0.5 * (positions.min(axis=0) + positions.max(axis=0))
    return view_from(first + share * (last - first), ELEVATION, middle)


def frame_in_space(sequence: StateSequence) -> tuple[Points, Points]:
    """Return the lower left and upper right corner of all states, lattice units."""
    problem = sequence.problem
    positions, step = problem.lattice.positions, spacing(problem)
    beams = problem.lattice.beams[sequence.present]
    nodes = np.unique(np.concatenate([beams.ravel(), problem.input.nodes, problem.output.nodes]))
    points, arrows = [], []
    for state in range(len(sequence.moved)):
        view = view_at(sequence, state)
        points += [view.screen(positions[nodes]), view.screen(sequence.moved[state][nodes])]
        arrows += _arrows(sequence, state, view)
        if len(problem.supports.nodes):
            held = view.screen(positions[problem.supports.nodes])
            points.append(outline_around(held, 0.35 * step))
    return extent(points, arrows, 0.2 * step)


def _arrows(sequence: StateSequence, state: int, view: View) -> list[Arrow]:
    motion = _motion(sequence, state)
    return [*input_arrows(motion, view), *output_arrows(motion, view)]


def _motion(sequence: StateSequence, state: int) -> Motion:
    design = sequence.problem.full_design()
    return Motion(design, sequence.moved[state] - sequence.problem.lattice.positions)


class SpaceArtist:
    """The artists of one lattice in space.

    Parameters and attributes are those of `bellcrank.plots.movies.lattice_artist.LatticeArtist`.
    """

    def __init__(self, panel: Panel, sequence: StateSequence, scale: PowerNorm) -> None:
        self._panel, self._sequence, self._scale = panel, sequence, scale
        self._moved = sequence.moved
        problem = sequence.problem
        self._beams = problem.lattice.beams
        held = np.isin(self._beams, problem.supports.fixed).all(axis=1)
        self._ground = np.flatnonzero(sequence.present & held)
        self._free = np.flatnonzero(sequence.present & ~held)
        self._supports = [self._support() for _ in support_groups(problem)]
        self._on_ground = self._lines(1.0, colors=style.GROUND)
        self._at_rest = self._lines(1.5, colors=style.IDLE_REST)
        self._struts = self._lines(STRUTS)
        self._trail = self._lines(TRAIL, colors=style.OUTPUT, linewidths=0.8)
        regions = ((problem.input.nodes, style.INPUT), (problem.output.nodes, style.OUTPUT))
        view, rest = view_at(sequence, 0), problem.lattice.positions
        self._dots: list[tuple[NDArray[np.int64], Any]] = []
        for nodes, colour in regions:
            (dot,) = created(panel, partial(add_nodes, panel, view.screen(rest[nodes]), colour))
            self._dots.append((nodes, dot))
        motion = _motion(sequence, 0)
        self._inputs = created(
            panel,
            partial(add_arrows, panel, input_arrows(motion, view), style.INPUT, bold=True),
        )
        self._outputs = created(
            panel,
            partial(add_arrows, panel, output_arrows(motion, view), style.WANTED, bold=True),
        )
        self.artists: list[Any] = [
            *self._supports, self._on_ground, self._at_rest, self._struts, self._trail,
            *self._outputs, *(dot for _, dot in self._dots), *self._inputs,
        ]  # fmt: skip
        for artist in self.artists:
            artist.set_animated(True)

    def _support(self) -> Polygon:
        area = Polygon(
            np.zeros((3, 2)), facecolor=style.GROUND_FILL, edgecolor=style.GROUND, linewidth=1.0,
            hatch="////", zorder=0.5,
        )  # fmt: skip
        self._panel.axes.add_patch(area)
        return area

    def _lines(self, level: float, **options: Any) -> LineCollection:
        lines = LineCollection([], capstyle="round", zorder=level, **options)
        self._panel.axes.add_collection(lines, autolim=False)
        return lines

    def update(self, state: int) -> None:
        """Update all artists to a state."""
        sequence, moved, problem = self._sequence, self._moved[state], self._sequence.problem
        view, rest = view_at(sequence, state), problem.lattice.positions
        seen = view.screen(rest)
        for area, group in zip(self._supports, support_groups(problem), strict=True):
            area.set_xy(outline_around(seen[group], 0.3 * spacing(problem)))
        for lines, beams in ((self._on_ground, self._ground), (self._at_rest, self._free)):
            lines.set_segments(list(seen[self._beams[beams]]))
            lines.set_linewidth(self._panel.struts(beams, 0.6).tolist())
        depth = (moved[self._beams[self._free]] @ view.toward).mean(axis=1)
        order = self._free[np.argsort(depth, kind="stable")]
        colours = ENERGY(self._scale(sequence.energy[state][order]))[:, :3]
        segments, colours, widths = margins(
            view.screen(moved[self._beams[order]]), colours, self._panel.struts(order)
        )
        self._struts.set_segments(list(segments))
        self._struts.set_color(list(colours))
        self._struts.set_linewidth(widths.tolist())
        path = np.concatenate([rest[None], self._moved[: state + 1]])[:, problem.output.nodes]
        self._trail.set_segments(list(view.screen(path).transpose(1, 0, 2)))
        for nodes, dot in self._dots:
            dot.set_data(*view.screen(moved[nodes]).T)
        self._move_arrows(state, view)

    def _move_arrows(self, state: int, view: View) -> None:
        """Turn the arrows with the camera, and move those of the input with its nodes."""
        problem, moved = self._sequence.problem, self._moved[state]
        nodes = problem.input.nodes
        shift = (view.screen(moved) - view.screen(problem.lattice.positions))[nodes].mean(axis=0)
        motion = _motion(self._sequence, state)
        for artists, arrows, by in (
            (self._inputs, input_arrows(motion, view), shift),
            (self._outputs, output_arrows(motion, view), np.zeros(2)),
        ):
            for artist, arrow in zip(artists, arrows, strict=True):
                x, y = np.add(arrow.tail, by)
                dx, dy = np.subtract(arrow.tip, arrow.tail)
                artist.set_data(x=x, y=y, dx=dx, dy=dy)
