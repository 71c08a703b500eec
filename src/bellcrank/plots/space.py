"""Drawings of designs in space: parallel projection, near struts dark and in front."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgb

from bellcrank.plots import style
from bellcrank.plots.marks import Panel, add_arrows, add_nodes, add_path, support_area
from bellcrank.plots.scene import (
    Arrow,
    Motion,
    arrow_length,
    beam_kinds,
    extent,
    outline_around,
    output_displacements,
    spacing,
    support_groups,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.model import Input, Output

    Points = NDArray[np.float64]

PALE = 0.72
"""Part of white in the colour of the farthest struts."""
HALO, SHORTER = 1.6, 0.2
"""Width of the white margin of a strut, over the width of the strut, and the part of its length by
which the margin is shorter at each end, so that it does not cover other struts of the joint."""


class View(NamedTuple):
    """A direction of view: unit vectors to the right, up, and toward the viewer."""

    right: Points
    up: Points
    toward: Points
    middle: Points
    """The point in the middle of the picture."""

    def screen(self, points: Points) -> Points:
        """Return (..., 2) the positions of points (..., 3) in the picture."""
        relative = points - self.middle
        return np.stack([relative @ self.right, relative @ self.up], axis=-1)


def view_from(
    azimuth: float = -28.0, elevation: float = 16.0, middle: Points | None = None
) -> View:
    """Return a view.

    Parameters
    ----------
    azimuth
        Angle about z from which the viewer looks, degrees; 0 from the front, 90 from the right.
    elevation
        Angle above the horizontal, degrees.
    middle : (3,), optional
        The point in the middle of the picture; the origin by default.

    Examples
    --------
    >>> view_from(0.0, 0.0).screen(np.array([1.0, 5.0, 2.0]))
    array([1., 2.])
    """
    a, e = math.radians(azimuth), math.radians(elevation)
    right = np.array([math.cos(a), math.sin(a), 0.0])
    toward = np.array([math.sin(a) * math.cos(e), -math.cos(a) * math.cos(e), math.sin(e)])
    return View(right, np.cross(toward, right), toward, np.zeros(3) if middle is None else middle)


VIEW = view_from()


def frame_in_space(
    motion: Motion, view: View = VIEW
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the lower left and upper right corner, (2,) each, of a drawing, lattice units."""
    problem = motion.design.problem
    rest, moved = (view.screen(each) for each in (problem.lattice.positions, motion.moved))
    points = [rest, moved]
    if len(problem.supports.fixed):
        points.append(outline_around(rest[problem.supports.fixed], 0.35 * spacing(problem)))
    return extent(points, arrows_in_space(motion, view), 0.2 * spacing(problem))


def arrows_in_space(motion: Motion, view: View = VIEW) -> list[Arrow]:
    """Return the arrows of the input and of the wanted directions of the outputs."""
    return [*input_arrows(motion, view), *output_arrows(motion, view)]


def add_drawing_in_space(
    panel: Panel, motion: Motion, view: View = VIEW, *, displaced: bool = True
) -> None:
    """Draw a design on a panel, at rest or displaced."""
    problem = panel.problem
    rest, moved = problem.lattice.positions, motion.moved
    _add_supports(panel, view)
    kinds = beam_kinds(motion.design)
    if displaced:
        _add_struts(panel, rest, kinds.load_bearing, style.REST, view, level=2.0, shaded=False)
    _add_struts(panel, rest, kinds.ground, style.GROUND, view, level=1.0, shaded=False)
    present = np.concatenate([kinds.load_bearing, kinds.unloaded])
    _add_struts(panel, moved if displaced else rest, present, style.INK, view, level=3.0)
    ends = [(problem.input.nodes, style.INPUT)]
    ends += [(output.nodes, style.OUTPUT) for output in problem.outputs.values()]
    for nodes, colour in ends:
        if displaced:
            add_nodes(panel, view.screen(rest[nodes]), colour, hollow=True)
        add_nodes(panel, view.screen(moved[nodes] if displaced else rest[nodes]), colour)
    add_arrows(panel, input_arrows(motion, view), style.INPUT, bold=True)
    add_arrows(panel, output_arrows(motion, view), style.WANTED, bold=True)
    if displaced and not motion.paths:
        arrows = [_projected(view, *ends) for ends in output_displacements(motion)]
        add_arrows(panel, arrows, style.OUTPUT, level=5.5)
    if displaced:
        for path in motion.drawn_paths(wanted=True):
            add_path(panel, view.screen(path), style.WANTED, wanted=True)
        for path in motion.drawn_paths():
            add_path(panel, view.screen(path), style.OUTPUT)


def _add_struts(
    panel: Panel,
    positions: Points,
    beams: NDArray[np.int64],
    colour: str,
    view: View,
    *,
    level: float,
    shaded: bool = True,
) -> None:
    """Draw struts from the farthest to the nearest, each with a white margin if they are shaded."""
    if not len(beams):
        return
    ends = positions[panel.problem.lattice.beams[beams]]
    depth = (ends @ view.toward).mean(axis=1)
    order = np.argsort(depth)
    lines, widths = view.screen(ends[order]), panel.struts(beams[order])
    if not shaded:
        collection = LineCollection(
            list(lines), colors=colour, linewidths=widths, capstyle="round", zorder=level
        )
        panel.axes.add_collection(collection, autolim=False)
        return
    share = (depth[order] - depth.min()) / max(float(np.ptp(depth)), 1e-12)
    white = PALE * (1.0 - share)[:, None]
    colours = (1.0 - white) * np.array(to_rgb(colour)) + white
    segments, colours, widths = margins(lines, colours, widths)
    collection = LineCollection(
        list(segments), colors=colours, linewidths=widths, capstyle="round", zorder=level
    )
    panel.axes.add_collection(collection, autolim=False)


def margins(
    lines: Points, colours: NDArray[np.float64], widths: Points
) -> tuple[Points, NDArray[np.float64], Points]:
    """Return lines with a white margin below each, which is shorter at both ends.

    Parameters
    ----------
    lines : (n, 2, 2)
        In the order of drawing.
    colours : (n, 3)
    widths : (n,)

    Returns
    -------
    lines, colours, widths
        (2 n, ...) of both.
    """
    inner = lines + SHORTER * (lines[:, ::-1] - lines)
    return (
        np.stack([inner, lines], axis=1).reshape(-1, 2, 2),
        np.stack([np.ones_like(colours), colours], axis=1).reshape(-1, 3),
        np.stack([HALO * widths, widths], axis=1).ravel(),
    )


def _add_supports(panel: Panel, view: View) -> None:
    """Draw fixed supports as hatched areas, and rollers as circles."""
    problem = panel.problem
    rest, step = view.screen(problem.lattice.positions), spacing(problem)
    for group in support_groups(problem):
        panel.axes.add_patch(support_area(outline_around(rest[group], 0.3 * step)))
    supports = problem.supports
    rolling = np.unique(np.concatenate([supports.fixed_x, supports.fixed_y, supports.fixed_z]))
    if len(rolling):
        add_nodes(panel, rest[rolling], style.NOTE, hollow=True)


def input_arrows(motion: Motion, view: View) -> list[Arrow]:
    """Return arrows that end at the input."""
    problem = motion.design.problem
    length, gap = arrow_length(problem), 0.4 * spacing(problem)
    arrows = []
    for middle, direction, low, _ in _places(problem.input, problem.lattice.positions):
        tip = middle + (low - gap) * direction
        arrows.append(_projected(view, tip - length * direction, tip))
    return arrows


def output_arrows(motion: Motion, view: View) -> list[Arrow]:
    """Return arrows that start at the outputs, beyond their displaced nodes.

    Those of several outputs that would point into the part, such as the jaws of a gripper, end at
    the outputs.
    """
    problem = motion.design.problem
    positions = problem.lattice.positions
    length, gap = arrow_length(problem), 0.4 * spacing(problem)
    centre = 0.5 * (positions.min(axis=0) + positions.max(axis=0))
    arrows = []
    for output in problem.outputs.values():
        there = _places(output, motion.moved)
        for (middle, direction, low, high), (gone, _, _, far) in zip(
            _places(output, positions), there, strict=True
        ):
            inward = float((centre - middle) @ direction) > length
            if inward and len(problem.outputs) > 1:
                tail = middle + (low - gap - length) * direction
            else:
                reach = max(high, float((gone - middle) @ direction) + far)
                tail = middle + (reach + gap) * direction
            arrows.append(_projected(view, tail, tail + length * direction))
    return arrows


def _places(region: Input | Output, positions: Points) -> list[tuple[Points, Points, float, float]]:
    """Return the middle and direction of a region, and its extent from there along the direction.

    One for each node if the directions differ.
    """
    points, directions = positions[region.nodes], region.direction
    if not np.allclose(directions, directions[0]):
        return [(point, way, 0.0, 0.0) for point, way in zip(points, directions, strict=True)]
    middle, way = points.mean(axis=0), directions[0]
    along = (points - middle) @ way
    return [(middle, way, float(along.min()), float(along.max()))]


def _projected(view: View, tail: Points, tip: Points) -> Arrow:
    (x, y), (u, v) = view.screen(np.stack([tail, tip])).tolist()
    return Arrow((x, y), (u, v))
