"""`bellcrank train`, `predict` and `onnx`: from a dataset to predictions, and what is refused."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from typing import TYPE_CHECKING

import numpy as np
import pytest
from tests.learning.tiny import tiny_dataset, tiny_model, tiny_problem

from bellcrank.model import pack_mask, write_problem
from bellcrank.surrogate.trained import read_model

from .helpers import call, refusal

if TYPE_CHECKING:
    from pathlib import Path

TRAINING = (
    "--model", "mlp", "--epochs", "2", "--set", "batch=64", "--set", "precision=float32",
    "--device", "cpu",
)  # fmt: skip


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("data") / "tiny.parquet"
    tiny_dataset().write(path)
    return path


@pytest.fixture(scope="module")
def trained(data: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of two networks. Not to be changed."""
    folder = tmp_path_factory.mktemp("trained") / "networks"
    outcome = call("train", data, *TRAINING, "--members", "2", "--out", folder)
    assert outcome.code == 0, outcome.err
    assert f"written to {folder}/" in outcome.out
    return folder


@pytest.fixture(scope="module")
def problem(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("problem") / "tiny.json"
    write_problem(tiny_problem(), path)
    return path


@pytest.fixture(scope="module")
def masks(tmp_path_factory: pytest.TempPathFactory) -> Path:
    beams = tiny_problem().lattice.beam_count
    rows = np.unpackbits(tiny_dataset().packed[::200], axis=1, count=beams).astype(bool)
    path = tmp_path_factory.mktemp("masks") / "masks.json"
    path.write_text(json.dumps({"masks": [pack_mask(row) for row in rows]}))
    return path


def test_training_leaves_models_records_and_pictures(trained: Path) -> None:
    for member in range(2):
        own = trained / f"member-{member}"
        model = read_model(own / "model.safetensors")
        assert model.record["recipe"]["seed"] == member
        assert len((own / "log.csv").read_text().splitlines()) == 3
        assert (own / "training.png").read_bytes().startswith(b"\x89PNG")


def test_predictions_have_the_form_of_evaluate(trained: Path, problem: Path, masks: Path) -> None:
    words = ("predict", problem, "--designs", masks, "--model", trained, "--json")
    rows = call(*words, "--device", "cpu").data["results"]
    told = json.loads(masks.read_text())["masks"]
    assert [row["mask"] for row in rows] == told
    assert {row["status"] for row in rows} == {"predicted"}
    members = [read_model(trained / f"member-{k}" / "model.safetensors") for k in range(2)]
    packed = np.array([list(bytes.fromhex(mask)) for mask in told], np.uint8)
    said = np.array([model.predict(packed, device="cpu") for model in members])
    assert [row["efficiency"] for row in rows] == pytest.approx(said.mean(axis=0).tolist())
    assert [row["spread"] for row in rows] == pytest.approx(said.std(axis=0, ddof=1).tolist())
    both = call("evaluate", problem, "--designs", masks, "--json").data["results"]
    assert set(both[0]) <= set(rows[0])
    alone = call("predict", problem, "--model", trained / "member-1", "--device", "cpu")
    assert "spread" not in alone.out


def test_onnx_predicts_the_same(trained: Path, problem: Path, masks: Path, tmp_path: Path) -> None:
    file = tmp_path / "network.onnx"
    made = call("onnx", problem, file, "--model", trained / "member-0")
    assert made.code == 0, made.err
    words = ("predict", problem, "--designs", masks, "--json", "--model")
    slow = call(*words, trained / "member-0", "--device", "cpu").data["results"]
    fast = call(*words, file).data["results"]
    for one, other in zip(slow, fast, strict=True):
        assert one["efficiency"] == pytest.approx(other["efficiency"], abs=1e-4)
    assert "exists" in refusal("onnx", problem, file, "--model", trained / "member-0")
    assert "2 networks" in refusal("onnx", problem, tmp_path / "two.onnx", "--model", trained)
    assert ".onnx" in refusal("onnx", problem, tmp_path / "network.pt")


def test_a_killed_ensemble_goes_on_with_all_its_members(data: Path, tmp_path: Path) -> None:
    folder = tmp_path / "networks"
    command = [sys.executable, "-m", "bellcrank", "train", str(data), *TRAINING]
    command += ["--epochs", "400", "--members", "2", "--out", str(folder)]
    process = subprocess.Popen(
        command, stderr=subprocess.DEVNULL, env={**os.environ, "OMP_NUM_THREADS": "1"}
    )
    try:
        deadline = time.monotonic() + 120.0
        while not (folder / "member-1" / "training.json").exists():
            assert process.poll() is None
            assert time.monotonic() < deadline
            time.sleep(0.05)
        time.sleep(1.0)
    finally:
        process.send_signal(signal.SIGKILL)
        process.wait()
    # Made short, so that going on ends.
    for member in range(2):
        description = folder / f"member-{member}" / "training.json"
        told = json.loads(description.read_text())
        assert told["recipe"]["epochs"] == 400
        told["recipe"]["epochs"] = 1
        description.write_text(json.dumps(told))
        (folder / f"member-{member}" / "checkpoint.safetensors").unlink(missing_ok=True)
    outcome = call("train", data, "--resume", folder)
    assert outcome.code == 0, outcome.err
    assert all((folder / f"member-{k}" / "model.safetensors").exists() for k in range(2))


def test_what_training_refuses(data: Path, trained: Path, tmp_path: Path) -> None:
    out = ("--out", tmp_path / "new")
    assert "no such file" in refusal("train", tmp_path / "nothing.parquet")
    assert "resnet18-w16" in refusal("train", data, "--model", "transformer", *out)
    assert "paper" in refusal("train", data, "--recipe", "grandmother", *out)
    assert "no such key" in refusal("train", data, "--set", "momentum=0.9", *out)
    assert "members" in refusal("train", data, "--members", "0", *out)
    assert "learning_rate" in refusal("train", data, "--set", "learning_rate=fast", *out)
    assert "device" in refusal("train", data, "--device", "abacus", *out)
    assert "leave out" in refusal("train", data, "--resume", trained, "--epochs", "3")
    assert "lies there already" in refusal("train", data, "--members", "2", "--out", trained)
    assert "no training to go on with" in refusal("train", data, "--resume", tmp_path)


def test_what_predicting_refuses(trained: Path, problem: Path, tmp_path: Path) -> None:
    assert "no trained model in this folder" in refusal("predict", problem, "--model", tmp_path)
    assert "has learnt 'tiny'" in refusal("predict", "scaling-8", "--model", trained)
    whole = (trained / "member-0" / "model.safetensors").read_bytes()
    short = tmp_path / "short.safetensors"
    short.write_bytes(whole[: len(whole) // 2])
    assert "truncated" in refusal("predict", problem, "--model", short)


def test_a_network_of_another_seed_is_another_network() -> None:
    assert tiny_model(0).predict(tiny_dataset().packed[:5]) != pytest.approx(
        tiny_model(1).predict(tiny_dataset().packed[:5])
    )
