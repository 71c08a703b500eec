"""Bundles of arrays that kernels take by the address of a table."""

from __future__ import annotations

import copy
import pickle
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numba
import numpy as np
import pytest

from bellcrank.mechanics.kernels.bundle import Bundle

if TYPE_CHECKING:
    from bellcrank.mechanics.kernels.arrays import Bytes, Floats, Ints


class Pair(NamedTuple):
    first: Floats
    second: Floats


@dataclass(frozen=True, eq=False)
class Inner(Bundle):
    weight: Floats


@dataclass(frozen=True, eq=False)
class Outer(Bundle):
    unit: tuple[float, ...]
    grid: Floats
    index: Ints
    flag: Bytes
    is_on: bool
    count: int
    scale: float
    pair: Pair
    inner: Inner


def outer() -> Outer:
    return Outer(
        unit=(0.0, 0.0, 0.0),
        grid=np.arange(12.0).reshape(2, 3, 2),
        index=np.array([4, 5, 6]),
        flag=np.array([1, 0], np.uint8),
        is_on=True,
        count=-7,
        scale=0.125,
        pair=Pair(np.ones((2, 2)), np.full((1, 3), 2.0)),
        inner=Inner(np.array([10.0, 20.0])),
    )


@numba.njit
def read(bundle: Outer) -> tuple[float, ...]:
    return (
        float(len(bundle.unit)),
        bundle.grid[1, 2, 1],
        float(bundle.index[2]),
        float(bundle.flag[0]),
        1.0 if bundle.is_on else 0.0,
        float(bundle.count),
        bundle.scale,
        bundle.pair.first[1, 1] + bundle.pair.second[0, 2],
        bundle.inner.weight[-1],
        float(bundle.grid.shape[0] * 100 + bundle.grid.shape[1] * 10 + bundle.grid.shape[2]),
    )


@numba.njit
def write(bundle: Outer) -> None:
    bundle.grid[0, 1, 1] = -1.0
    bundle.inner.weight[0] = -2.0


def test_kernels_read_and_fill_what_python_holds() -> None:
    bundle = outer()
    assert read(bundle) == (3.0, 11.0, 6.0, 1.0, 1.0, -7.0, 0.125, 3.0, 20.0, 232.0)
    write(bundle)
    assert bundle.grid[0, 1, 1] == -1.0
    assert bundle.inner.weight[0] == -2.0


def test_a_replaced_field_is_read_and_the_type_is_the_same() -> None:
    bundle = replace(outer(), count=9, grid=np.zeros((4, 5, 6)), is_on=False)
    found = read(bundle)
    assert found[4:6] == (0.0, 9.0)
    assert found[-1] == 456.0
    assert len(read.signatures) == 1


def test_an_array_that_is_not_contiguous_is_refused() -> None:
    with pytest.raises(TypeError, match="grid: expected a C-contiguous, writable array"):
        replace(outer(), grid=np.zeros((4, 6)).T)


def test_fields_are_fixed() -> None:
    with pytest.raises(AttributeError):
        outer().count = 3  # type: ignore[misc]


@pytest.mark.parametrize(
    "duplicate", [copy.deepcopy, lambda bundle: pickle.loads(pickle.dumps(bundle))]
)
def test_a_copy_has_a_table_of_its_own(duplicate) -> None:
    bundle = outer()
    other = duplicate(bundle)
    write(other)
    assert other.grid[0, 1, 1] == -1.0
    assert bundle.grid[0, 1, 1] == 3.0
    assert bundle.inner.weight[0] == 10.0
