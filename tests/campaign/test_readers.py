"""Every reader of Parquet sees the store as one table, by one name."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from .helpers import ROWS

if TYPE_CHECKING:
    from pathlib import Path

COLUMNS = [
    "task", "run", "seed", "step", "mask", "efficiency", "cost", "temperature", "accepted",
    "status",
]  # fmt: skip


@pytest.fixture(params=["finished", "tabled"])
def folder(request: pytest.FixtureRequest) -> Path:
    return request.getfixturevalue(request.param)


def test_pandas_reads_the_folder(folder: Path) -> None:
    pandas = pytest.importorskip("pandas")
    table = pandas.read_parquet(folder / "proposals")
    assert list(table.columns) == COLUMNS
    assert len(table) == ROWS
    assert table.groupby("task")["seed"].nunique().to_dict() == {"large": 1, "scaling-8-paper": 3}


def test_polars_reads_a_glob(folder: Path) -> None:
    polars = pytest.importorskip("polars")
    table = polars.read_parquet(f"{folder}/proposals/**/*.parquet")
    assert table.columns == COLUMNS
    assert table.height == ROWS
    assert table.unique(["run", "step"]).height == ROWS


def test_duckdb_reads_a_glob(folder: Path) -> None:
    duckdb = pytest.importorskip("duckdb")
    with duckdb.connect() as database:
        table = database.sql(f"select * from '{folder}/proposals/**/*.parquet'")
        assert table.columns == COLUMNS
        counted = database.sql(
            f"select count(*), count(distinct (run, step)), max(octet_length(mask)) "
            f"from '{folder}/proposals/**/*.parquet'"
        ).fetchall()
    assert counted == [(ROWS, ROWS, 44)]
