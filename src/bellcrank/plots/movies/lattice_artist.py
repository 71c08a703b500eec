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

    from numpy.typing import NDArray

    from bellcrank.plots.movies.records import StateSequence

ENERGY = LinearSegmentedColormap.from_list(
    "energy", ["#a9b5c1", "#7f9fbd", "#e8a33d", "#d9480f", "#7a1500"]
)
"""Grey for low, dark for high strain energy; monotonic in brightness."""
TOP_QUANTILE = 0.995
"""Quantile of the energies at the end of the colour scale; beams above it share one colour."""


def energy_scale(sequences: tuple[StateSequence, ...]) -> PowerNorm:
    """Return the colour scale for all states."""
    tops = [np.quantile(one.energy, TOP_QUANTILE, axis=1).max() for one in sequences]
    return PowerNorm(0.5, 0.0, float(max(tops)) or 1.0, clip=True)


def frame_of(sequence: StateSequence) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the lower left and upper right corner of all states, lattice units."""
    problem = sequence.problem
    positions, step = problem.lattice.positions, spacing(problem)
    beams = problem.lattice.beams[sequence.present]
    nodes = np.unique(np.concatenate([beams.ravel(), problem.input.nodes, problem.output.nodes]))
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
        Colour scale of the energy.

    Attributes
    ----------
    artists
        Matplotlib artists that are redrawn for each state.
    """

    def __init__(self, panel: Panel, sequence: StateSequence, scale: PowerNorm) -> None:
        self._panel, self._sequence, self._moved = panel, sequence, sequence.moved
        self._beams = sequence.problem.lattice.beams
        ends = np.isin(self._beams, sequence.problem.supports.fixed)
        held = ends[:, 0] & ends[:, 1]
        self._draw_fixed_parts(held)
        rest = sequence.problem.lattice.positions
        self._free = sequence.present & ~held
        self._unloaded = self._struts(0.55, colors=style.IDLE)
        self._loaded = self._struts(1.0, cmap=ENERGY, norm=scale)
        self._trail = self._struts(0.22, colors=style.OUTPUT, alpha=0.75)
        problem = sequence.problem
        regions = ((problem.input.nodes, style.INPUT), (problem.output.nodes, style.OUTPUT))
        self._dots: list[tuple[NDArray[np.int64], Any]] = []
        for nodes, colour in regions:
            (dot,) = created(panel, partial(add_nodes, panel, rest[nodes], colour))
            self._dots.append((nodes, dot))
        self._input_arrows = input_arrows(problem)
        self._arrows: list[Any] = created(
            panel, partial(add_arrows, panel, self._input_arrows, style.INPUT, bold=True)
        )
        self.artists: list[Any] = [
            self._unloaded, self._loaded, self._trail, *(dot for _, dot in self._dots),
            *self._arrows,
        ]  # fmt: skip
        for artist in self.artists:
            artist.set_animated(True)

    def _draw_fixed_parts(self, held: NDArray[np.bool_]) -> None:
        """Draw the supports, the structure at rest, and the input and output nodes at rest."""
        panel, problem = self._panel, self._sequence.problem
        present, rest = self._sequence.present, problem.lattice.positions
        add_supports(panel)
        ground, free = np.flatnonzero(present & held), np.flatnonzero(present & ~held)
        add_struts(panel, rest, ground, style.GROUND, width=0.6, level=1.0)
        add_struts(panel, rest, free, style.IDLE_REST, level=1.5)
        add_nodes(panel, rest[problem.input.nodes], style.INPUT, hollow=True)
        add_nodes(panel, rest[problem.output.nodes], style.OUTPUT, hollow=True)
        add_arrows(panel, _output_arrows(self._sequence), style.WANTED, bold=True)

    def _struts(self, width: float, **options: Any) -> LineCollection:
        """Add an empty collection of lines; `width` is a multiple of the strut width."""
        points = max(width * self._panel.strut, 0.6)
        drawn = LineCollection([], linewidths=points, capstyle="round", **options)
        self._panel.axes.add_collection(drawn, autolim=False)
        return drawn

    def update(self, state: int) -> None:
        """Update all artists to a state."""
        sequence, moved = self._sequence, self._moved[state]
        loaded = np.flatnonzero(self._free & sequence.load_bearing)
        energy = sequence.energy[state]
        loaded = loaded[np.argsort(energy[loaded], kind="stable")]
        self._loaded.set_array(energy[loaded])
        self._loaded.set_segments(list(moved[self._beams[loaded]]))
        self._loaded.set_linewidth(self._panel.struts(loaded).tolist())
        unloaded = np.flatnonzero(self._free & ~sequence.load_bearing)
        self._unloaded.set_segments(list(moved[self._beams[unloaded]]))
        self._unloaded.set_linewidth(self._panel.struts(unloaded, 0.55).tolist())
        nodes = sequence.problem.output.nodes
        path = self._moved[: state + 1]
        rest = sequence.problem.lattice.positions[None]
        self._trail.set_segments(list(np.concatenate([rest, path])[:, nodes].transpose(1, 0, 2)))
        for nodes, dot in self._dots:
            dot.set_data(*moved[nodes].T)
        self._move_input_arrows(moved)

    def _move_input_arrows(self, moved: NDArray[np.float64]) -> None:
        """Move the input arrows with the input nodes."""
        region = self._sequence.problem.input
        shift = moved[region.nodes] - self._sequence.problem.lattice.positions[region.nodes]
        if len(self._input_arrows) != len(shift):
            shift = shift.mean(axis=0, keepdims=True).repeat(len(self._input_arrows), axis=0)
        for arrow, rest, (x, y) in zip(self._arrows, self._input_arrows, shift, strict=True):
            arrow.set_data(x=rest.tail[0] + x, y=rest.tail[1] + y)


def created(panel: Panel, draw: Callable[[], None]) -> list[Any]:
    """Call a drawing function; return the artists that it adds to the panel."""
    before = set(panel.axes.get_children())
    draw()
    return [one for one in panel.axes.get_children() if one not in before]


def _output_arrows(sequence: StateSequence) -> list[Arrow]:
    """Return output arrows that do not overlap the output nodes in any state."""
    output = sequence.problem.output
    reach = (sequence.moved[:, output.nodes] * output.direction).sum(axis=2).max(axis=1)
    return output_arrows(sequence.problem, sequence.moved[int(reach.argmax())])
