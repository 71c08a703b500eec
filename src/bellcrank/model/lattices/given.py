"""Lattices of given nodes and beams."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidProblem
from bellcrank.model.lattice import Lattice
from bellcrank.model.lattices.registry import lattices

if TYPE_CHECKING:
    from collections.abc import Sequence


@lattices.register("nodes")
def given_nodes(positions: Sequence[Sequence[float]], beams: Sequence[Sequence[int]]) -> Lattice:
    """Return the lattice of given nodes and beams.

    Parameters
    ----------
    positions
        Coordinates of each node, lattice units.
    beams
        The two nodes of each beam.

    Raises
    ------
    InvalidProblem
        As `Lattice`.

    Examples
    --------
    >>> given_nodes([[0, 0], [1, 0], [0.5, 0.75]], [[0, 1], [1, 2], [2, 0]]).beam_count
    3
    """
    try:
        arrays = np.array(positions, dtype=np.float64), np.array(beams, dtype=np.int64)
    except ValueError:
        raise InvalidProblem(
            "positions and beams: expected as many coordinates of each node, and two nodes of "
            "each beam"
        ) from None
    return Lattice(*arrays)
