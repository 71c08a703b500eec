"""The record of a search: one row for each proposal, accepted or not."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np

from bellcrank.errors import InvalidSettings

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

COLUMNS = ("step", "mask", "efficiency", "cost", "temperature", "accepted", "status")
"""What can be read back of a chain, in the order of the files."""


class Proposals(NamedTuple):
    """Consecutive proposals of one chain.

    Parameters
    ----------
    mask : (n, ceil(M / 8)) uint8
        The proposed designs, packed by `numpy.packbits` over the M beams.
    efficiency : (n,) float64
        Of the proposed design, accepted or not; NaN where there is none.
    cost : (n,) float64
        What the search compared.
    temperature : (n,) float64
        At which the proposal was judged, in units of the cost.
    accepted : (n,) bool
        Whether the chain moved there.
    status : (n,) int8
        How the computation of the response ended.
    """

    mask: NDArray[np.uint8]
    efficiency: NDArray[np.float64]
    cost: NDArray[np.float64]
    temperature: NDArray[np.float64]
    accepted: NDArray[np.bool_]
    status: NDArray[np.int8]


class ProposalColumns(Protocol):
    """Whatever has the columns of `Proposals`; values are cast when they are stored."""

    @property
    def mask(self) -> NDArray[Any]:
        """(n, bytes) packed designs."""

    @property
    def efficiency(self) -> NDArray[Any]:
        """(n,) of the proposed design."""

    @property
    def cost(self) -> NDArray[Any]:
        """(n,) what the search compared."""

    @property
    def temperature(self) -> NDArray[Any]:
        """(n,) at which the proposal was judged."""

    @property
    def accepted(self) -> NDArray[Any]:
        """(n,) whether the chain moved there."""

    @property
    def status(self) -> NDArray[Any]:
        """(n,) how the response ended."""


def checked_proposals(records: ProposalColumns, mask_bytes: int) -> Proposals:
    """Cast the columns of `records` and check that they fit together.

    Parameters
    ----------
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


def checked_columns(columns: Sequence[str] | None) -> list[str]:
    """Return the names of the columns to read; all where none are named.

    Raises
    ------
    InvalidSettings
        If one does not exist.

    Examples
    --------
    >>> checked_columns(["step", "cost"])
    ['step', 'cost']
    >>> checked_columns(["energy"])
    Traceback (most recent call last):
        ...
    bellcrank.errors.InvalidSettings: no column 'energy' in a run; known: step, mask, \
efficiency, cost, temperature, accepted, status
    """
    names = list(COLUMNS if columns is None else columns)
    if wrong := next((name for name in names if name not in COLUMNS), None):
        raise InvalidSettings(f"no column {wrong!r} in a run; known: {', '.join(COLUMNS)}")
    return names


def empty_columns(columns: Sequence[str], mask_bytes: int) -> dict[str, NDArray[Any]]:
    """Return the columns of a chain that has not begun."""
    dtypes = {"step": np.int64, "mask": np.uint8, "accepted": np.bool_, "status": np.int8}
    return {
        name: np.empty((0, mask_bytes) if name == "mask" else 0, dtypes.get(name, np.float64))
        for name in columns
    }
