"""Which nodes of parts in their places are the same node of the machine.

Nodes of linked ports that lie on one another become one, as do supports; everything else must keep
its distance.
"""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from bellcrank.errors import InvalidFile
from bellcrank.machines.plan import welded

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.machines.placing import Part
    from bellcrank.machines.plan import Link, Plan, PortName

SAME = 1e-6
"""Of the spacing: nodes nearer than this are one node."""
CLEAR = 0.5
"""Of the spacing: nodes of different parts must be further apart than this."""


def unite(
    plan: Plan, parts: dict[str, Part]
) -> tuple[dict[str, NDArray[np.int64]], NDArray[np.float64]]:
    """Give every node of every part its number in the machine.

    Returns
    -------
    nodes
        For each part, the number of each of its nodes.
    positions : (N, 2) float64

    Raises
    ------
    InvalidFile
        If ports that are welded do not meet or lie on supports, or parts overlap.
    """
    union = _Union(plan, parts)
    for link in plan.links:
        if link.kind == "weld":
            union.check_meets(link)
    for ports in welded(plan):
        for first, second in combinations(ports, 2):
            union.weld(first, second)
    union.join_supports()
    union.check_clear()
    return union.result()


def numbered(
    values: NDArray[np.integer[Any]],
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Give distinct rows numbers, in the order in which they first come.

    Returns
    -------
    first
        Where each distinct row comes first.
    number
        Of each row.

    Examples
    --------
    >>> numbered(np.array([7, 3, 7, 5]))
    (array([0, 1, 3]), array([0, 1, 0, 2]))
    """
    _, first, name = np.unique(values, axis=0, return_index=True, return_inverse=True)
    rank = np.empty(len(first), np.int64)
    rank[np.argsort(first)] = np.arange(len(first))
    return np.sort(first), rank[name.ravel()]


class _Union:
    """Nodes of all parts, one after the other, and which pairs of them are near or the same."""

    def __init__(self, plan: Plan, parts: dict[str, Part]) -> None:
        self.plan, self.parts = plan, parts
        counts = [part.design.problem.lattice.node_count for part in parts.values()]
        self.first = dict(zip(parts, np.cumsum([0, *counts[:-1]]).tolist(), strict=True))
        self.positions = np.concatenate([part.positions for part in parts.values()])
        self.owner = np.repeat(np.arange(len(parts)), counts)
        spacing = min(part.spacing for part in parts.values())
        near = cKDTree(self.positions).query_pairs(CLEAR * spacing, output_type="ndarray")
        self.near = near[self.owner[near[:, 0]] != self.owner[near[:, 1]]].reshape(-1, 2)
        apart = self.positions[self.near[:, 0]] - self.positions[self.near[:, 1]]
        self.touching = np.linalg.norm(apart, axis=1) < SAME * spacing
        self.same = np.zeros(len(self.near), np.bool_)

    def check_meets(self, link: Link) -> None:
        """Refuse a weld of ports that share no place."""
        if not self._meeting(link.first, link.second).any():
            ends = [self.parts[port.part].centre(port.port) for port in (link.first, link.second)]
            raise InvalidFile(
                f"{self.plan.source}: ports {link.first} and {link.second} do not meet: no node "
                f"of one lies on one of the other (their middles are "
                f"{np.linalg.norm(ends[1] - ends[0]):.3g} apart); move a part, or link them by "
                f"a bridge"
            )

    def weld(self, first: PortName, second: PortName) -> None:
        """Let the nodes of two ports that lie on one another be one."""
        for port, other in ((first, second), (second, first)):
            if (self.touching & self._between(self._port(port), self._supports(other.part))).any():
                raise InvalidFile(
                    f"{self.plan.source}: port {port} lies on supports of {other.part}, which "
                    f"would hold it fast"
                )
        self.same |= self._meeting(first, second)

    def join_supports(self) -> None:
        """Let supports of different parts that lie on one another be one."""
        held = np.concatenate([self._supports(name) for name in self.parts])
        self.same |= self.touching & np.isin(self.near, held).all(axis=1)

    def check_clear(self) -> None:
        """Refuse nodes of different parts that are near one another and not the same."""
        if self.same.all():
            return
        node, other = self.near[np.flatnonzero(~self.same)[0]]
        names = list(self.parts)
        x, y = self.positions[node]
        raise InvalidFile(
            f"{self.plan.source}: parts {names[self.owner[node]]} and {names[self.owner[other]]} "
            f"overlap near ({x:.4g}, {y:.4g}); only the ports of a link, and supports, may share "
            f"their place"
        )

    def result(self) -> tuple[dict[str, NDArray[np.int64]], NDArray[np.float64]]:
        """Return each part's nodes by their numbers in the machine, and all positions."""
        pairs, count = self.near[self.same], len(self.positions)
        links = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
        _, piece = connected_components(links, directed=False)
        first, number = numbered(piece)
        ends = [*list(self.first.values())[1:], count]
        nodes = {
            part: number[start:end]
            for (part, start), end in zip(self.first.items(), ends, strict=True)
        }
        return nodes, self.positions[first]

    def _meeting(self, first: PortName, second: PortName) -> NDArray[np.bool_]:
        """Return which pairs are nodes of two ports that lie on one another."""
        meeting: NDArray[np.bool_] = self.touching & self._between(
            self._port(first), self._port(second)
        )
        return meeting

    def _port(self, port: PortName) -> NDArray[np.int64]:
        nodes: NDArray[np.int64] = self.parts[port.part].region(port.port).nodes
        return np.asarray(nodes + self.first[port.part])

    def _supports(self, name: str) -> NDArray[np.int64]:
        part = self.parts[name]
        if not part.supported:
            return np.empty(0, np.int64)
        return np.asarray(self.first[name] + part.design.problem.supports.nodes)

    def _between(self, ones: NDArray[np.int64], others: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Return which pairs have one node of each."""
        one, other = np.isin(self.near, ones), np.isin(self.near, others)
        return (one[:, 0] & other[:, 1]) | (one[:, 1] & other[:, 0])
