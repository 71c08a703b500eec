"""`bellcrank train`, `predict` and `onnx`: from a dataset to predictions, and what is refused."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
import pytest

from bellcrank.model import find_problem, pack_mask, write_problem
from bellcrank.surrogate.trained import read_model
from tests.surrogate.helpers import random_dataset, same_weights, untrained
from tests.surrogate.tiny import tiny_dataset, tiny_model, tiny_problem

from .helpers import Outcome, call, refusal

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

TRAINING = (
    "--model", "mlp", "--epochs", "2", "--set", "batch=64", "--set", "precision=float32",
    "--device", "cpu",
)  # fmt: skip
ROUNDS = (
    "--rounds", "2", "--round", "chains=3", "--round", "steps=20", "--round", "disputed=4",
    "--round", "best=2", "--round", "epochs=1", "--round", "epoch_size=256",
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
def in_rounds(
    data: Path, trained: Path, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Path, Outcome]:
    """The folder of two networks that went on in two rounds, and what was said."""
    folder = tmp_path_factory.mktemp("in_rounds") / "networks"
    outcome = call("train", data, *TRAINING, "--from", trained, *ROUNDS, "--out", folder)
    assert outcome.code == 0, outcome.err
    return folder, outcome


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


def test_an_ensemble_killed_while_it_begins_loses_no_member(data: Path, tmp_path: Path) -> None:
    whole = tmp_path / "whole"
    options = (*TRAINING, "--epochs", "1", "--members", "3")
    assert call("train", data, *options, "--out", whole).code == 0
    folder = tmp_path / "killed"
    assert call("train", data, *options, "--out", folder).code == 0
    for member in (0, 2):  # as if the second had been the only one to be begun so far
        shutil.rmtree(folder / f"member-{member}")
    for name in ("model.safetensors", "checkpoint.safetensors", "log.csv", "training.png"):
        (folder / "member-1" / name).unlink()
    outcome = call("train", data, "--resume", folder)
    assert outcome.code == 0, outcome.err
    for member in range(3):
        one, other = (
            read_model(each / f"member-{member}" / "model.safetensors") for each in (whole, folder)
        )
        assert same_weights(one, other)


def test_a_kill_before_the_picture_costs_no_more_than_the_picture(
    data: Path, tmp_path: Path
) -> None:
    folder = tmp_path / "network"
    assert call("train", data, *TRAINING, "--epochs", "1", "--out", folder).code == 0
    written = (folder / "model.safetensors").read_bytes()
    (folder / "training.png").unlink()
    assert call("train", data, "--resume", folder).code == 0
    assert (folder / "training.png").exists()
    assert (folder / "model.safetensors").read_bytes() == written


def test_rounds_tell_what_they_found(in_rounds: tuple[Path, Outcome], data: Path) -> None:
    folder, outcome = in_rounds
    lines = [line for line in outcome.err.splitlines() if "labelled" in line]
    assert [line.split("  ")[0] for line in lines] == ["round 1 of 2", "round 2 of 2"]
    told = [json.loads((folder / f"round-{k}" / "round.json").read_text()) for k in (1, 2)]
    for line, each in zip(lines, told, strict=True):
        assert f"{each['labelled']} designs labelled" in line
        assert f"for them {each['surprise']['r_squared']:.4f};" in line
        mean = np.mean([member["r_squared"] for member in each["held_out"]])
        assert line.endswith(f"the networks' mean R² on what the dataset holds out {mean:.4f}")
    assert outcome.out.count("mlp") == 2
    assert f"written to {folder}/" in outcome.out
    again = call("train", data, "--resume", folder, "--json").data
    assert [each["round"] for each in again["rounds"]] == [1, 2]
    for each, kept in zip(again["rounds"], told, strict=True):
        assert each.items() <= kept.items()
    assert [each["recipe"]["seed"] for each in again["results"]] == [0, 1]
    for member in range(2):
        own = folder / "round-2" / f"member-{member}"
        assert read_model(own / "model.safetensors").record == again["results"][member]
        assert (own / "training.png").read_bytes().startswith(b"\x89PNG")


def test_predictions_are_those_of_the_last_finished_round(
    in_rounds: tuple[Path, Outcome], problem: Path, tmp_path: Path
) -> None:
    folder = shutil.copytree(in_rounds[0], tmp_path / "networks")

    def said(model: Path) -> float:
        (row,) = call("predict", problem, "--model", model, "--device", "cpu", "--json").data[
            "results"
        ]
        return float(row["efficiency"])

    assert said(folder) == said(folder / "round-2") != said(folder / "round-1")
    (folder / "round-2" / "round.json").unlink()
    assert said(folder) == said(folder / "round-1")


class Asked:
    """Ctrl-C, as if it came when it is asked for the time of that number."""

    def __init__(self, number: int) -> None:
        self.left = number

    def is_set(self) -> bool:
        self.left -= 1
        return self.left <= 0


def test_interrupted_rounds_go_on_to_the_same_networks(
    in_rounds: tuple[Path, Outcome],
    data: Path,
    trained: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    folder = tmp_path / "networks"
    words = [*TRAINING, "--from", trained, *ROUNDS, "--out", folder]
    for number in (10, 24, 27):  # of 20 steps and 2 x 4 batches a round
        with monkeypatch.context() as patch:

            @contextlib.contextmanager
            def asked(number: int = number) -> Iterator[Asked]:
                yield Asked(number)

            patch.setattr("bellcrank.cli.design.stopping_on_interrupt", asked)
            outcome = call("train", data, *words)
        assert outcome.code == 130
        assert f"Go on with: bellcrank train {data} --resume {folder}" in outcome.err
        words = ["--resume", folder, "--device", "cpu"]
    assert (folder / "round-2").exists()
    assert not (folder / "round-2" / "round.json").exists()
    assert call("train", data, *words).code == 0
    for member in range(2):
        ours, theirs = (
            read_model(place / "round-2" / f"member-{member}" / "model.safetensors")
            for place in (folder, in_rounds[0])
        )
        assert same_weights(ours, theirs)


def test_a_training_goes_on_from_a_file_or_the_shipped_network(
    data: Path, trained: Path, tmp_path: Path
) -> None:
    gently = ("--set", "learning_rate=1e-12", "--set", "epoch_size=64")
    first = trained / "member-1" / "model.safetensors"
    outcome = call(
        "train", data, *TRAINING, *gently, "--from", first, "--out", tmp_path / "on", "--json"
    )
    assert outcome.code == 0, outcome.err
    assert set(outcome.data) == {"results"}
    after, before = read_model(tmp_path / "on" / "model.safetensors"), read_model(first)
    assert after.seen["designs"] == before.seen["designs"] + 128
    assert (after.mean, after.deviation) == (before.mean, before.deviation)
    random_dataset(find_problem("crane"), runs=2, steps=3).write(tmp_path / "crane.parquet")
    outcome = call(
        "train", tmp_path / "crane.parquet", "--from", "shipped", "--epochs", "1", "--set",
        "batch=2", "--out", tmp_path / "crane", "--device", "cpu",
    )  # fmt: skip
    assert outcome.code == 0, outcome.err
    assert read_model(tmp_path / "crane" / "model.safetensors").seen["designs"] > 1e6


def test_what_rounds_and_starts_refuse(
    data: Path, trained: Path, in_rounds: tuple[Path, Outcome], tmp_path: Path
) -> None:
    refused = partial(refusal, folder=tmp_path)
    words = ("train", data, *TRAINING, "--out", tmp_path / "new")
    assert "at least 0, got -1" in refused(*words, "--rounds", "-1")
    assert "say how many (--rounds N)" in refused(*words, "--round", "chains=3")
    assert "stride: no such key in a round" in refused(
        *words, "--rounds", "1", "--round", "stride=3"
    )
    assert "expected KEY=VALUE" in refused(*words, "--rounds", "1", "--round", "chains")
    assert "share: " in refused(*words, "--rounds", "1", "--round", "share=all")
    assert "epoch_size: " in refused(*words, "--rounds", "1", "--round", "epoch_size=63")
    assert "(--members 3)" in refused(*words, "--rounds", "1", "--round", "caution=1")
    assert "cannot be read" in refused(*words, "--from", tmp_path / "absent.safetensors")
    assert "no trained model" in refused(*words, "--from", tmp_path)
    assert "no trained model for 'tiny' comes with" in refused(*words, "--from", "shipped")
    assert "3 networks cannot go on from 2" in refused(*words, "--from", trained, "--members", "3")
    other = ("train", data, "--model", "grid", "--out", tmp_path / "new", "--from", trained)
    for rounds in ((), ("--rounds", "1")):
        assert "(--model mlp)" in refused(*other, *rounds)
    untrained(find_problem("scaling-8")).write(tmp_path / "stranger.safetensors")
    assert "has learnt 'scaling-8'" in refused(*words, "--from", tmp_path / "stranger.safetensors")
    folder = in_rounds[0]
    for option in (
        ("--rounds", "3"),
        ("--round", "chains=3"),
        ("--from", trained),
        ("--members", "2"),
    ):
        assert "leave out the other options" in refused("train", data, "--resume", folder, *option)
    lies = "lies there already"
    assert lies in refused("train", data, *TRAINING, *ROUNDS, "--out", folder, folder=folder)
    assert lies in refused("train", data, *TRAINING, *ROUNDS, "--out", trained, folder=trained)
    assert lies in refused("train", data, *TRAINING, "--out", folder, folder=folder)
    tiny_dataset().take(np.arange(1000)).write(tmp_path / "other.parquet")
    for place in (folder, trained):
        assert "begun with other data" in refused(
            "train", tmp_path / "other.parquet", "--resume", place, folder=place
        )
    damaged = shutil.copytree(folder, tmp_path / "damaged")
    (damaged / "round-1" / "round.json").write_text("{")
    assert "delete it and resume" in refused("train", data, "--resume", damaged, folder=damaged)
    assert not (tmp_path / "new").exists()


def test_what_training_refuses(data: Path, trained: Path, tmp_path: Path) -> None:
    out = ("--out", tmp_path / "new")
    assert "no such file" in refusal("train", tmp_path / "nothing.parquet")
    assert "resnet18-w16" in refusal("train", data, "--model", "transformer", *out)
    assert "paper" in refusal("train", data, "--recipe", "grandmother", *out)
    assert "no such key" in refusal("train", data, "--set", "momentum=0.9", *out)
    assert "no such key" in refusal("train", data, "--set", "name=paper", *out)
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
