"""The geometry of a drawing: kinds of beams, arrows, supports, extent."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidProblem, InvalidSettings
from bellcrank.mechanics import load_bearing_core

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.model import Design, Input, Output, Problem


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """A design and the displacement of its nodes.

    Parameters
    ----------
    design
        Problem and beams.
    displacement : (N, d) float64, lattice units
        Displacement of each node. Nodes with values that are not finite are drawn at rest.
    efficiency
        Written below the title; None or nan if unknown.
    name
        Title in pictures with several designs.
    note
        Text after the efficiency, for example a status.
    magnify
        Factor by which the drawn displacement is larger than the given one; part of the caption.
    paths, wanted_paths : tuple of (k, d) float64, lattice units
        Paths of the outputs along the stroke, and wanted ones, as displacements of their mean
        positions, in the order of the outputs; empty for those that are not drawn.

    Raises
    ------
    InvalidProblem
        If the displacement has not one row for each node.
    InvalidSettings
        If `magnify` is not positive and finite.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> crane = find_problem("crane").full_design()
    >>> Motion(crane, np.zeros((133, 2)), efficiency=0.5).caption
    'efficiency 0.500 · 352 beams'
    """

    design: Design
    displacement: NDArray[np.float64]
    efficiency: float | None = None
    name: str = ""
    note: str = ""
    magnify: float = 1.0
    paths: tuple[NDArray[np.float64], ...] = ()
    wanted_paths: tuple[NDArray[np.float64], ...] = ()

    def __post_init__(self) -> None:
        expected = self.design.problem.lattice.positions.shape
        given = np.array(self.displacement, dtype=np.float64)
        if given.shape != expected:
            raise InvalidProblem(
                f"displacement: expected shape {expected}, one row for each node, got {given.shape}"
            )
        if not 0.0 < self.magnify < np.inf:
            raise InvalidSettings(f"magnify: expected a number above 0, got {self.magnify!r}")
        given[~np.isfinite(given).all(axis=1)] = 0.0
        given.flags.writeable = False
        object.__setattr__(self, "displacement", given)

    @property
    def moved(self) -> NDArray[np.float64]:
        """(N, d) drawn positions of the displaced nodes, lattice units."""
        return self.design.problem.lattice.positions + self.magnify * self.displacement

    def drawn_paths(self, *, wanted: bool = False) -> list[NDArray[np.float64]]:
        """Return the paths of the mean positions of outputs, (k, d) each, lattice units."""
        problem = self.design.problem
        found = []
        for output, path in zip(
            problem.outputs.values(), self.wanted_paths if wanted else self.paths, strict=False
        ):
            if len(path):
                middle = problem.lattice.positions[output.nodes].mean(axis=0)
                found.append(middle + self.magnify * np.asarray(path))
        return found

    @property
    def caption(self) -> str:
        """Efficiency, number of beams and note on one line."""
        known = self.efficiency is not None and np.isfinite(self.efficiency)
        efficiency = f"efficiency {self.efficiency:.3f}" if known else "no efficiency"
        magnified = "" if self.magnify == 1.0 else f"motion drawn {self.magnify:g} times its size"
        parts = [efficiency, f"{self.design.beam_count} beams", self.note, magnified]
        return " · ".join(part for part in parts if part)


@dataclass(frozen=True, slots=True, eq=False)
class BeamKinds:
    """The beams of a design by function.

    Parameters
    ----------
    ground, unloaded, load_bearing : (n,) int64, beam indices
        Beams between fixed nodes; loose beams and dead ends, which carry no load; all others.
    """

    ground: NDArray[np.int64]
    unloaded: NDArray[np.int64]
    load_bearing: NDArray[np.int64]


def beam_kinds(design: Design) -> BeamKinds:
    """Classify the beams of a design by function."""
    problem = design.problem
    held = np.isin(problem.lattice.beams, problem.supports.fixed).all(axis=1)
    load_bearing = load_bearing_core(design) & ~held
    return BeamKinds(
        ground=np.flatnonzero(design.mask & held),
        unloaded=np.flatnonzero(design.mask & ~held & ~load_bearing),
        load_bearing=np.flatnonzero(load_bearing),
    )


@dataclass(frozen=True, slots=True)
class Arrow:
    """An arrow in the plane, lattice units."""

    tail: tuple[float, float]
    tip: tuple[float, float]


def spacing(problem: Problem) -> float:
    """Return the median beam length, lattice units."""
    return float(np.median(problem.lattice.rest_length))


def arrow_length(problem: Problem) -> float:
    """Return the length of the arrows at input and output, lattice units."""
    extents = np.ptp(problem.lattice.positions, axis=0)
    size = float(np.prod(extents) ** (1.0 / len(extents)))
    return max(min(1.5 * spacing(problem), size / 4.0), size / 9.0)


def input_arrows(problem: Problem) -> list[Arrow]:
    """Return arrows along the input direction that end at each connected part of the input."""
    region = problem.input
    points = problem.lattice.positions[region.nodes]
    length, gap = arrow_length(problem), 0.45 * spacing(problem)
    arrows = []
    for own, directions in _parts(problem, region, points):
        if _is_uniform(directions):
            tip = _edge(own, directions[0], side=-1.0) - gap * directions[0]
            arrows.append(Arrow(_pair(tip - length * directions[0]), _pair(tip)))
            continue
        tips = own - 0.5 * gap * directions
        arrows += [
            Arrow(_pair(tip - 0.6 * length * t), _pair(tip))
            for tip, t in zip(tips, directions, strict=True)
        ]
    return arrows


def output_arrows(problem: Problem, moved: NDArray[np.float64]) -> list[Arrow]:
    """Return arrows along the wanted directions that start at each connected part of an output.

    Parameters
    ----------
    moved : (N, 2) lattice units
        Positions of the displaced nodes, which the arrows do not overlap.
    """
    return [
        arrow for output in problem.outputs.values() for arrow in _arrows_of(problem, output, moved)
    ]


def _arrows_of(problem: Problem, region: Output, moved: NDArray[np.float64]) -> list[Arrow]:
    """Return the arrows of one output."""
    points = np.concatenate([problem.lattice.positions, moved], axis=1)[region.nodes]
    length, gap = arrow_length(problem), 0.45 * spacing(problem)
    arrows = []
    for own, directions in _parts(problem, region, points):
        at_rest, gone = own[:, :2], own[:, 2:]
        if not _is_uniform(directions):
            arrows += [
                Arrow(_pair(point), _pair(point + 0.6 * length * t))
                for point, t in zip(at_rest, directions, strict=True)
            ]
            continue
        direction = directions[0]
        start = _edge(at_rest, direction, side=1.0)
        reach = max(float((gone @ direction).max() - start @ direction), 0.0)
        tail = start + (reach + gap) * direction
        arrows.append(Arrow(_pair(tail), _pair(tail + length * direction)))
    return arrows


def displacement_arrows(motion: Motion) -> list[Arrow]:
    """Return the displacements of the output nodes in the plane as arrows, if they are visible."""
    return [Arrow(_pair(a), _pair(b)) for a, b in output_displacements(motion)]


def output_displacements(motion: Motion) -> NDArray[np.float64]:
    """Return (n, 2, d) the positions of output nodes, at rest and displaced, if this is visible."""
    problem = motion.design.problem
    nodes = np.concatenate([output.nodes for output in problem.outputs.values()])
    ends = np.stack([problem.lattice.positions[nodes], motion.moved[nodes]], axis=1)
    found: NDArray[np.float64] = ends[
        np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) > 0.15 * spacing(problem)
    ]
    return found


def outline_around(points: NDArray[np.float64], radius: float) -> NDArray[np.float64]:
    """Return the convex outline at distance `radius` around points.

    Parameters
    ----------
    points : (n, 2) lattice units, n >= 1

    Returns
    -------
    (k, 2) corners, counter-clockwise

    Examples
    --------
    >>> outline = outline_around(np.zeros((1, 2)), 0.5)
    >>> bool(np.allclose(np.hypot(*outline.T), 0.5))
    True
    """
    from scipy.spatial import ConvexHull

    angle = np.linspace(0.0, 2.0 * np.pi, 32, endpoint=False)
    circle = radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    around = (points[:, None, :] + circle).reshape(-1, 2)
    corners: NDArray[np.float64] = around[ConvexHull(around).vertices]
    return corners


def support_groups(problem: Problem) -> list[NDArray[np.int64]]:
    """Group the fixed nodes that are connected by beams of the lattice."""
    return _connected_groups(problem, problem.supports.fixed)


def _connected_groups(problem: Problem, nodes: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    """Group nodes that are connected by beams between them."""
    beams = problem.lattice.beams
    owner = {int(node): int(node) for node in nodes}

    def root(node: int) -> int:
        while owner[node] != node:
            node = owner[node]
        return node

    for a, b in beams[np.isin(beams, nodes).all(axis=1)].tolist():
        owner[root(a)] = root(b)
    roots = np.array([root(int(node)) for node in nodes], dtype=np.int64)
    return [nodes[roots == one] for one in np.unique(roots)]


def _parts(
    problem: Problem, region: Input | Output, rows: NDArray[np.float64]
) -> list[tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """Return rows and directions of the nodes of each connected part of a region.

    A region with isolated nodes counts as one part: a packing of discs may have no beam
    between them.
    """
    groups = _connected_groups(problem, region.nodes)
    if min(map(len, groups)) == 1:
        groups = [region.nodes]
    inside = [np.isin(region.nodes, group) for group in groups]
    return [(rows[own], region.direction[own]) for own in inside]


def extent(
    points: list[NDArray[np.float64]], arrows: list[Arrow], margin: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the lower left and upper right corner, (2,) each, of points and arrows."""
    ends = [np.array([arrow.tail, arrow.tip]) for arrow in arrows]
    corners = np.concatenate([*points, *ends])
    return corners.min(axis=0) - margin, corners.max(axis=0) + margin


def aligned_frames(
    frames: list[tuple[NDArray[np.float64], NDArray[np.float64]]], problems: list[Problem]
) -> list[tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """Extend frames to one height, so that the lower edges of the lattices are aligned.

    Parameters
    ----------
    frames
        Lower left and upper right corner, (2,) each, of the visible area of each problem.
    """
    bases = [float(problem.lattice.positions[:, 1].min()) for problem in problems]
    below = max(base - float(low[1]) for base, (low, _) in zip(bases, frames, strict=True))
    above = max(float(high[1]) - base for base, (_, high) in zip(bases, frames, strict=True))
    return [
        (np.array([low[0], base - below]), np.array([high[0], base + above]))
        for base, (low, high) in zip(bases, frames, strict=True)
    ]


def of_one_height(
    frames: list[tuple[NDArray[np.float64], NDArray[np.float64]]],
) -> list[tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """Extend frames upward to the largest height among them."""
    height = max(float(high[1] - low[1]) for low, high in frames)
    return [(low, np.array([high[0], low[1] + height])) for low, high in frames]


def _is_uniform(direction: NDArray[np.float64]) -> bool:
    return bool(np.allclose(direction, direction[0]))


def _edge(
    points: NDArray[np.float64], direction: NDArray[np.float64], side: float
) -> NDArray[np.float64]:
    """Return the middle of the side of a region that is farthest along ``side * direction``."""
    across = np.array([-direction[1], direction[0]])
    sideways = points @ across
    along = side * (side * points @ direction).max()
    middle: NDArray[np.float64] = (
        0.5 * (sideways.min() + sideways.max()) * across + along * direction
    )
    return middle


def _pair(point: NDArray[np.float64]) -> tuple[float, float]:
    return float(point[0]), float(point[1])
