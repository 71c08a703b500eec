"""Coarser lattices of a problem, whose beams are straight chains of its beams.

The end nodes of straight chains of `stride` beams form a lattice with this times the spacing, if
the lattice is regular. A design of the coarse problem is one of the original problem with the
chains in place of the beams. In a frame both move alike, since a straight chain is one strut. The
angular springs within a chain make the springs of the original problem more compliant.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidProblem
from bellcrank.model.conditions import ROLLERS, Input, Output, Stiffness, Supports
from bellcrank.model.lattice import Lattice
from bellcrank.model.loads import Loads, NodeForce, NodeSpring
from bellcrank.model.problem import Problem

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from numpy.typing import NDArray

    from bellcrank.model.specification import Case

MOST_DIRECTIONS = 64
"""Largest number of different vectors along the beams of a regular lattice."""
DIGITS = 4
"""Decimals to which these vectors are rounded, in median beam lengths."""
LEAST_SHARE = 0.5
"""Least number of chains of a coarse lattice, over that of the one with most chains."""


@dataclass(frozen=True, slots=True, eq=False)
class CoarseProblem:
    """A problem on a coarser lattice.

    Parameters
    ----------
    problem
        The coarse problem, with the units of the original one.
    chains : (M, stride) int64
        Beams of the original problem in place of each coarse beam.
    always : (m,) bool
        Beams that each design has: those that may not be changed, and paths from nodes of supports,
        inputs, outputs and loads to the nearest coarse node.
    """

    problem: Problem
    chains: NDArray[np.int64]
    always: NDArray[np.bool_]

    def original(self, mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return (m,) the design of the original problem for a coarse design (M,)."""
        design = self.always.copy()
        design[self.chains[mask].ravel()] = True
        return design


def coarse_problems(problem: Problem, stride: int) -> Iterator[CoarseProblem]:
    """Yield coarse problems; none if the lattice has no straight chains.

    There is one for each set of nodes that such chains join, first those with nodes of most
    supports, inputs, outputs and loads.

    Parameters
    ----------
    problem
        Problem with beams of equal width.
    stride
        Number of beams of each chain, at least 2.

    Examples
    --------
    >>> from bellcrank.model.builtin.scaling import scaling
    >>> fine = scaling(20)
    >>> coarse = next(coarse_problems(fine, 2))
    >>> fine.lattice.node_count, coarse.problem.lattice.node_count
    (451, 110)
    >>> design = coarse.original(coarse.problem.initial)
    >>> int(design.sum()), fine.lattice.beam_count
    (677, 1269)
    """
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import connected_components

    if problem.widths is not None or problem.joints is not None:
        return
    possible = problem.initial.copy()
    possible[problem.designable] = True
    found = straight_chains(problem.lattice, possible, stride)
    if not len(found.beams):
        return
    nodes = problem.lattice.node_count
    joined = csr_matrix((np.ones(len(found.beams)), tuple(found.ends.T)), shape=(nodes, nodes))
    label = connected_components(joined, directed=False)[1]
    counts = np.bincount(label[found.ends[:, 0]], minlength=label.max() + 1)
    regions = _regions(problem)

    def order(group: int) -> tuple[int, int]:
        covered = sum(bool((label[each] == group).any()) for each in regions)
        return -covered, -int(counts[group])

    large = np.flatnonzero(counts >= LEAST_SHARE * counts.max())
    for group in sorted(large.tolist(), key=order):
        chosen = label[found.ends[:, 0]] == group
        try:
            yield _Reduction(problem, possible, found.of(chosen)).coarse()
        except InvalidProblem:
            # Two regions have the same coarse node, or a coarse beam is too short.
            continue


@dataclass(frozen=True, slots=True, eq=False)
class Chains:
    """Straight chains of beams.

    Parameters
    ----------
    ends : (c, 2) int64
        Their end nodes.
    beams : (c, stride) int64
        Their beams.
    """

    ends: NDArray[np.int64]
    beams: NDArray[np.int64]

    def of(self, chosen: NDArray[np.bool_]) -> Chains:
        """Return some of them."""
        return Chains(self.ends[chosen], self.beams[chosen])


def straight_chains(lattice: Lattice, possible: NDArray[np.bool_], stride: int) -> Chains:
    """Return all straight chains of a number of equal beams.

    Parameters
    ----------
    lattice
        The lattice; one whose beams have many different vectors has no chains.
    possible : (m,) bool
        Beams that may be in a chain.
    stride
        Number of beams of a chain.
    """
    positions, beams = lattice.positions, lattice.beams
    vectors = (positions[beams[:, 1]] - positions[beams[:, 0]]) / np.median(lattice.rest_length)
    both = np.concatenate([vectors, -vectors]).round(DIGITS) + 0.0
    kinds, kind = np.unique(both, axis=0, return_inverse=True)
    if len(kinds) > MOST_DIRECTIONS:
        return Chains(np.empty((0, 2), np.int64), np.empty((0, stride), np.int64))
    first, last = np.concatenate([beams, beams[:, ::-1]]).T
    # Node and beam that follow a node in each direction, -1 for none.
    following = np.full((len(positions), len(kinds)), -1)
    along = following.copy()
    following[first, kind.ravel()] = last
    along[first, kind.ravel()] = np.where(possible, np.arange(len(beams)), -1)[
        np.tile(np.arange(len(beams)), 2)
    ]
    direction = np.broadcast_to(np.arange(len(kinds)), following.shape)
    begin = np.broadcast_to(np.arange(len(positions))[:, None], following.shape)
    end, complete, steps = begin, np.ones(following.shape, dtype=bool), []
    for _ in range(stride):
        step = along[end, direction]
        complete = complete & (step >= 0)
        end = np.where(complete, following[end, direction], end)
        steps.append(step)
    once = complete & (begin < end)
    return Chains(
        np.column_stack([begin[once], end[once]]), np.stack([each[once] for each in steps], axis=1)
    )


def _regions(problem: Problem) -> list[NDArray[np.int64]]:
    """Return the nodes of each support, input, output and load of all cases."""
    found = []
    for case in problem.cases.values():
        found += [case.supports.nodes, case.input.nodes]
        found += [each.nodes for each in case.outputs.values()]
        found += [each.nodes for each in case.loads.forces]
        found += [each.nodes for each in case.loads.springs]
    return found


class _Reduction:
    """Reduces a problem to the nodes that chains join."""

    def __init__(self, problem: Problem, possible: NDArray[np.bool_], chains: Chains) -> None:
        self.problem = problem
        self.chains = chains
        self.possible = possible
        self.nodes, ends = np.unique(chains.ends, return_inverse=True)
        self.ends = ends.reshape(-1, 2)
        count = problem.lattice.node_count
        self.index = np.full(count, -1)
        self.index[self.nodes] = np.arange(len(self.nodes))
        self.always = problem.initial.copy()
        self.always[problem.designable] = False

    def coarse(self) -> CoarseProblem:
        problem, chains = self.problem, self.chains
        lattice = Lattice(positions=problem.lattice.positions[self.nodes], beams=self.ends)
        wanted = problem.specification
        if wanted is not None:
            wanted = replace(
                wanted,
                outputs=self._outputs(wanted.outputs),
                cases=tuple(self._case(case) for case in wanted.cases),
            )
        stride = chains.beams.shape[1]
        coarse = Problem(
            name=problem.name,
            lattice=lattice,
            supports=self._supports(problem.supports),
            input=self._input(problem.input),
            output=self._output(problem.output),
            stiffness=Stiffness(problem.stiffness.bond / stride, problem.stiffness.angle),
            designable=np.flatnonzero(np.isin(chains.beams, problem.designable).any(axis=1)),
            aggregate=problem.aggregate,
            objective=problem.objective,
            section=problem.section,
            material=problem.material,
            loads=self._loads(problem.loads),
            specification=wanted,
        )
        return CoarseProblem(coarse, chains.beams, self.always)

    def _region(self, nodes: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the coarse nodes of a region; the nearest ones, with paths to them, if none."""
        own = self.index[nodes]
        if not len(nodes) or (own >= 0).any():
            return own[own >= 0]
        return self._joined(nodes)

    def _joined(self, nodes: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the nearest coarse nodes of a region; designs then have the paths to them."""
        from scipy.sparse import csr_matrix
        from scipy.sparse.csgraph import dijkstra

        lattice, beams = self.problem.lattice, np.flatnonzero(self.possible)
        ends, shape = tuple(lattice.beams[beams].T), (lattice.node_count,) * 2
        length = csr_matrix((lattice.rest_length[beams], ends), shape=shape)
        number = csr_matrix((beams, ends), shape=shape)
        number = number + number.T
        distance, before = dijkstra(length, directed=False, indices=nodes, return_predecessors=True)
        nearest = self.nodes[distance[:, self.nodes].argmin(axis=1)]
        for row, (node, end) in enumerate(zip(nodes.tolist(), nearest.tolist(), strict=True)):
            here = int(end)
            while here != node:
                previous = int(before[row, here])
                if previous < 0:
                    raise InvalidProblem(f"node {node} is not joined to the coarse lattice")
                self.always[number[previous, here]] = True
                here = previous
        return np.unique(self.index[nearest])

    def _each(
        self, values: NDArray[np.float64], nodes: NDArray[np.int64], own: NDArray[np.int64]
    ) -> NDArray[np.float64]:
        """Return the values (n, k) of nodes for coarse nodes: those of the nearest node."""
        positions = self.problem.lattice.positions
        apart = positions[self.nodes[own]][:, None] - positions[nodes]
        return np.asarray(values[np.linalg.norm(apart, axis=2).argmin(axis=1)])

    def _supports(self, given: Supports) -> Supports:
        rollers = {name: self._region(getattr(given, name)) for name in ROLLERS}
        return Supports(fixed=self._region(given.fixed), **rollers)

    def _input(self, given: Input) -> Input:
        own = self._region(given.nodes)
        share = 1.0 if given.drive == "displacement" else len(given.nodes) / len(own)
        return replace(
            given, nodes=own, amount=share * given.amount,
            direction=self._each(given.direction, given.nodes, own),
            during=None if given.during is None else self._each(given.during, given.nodes, own),
        )  # fmt: skip

    def _output(self, given: Output) -> Output:
        own = self._region(given.nodes)
        share = len(given.nodes) / len(own)
        return replace(
            given, nodes=own, direction=self._each(given.direction, given.nodes, own),
            spring=None if given.spring is None else share * given.spring,
        )  # fmt: skip

    def _outputs(self, given: Mapping[str, Output]) -> dict[str, Output]:
        return {name: self._output(each) for name, each in given.items()}

    def _loads(self, given: Loads) -> Loads:
        forces, springs = [], []
        for each in given.forces:
            own = self._region(each.nodes)
            forces.append(NodeForce(own, each.force.sum(axis=0) / len(own), each.during))
        for spring in given.springs:
            own = self._region(spring.nodes)
            share = len(spring.nodes) / len(own)
            direction = self._each(spring.direction, spring.nodes, own)
            springs.append(NodeSpring(own, direction, share * spring.stiffness))
        return replace(given, forces=tuple(forces), springs=tuple(springs))

    def _case(self, given: Case) -> Case:
        return replace(
            given, supports=self._supports(given.supports), input=self._input(given.input),
            outputs=self._outputs(given.outputs), loads=self._loads(given.loads),
        )  # fmt: skip
