"""Elementary operations on arrays, written as loops.

numba supports ``a, b = array[i]`` and ``array[:] = other``, but compiles checks and error
messages into each such statement, which adds seconds of compilation.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from bellcrank.mechanics.kernels._compile import kernel

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.mechanics.kernels.arrays import Floats


@kernel
def pair(array: NDArray[Any], index: int) -> tuple[Any, Any]:
    """Return the two entries of a row."""
    return array[index, 0], array[index, 1]


@kernel
def triple(array: Floats, index: int) -> tuple[float, float, float]:
    """Return the three entries of a row."""
    return array[index, 0], array[index, 1], array[index, 2]


@kernel
def clear(field: NDArray[Any], rows: int) -> None:
    """Set the first rows of a two-dimensional array to zero."""
    for row in range(rows):
        for column in range(field.shape[1]):
            field[row, column] = 0


@kernel
def copy(source: Floats, target: Floats) -> None:
    """Copy one two-dimensional array onto another."""
    for row in range(len(source)):
        for column in range(source.shape[1]):
            target[row, column] = source[row, column]


@kernel
def copy_row(source: Floats, target: Floats) -> None:
    """Copy one one-dimensional array onto another."""
    for index in range(len(source)):
        target[index] = source[index]


@kernel
def largest_difference(a: Floats, b: Floats) -> float:
    """Largest difference between the components of two fields."""
    largest = 0.0
    for row in range(len(a)):
        for column in range(a.shape[1]):
            largest = max(largest, abs(a[row, column] - b[row, column]))
    return largest


@kernel
def dot(a: Floats, b: Floats) -> float:
    """Inner product of two fields on the nodes."""
    total = 0.0
    for node in range(len(a)):
        total += a[node, 0] * b[node, 0] + a[node, 1] * b[node, 1]
    return total


@kernel
def move(u: Floats, scale: float, direction: Floats) -> None:
    """Add `scale * direction` to `u`."""
    for node in range(len(u)):
        u[node, 0] += scale * direction[node, 0]
        u[node, 1] += scale * direction[node, 1]


@kernel
def largest_component(field: Floats) -> float:
    """Largest absolute component of a field; nan if one is nan."""
    largest = 0.0
    for row in range(len(field)):
        for column in range(field.shape[1]):
            size = abs(field[row, column])
            if not size <= largest:
                largest = size
    return largest
