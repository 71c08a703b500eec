"""What a real part can do without: loose pieces, dead ends, whatever no force goes through."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bellcrank.mechanics import SpringEvaluator

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.model import Design, Problem


def loaded_beams(problem: Problem, mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the beams on some way between two nodes that are driven, watched or held.

    A part that hangs by a single node is in equilibrium without any force in that node,
    whatever its shape: it carries nothing. Nor does what stands on fixed supports alone.
    With all fixed supports as one node, to which driven, watched and rolling nodes are
    tied, what carries load is the biconnected components of that node that hold a tie.
    Beams between two fixed supports stay: they make one piece of the part.

    Parameters
    ----------
    mask : (M,) bool

    Returns
    -------
    (M,) bool
        A part of `mask`.
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
    """Biconnected components that contain the root, as lists of edges.

    Depth-first search with low points (Hopcroft and Tarjan, Commun. ACM 16, 372, 1973):
    a component is complete when a branch below a node reaches no higher than the node.
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
    """Count the separate pieces a design would print as."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    beams = problem.lattice.beams[mask]
    used, local = np.unique(beams, return_inverse=True)
    local = local.reshape(beams.shape)
    graph = coo_matrix((np.ones(len(beams)), local.T), shape=(len(used), len(used)))
    return int(connected_components(graph, directed=False)[0])


def clean(design: Design, evaluator: SpringEvaluator | None = None) -> Design:
    """Leave out of a design what no load can reach.

    First the load-bearing core (no loose pieces, no dead ends), then what hangs by a
    single node or stands on supports alone. In the model the former soften the joint they
    hang at; in a real part all are idle mass.

    Parameters
    ----------
    evaluator
        One of the design's problem, to save building it for each of many designs.

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
