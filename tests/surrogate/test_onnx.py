"""The same network in ONNX Runtime says the same."""

from __future__ import annotations

import json
import sys
from typing import TYPE_CHECKING

import numpy as np
import onnx
import onnxruntime
import pytest

from bellcrank.errors import (
    InvalidDataset,
    InvalidFile,
    InvalidModel,
    InvalidSettings,
    OutputExists,
)
from bellcrank.surrogate.onnx import in_onnx, onnx_bytes, read_onnx, write_onnx
from bellcrank.surrogate.predictor import Predictor

from .helpers import moved, random_masks, untrained

if TYPE_CHECKING:
    from pathlib import Path

    from bellcrank.model import Problem
    from bellcrank.surrogate.trained import TrainedModel


@pytest.fixture(scope="module", params=["mlp", "resnet18-w16"])
def model(request: pytest.FixtureRequest, problem: Problem) -> TrainedModel:
    return untrained(problem, request.param)


@pytest.fixture(scope="module")
def file(model: TrainedModel, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("onnx") / "model.onnx"
    write_onnx(model, path)
    return path


def test_batches_of_any_size_give_what_pytorch_gives(
    model: TrainedModel, file: Path, problem: Problem
) -> None:
    fast = read_onnx(file, threads=1)
    for count in (0, 1, 7, 64):
        packed = np.packbits(random_masks(problem, count, seed=count), axis=1)
        expected = model.predict(packed, device="cpu")
        found = fast.predict(packed)
        assert found.shape == (count,)
        assert found.dtype == np.float64
        assert np.allclose(found, expected, rtol=0.0, atol=1e-4)
    assert expected.std() > 1e-2


def test_the_network_itself_takes_any_batch(model: TrainedModel, file: Path) -> None:
    session = onnxruntime.InferenceSession(file, providers=["CPUExecutionProvider"])
    for count in (1, 2, 65):
        inputs = np.zeros((count, *model.view.shape), np.float32)
        assert session.run(None, {"design": inputs})[0].shape == (count,)


def test_the_file_says_what_the_weights_say(model: TrainedModel, file: Path) -> None:
    told = onnx.load(file).metadata_props
    assert [each.key for each in told] == ["bellcrank"]
    assert json.loads(told[0].value) == model.describe()
    again = read_onnx(file)
    assert (again.architecture, again.mean, again.deviation, again.record) == (
        model.architecture, model.mean, model.deviation, model.record,
    )  # fmt: skip


def test_it_takes_the_place_of_a_trained_model(
    model: TrainedModel, file: Path, problem: Problem
) -> None:
    given, old_beam = moved(problem)
    masks = random_masks(problem, 5)
    members = [read_onnx(file), model]
    found = Predictor(given, members, device="cpu").predict(masks[:, old_beam])
    assert found.spread is not None
    assert found.spread.max() < 1e-4
    fast = read_onnx(file)
    with pytest.raises(InvalidDataset, match="packed: expected masks of 28 bytes"):
        fast.predict(np.zeros((1, 3), np.uint8))
    for device, precision in (("cuda", "float32"), ("cpu", "bfloat16")):
        with pytest.raises(InvalidSettings, match="on the cpu in float32"):
            fast.predict(np.packbits(masks, axis=1), device=device, precision=precision)


def test_truncated_and_other_files_are_refused(file: Path, tmp_path: Path) -> None:
    content = file.read_bytes()
    path = tmp_path / "model.onnx"
    for damaged in (b"", content[:1000], content[: len(content) // 2], b"\x00" * 64):
        path.write_bytes(damaged)
        with pytest.raises(InvalidModel, match=r"model\.onnx: ") as refusal:
            read_onnx(path)
        assert "\n" not in str(refusal.value)
    other = onnx.load(file)
    del other.metadata_props[:]
    path.write_bytes(other.SerializeToString())
    with pytest.raises(InvalidModel, match="not a model of bellcrank: it does not say"):
        read_onnx(path)
    with pytest.raises(InvalidFile, match="cannot be read"):
        read_onnx(tmp_path / "absent.onnx")


def test_a_file_is_not_written_over_without_being_told(
    model: TrainedModel, file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = file.read_bytes()
    monkeypatch.setattr("bellcrank.surrogate.onnx.onnx_bytes", lambda _model: b"new")
    with pytest.raises(OutputExists):
        write_onnx(model, file)
    assert file.read_bytes() == before


def test_what_is_missing_is_said_with_how_to_install_it(
    model: TrainedModel, file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    message = r"install it with: pip install 'bellcrank\[onnx\]'"
    for name in ("onnx", "onnxscript"):
        with monkeypatch.context() as patch:
            patch.setitem(sys.modules, name, None)
            with pytest.raises(InvalidSettings, match=f"needs {name}; {message}"):
                onnx_bytes(model)
    monkeypatch.setitem(sys.modules, "onnxruntime", None)
    with pytest.raises(InvalidSettings, match=message):
        read_onnx(file)
    with pytest.raises(InvalidSettings, match=message):
        in_onnx(model)


def test_an_onnx_file_is_read_without_pytorch(
    file: Path, monkeypatch: pytest.MonkeyPatch, problem: Problem
) -> None:
    monkeypatch.setitem(sys.modules, "torch", None)
    packed = np.packbits(random_masks(problem, 2), axis=1)
    assert read_onnx(file).predict(packed).shape == (2,)
