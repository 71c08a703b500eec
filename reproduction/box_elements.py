"""Square elements of a box for topology optimisation: fixed regions, load, output and supports."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from reproduction.boxes import Box

PAD = 1.7
"""Radius of the solid regions around ports and supports, mm; slightly larger than in bellcrank."""


@dataclass(frozen=True, slots=True)
class Grid:
    """Square elements of a box, or cubes.

    In the plane, elements and corners are numbered in rows from the bottom, each row from the left;
    the degrees of freedom of corner ``k`` are ``2 k`` to the right and ``2 k + 1`` upwards. In
    space (`benchmarks.inverters`) the numbers are those of pyMOTO.

    Parameters
    ----------
    counts
        Numbers of elements across and up; in space along x, y and z.
    load, output : (n,)
        Unit load at the input, and mean output.
    held : (h,)
        Fixed degrees of freedom.
    solid, empty
        Numbers of the fixed solid and of the fixed void elements.
    """

    counts: tuple[int, ...]
    load: NDArray[np.float64]
    output: NDArray[np.float64]
    held: NDArray[np.int64]
    solid: NDArray[np.int64]
    empty: NDArray[np.int64]


def grid_of(box: Box, elements: int) -> Grid:
    """Return the elements of a box.

    Parameters
    ----------
    elements
        Number of elements along the longer side.
    """
    size = box.high - box.low
    across, up = (max(round(elements * float(side) / size.max()), 2) for side in size)
    step = size / np.array([across, up])
    solid, empty = _fixed_elements(box, _places(across, up, 0.5) * step + box.low)
    corners = _places(across + 1, up + 1, 0.0) * step + box.low
    load, output, held = _ports(box, corners)
    return Grid((across, up), load, output, held, solid, empty)


def _places(columns: int, rows: int, shift: float) -> NDArray[np.float64]:
    """Return the (columns rows, 2) places of corners or centres, in elements."""
    across, up = np.meshgrid(np.arange(columns) + shift, np.arange(rows) + shift)
    return np.column_stack([across.ravel(), up.ravel()])


def _fixed_elements(
    box: Box, centres: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the numbers of the fixed solid and of the fixed void elements."""
    problem = box.problem
    ports = np.concatenate([problem.input.nodes, problem.output.nodes, problem.supports.fixed])
    away = np.hypot(*(centres[:, None] - box.positions[ports][None]).transpose(2, 0, 1)).min(axis=1)
    solid = away < PAD
    empty = np.zeros(len(centres), dtype=bool)
    if box.void is not None:
        empty = ((centres > box.void[0]) & (centres < box.void[1])).all(axis=1) & ~solid
    return np.flatnonzero(solid), np.flatnonzero(empty)


def _ports(
    box: Box, corners: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
    """Return the unit load at the input, the mean output, and the fixed degrees of freedom."""
    problem = box.problem

    def nearest(node: int) -> int:
        return int(np.argmin(np.hypot(*(corners - box.positions[node]).T)))

    load, output = np.zeros(2 * len(corners)), np.zeros(2 * len(corners))
    for vector, region in ((load, problem.input), (output, problem.output)):
        for node, direction in zip(region.nodes.tolist(), region.direction, strict=True):
            at = 2 * nearest(node)
            vector[at : at + 2] += direction / len(region.nodes)
    held = [
        2 * corner + axis
        for node in problem.supports.fixed
        for corner in np.flatnonzero(np.hypot(*(corners - box.positions[node]).T) < 0.8 * PAD)
        for axis in (0, 1)
    ]
    return load, output, np.array(sorted(set(held)), dtype=np.int64)
