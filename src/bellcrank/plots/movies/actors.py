"""One lattice on the stage: what stands still, and what is drawn anew for each state."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.colors import LinearSegmentedColormap, PowerNorm

from bellcrank.plots import style
from bellcrank.plots.marks import Panel, put_arrows, put_nodes, put_struts, put_supports
from bellcrank.plots.scene import (
    Arrow,
    extent,
    input_arrows,
    outline_around,
    spacing,
    wanted_arrows,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.artist import Artist
    from numpy.typing import NDArray

    from bellcrank.plots.movies.records import Course

ENERGY = LinearSegmentedColormap.from_list(
    "energy", ["#a9b5c1", "#7f9fbd", "#e8a33d", "#d9480f", "#7a1500"]
)
"""Grey where nothing happens, dark where most of the work goes; readable without colours too."""
TOP_SHARE = 0.995
"""Part of the beams that the colours tell apart: the few worst ones share the darkest."""
GONE = "#e8998d"
CAME = "#009e73"


def energy_scale(courses: tuple[Course, ...]) -> PowerNorm | None:
    """Return the scale of colours for all states; None where beams are drawn in black."""
    known = [course.energy for course in courses if course.energy is not None]
    if not known:
        return None
    tops = [np.quantile(energy, TOP_SHARE, axis=1).max() for energy in known]
    return PowerNorm(0.5, 0.0, float(max(tops)) or 1.0, clip=True)


def frame_of(course: Course) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lower left and upper right corner, lattice units, of all that is ever drawn."""
    problem = course.problem
    positions, step = problem.lattice.positions, spacing(problem)
    seen = course.present.any(axis=0)
    nodes = np.unique(
        np.concatenate(
            [problem.lattice.beams[seen].ravel(), problem.input.nodes, problem.output.nodes]
        )
    )
    places = [positions, course.moved[:, nodes].reshape(-1, 2)]
    if len(problem.supports.nodes):
        places.append(outline_around(positions[problem.supports.nodes], 0.35 * step))
    return extent(places, [*input_arrows(problem), *_wanted(course)], 0.2 * step)


class Actor:
    """Draws one lattice.

    Parameters
    ----------
    panel
        Where; what stands still is put on it at once.
    course
        What the lattice goes through.
    scale
        Of the colours; None for black beams.
    """

    def __init__(self, panel: Panel, course: Course, scale: PowerNorm | None) -> None:
        self._panel, self._course, self._moved = panel, course, course.moved
        self._beams = course.problem.lattice.beams
        held = np.isin(self._beams, course.problem.supports.fixed).all(axis=1)
        self._ground = held
        self._one = course.is_one_design
        self._still()
        rest = course.problem.lattice.positions
        coloured: dict[str, Any] = {"colors": style.INK}
        if scale is not None:
            coloured = {"cmap": ENERGY, "norm": scale}
        self._ghost = self._struts(1.0, colors=style.IDLE_REST)
        self._gone = self._struts(0.55, colors=GONE)
        marks = [] if self._one else self._moving(self._mark_rest)
        self._idle = self._struts(0.55, colors=style.IDLE)
        self._bearing = self._struts(1.0, **coloured)
        self._came = self._struts(1.0, colors=CAME)
        self._trail = self._struts(0.22, colors=style.OUTPUT, alpha=0.75)
        problem = course.problem
        regions = ((problem.input.nodes, style.INPUT), (problem.output.nodes, style.OUTPUT))
        self._dots: list[tuple[NDArray[np.int64], Any]] = []
        for nodes, colour in regions:
            (dot,) = self._moving(partial(put_nodes, panel, rest[nodes], colour))
            self._dots.append((nodes, dot))
        self._pushes = input_arrows(problem)
        self._arrows: list[Any] = self._moving(
            partial(put_arrows, panel, self._pushes, style.INPUT, bold=True)
        )
        self.artists: list[Any] = [
            self._ghost, self._gone, *marks, self._idle, self._bearing, self._came, self._trail,
            *(dot for _, dot in self._dots), *self._arrows,
        ]  # fmt: skip
        for artist in self.artists:
            artist.set_animated(True)

    def _still(self) -> None:
        """Draw what never moves."""
        panel, course = self._panel, self._course
        rest = course.problem.lattice.positions
        put_supports(panel)
        ground = np.flatnonzero(course.present[0] & self._ground)
        put_struts(panel, rest, ground, style.GROUND, width=0.6, level=1.0)
        if self._one:
            free = np.flatnonzero(course.present[0] & ~self._ground)
            put_struts(panel, rest, free, style.IDLE_REST, level=1.5)
            self._mark_rest()
        put_arrows(panel, _wanted(course), style.WANTED, bold=True)

    def _mark_rest(self) -> None:
        """Mark where the nodes of the regions are at rest."""
        problem = self._course.problem
        for nodes, colour in (
            (problem.input.nodes, style.INPUT),
            (problem.output.nodes, style.OUTPUT),
        ):
            put_nodes(self._panel, problem.lattice.positions[nodes], colour, hollow=True)

    def _struts(self, width: float, **looks: Any) -> LineCollection:
        """Add an empty collection of lines, as wide as so many struts."""
        points = max(width * self._panel.strut, 0.6)
        drawn = LineCollection([], linewidths=points, capstyle="round", **looks)
        self._panel.axes.add_collection(drawn, autolim=False)
        return drawn

    def _moving(self, put: Callable[[], None]) -> list[Artist]:
        """Put marks on the panel; return what came."""
        before = set(self._panel.axes.get_children())
        put()
        return [one for one in self._panel.axes.get_children() if one not in before]

    def place(self, state: int) -> None:
        """Move everything to a state."""
        course, moved = self._course, self._moved[state]
        present = course.present[state] & ~self._ground
        bearing = np.flatnonzero(present & course.bearing[state])
        if course.energy is not None:
            energy = course.energy[state]
            bearing = bearing[np.argsort(energy[bearing], kind="stable")]
            self._bearing.set_array(energy[bearing])
        self._bearing.set_segments(list(moved[self._beams[bearing]]))
        idle = np.flatnonzero(present & ~course.bearing[state])
        self._idle.set_segments(list(moved[self._beams[idle]]))
        if not self._one:
            self._show_changes(state, present)
        nodes = course.problem.output.nodes
        path = self._moved[: state + 1] if self._one else moved[None]
        rest = course.problem.lattice.positions[None]
        self._trail.set_segments(list(np.concatenate([rest, path])[:, nodes].transpose(1, 0, 2)))
        for nodes, dot in self._dots:
            dot.set_data(*moved[nodes].T)
        self._push(moved)

    def _show_changes(self, state: int, present: NDArray[np.bool_]) -> None:
        """Draw the lattice at rest, and what came and went since the state before."""
        course, rest = self._course, self._course.problem.lattice.positions
        before = course.present[max(state - 1, 0)] & ~self._ground
        gone, came = np.flatnonzero(before & ~present), np.flatnonzero(present & ~before)
        self._ghost.set_segments(list(rest[self._beams[present]]))
        self._gone.set_segments(list(rest[self._beams[gone]]))
        self._came.set_segments(list(self._moved[state][self._beams[came]]))

    def _push(self, moved: NDArray[np.float64]) -> None:
        """Let the arrows of the input go with it."""
        region = self._course.problem.input
        shift = moved[region.nodes] - self._course.problem.lattice.positions[region.nodes]
        if len(self._pushes) != len(shift):
            shift = shift.mean(axis=0, keepdims=True).repeat(len(self._pushes), axis=0)
        for arrow, push, (x, y) in zip(self._arrows, self._pushes, shift, strict=True):
            arrow.set_data(x=push.tail[0] + x, y=push.tail[1] + y)


def _wanted(course: Course) -> list[Arrow]:
    """Return arrows of the output that stay clear of it in every state."""
    output = course.problem.output
    reach = (course.moved[:, output.nodes] * output.direction).sum(axis=2).max(axis=1)
    return wanted_arrows(course.problem, course.moved[int(reach.argmax())])
