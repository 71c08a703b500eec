"""A dataset's file comes back as it was, and whatever is wrong with it is said in one line."""

from __future__ import annotations

import random
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from bellcrank.errors import (
    BellcrankError,
    CorruptRun,
    InvalidDataset,
    InvalidFile,
    OutputExists,
)
from bellcrank.surrogate.dataset import Dataset, join, read_dataset
from bellcrank.surrogate.splitting import split_by_run

from .helpers import equal, random_dataset

if TYPE_CHECKING:
    from pathlib import Path

    from bellcrank.model import Problem


def test_a_dataset_comes_back_to_the_last_bit(data: Dataset, tmp_path: Path) -> None:
    path = tmp_path / "data.parquet"
    data.write(path)
    assert equal(read_dataset(path), data)


def test_a_file_is_not_written_over_without_being_told(data: Dataset, tmp_path: Path) -> None:
    path = tmp_path / "data.parquet"
    data.write(path)
    with pytest.raises(OutputExists):
        data.write(path)
    data.take(np.arange(5)).write(path, overwrite=True)
    assert len(read_dataset(path)) == 5


def test_the_folder_that_a_dataset_was_built_in_stands_for_it(built: Path) -> None:
    assert equal(read_dataset(built), read_dataset(built / "dataset.parquet"))


def test_some_rows_are_a_dataset_too(data: Dataset) -> None:
    some = data.take(data.run == 2)
    assert some.run_count == 1
    assert np.array_equal(some.packed, data.packed[data.run == 2])
    assert not some.efficiency.flags.writeable


def columns_of(data: Dataset, **changes: Any) -> dict[str, Any]:
    given = {name: getattr(data, name) for name in ("packed", "efficiency", "run", "step")}
    return given | changes


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"efficiency": np.r_[np.zeros(319), np.nan]}, r"row 319 \(run 7, step 39\) is nan"),
        ({"efficiency": np.r_[-np.inf, np.zeros(319)]}, r"row 0 \(run 0, step 0\) is -inf"),
        ({"efficiency": np.zeros(5)}, "efficiency: expected 320 rows"),
        ({"efficiency": ["much"] * 320}, "efficiency: could not convert"),
        ({"packed": np.zeros((320, 3), np.uint8)}, "masks of 28 bytes for the 219 beams"),
        ({"packed": np.zeros(320, np.uint8)}, "masks of 28 bytes for the 219 beams"),
        ({"run": np.r_[-1, np.zeros(319)]}, "run: row 0 is -1; expected 0 to"),
        ({"step": np.full(320, 2**40)}, "step: row 0 is 1099511627776; expected 0 to"),
    ],
)
def test_columns_that_cannot_be_are_refused(
    data: Dataset, changes: dict[str, Any], message: str
) -> None:
    with pytest.raises(InvalidDataset, match=message):
        Dataset(data.problem, **columns_of(data, **changes))


def test_an_empty_dataset_is_refused(data: Dataset) -> None:
    with pytest.raises(InvalidDataset, match="the dataset is empty"):
        data.take(np.arange(0))


def test_a_single_run_cannot_be_split(data: Dataset) -> None:
    with pytest.raises(InvalidDataset, match="all 40 designs come from one run"):
        split_by_run(data.take(data.run == 1), 0.25, 0)


def test_what_is_no_dataset_is_refused(tmp_path: Path, data: Dataset) -> None:
    with pytest.raises(InvalidFile, match="no such file"):
        read_dataset(tmp_path / "absent.parquet")
    with pytest.raises(InvalidFile, match=r"no dataset\.parquet in this folder"):
        read_dataset(tmp_path)
    text = tmp_path / "text.parquet"
    text.write_text("not a Parquet file at all")
    with pytest.raises(InvalidFile, match="not a Parquet file"):
        read_dataset(text)
    other = tmp_path / "other.parquet"
    pq.write_table(pa.table({"run": [1], "step": [2]}), other)
    with pytest.raises(InvalidFile, match="it has no column 'mask'"):
        read_dataset(other)


def test_other_parquet_with_our_columns_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "alike.parquet"
    names = ("run", "step", "mask", "efficiency", "accepted")
    pq.write_table(pa.table({name: ["a"] for name in names}), path)
    with pytest.raises(CorruptRun, match="damaged"):
        read_dataset(path)


def test_a_label_that_is_no_number_is_found_in_a_file(tmp_path: Path, data: Dataset) -> None:
    path = tmp_path / "nan.parquet"
    bad = data.take(np.arange(9))
    efficiency = bad.efficiency.copy()
    efficiency[4] = np.nan
    object.__setattr__(bad, "efficiency", efficiency)
    bad.write(path)
    with pytest.raises(InvalidDataset, match=r"nan\.parquet: efficiency: row 4 .* is nan"):
        read_dataset(path)


def test_no_bit_of_a_file_can_change_what_is_read_without_a_word(
    tmp_path: Path, data: Dataset
) -> None:
    path = tmp_path / "data.parquet"
    few = data.take(np.arange(60))
    few.write(path)
    whole = path.read_bytes()
    chance = random.Random(4)
    places = [0, len(whole) - 1, *(chance.randrange(len(whole)) for _ in range(120))]
    refusals = []
    for place in places:
        content = bytearray(whole)
        content[place] ^= 1 << chance.randrange(8)
        path.write_bytes(content)
        try:
            found = read_dataset(path)
        except BellcrankError as error:
            refusals.append(str(error))
        else:
            assert equal(found, few)
    assert len(refusals) > 80
    assert all(str(path) in each and "\n" not in each for each in refusals)
    for cut in (0, 3, 100, len(whole) // 2, len(whole) - 1):
        path.write_bytes(whole[:cut])
        with pytest.raises((InvalidFile, CorruptRun)):
            read_dataset(path)


def test_joined_datasets_keep_their_rows_and_get_runs_of_their_own(
    data: Dataset, problem: Problem
) -> None:
    other = random_dataset(problem, runs=3, seed=6)
    joined = join([data, other, other])
    assert joined.run_count == data.run_count + 6
    parts = np.split(np.arange(len(joined)), [len(data), len(data) + len(other)])
    for part, source, first in zip(parts, (data, other, other), (0, 8, 11), strict=True):
        found = joined.take(part)
        assert np.array_equal(found.run, source.run + first)
        for name in ("packed", "efficiency", "step", "accepted"):
            assert np.array_equal(getattr(found, name), getattr(source, name))
    assert join([data]) is data


def test_datasets_of_different_problems_are_not_joined(data: Dataset, crane: Problem) -> None:
    with pytest.raises(InvalidDataset, match=r"dataset 2 has another problem \('crane'\)"):
        join([data, random_dataset(crane)])
    with pytest.raises(InvalidDataset, match="no dataset is given"):
        join([])
