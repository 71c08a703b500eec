"""The plain lever: what a design of the library must beat.

Drawn from lever mechanics, and from nothing that a search found: stiff arms of triangulated
struts from a pivot, a single node of the support, to the input and to the output, or straight from
the input to the output; both ports whole. Of all pivots, arms and widths the best is taken, by
the same mechanics and under the same load as the design that it is compared with. So it is a strong
member of its family rather than a typical one. There are directions that no lever makes: its
efficiency there is about 0, or below.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.mechanics import CAREFUL, Status
from bellcrank.model import Design
from bellcrank.search.goals import Case, GoalResponder

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from bellcrank.model import Problem

ARMS = {
    "bar": ("across",),
    "bell crank": ("to input", "to output"),
    "hinged bar": ("to input", "across"),
    "propped bar": ("to output", "across"),
    "triangle": ("to input", "to output", "across"),
}
"""Arms of each kind of lever; the first has no pivot."""
WIDTHS = (0.6, 0.9)
"""How far from the middle of an arm its nodes may be, in spacings."""
MOST_PIVOTS = 24
"""More support nodes than that are thinned out evenly."""


@dataclass(frozen=True, slots=True)
class Shape:
    """What a lever is made of.

    Parameters
    ----------
    arms
        A key of `ARMS`.
    width
        Half the width of its arms, in spacings.
    pivot
        Node of the support that it turns about; None for a bar that hangs between the ports.

    Examples
    --------
    >>> Shape("bell crank", 0.6, 4).label
    'bell crank about node 4, arms of 0.6 spacings to each side'
    """

    arms: str
    width: float
    pivot: int | None

    @property
    def label(self) -> str:
        """In words."""
        place = "" if self.pivot is None else f" about node {self.pivot}"
        return f"{self.arms}{place}, arms of {self.width:g} spacings to each side"


def plain_lever(problem: Problem, goals: Sequence[str] = ()) -> Design:
    """Return the most efficient plain lever for a problem.

    Parameters
    ----------
    goals
        What it must keep, as a search would.

    Raises
    ------
    InvalidSettings
        If no lever of the family is stable and keeps the goals.

    Examples
    --------
    >>> from bellcrank.machines import elementary
    >>> lever = plain_lever(elementary(7, "up"))
    >>> lever.provenance["arms"], lever.provenance["pivot"] in range(7), lever.efficiency > 1.0
    ('bell crank', True, True)
    """
    judge = GoalResponder([Case(problem)], goals)
    best: Design | None = None
    seen: set[bytes] = set()
    for shape in shapes(problem):
        lever = lever_of(problem, shape)
        key = lever.mask.tobytes()
        if key in seen:
            continue
        seen.add(key)
        response = judge.respond(lever.mask, CAREFUL)
        if response.status is not Status.CONVERGED:
            continue
        if best is None or best.efficiency is None or response.efficiency > best.efficiency:
            best = replace(lever, efficiency=response.efficiency)
    if best is None:
        what = f"is stable and keeps {', '.join(goals)}" if goals else "is stable"
        raise InvalidSettings(f"{problem.name}: no plain lever {what}")
    return best


def shapes(problem: Problem) -> Iterator[Shape]:
    """Yield all levers of the family, as shapes."""
    pivots = problem.supports.fixed
    if len(pivots) > MOST_PIVOTS:
        pivots = pivots[np.linspace(0, len(pivots) - 1, MOST_PIVOTS).round().astype(np.int64)]
    for arms, width in itertools.product(ARMS, WIDTHS):
        if arms == "bar":
            yield Shape(arms, width, None)
            continue
        for pivot in pivots.tolist():
            yield Shape(arms, width, pivot)


def lever_of(problem: Problem, shape: Shape) -> Design:
    """Return a lever as a design: all beams between its nodes, and no others.

    Examples
    --------
    >>> from bellcrank.machines import elementary
    >>> bar = lever_of(elementary(7, "down"), Shape("bar", 0.6, None))
    >>> bar.beam_count < 60, bar.provenance["kind"]
    (True, 'lever')
    """
    lattice = problem.lattice
    ends = {
        "input": lattice.positions[problem.input.nodes].mean(axis=0),
        "output": lattice.positions[problem.output.nodes].mean(axis=0),
    }
    if shape.pivot is not None:
        ends["pivot"] = lattice.positions[shape.pivot]
    ways = {
        "across": ("input", "output"),
        "to input": ("pivot", "input"),
        "to output": ("pivot", "output"),
    }
    reach = shape.width * float(np.median(lattice.rest_length))
    nodes = np.zeros(lattice.node_count, dtype=np.bool_)
    nodes[problem.input.nodes] = nodes[problem.output.nodes] = True
    for arm in ARMS[shape.arms]:
        start, stop = (ends[name] for name in ways[arm])
        nodes |= _distance(lattice.positions, start, stop) < reach
    nodes[problem.supports.nodes] = False
    if shape.pivot is not None:
        nodes[shape.pivot] = True
    provenance = {
        "kind": "lever",
        "origin": f"drawn from lever mechanics: {shape.label}",
        "arms": shape.arms,
        "width": shape.width,
        "pivot": shape.pivot,
    }
    return Design(problem, nodes[lattice.beams].all(axis=1), provenance=provenance)


def _distance(
    points: NDArray[np.float64], start: NDArray[np.float64], stop: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(n,) from each point to a segment."""
    way = stop - start
    part = np.clip((points - start) @ way / (way @ way), 0.0, 1.0)
    away: NDArray[np.float64] = np.linalg.norm(points - start - part[:, None] * way, axis=1)
    return away
