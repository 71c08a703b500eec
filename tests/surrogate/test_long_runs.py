"""The benchmarks on long runs and on runs of an independent program."""

from __future__ import annotations

import json
import sys
from typing import TYPE_CHECKING

import numpy as np
import pytest

from bellcrank.mechanics import SpringEvaluator
from bellcrank.model import find_problem
from bellcrank.surrogate.dataset import Dataset, read_dataset
from benchmarks import independent_simulation
from benchmarks import surrogate_long_runs as benchmark

from .helpers import random_masks, untrained

if TYPE_CHECKING:
    from pathlib import Path


def test_the_bias_is_that_of_the_designs_beyond_the_bound() -> None:
    crane = find_problem("crane")
    model = untrained(crane)
    packed = np.packbits(random_masks(crane, 6), axis=1)
    actual = np.array([-4.0, -3.5, -3.0, 2.0, 3.0, 5.0])
    found = benchmark.measure(model, Dataset(crane, packed, actual, [0, 0, 0, 1, 1, 1]))
    error = model.predict(packed) - actual
    assert found["below"] == {"count": 2, "bias": pytest.approx(error[:2].mean())}
    assert found["above"] == {"count": 1, "bias": pytest.approx(error[5])}
    assert (found["runs"], found["count"], found["range"]) == (2, 6, [-4.0, 5.0])
    inner = benchmark.measure(model, Dataset(crane, packed, actual / 2.0, np.arange(6)))
    assert inner["below"] == {"count": 0, "bias": None}
    assert benchmark.table_row({"set": "inner", "network": "a", **inner}).endswith("| - | - |")


def test_a_row_replaces_that_of_the_same_network_and_set_only(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    spec = {"runs": 2, "steps": 250, "seed": 8, "every": 50}
    monkeypatch.setattr(benchmark, "SETS", {"tiny": spec})
    crane = find_problem("crane")
    untrained(crane).write(tmp_path / "a.safetensors")
    untrained(crane, seed=1).write(tmp_path / "b.safetensors")
    common = ["--folder", str(tmp_path / "runs"), "--record", str(tmp_path / "record.json")]
    common += ["--workers", "1"]
    for name in ("a", "b", "a"):
        words = ["", "--network", f"{name}={tmp_path / name}.safetensors", *common]
        monkeypatch.setattr(sys, "argv", words)
        benchmark.main()
    record = json.loads((tmp_path / "record.json").read_text())
    assert [(row["network"], row["set"]) for row in record["rows"]] == [
        ("b", "tiny"),
        ("a", "tiny"),
    ]
    assert record["sets"] == {"tiny": spec}
    assert [row["count"] for row in record["rows"]] == [10, 10]
    file = tmp_path / "runs" / "tiny" / "dataset.parquet"
    words = ["", "--network", f"a={tmp_path / 'a'}.safetensors", "--set", f"given={file}", *common]
    monkeypatch.setattr(sys, "argv", words)
    benchmark.main()
    rows = json.loads((tmp_path / "record.json").read_text())["rows"]
    assert [row["set"] for row in rows] == ["tiny", "tiny", "given"]
    assert rows[2]["r_squared"] == rows[1]["r_squared"]


def test_the_independent_program_agrees_with_the_mechanics_and_writes_its_designs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    words = ["", str(tmp_path / "d.parquet"), "--runs", "2", "--steps", "9"]
    monkeypatch.setattr(sys, "argv", words)
    independent_simulation.main()
    crane, data = find_problem("crane"), read_dataset(tmp_path / "d.parquet")
    assert data.run.tolist() == 9 * [0] + 9 * [1]
    evaluator = SpringEvaluator(crane)
    masks = np.unpackbits(data.packed, axis=1, count=crane.lattice.beam_count).astype(bool)
    expected = [evaluator.evaluate(mask).efficiency for mask in masks]
    assert data.efficiency == pytest.approx(expected, abs=1e-7)
