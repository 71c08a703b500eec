"""Records of a search: one row for each proposal, accepted or not."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from bellcrank.errors import InvalidSettings

if TYPE_CHECKING:
    from numpy.typing import NDArray

COLUMNS = ("step", "mask", "efficiency", "cost", "temperature", "accepted", "status")
"""Columns of a chain, in the order of the files."""


class Proposals(NamedTuple):
    """Consecutive proposals of one chain.

    Parameters
    ----------
    mask : (n, ceil(M / 8)) uint8
        Proposed designs, packed by `numpy.packbits` over the M beams.
    efficiency : (n,) float64
        Efficiency of the proposed design, accepted or not; NaN if it has none.
    cost : (n,) float64
        Cost that the search minimises.
    temperature : (n,) float64
        Temperature of the acceptance rule, in units of the cost.
    accepted : (n,) bool
        Whether the proposal was accepted.
    status : (n,) int8
        Status of the evaluation.
    """

    mask: NDArray[np.uint8]
    efficiency: NDArray[np.float64]
    cost: NDArray[np.float64]
    temperature: NDArray[np.float64]
    accepted: NDArray[np.bool_]
    status: NDArray[np.int8]


def checked_proposals(records: Any, mask_bytes: int) -> Proposals:
    """Cast the columns of `records` and check their shapes.

    Parameters
    ----------
    records
        Object with the columns of `Proposals`, of any types.
    mask_bytes
        Bytes of a packed design of the run's problem.

    Raises
    ------
    InvalidSettings
        If a column has the wrong shape, or there are no rows.
    """
    cast = Proposals(
        np.ascontiguousarray(records.mask, dtype=np.uint8),
        np.ascontiguousarray(records.efficiency, dtype=np.float64),
        np.ascontiguousarray(records.cost, dtype=np.float64),
        np.ascontiguousarray(records.temperature, dtype=np.float64),
        np.ascontiguousarray(records.accepted, dtype=np.bool_),
        np.ascontiguousarray(records.status, dtype=np.int8),
    )
    rows = len(cast.efficiency)
    if rows == 0:
        raise InvalidSettings("proposals: expected at least one row, got none")
    for name, column in cast._asdict().items():
        expected = (rows, mask_bytes) if name == "mask" else (rows,)
        if column.shape != expected:
            raise InvalidSettings(
                f"proposals: {name}: expected shape {expected}, got {column.shape}"
            )
    return cast
