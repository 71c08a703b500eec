"""Terms of the beams alone: how much there is, how it hangs together."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bellcrank.search.cleaning import pieces
from bellcrank.search.goals.terms import Kind, Term, above, at_least, at_most, counted, nothing
from bellcrank.search.goals.terms import terms as registry

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.model import Problem

USUAL_FAULTS = 10.0
"""Missing beams at which the excess of a degree is one half."""


def mass_of(problem: Problem, core: NDArray[np.bool_]) -> float:
    """Return the length of the designable beams that carry load, as a part of all of them.

    Parameters
    ----------
    core : (M,) bool
        The beams that carry load.
    """
    length = problem.lattice.rest_length[problem.designable]
    return float(length @ core[problem.designable] / length.sum())


def mass(problem: Problem, bound: float) -> Term:
    """At most so much of the designable beams: what is printed, loose pieces and dead ends not.

    Raises
    ------
    ValueError
        If any design would do.
    """
    if bound >= 1.0:
        raise ValueError("expected a part below 1 of the length of the designable beams")
    length = problem.lattice.rest_length
    share = np.zeros(len(length))
    share[problem.designable] = length[problem.designable] / length[problem.designable].sum()

    def of_beams(_mask: NDArray[np.bool_], core: NDArray[np.bool_]) -> float:
        return above(float(share @ core), bound)

    def by_flip(core: NDArray[np.bool_]) -> NDArray[np.float64]:
        now = float(share @ core)
        after = np.maximum(now + np.where(core, -share, share), 1e-12)
        change: NDArray[np.float64] = np.maximum(0.0, 1.0 - bound / after) - above(now, bound)
        return change

    return Term(of_beams=of_beams, by_flip=by_flip)


def whole(rest: str) -> int:
    """Read ``>= NUMBER`` with a whole number."""
    number = at_least(rest)
    if number != int(number):
        raise ValueError(rest)
    return int(number)


def degree(problem: Problem, bound: int) -> Term:
    """At least so many load-bearing beams at each free node that has some.

    Supports, input and output nodes are not free.

    Raises
    ------
    ValueError
        If no node of the lattice has so many.
    """
    beams, nodes = problem.lattice.beams, problem.lattice.node_count
    most = int(np.bincount(beams.ravel()).max())
    if bound > most:
        raise ValueError(f"no node of problem {problem.name!r} has more than {most} beams")
    free = np.ones(nodes, dtype=bool)
    free[[*problem.supports.nodes, *problem.input.nodes, *problem.output.nodes]] = False

    def of_beams(_mask: NDArray[np.bool_], core: NDArray[np.bool_]) -> float:
        number = np.bincount(beams[core].ravel(), minlength=nodes)
        missing = np.where(free & (number > 0), np.maximum(0, bound - number), 0).sum()
        return counted(float(missing), USUAL_FAULTS)

    return Term(of_beams=of_beams)


def connected(problem: Problem, _nothing: None) -> Term:
    """One piece of load-bearing beams, which holds input, output and a support.

    Each piece too many and each of the three that is missing is a fault.
    """
    regions = [problem.supports.nodes, problem.input.nodes, problem.output.nodes]

    def of_beams(_mask: NDArray[np.bool_], core: NDArray[np.bool_]) -> float:
        touched = np.zeros(problem.lattice.node_count, dtype=bool)
        touched[problem.lattice.beams[core]] = True
        missing = sum(len(nodes) > 0 and not touched[nodes].any() for nodes in regions)
        return counted(missing + max(0, pieces(problem, core) - 1))

    return Term(of_beams=of_beams, price=1)


registry.register("mass")(Kind("'mass <= NUMBER', the number above 0", at_most, mass))
registry.register("degree")(Kind("'degree >= NUMBER', the number whole and above 0", whole, degree))
registry.register("connected")(Kind("'connected' alone", nothing, connected))
