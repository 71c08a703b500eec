"""Which beams of a design hang together, and which on no support."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.model import Design


def piece_of_beams(design: Design) -> NDArray[np.int64]:
    """Return (b,) the number of the piece that each present beam belongs to, from 0.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> int(piece_of_beams(find_problem("crane").full_design()).max())
    0
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    beams = design.problem.lattice.beams[design.mask]
    count = design.problem.lattice.node_count
    graph = coo_array((np.ones(len(beams)), beams.T), shape=(count, count))
    piece = connected_components(graph, directed=False)[1][beams[:, 0]]
    numbered: NDArray[np.int64] = np.unique(piece, return_inverse=True)[1]
    return numbered


def require_held(design: Design) -> None:
    """Refuse a design of which a piece hangs on no support.

    Raises
    ------
    InvalidSettings
        Naming the first beam of such a piece.
    """
    problem = design.problem
    present = np.flatnonzero(design.mask)
    piece = piece_of_beams(design)
    held = np.isin(problem.lattice.beams[present], problem.supports.nodes).any(axis=1)
    loose = ~np.isin(piece, piece[held])
    if loose.any():
        count = int(piece.max()) + 1
        raise InvalidSettings(
            f"the design is in {count} piece{'s' * (count > 1)}: {loose.sum()} of its "
            f"{len(present)} beams hang on no support, the first being beam {present[loose][0]}; "
            "leave them out"
        )


def doubts_about(design: Design) -> list[str]:
    """Return what a builder should know of a design before any motion, as sentences.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> doubts_about(find_problem("crane").full_design())
    []
    """
    problem = design.problem
    beams = problem.lattice.beams[design.mask]
    found = []
    for region, name in ((problem.input.nodes, "input"), (problem.output.nodes, "output")):
        missing = np.setdiff1d(region, beams)
        if len(missing):
            every = "none" if len(missing) == len(region) else f"not all {len(region)}"
            found.append(f"{every} of the {name} nodes have beams, node {missing[0]} has none")
    piece = piece_of_beams(design)
    ends = [
        set(piece[np.isin(beams, region).any(axis=1)].tolist())
        for region in (problem.input.nodes, problem.output.nodes)
    ]
    if ends[0] and ends[1] and not ends[0] & ends[1]:
        found.append("input and output do not hang together: no motion can reach the output")
    crossing = crossings(design)
    if len(crossing):
        first, second = crossing[0]
        found.append(
            f"beams cross each other without a node, {first} and {second} among them: frames and "
            "the discrete model let them pass, in the printed outline they are joined"
        )
    return found


def crossings(design: Design) -> NDArray[np.int64]:
    """Return (p, 2) the pairs of beams that meet elsewhere than in a common node."""
    import shapely

    present = np.flatnonzero(design.mask)
    beams = design.problem.lattice.beams[present]
    lines = shapely.linestrings(design.problem.lattice.positions[beams])
    one, other = shapely.STRtree(lines).query(lines, predicate="intersects")
    one, other = one[one < other], other[one < other]
    shared = (beams[one][:, :, None] == beams[other][:, None, :]).any(axis=(1, 2))
    pairs: NDArray[np.int64] = np.stack([present[one[~shared]], present[other[~shared]]], axis=1)
    return pairs
