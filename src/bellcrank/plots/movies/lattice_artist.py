"""The drawing of one lattice in a movie: fixed parts, and parts updated for each state."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.colors import LinearSegmentedColormap, PowerNorm

from bellcrank.plots import style
from bellcrank.plots.marks import Panel, add_arrows, add_nodes, add_struts, add_supports
from bellcrank.plots.scene import (
    Arrow,
    extent,
    input_arrows,
    outline_around,
    output_arrows,
    spacing,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.artist import Artist
    from numpy.typing import NDArray

    from bellcrank.plots.movies.records import StateSequence

ENERGY = LinearSegmentedColormap.from_list(
    "energy", ["#a9b5c1", "#7f9fbd", "#e8a33d", "#d9480f", "#7a1500"]
)
"""Grey for low, dark for high strain energy; monotonic in brightness."""
TOP_QUANTILE = 0.995
"""Quantile of the energies at the end of the colour scale; beams above it share one colour."""
REMOVED = "#e8998d"
ADDED = "#009e73"


def energy_scale(sequences: tuple[StateSequence, ...]) -> PowerNorm | None:
    """Return the colour scale for all states, or None if beams are drawn in black."""
    known = [sequence.energy for sequence in sequences if sequence.energy is not None]
    if not known:
        return None
    tops = [np.quantile(energy, TOP_QUANTILE, axis=1).max() for energy in known]
    return PowerNorm(0.5, 0.0, float(max(tops)) or 1.0, clip=True)


def frame_of(sequence: StateSequence) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the lower left and upper right corner of all states, lattice units."""
    problem = sequence.problem
    positions, step = problem.lattice.positions, spacing(problem)
    seen = sequence.present.any(axis=0)
    nodes = np.unique(
        np.concatenate(
            [problem.lattice.beams[seen].ravel(), problem.input.nodes, problem.output.nodes]
        )
    )
    points = [positions, sequence.moved[:, nodes].reshape(-1, 2)]
    if len(problem.supports.nodes):
        points.append(outline_around(positions[problem.supports.nodes], 0.35 * step))
    return extent(points, [*input_arrows(problem), *_output_arrows(sequence)], 0.2 * step)


class LatticeArtist:
    """The artists of one lattice.

    Parameters
    ----------
    panel
        Panel to draw on; the fixed parts are drawn at once.
    sequence
        States of the lattice.
    scale
        Colour scale; None for black beams.

    Attributes
    ----------
    artists
        Matplotlib artists that are redrawn for each state.
    """

    def __init__(self, panel: Panel, sequence: StateSequence, scale: PowerNorm | None) -> None:
        self._panel, self._sequence, self._moved = panel, sequence, sequence.moved
        self._beams = sequence.problem.lattice.beams
        held = np.isin(self._beams, sequence.problem.supports.fixed).all(axis=1)
        self._held = held
        self._one_design = sequence.is_one_design
        self._draw_fixed_parts()
        rest = sequence.problem.lattice.positions
        coloured: dict[str, Any] = {"colors": style.INK}
        if scale is not None:
            coloured = {"cmap": ENERGY, "norm": scale}
        self._ghost = self._struts(1.0, colors=style.IDLE_REST)
        self._removed = self._struts(0.55, colors=REMOVED)
        marks = [] if self._one_design else self._created(self._mark_rest)
        self._unloaded = self._struts(0.55, colors=style.IDLE)
        self._loaded = self._struts(1.0, **coloured)
        self._added = self._struts(1.0, colors=ADDED)
        self._trail = self._struts(0.22, colors=style.OUTPUT, alpha=0.75)
        problem = sequence.problem
        regions = ((problem.input.nodes, style.INPUT), (problem.output.nodes, style.OUTPUT))
        self._dots: list[tuple[NDArray[np.int64], Any]] = []
        for nodes, colour in regions:
            (dot,) = self._created(partial(add_nodes, panel, rest[nodes], colour))
            self._dots.append((nodes, dot))
        self._input_arrows = input_arrows(problem)
        self._arrows: list[Any] = self._created(
            partial(add_arrows, panel, self._input_arrows, style.INPUT, bold=True)
        )
        self.artists: list[Any] = [
            self._ghost, self._removed, *marks, self._unloaded, self._loaded, self._added,
            self._trail, *(dot for _, dot in self._dots), *self._arrows,
        ]  # fmt: skip
        for artist in self.artists:
            artist.set_animated(True)

    def _draw_fixed_parts(self) -> None:
        """Draw the supports and, for one design, the structure at rest."""
        panel, sequence = self._panel, self._sequence
        rest = sequence.problem.lattice.positions
        add_supports(panel)
        ground = np.flatnonzero(sequence.present[0] & self._held)
        add_struts(panel, rest, ground, style.GROUND, width=0.6, level=1.0)
        if self._one_design:
            free = np.flatnonzero(sequence.present[0] & ~self._held)
            add_struts(panel, rest, free, style.IDLE_REST, level=1.5)
            self._mark_rest()
        add_arrows(panel, _output_arrows(sequence), style.WANTED, bold=True)

    def _mark_rest(self) -> None:
        """Mark the rest positions of the input and output nodes."""
        problem = self._sequence.problem
        for nodes, colour in (
            (problem.input.nodes, style.INPUT),
            (problem.output.nodes, style.OUTPUT),
        ):
            add_nodes(self._panel, problem.lattice.positions[nodes], colour, hollow=True)

    def _struts(self, width: float, **options: Any) -> LineCollection:
        """Add an empty collection of lines; `width` is a multiple of the strut width."""
        points = max(width * self._panel.strut, 0.6)
        drawn = LineCollection([], linewidths=points, capstyle="round", **options)
        self._panel.axes.add_collection(drawn, autolim=False)
        return drawn

    def _created(self, draw: Callable[[], None]) -> list[Artist]:
        """Call a drawing function; return the artists that it adds to the panel."""
        before = set(self._panel.axes.get_children())
        draw()
        return [one for one in self._panel.axes.get_children() if one not in before]

    def update(self, state: int) -> None:
        """Update all artists to a state."""
        sequence, moved = self._sequence, self._moved[state]
        present = sequence.present[state] & ~self._held
        loaded = np.flatnonzero(present & sequence.load_bearing[state])
        if sequence.energy is not None:
            energy = sequence.energy[state]
            loaded = loaded[np.argsort(energy[loaded], kind="stable")]
            self._loaded.set_array(energy[loaded])
        self._loaded.set_segments(list(moved[self._beams[loaded]]))
        unloaded = np.flatnonzero(present & ~sequence.load_bearing[state])
        self._unloaded.set_segments(list(moved[self._beams[unloaded]]))
        if not self._one_design:
            self._show_changes(state, present)
        nodes = sequence.problem.output.nodes
        path = self._moved[: state + 1] if self._one_design else moved[None]
        rest = sequence.problem.lattice.positions[None]
        self._trail.set_segments(list(np.concatenate([rest, path])[:, nodes].transpose(1, 0, 2)))
        for nodes, dot in self._dots:
            dot.set_data(*moved[nodes].T)
        self._move_input_arrows(moved)

    def _show_changes(self, state: int, present: NDArray[np.bool_]) -> None:
        """Update the lattice at rest and the beams added and removed since the previous state."""
        sequence, rest = self._sequence, self._sequence.problem.lattice.positions
        before = sequence.present[max(state - 1, 0)] & ~self._held
        removed, added = np.flatnonzero(before & ~present), np.flatnonzero(present & ~before)
        self._ghost.set_segments(list(rest[self._beams[present]]))
        self._removed.set_segments(list(rest[self._beams[removed]]))
        self._added.set_segments(list(self._moved[state][self._beams[added]]))

    def _move_input_arrows(self, moved: NDArray[np.float64]) -> None:
        """Move the input arrows with the input nodes."""
        region = self._sequence.problem.input
        shift = moved[region.nodes] - self._sequence.problem.lattice.positions[region.nodes]
        if len(self._input_arrows) != len(shift):
            shift = shift.mean(axis=0, keepdims=True).repeat(len(self._input_arrows), axis=0)
        for arrow, rest, (x, y) in zip(self._arrows, self._input_arrows, shift, strict=True):
            arrow.set_data(x=rest.tail[0] + x, y=rest.tail[1] + y)


def _output_arrows(sequence: StateSequence) -> list[Arrow]:
    """Return output arrows that do not overlap the output nodes in any state."""
    output = sequence.problem.output
    reach = (sequence.moved[:, output.nodes] * output.direction).sum(axis=2).max(axis=1)
    return output_arrows(sequence.problem, sequence.moved[int(reach.argmax())])
