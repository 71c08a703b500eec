"""The drawing of one lattice in space in a movie, seen by a camera that turns along the stroke."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.collections import LineCollection

from bellcrank.plots import style
from bellcrank.plots.marks import Panel, add_arrows, add_nodes, support_area
from bellcrank.plots.movies.lattice_artist import ENERGY, created
from bellcrank.plots.scene import Motion, outline_around, spacing, support_groups
from bellcrank.plots.space import (
    View,
    frame_in_space,
    input_arrows,
    margins,
    output_arrows,
    view_from,
)

if TYPE_CHECKING:
    from matplotlib.colors import PowerNorm
    from numpy.typing import NDArray

    from bellcrank.plots.movies.records import StateSequence

    Points = NDArray[np.float64]

AZIMUTHS = (-50.0, -10.0)
"""Azimuth of the camera at rest and at full stroke, degrees."""
ELEVATION = 16.0


def view_at(sequence: StateSequence, state: int) -> View:
    """Return the view of a state."""
    share = state / max(len(sequence.notes) - 1, 1)
    first, last = AZIMUTHS
    positions = sequence.problem.lattice.positions
    middle = 0.5 * (positions.min(axis=0) + positions.max(axis=0))
    return view_from(first + share * (last - first), ELEVATION, middle)


def whole_frame(sequence: StateSequence) -> tuple[Points, Points]:
    """Return the lower left and upper right corner of all states, lattice units."""
    frames = [
        frame_in_space(_motion(sequence, state), view_at(sequence, state))
        for state in range(len(sequence.notes))
    ]
    low, high = np.array(frames).transpose(1, 0, 2)
    return low.min(axis=0), high.max(axis=0)


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
        self._groups = support_groups(problem)
        self._supports = [support_area(np.zeros((3, 2))) for _ in self._groups]
        for area in self._supports:
            panel.axes.add_patch(area)
        self._on_ground = self._lines(1.0, colors=style.GROUND)
        self._at_rest = self._lines(1.5, colors=style.IDLE_REST)
        self._struts = self._lines(3.0)
        self._trail = self._lines(4.0, colors=style.OUTPUT, linewidths=0.8)
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

    def _lines(self, level: float, **options: Any) -> LineCollection:
        lines = LineCollection([], capstyle="round", zorder=level, **options)
        self._panel.axes.add_collection(lines, autolim=False)
        return lines

    def update(self, state: int) -> None:
        """Update all artists to a state."""
        sequence, moved, problem = self._sequence, self._moved[state], self._sequence.problem
        view, rest = view_at(sequence, state), problem.lattice.positions
        seen = view.screen(rest)
        for area, group in zip(self._supports, self._groups, strict=True):
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
