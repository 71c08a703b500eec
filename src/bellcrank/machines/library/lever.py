"""The plain lever: the design that entries of the library are compared with.

A plain lever follows from lever mechanics, without a search. Stiff arms of triangulated struts
rotate about a pivot, a single supported node, and carry the output. An input that only translates
cannot be part of the rotating arms; a *link*, a straight row of struts along a line of the lattice,
connects a node of the input with the *knee* of the lever. With r measured from the pivot, d the
direction of the link, t_in and t_out the directions of the ports, and x the cross product,

    efficiency = (d . t_in) (t_out . (z x r_output)) / (d . (z x r_knee)).

The family also contains simpler shapes that are welded to the input and must bend: a bar from port
to port, with and without a stay, a bell crank, and a triangle. The plain lever is the most
efficient member of the family, by the same mechanics and under the same load as the design that it
is compared with. In some directions every lever is poor, with an efficiency near or below 0.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.mechanics import VERIFICATION_INCREMENT, Status
from bellcrank.model import Design
from bellcrank.search.constraints import ConstrainedEvaluator, LoadCase

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from bellcrank.model import Problem

LEVER = "lever"
ARMS = {
    LEVER: (("pivot", "knee"), ("pivot", "output")),
    "bar": (("input", "output"),),
    "bell crank": (("pivot", "input"), ("pivot", "output")),
    "bar with a stay at the input": (("pivot", "input"), ("input", "output")),
    "bar with a stay at the output": (("pivot", "output"), ("input", "output")),
    "triangle": (("pivot", "input"), ("pivot", "output"), ("input", "output")),
}
"""Ends of the arms of each shape; only the first shape has a link."""
HALF_WIDTH = 0.9
"""Largest distance of a node from the axis of its arm, in spacings: at least two rows of nodes."""
MIN_ARM = 1.5
"""Smallest distance of the knee from the pivot, in spacings."""
LINK_LENGTHS = (2, 8)
"""Smallest and largest number of struts of a link."""
MIN_ALIGNMENT = 0.35
"""Smallest cosine of the angle between a link and the input direction."""
MAX_PIVOTS = 24
"""Largest number of pivots; more supported nodes are sampled evenly."""


@dataclass(frozen=True, slots=True)
class Shape:
    """Shape of a lever.

    Parameters
    ----------
    arms
        A key of `ARMS`.
    pivot
        Supported node that it rotates about; None for a bar between the ports.
    link
        Nodes from the input to the knee; empty without a link.

    Examples
    --------
    >>> Shape("lever", 4, (80, 71, 62)).label
    'lever about node 4, by a link of 2 struts'
    """

    arms: str
    pivot: int | None = None
    link: tuple[int, ...] = ()

    @property
    def label(self) -> str:
        """Description of the shape."""
        pivot = "" if self.pivot is None else f" about node {self.pivot}"
        return self.arms + pivot + (f", by a link of {len(self.link) - 1} struts" * bool(self.link))


def plain_lever(problem: Problem, goals: Sequence[str] = ()) -> Design:
    """Return the most efficient plain lever for a problem.

    Parameters
    ----------
    problem
        Problem with fixed supports, of the spring model or of a frame.
    goals
        Constraints that it must satisfy.

    Raises
    ------
    InvalidSettings
        If no lever of the family is stable and satisfies the constraints.

    Examples
    --------
    >>> from bellcrank.machines import elementary
    >>> lever = plain_lever(elementary(7, "up"))
    >>> lever.provenance["pivot"] in range(7), lever.efficiency > 1.0
    (True, True)
    """
    evaluator = ConstrainedEvaluator([LoadCase(problem)], goals)
    best: Design | None = None
    for shape in shapes(problem):
        lever = lever_of(problem, shape)
        response = evaluator.evaluate(lever.mask, VERIFICATION_INCREMENT)
        if response.status is not Status.CONVERGED:
            continue
        if best is None or best.efficiency is None or response.efficiency > best.efficiency:
            best = replace(lever, efficiency=response.efficiency)
    if best is None:
        what = f"is stable and satisfies {', '.join(goals)}" if goals else "is stable"
        raise InvalidSettings(f"{problem.name}: no plain lever {what}")
    return best


def shapes(problem: Problem) -> Iterator[Shape]:
    """Yield the shapes of all levers of the family."""
    pivots = problem.supports.fixed
    if len(pivots) > MAX_PIVOTS:
        pivots = pivots[np.linspace(0, len(pivots) - 1, MAX_PIVOTS).round().astype(np.int64)]
    links = list(_links(problem))
    positions, spacing = problem.lattice.positions, _spacing(problem)
    for arms in ARMS:
        if arms == "bar":
            yield Shape(arms)
        elif arms != LEVER:
            yield from (Shape(arms, pivot) for pivot in pivots.tolist())
    for pivot, link in itertools.product(pivots.tolist(), links):
        if np.hypot(*(positions[link[-1]] - positions[pivot])) > MIN_ARM * spacing:
            yield Shape(LEVER, pivot, link)


def lever_of(problem: Problem, shape: Shape) -> Design:
    """Return the design of a lever: its arms, its link, and both complete ports.

    Examples
    --------
    >>> from bellcrank.machines import elementary
    >>> bar = lever_of(elementary(7, "down"), Shape("bar"))
    >>> bar.beam_count < 80, bar.provenance["kind"]
    (True, 'lever')
    """
    lattice = problem.lattice
    taken = np.zeros(lattice.node_count, dtype=np.bool_)
    taken[problem.supports.nodes] = True
    ends = {
        "input": lattice.positions[problem.input.nodes].mean(axis=0),
        "output": lattice.positions[problem.output.nodes].mean(axis=0),
    }
    if shape.link:
        # The rotating arms share only the knee with the translating link and input.
        taken[problem.input.nodes] = taken[list(shape.link)] = True
        ends["knee"] = lattice.positions[shape.link[-1]]
        taken[shape.link[-1]] = False
    if shape.pivot is not None:
        taken[shape.pivot] = False
        ends["pivot"] = lattice.positions[shape.pivot]
    body = np.zeros(lattice.node_count, dtype=np.bool_)
    for start, stop in ARMS[shape.arms]:
        away = _distance(lattice.positions, ends[start], ends[stop])
        body |= away < HALF_WIDTH * _spacing(problem)
    body[problem.output.nodes] = True
    body &= ~taken
    given = np.isin(np.arange(lattice.node_count), problem.input.nodes)
    if not shape.link:
        body |= given
    mask = body[lattice.beams].all(axis=1) | given[lattice.beams].all(axis=1) | _at_ports(problem)
    mask[_beams_along(problem, shape.link)] = True
    provenance = {
        "kind": "lever",
        "origin": f"from lever mechanics: {shape.label}",
        "arms": shape.arms,
        "pivot": shape.pivot,
        "link": list(shape.link),
    }
    return Design(problem, mask, provenance=provenance)


def _at_ports(problem: Problem) -> NDArray[np.bool_]:
    """(M,) whether a beam is at a port and belongs to every design of the problem."""
    lattice = problem.lattice
    present = problem.initial & lattice.beams_touching(
        np.concatenate([problem.input.nodes, problem.output.nodes])
    )
    present[problem.designable] = False
    present[lattice.beams_touching(problem.supports.nodes)] = False
    return present


def _spacing(problem: Problem) -> float:
    return float(np.median(problem.lattice.rest_length))


def _links(problem: Problem) -> Iterator[tuple[int, ...]]:
    """Yield straight rows of nodes from the input, roughly along its direction."""
    lattice = problem.lattice
    neighbours: list[list[int]] = [[] for _ in range(lattice.node_count)]
    for first, second in lattice.beams.tolist():
        neighbours[first].append(second)
        neighbours[second].append(first)
    closed = {*problem.supports.nodes.tolist(), *problem.input.nodes.tolist()}
    closed |= set(problem.output.nodes.tolist())
    push = problem.input.direction.mean(axis=0)
    for corner in problem.input.nodes.tolist():
        for second in neighbours[corner]:
            way = lattice.positions[second] - lattice.positions[corner]
            if second in closed or abs(way @ push) < MIN_ALIGNMENT * np.hypot(*way):
                continue
            row = [corner, second]
            while len(row) <= LINK_LENGTHS[1]:
                if len(row) > LINK_LENGTHS[0]:
                    yield tuple(row)
                ahead = [
                    node
                    for node in neighbours[row[-1]]
                    if node not in closed and _continues(lattice.positions, row, node)
                ]
                if not ahead:
                    break
                row.append(ahead[0])


def _continues(positions: NDArray[np.float64], row: list[int], node: int) -> bool:
    """Whether a node continues a row in its direction."""
    before, after = positions[row[-1]] - positions[row[-2]], positions[node] - positions[row[-1]]
    return bool(before @ after > 0.99 * np.hypot(*before) * np.hypot(*after))


def _beams_along(problem: Problem, row: Sequence[int]) -> NDArray[np.int64]:
    """(n,) numbers of the beams between successive nodes of a row."""
    pairs = {frozenset(pair) for pair in itertools.pairwise(row)}
    return np.array(
        [
            number
            for number, ends in enumerate(problem.lattice.beams.tolist())
            if frozenset(ends) in pairs
        ],
        dtype=np.int64,
    )


def _distance(
    points: NDArray[np.float64], start: NDArray[np.float64], stop: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(n,) distance of points from a segment."""
    way = stop - start
    part = np.clip((points - start) @ way / (way @ way), 0.0, 1.0)
    away: NDArray[np.float64] = np.linalg.norm(points - start - part[:, None] * way, axis=1)
    return away
