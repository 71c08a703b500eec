"""Merging of coincident nodes of the parts of a machine.

Coincident nodes of welded ports become one node, and so do coincident supports of parts whose
supports hold the machine. All other nodes of different parts must be at least `MIN_DISTANCE` apart.
"""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidFile
from bellcrank.machines.plan import welded_ports

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.machines.placement import Part
    from bellcrank.machines.plan import Link, Plan, PortName

COINCIDENT = 1e-6
"""Distance below which two nodes coincide, as a fraction of the spacing: the smallest median beam
length of the parts."""
MIN_DISTANCE = 0.5
"""Smallest distance of nodes of different parts that are not merged, as a fraction of the same
spacing."""


def merge_nodes(
    plan: Plan, parts: dict[str, Part]
) -> tuple[dict[str, NDArray[np.int64]], NDArray[np.float64]]:
    """Return the nodes of a machine, with coincident port nodes and supports merged.

    Returns
    -------
    nodes
        For each part, the machine's number of each of its nodes.
    positions : (N, d) float64, lattice units of the machine
        Position of each node; of merged nodes, that of the first.

    Raises
    ------
    InvalidFile
        If the ports of a weld do not meet, a welded port lies on supports of the other part, or
        nodes of different parts are too close.
    """
    merger = _NodeMerger(plan, parts)
    for link in plan.links:
        if link.kind == "weld":
            merger.check_meets(link)
    for ports in welded_ports(plan):
        for first, second in combinations(ports, 2):
            merger.weld(first, second)
    merger.merge_supports()
    merger.check_distances()
    return merger.result()


def unique_rows(
    values: NDArray[np.integer[Any]],
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Assign numbers to the distinct rows of an array, in the order of first occurrence.

    Returns
    -------
    first
        Index of the first occurrence of each distinct row.
    number
        Number of each row.

    Examples
    --------
    >>> unique_rows(np.array([7, 3, 7, 5]))
    (array([0, 1, 3]), array([0, 1, 0, 2]))
    """
    _, first, name = np.unique(values, axis=0, return_index=True, return_inverse=True)
    rank = np.empty(len(first), np.int64)
    rank[np.argsort(first)] = np.arange(len(first))
    return np.sort(first), rank[name.ravel()]


class _NodeMerger:
    """Concatenated nodes of all parts, and the pairs of near nodes with a mark on those to merge.

    The pairs are those of nodes of different parts nearer than `MIN_DISTANCE`.
    """

    def __init__(self, plan: Plan, parts: dict[str, Part]) -> None:
        from scipy.spatial import cKDTree

        self.plan, self.parts = plan, parts
        counts = [part.design.problem.lattice.node_count for part in parts.values()]
        self.offset = dict(zip(parts, np.cumsum([0, *counts[:-1]]).tolist(), strict=True))
        self.positions = np.concatenate([part.positions for part in parts.values()])
        self.owner = np.repeat(np.arange(len(parts)), counts)
        spacing = min(part.spacing for part in parts.values())
        near = cKDTree(self.positions).query_pairs(MIN_DISTANCE * spacing, output_type="ndarray")
        self.near = near[self.owner[near[:, 0]] != self.owner[near[:, 1]]].reshape(-1, 2)
        apart = self.positions[self.near[:, 0]] - self.positions[self.near[:, 1]]
        self.coincident = np.linalg.norm(apart, axis=1) < COINCIDENT * spacing
        self.merged = np.zeros(len(self.near), np.bool_)

    def check_meets(self, link: Link) -> None:
        """Check that the ports of a weld have a coincident pair of nodes."""
        if not self._coincident(link.first, link.second).any():
            ends = [self.parts[port.part].centre(port.port) for port in (link.first, link.second)]
            raise InvalidFile(
                f"{self.plan.source}: ports {link.first} and {link.second} do not meet: no node "
                f"of one coincides with a node of the other (their centres are "
                f"{np.linalg.norm(ends[1] - ends[0]):.3g} apart); move a part, or link them by "
                f"a bridge"
            )

    def weld(self, first: PortName, second: PortName) -> None:
        """Merge the coincident nodes of two ports."""
        for port, other in ((first, second), (second, first)):
            pairs = self._between(self._port(port), self._supports(other.part))
            if (self.coincident & pairs).any():
                raise InvalidFile(
                    f"{self.plan.source}: port {port} lies on supports of part {other.part} and "
                    f"could not move"
                )
        self.merged |= self._coincident(first, second)

    def merge_supports(self) -> None:
        """Merge coincident supports of different parts."""
        held = np.concatenate([self._supports(name) for name in self.parts])
        self.merged |= self.coincident & np.isin(self.near, held).all(axis=1)

    def check_distances(self) -> None:
        """Check that nearby nodes of different parts are merged."""
        if self.merged.all():
            return
        node, other = self.near[np.flatnonzero(~self.merged)[0]]
        names = list(self.parts)
        point = ", ".join(f"{each:.4g}" for each in self.positions[node])
        raise InvalidFile(
            f"{self.plan.source}: parts {names[self.owner[node]]} and {names[self.owner[other]]} "
            f"overlap near ({point}); only welded ports and supports may coincide"
        )

    def result(self) -> tuple[dict[str, NDArray[np.int64]], NDArray[np.float64]]:
        """Return the machine's node numbers of each part, and all positions."""
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components

        pairs, count = self.near[self.merged], len(self.positions)
        links = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
        _, piece = connected_components(links, directed=False)
        first, number = unique_rows(piece)
        numbers = np.split(number, list(self.offset.values())[1:])
        return dict(zip(self.offset, numbers, strict=True)), self.positions[first]

    def _coincident(self, first: PortName, second: PortName) -> NDArray[np.bool_]:
        """Return which pairs are coincident nodes of two ports."""
        pairs: NDArray[np.bool_] = self.coincident & self._between(
            self._port(first), self._port(second)
        )
        return pairs

    def _port(self, port: PortName) -> NDArray[np.int64]:
        nodes: NDArray[np.int64] = self.parts[port.part].nodes(port.port)
        return np.asarray(nodes + self.offset[port.part])

    def _supports(self, name: str) -> NDArray[np.int64]:
        part = self.parts[name]
        if not part.supported:
            return np.empty(0, np.int64)
        return np.asarray(self.offset[name] + part.design.problem.supports.nodes)

    def _between(self, ones: NDArray[np.int64], others: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Return which pairs have one node in each of two sets."""
        one, other = np.isin(self.near, ones), np.isin(self.near, others)
        return (one[:, 0] & other[:, 1]) | (one[:, 1] & other[:, 0])
