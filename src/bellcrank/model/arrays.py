"""Validated, read-only arrays for the objects of the model.

Arrays are copied, cast, made contiguous and locked when an object is built. Immutable objects can
be shared between chains and hashed once.
"""

from __future__ import annotations

from dataclasses import fields
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidProblem

if TYPE_CHECKING:
    from collections.abc import Callable

    from _typeshed import DataclassInstance
    from numpy.typing import ArrayLike, NDArray


def locked(array: NDArray[Any]) -> NDArray[Any]:
    """Return a contiguous, read-only copy of `array`.

    Examples
    --------
    >>> locked(np.zeros(2))[0] = 1.0
    Traceback (most recent call last):
        ...
    ValueError: assignment destination is read-only
    """
    copy = np.array(array, order="C", copy=True)
    copy.flags.writeable = False
    return copy


def real_array(name: str, values: ArrayLike) -> NDArray[np.float64]:
    """Cast `values` to finite numbers; negative zeros become zeros.

    Raises
    ------
    InvalidProblem
        If they are not numbers, ragged, or not finite; names the first invalid entry.
    """
    raw = _as_array(name, values)
    if raw.dtype.kind not in "iuf":
        raise InvalidProblem(f"{name}: expected numbers, got values of type {raw.dtype}")
    # Adding zero turns -0.0 into 0.0, which would otherwise hash differently.
    array: NDArray[np.float64] = np.asarray(raw, dtype=np.float64) + 0.0
    bad = np.argwhere(~np.isfinite(array))
    if len(bad):
        where = "".join(f"[{k}]" for k in bad[0])
        raise InvalidProblem(f"{name}{where}: expected a finite number, got {array[tuple(bad[0])]}")
    return array


def positive_number(name: str, value: ArrayLike) -> float:
    """Return a finite number greater than zero.

    Raises
    ------
    InvalidProblem
        If `value` is not one.
    """
    number = real_array(name, value)
    if number.ndim != 0 or number <= 0.0:
        raise InvalidProblem(f"{name}: expected a number greater than 0, got {value!r}")
    return float(number)


def index_array(name: str, values: ArrayLike) -> NDArray[np.int64]:
    """Cast `values` to integers without rounding.

    Raises
    ------
    InvalidProblem
        If they are not integers.
    """
    array = _as_array(name, values)
    if array.size == 0:
        return array.astype(np.int64)
    if not np.issubdtype(array.dtype, np.integer):
        raise InvalidProblem(f"{name}: expected integers, got values of type {array.dtype}")
    return array.astype(np.int64)


def id_list(name: str, values: ArrayLike) -> NDArray[np.int64]:
    """Cast `values` to a flat list of distinct ids, in the order given.

    Raises
    ------
    InvalidProblem
        If they are not a flat list of integers, or one is repeated.
    """
    ids = index_array(name, values)
    if ids.ndim != 1:
        raise InvalidProblem(f"{name}: expected a flat list of ids, got shape {ids.shape}")
    first = np.unique(ids, return_index=True)[1]
    if len(first) < len(ids):
        repeated = np.setdiff1d(np.arange(len(ids)), first)[0]
        raise InvalidProblem(f"{name}[{repeated}]: {ids[repeated]} is listed twice")
    return ids


def check_ids(name: str, ids: NDArray[np.int64], count: int, kind: str) -> None:
    """Check that all `ids` are between 0 and ``count - 1``.

    Parameters
    ----------
    name
        Name of the argument, for the error.
    ids : (n,) int64
        Node or beam numbers.
    count
        Number of nodes or beams.
    kind
        ``"node"`` or ``"beam"``, for the error.

    Raises
    ------
    InvalidProblem
        If one is not; names the first invalid entry.
    """
    bad = np.flatnonzero((ids < 0) | (ids >= count))
    if len(bad):
        raise InvalidProblem(
            f"{name}[{bad[0]}]: expected a {kind} from 0 to {count - 1}, got {ids[bad[0]]}"
        )


def _as_array(name: str, values: ArrayLike) -> NDArray[Any]:
    """Return an array, or name the first row of another length in the error."""
    try:
        return np.asarray(values)
    except ValueError:
        rows = list(values)  # type: ignore[arg-type]  # only sequences can be ragged
        sizes = [len(row) if isinstance(row, list | tuple) else None for row in rows]
        odd = next((k for k, size in enumerate(sizes) if size != sizes[0]), 0)
        raise InvalidProblem(
            f"{name}[{odd}]: expected {sizes[0]} numbers as in {name}[0], got {rows[odd]!r}"
        ) from None


def boolean_mask(name: str, values: ArrayLike, length: int) -> NDArray[np.bool_]:
    """Return `values` as a mask with one boolean per beam.

    Raises
    ------
    InvalidProblem
        If the shape or the type is another.
    """
    mask = np.asarray(values)
    if mask.shape != (length,):
        raise InvalidProblem(
            f"{name}: expected one boolean per beam, shape ({length},), got shape {mask.shape}"
        )
    if mask.dtype != np.bool_:
        raise InvalidProblem(f"{name}: expected booleans, got values of type {mask.dtype}")
    return mask


def rebuild(instance: DataclassInstance) -> tuple[Callable[[], Any], tuple[()]]:
    """Pickle and copy `instance` through its constructor (for use as ``__reduce__``).

    Pickle does not restore the read-only flag of arrays; the constructor sets it again.
    """
    values = {field.name: getattr(instance, field.name) for field in fields(instance)}
    return partial(type(instance), **values), ()
