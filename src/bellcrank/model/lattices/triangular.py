"""Triangular lattices: rows of equally spaced nodes, connected to all neighbours."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidProblem
from bellcrank.model.lattice import Lattice, check_node_count
from bellcrank.model.lattices.registry import lattices

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray


@lattices.register("triangular-rows")
def triangular_rows(
    counts: Sequence[int], first_x: Sequence[float], spacing: float = 1.0
) -> Lattice:
    """Return a triangular lattice of rows, from the bottom up.

    Nodes are numbered row by row from the bottom, left to right; beams are
    sorted by their first node, then by their second.

    Parameters
    ----------
    counts
        Number of nodes in each row.
    first_x
        x of the first node of each row, lattice units. Neighbouring rows are shifted by half a
        spacing.
    spacing
        Distance between neighbours; the distance of rows is ``sqrt(3) / 2`` times as large.

    Raises
    ------
    InvalidProblem
        If counts and shifts are inconsistent, or the lattice is too large.

    Examples
    --------
    >>> lattice = triangular_rows(counts=[2, 1], first_x=[0.0, 0.5])
    >>> lattice.beams
    array([[0, 1],
           [0, 2],
           [1, 2]])
    >>> lattice.rest_length.round(12)
    array([1., 1., 1.])
    """
    _check_rows(counts, first_x, spacing)
    height = spacing * math.sqrt(3.0) / 2.0
    rows = [
        np.column_stack([start + spacing * np.arange(count), np.full(count, height * row)])
        for row, (count, start) in enumerate(zip(counts, first_x, strict=True))
    ]
    first_node = np.concatenate([[0], np.cumsum(counts)])
    beams: list[tuple[int, int]] = []
    for row, nodes in enumerate(rows):
        first = int(first_node[row])
        beams += [(first + k, first + k + 1) for k in range(len(nodes) - 1)]
        if row + 1 < len(rows):
            beams += _between(nodes, rows[row + 1], spacing, first, int(first_node[row + 1]))
    return Lattice(np.concatenate(rows), np.array(sorted(beams)).reshape(-1, 2))


@lattices.register("triangular-rectangle")
def triangular_rectangle(columns: int, rows: int, spacing: float = 1.0) -> Lattice:
    """Return a rectangular lattice with alternately `columns` and ``columns + 1`` nodes in a row.

    Parameters
    ----------
    columns
        Number of nodes in the lowest row, which is shifted by half a spacing.
    rows
        Number of rows.
    spacing
        Distance between neighbours, lattice units.

    Raises
    ------
    InvalidProblem
        If there are no columns, fewer than two rows, or too many nodes.

    Examples
    --------
    >>> triangular_rectangle(columns=2, rows=3).positions.round(3)
    array([[0.5  , 0.   ],
           [1.5  , 0.   ],
           [0.   , 0.866],
           [1.   , 0.866],
           [2.   , 0.866],
           [0.5  , 1.732],
           [1.5  , 1.732]])
    """
    if columns < 1 or rows < 2:
        raise InvalidProblem(
            f"lattice: expected at least 1 column and 2 rows, got {columns} columns and {rows} rows"
        )
    check_node_count("lattice.columns", columns * rows + rows // 2)
    counts = [columns + row % 2 for row in range(rows)]
    first_x = [0.0 if row % 2 else 0.5 * spacing for row in range(rows)]
    return triangular_rows(counts, first_x, spacing)


def _between(
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
    spacing: float,
    first_lower: int,
    first_upper: int,
) -> list[tuple[int, int]]:
    """Return the beams from each node of a row to those half a spacing away in the row above."""
    beams: list[tuple[int, int]] = []
    tolerance = 1e-6 * spacing
    for shift in (-0.5 * spacing, 0.5 * spacing):
        wanted = lower[:, 0] + shift
        above = np.searchsorted(upper[:, 0], wanted - tolerance).clip(max=len(upper) - 1)
        there = np.flatnonzero(np.abs(upper[above, 0] - wanted) <= tolerance)
        beams += zip(
            (first_lower + there).tolist(), (first_upper + above[there]).tolist(), strict=True
        )
    return beams


def _check_rows(counts: Sequence[int], first_x: Sequence[float], spacing: float) -> None:
    if not (math.isfinite(spacing) and spacing > 0.0):
        raise InvalidProblem(f"lattice.spacing: expected a number greater than 0, got {spacing}")
    if len(counts) != len(first_x) or len(counts) == 0:
        raise InvalidProblem(
            "lattice: expected as many counts as first_x, at least one of each, "
            f"got {len(counts)} and {len(first_x)}"
        )
    for row, (count, start) in enumerate(zip(counts, first_x, strict=True)):
        if count < 1:
            raise InvalidProblem(f"lattice.counts[{row}]: expected at least 1, got {count}")
        if not math.isfinite(start):
            raise InvalidProblem(f"lattice.first_x[{row}]: expected a finite number, got {start}")
        offset = 0.0 if row == 0 else (start - first_x[row - 1]) / spacing
        if row > 0 and abs(offset % 1.0 - 0.5) > 1e-6:
            raise InvalidProblem(
                f"lattice.first_x[{row}]: expected a row shifted by half a spacing "
                f"({0.5 * spacing:g}) against the row below, got a shift of {offset * spacing:g}"
            )
    check_node_count("lattice.counts", sum(counts))
