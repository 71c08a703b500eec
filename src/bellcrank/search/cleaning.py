"""Removal of beams that carry no load: loose pieces, dead ends, parts held at a single node."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bellcrank.mechanics import SpringEvaluator

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.model import Design, Problem


def loaded_beams(problem: Problem, mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the beams on a path between two nodes that are input, output or supported.

    A part connected by a single node is in equilibrium without any force at that node, and so
    carries no load. The same holds for a part that touches fixed supports only. Merge all fixed
    supports into one root node and add a virtual edge from it to each input, output and roller
    node: the load-bearing beams are those of the biconnected components at the root that
    contain a virtual edge. Beams between two fixed supports are kept, since they join the part
    to one piece.

    Parameters
    ----------
    mask : (M,) bool

    Returns
    -------
    (M,) bool
        Subset of `mask`.
    """
    root = problem.lattice.node_count
    place = np.arange(root)
    place[problem.supports.fixed] = root
    links: list[list[tuple[int, int]]] = [[] for _ in range(root + 1)]
    kept = np.zeros(len(mask), dtype=bool)
    for beam in np.flatnonzero(mask).tolist():
        first, second = place[problem.lattice.beams[beam]].tolist()
        if first == second:
            kept[beam] = True
        else:
            links[first].append((second, beam))
            links[second].append((first, beam))
    terminals = {*problem.supports.nodes, *problem.input.nodes, *problem.output.nodes}
    for number, node in enumerate(sorted(set(place[list(terminals)].tolist()) - {root})):
        tie = -1 - number
        links[root].append((node, tie))
        links[node].append((root, tie))
    for component in _components_at(links, root):
        if min(component) < 0:
            kept[[beam for beam in component if beam >= 0]] = True
    return kept


def _components_at(links: list[list[tuple[int, int]]], root: int) -> list[list[int]]:
    """Return the biconnected components that contain the root, as lists of edges.

    Depth-first search with low points (Hopcroft and Tarjan, Commun. ACM 16, 372, 1973):
    a component is complete when the subtree below a node reaches no node above it.
    """
    depth = {root: 0}
    low = {root: 0}
    edges: list[int] = []
    found: list[list[int]] = []
    stack = [(root, 0, iter(links[root]), 0)]
    while stack:
        node, came_by, rest, mark = stack[-1]
        for far, edge in rest:
            if far not in depth:
                depth[far] = low[far] = depth[node] + 1
                stack.append((far, edge, iter(links[far]), len(edges)))
                edges.append(edge)
                break
            if edge != came_by and depth[far] < depth[node]:
                edges.append(edge)
                low[node] = min(low[node], depth[far])
        else:
            stack.pop()
            if stack:
                parent = stack[-1][0]
                low[parent] = min(low[parent], low[node])
                if low[node] >= depth[parent]:
                    component = edges[mark:]
                    del edges[mark:]
                    if parent == root:
                        found.append(component)
    return found


def pieces(problem: Problem, mask: NDArray[np.bool_]) -> int:
    """Return the number of connected pieces of a design."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    beams = problem.lattice.beams[mask]
    used, local = np.unique(beams, return_inverse=True)
    local = local.reshape(beams.shape)
    graph = coo_matrix((np.ones(len(beams)), local.T), shape=(len(used), len(used)))
    return int(connected_components(graph, directed=False)[0])


def clean(design: Design, evaluator: SpringEvaluator | None = None) -> Design:
    """Return a design without the beams that carry no load.

    Loose pieces and dead ends are removed first, then parts connected by a single node or to
    supports only. In the spring model dead ends soften the joint that they are attached to; in a
    real part all of these are unloaded mass.

    Parameters
    ----------
    evaluator
        An evaluator of the design's problem; pass one when many designs are cleaned.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> crane = find_problem("crane").full_design()
    >>> clean(crane).beam_count
    352
    """
    evaluator = evaluator or SpringEvaluator(design.problem, "displacement")
    core = evaluator.load_bearing(design.mask)
    return design.with_mask(loaded_beams(design.problem, core))
