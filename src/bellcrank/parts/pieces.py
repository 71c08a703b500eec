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
        raise InvalidSettings(
            f"the design is in {piece.max() + 1} pieces: {loose.sum()} of its {len(present)} beams "
            f"hang on no support, the first being beam {present[loose][0]}; leave them out"
        )
