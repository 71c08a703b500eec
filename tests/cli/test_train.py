"""`bellcrank train` and `predict`: from a dataset to predictions, and refused input."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import time
from typing import TYPE_CHECKING

import numpy as np
import pytest

from bellcrank.model import pack_mask, write_problem
from bellcrank.storage.description import read_description, write_description
from bellcrank.surrogate.trained_model import read_model
from bellcrank.surrogate.training_setup import DESCRIPTION, KEYS, TRAINING_SCHEMA
from tests.surrogate.helpers import same_weights
from tests.surrogate.tiny import tiny_dataset, tiny_problem

from .helpers import call, refusal

if TYPE_CHECKING:
    from collections.abc import Iterator
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
    """The folder of a training. Not to be changed."""
    folder = tmp_path_factory.mktemp("trained") / "network"
    outcome = call("train", data, *TRAINING, "--out", folder)
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


def test_a_training_writes_model_and_record(trained: Path, data: Path) -> None:
    model = read_model(trained / "model.safetensors")
    assert model.record["recipe"]["model"] == "mlp"
    assert len(model.record["epochs"]) == 2
    again = call("train", data, "--resume", trained, "--device", "cpu", "--json")
    assert again.data["results"][0]["held_out"] == model.record["held_out"]
    assert same_weights(read_model(trained / "model.safetensors"), model)


def test_predictions_have_the_form_of_evaluate(trained: Path, problem: Path, masks: Path) -> None:
    words = ("predict", problem, "--designs", masks, "--model", trained, "--json")
    rows = call(*words, "--device", "cpu").data["results"]
    given = json.loads(masks.read_text())["masks"]
    assert [row["mask"] for row in rows] == given
    assert {row["status"] for row in rows} == {"predicted"}
    packed = np.array([list(bytes.fromhex(mask)) for mask in given], np.uint8)
    predicted = read_model(trained / "model.safetensors").predict(packed, device="cpu")
    assert [row["efficiency"] for row in rows] == pytest.approx(predicted.tolist())
    assert f"{predicted[1]:.4f}" in call(*words[:-1], "--device", "cpu").out
    both = call("evaluate", problem, "--designs", masks, "--json").data["results"]
    assert set(rows[0]) - {"beams"} <= set(both[0])


class StopAfter:
    """An interrupt that arrives at the given number of checks."""

    def __init__(self, number: int) -> None:
        self.left = number

    def is_set(self) -> bool:
        self.left -= 1
        return self.left <= 0


def test_an_interrupted_training_resumes_to_the_same_network(
    trained: Path, data: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "network"
    with monkeypatch.context() as patch:

        @contextlib.contextmanager
        def stopping() -> Iterator[StopAfter]:
            yield StopAfter(10)

        patch.setattr("bellcrank.cli.stopping.stopping_on_interrupt", stopping)
        outcome = call("train", data, *TRAINING, "--out", folder)
    assert outcome.code == 130
    assert f"bellcrank train {data} --resume {folder}" in outcome.err
    assert not (folder / "model.safetensors").exists()
    assert call("train", data, "--resume", folder, "--device", "cpu").code == 0
    assert same_weights(*(read_model(each / "model.safetensors") for each in (folder, trained)))


@pytest.mark.slow
def test_a_killed_training_resumes(data: Path, tmp_path: Path) -> None:
    folder = tmp_path / "network"
    command = [sys.executable, "-m", "bellcrank", "train", str(data), *TRAINING]
    command += ["--epochs", "4000", "--out", str(folder)]
    process = subprocess.Popen(
        command, stderr=subprocess.DEVNULL, env={**os.environ, "OMP_NUM_THREADS": "1"}
    )
    try:
        deadline = time.monotonic() + 300.0
        while not (folder / "checkpoint.safetensors").exists():
            assert process.poll() is None
            assert time.monotonic() < deadline
            time.sleep(0.05)
    finally:
        process.send_signal(signal.SIGKILL)
        process.wait()
    path = folder / DESCRIPTION
    description = read_description(path, TRAINING_SCHEMA, "training", KEYS)
    assert description.content["recipe"]["epochs"] == 4000
    description.content["recipe"]["epochs"] = 1  # so that the rest is short
    write_description(path, TRAINING_SCHEMA, description, overwrite=True)
    (folder / "checkpoint.safetensors").unlink()
    outcome = call("train", data, "--resume", folder)
    assert outcome.code == 0, outcome.err
    assert (folder / "model.safetensors").exists()


@pytest.mark.parametrize(
    ("words", "facts"),
    [
        (("--model", "transformer"), ["transformer", "resnet18-w16"]),
        (("--recipe", "best"), ["best", "paper"]),
        (("--set", "momentum=0.9"), ["momentum", "learning_rate"]),
        (("--set", "learning_rate=fast"), ["learning_rate", "fast"]),
        (("--epochs", "0"), ["epochs", "0"]),
        (("--device", "abacus"), ["device", "abacus"]),
    ],
)
def test_invalid_settings_of_a_training_are_refused(
    data: Path, tmp_path: Path, words: tuple[str, ...], facts: list[str]
) -> None:
    message = refusal("train", data, *words, "--out", tmp_path / "new")
    assert all(fact in message for fact in facts), message
    assert not (tmp_path / "new").exists()


def test_existing_and_missing_trainings_are_refused(
    data: Path, trained: Path, tmp_path: Path
) -> None:
    assert "no such file" in refusal("train", tmp_path / "nothing.parquet")
    assert "--epochs" in refusal("train", data, "--resume", trained, "--epochs", "3") or (
        "--resume" in refusal("train", data, "--resume", trained, "--epochs", "3")
    )
    assert "--resume" in refusal("train", data, *TRAINING, "--out", trained)
    assert "training.json" in refusal("train", data, "--resume", tmp_path)
    tiny_dataset().take(np.arange(1000)).write(tmp_path / "other.parquet")
    assert "other data" in refusal("train", tmp_path / "other.parquet", "--resume", trained)


def test_a_training_on_several_datasets_starts_from_a_trained_network(
    data: Path, trained: Path, tmp_path: Path
) -> None:
    folder, start = tmp_path / "tuned", read_model(trained / "model.safetensors")
    words = (*TRAINING, "--set", "learning_rate=1e-5", "--start", trained, "--out", folder)
    outcome = call("train", data, data, *words)
    assert outcome.code == 0, outcome.err
    model = read_model(folder / "model.safetensors")
    assert model.record["start"] == start.record
    assert model.record["data"]["designs"] == 2 * start.record["data"]["designs"]
    assert model.record["data"]["runs"] == 2 * start.record["data"]["runs"]
    assert not same_weights(model, start)
    packed = tiny_dataset().packed[::100]
    change = model.predict(packed, device="cpu") - start.predict(packed, device="cpu")
    assert abs(change).max() < 0.2 * start.deviation
    assert "other data" in refusal("train", data, "--resume", folder)
    assert call("train", data, data, "--resume", folder, "--device", "cpu").code == 0


def test_a_start_that_does_not_fit_is_refused(data: Path, trained: Path, tmp_path: Path) -> None:
    words = ("train", data, "--out", tmp_path / "new")
    assert "'mlp'" in refusal(*words, "--start", trained)  # the recipe has resnet18-w16
    assert "no bundled network for 'tiny'" in refusal(*words, "--start", "bundled")
    assert "cannot be read" in refusal(*words, "--start", tmp_path / "absent")
    assert "--resume" in refusal("train", data, "--resume", trained, "--start", trained)
    assert not (tmp_path / "new").exists()


def test_models_that_cannot_predict_are_refused(
    trained: Path, problem: Path, tmp_path: Path
) -> None:
    assert "model.safetensors" in refusal("predict", problem, "--model", tmp_path)
    assert "'tiny'" in refusal("predict", "scaling-8", "--model", trained)
    whole = (trained / "model.safetensors").read_bytes()
    short = tmp_path / "short.safetensors"
    short.write_bytes(whole[: len(whole) // 2])
    assert "truncated" in refusal("predict", problem, "--model", short)
