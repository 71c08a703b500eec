"""Connected pieces of a design, their supports, and crossing beams."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.model.geometry import distances_to_segments, inner_distances

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.model import Design

TOUCHING = 1e-9
"""Distance of centre lines that intersect, over the length of the longest beam."""


def beam_pieces(design: Design) -> NDArray[np.int64]:
    """Return the number of the piece of each present beam, (b,) int64 from 0.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> int(beam_pieces(find_problem("crane").full_design()).max())
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


def check_supported(design: Design) -> None:
    """Check that all pieces of a design are supported.

    Raises
    ------
    InvalidSettings
        If not; names the first beam of an unsupported piece.
    """
    problem = design.problem
    present = np.flatnonzero(design.mask)
    piece = beam_pieces(design)
    supported = np.isin(problem.lattice.beams[present], problem.supports.nodes).any(axis=1)
    loose = ~np.isin(piece, piece[supported])
    if loose.any():
        count = int(piece.max()) + 1
        raise InvalidSettings(
            f"the design is in {count} piece{'s' * (count > 1)}: {loose.sum()} of its "
            f"{len(present)} beams are connected to no support, first beam {present[loose][0]}; "
            "remove them"
        )


def connection_warnings(design: Design) -> list[str]:
    """Return warnings about the connections of a design, as sentences.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> connection_warnings(find_problem("crane").full_design())
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
    piece = beam_pieces(design)
    ends = [
        set(piece[np.isin(beams, region).any(axis=1)].tolist())
        for region in (problem.input.nodes, problem.output.nodes)
    ]
    if ends[0] and ends[1] and not ends[0] & ends[1]:
        found.append("input and output are not connected: no motion reaches the output")
    crossing = crossings(design)
    if len(crossing):
        first, second = crossing[0]
        found.append(
            f"beams cross without a common node, for example {first} and {second}: they are "
            "independent in frames and in the spring model but joined in the printed part"
        )
    return found


def crossings(design: Design) -> NDArray[np.int64]:
    """Return the pairs of beams, (p, 2), that intersect without a common node."""
    from scipy.spatial import cKDTree

    present = np.flatnonzero(design.mask)
    beams = design.problem.lattice.beams[present]
    ends = design.problem.lattice.positions[beams]
    longest = float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).max(initial=0.0))
    near = cKDTree(ends.mean(axis=1)).query_pairs(longest, output_type="ndarray")
    one, other = near[np.lexsort(near.T[::-1])].T
    shared = (beams[one][:, :, None] == beams[other][:, None, :]).any(axis=(1, 2))
    one, other = one[~shared], other[~shared]
    gaps = [
        inner_distances(ends[one], ends[other])[0],
        *(
            distances_to_segments(ends[first, end], ends[second, 0], ends[second, 1])
            for first, second in ((one, other), (other, one))
            for end in (0, 1)
        ),
    ]
    meet = np.min(gaps, axis=0) <= TOUCHING * longest
    pairs: NDArray[np.int64] = np.stack([present[one[meet]], present[other[meet]]], axis=1)
    return pairs
