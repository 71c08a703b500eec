"""Bundles of arrays and numbers that a kernel takes as one argument.

numba passes a tuple of arrays by its parts, some seven scalars for each array. With twenty arrays
in a bundle and several bundles in each call, most of the machine code moves arguments, and most
of the compilation time goes there. A `Bundle` is passed by the address of a table instead, which
holds the address and the shape of each array; a kernel reads an entry where it uses the array.

The table does not change after the bundle is made, so neither may the bundle; the contents of its
arrays may.
"""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.mechanics.kernels.bundle_type import BundleType


class Bundle:
    """Base of frozen dataclasses of which kernels take instances.

    Fields are C-contiguous arrays, numbers, other bundles, named tuples of arrays, and tuples of
    numbers. Kernels read them as attributes.

    Raises
    ------
    TypeError
        If an array is not C-contiguous and writable.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> from bellcrank.mechanics.kernels.arrays import Floats
    >>> @dataclass(frozen=True, eq=False)
    ... class Points(Bundle):
    ...     position: Floats
    ...     scale: float
    >>> Points(np.zeros((3, 2)), 2.0).table[1:]
    array([                  3,                   2, 4611686018427387904])
    """

    table: NDArray[np.int64]
    """Addresses, shapes and numbers of the fields, in their order."""
    address: int
    """Address of the table."""
    _type: BundleType | None

    def __post_init__(self) -> None:
        entries: list[int] = []
        for field in fields(self):  # type: ignore[arg-type]
            entries += _entries(field.name, getattr(self, field.name))
        table = np.array(entries, dtype=np.int64)
        object.__setattr__(self, "table", table)
        object.__setattr__(self, "address", table.ctypes.data)
        object.__setattr__(self, "_type", None)

    def __reduce__(self) -> tuple[Any, ...]:
        """Return how to make a copy, which has a table of its own."""
        values = tuple(getattr(self, field.name) for field in fields(self))  # type: ignore[arg-type]
        return type(self), values

    @property
    def _numba_type_(self) -> BundleType:
        """Type of this bundle in kernels; numba asks for it under this name."""
        found = self._type
        if found is None:
            from bellcrank.mechanics.kernels.bundle_type import type_of

            found = type_of(self)
            object.__setattr__(self, "_type", found)
        return found


def _entries(name: str, value: Any) -> list[int]:
    """Return the entries of a value in the table."""
    if isinstance(value, np.ndarray):
        if not (value.flags.c_contiguous and value.flags.writeable):
            raise TypeError(f"{name}: expected a C-contiguous, writable array")
        return [value.ctypes.data, *value.shape]
    if isinstance(value, Bundle):
        return [value.address]
    if isinstance(value, tuple):
        return [entry for each in value for entry in _entries(name, each)]
    if isinstance(value, bool | int):
        return [int(value)]
    return [int(np.float64(value).view(np.int64))]
