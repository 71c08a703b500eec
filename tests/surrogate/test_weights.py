"""Weights know what they are for, and say so when they are asked to be for something else."""

from __future__ import annotations

import copy
import json
import math
import sys
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import torch
from safetensors.torch import save

from bellcrank.errors import (
    InvalidDataset,
    InvalidFile,
    InvalidModel,
    InvalidSettings,
    OutputExists,
)
from bellcrank.model import problem_to_dict
from bellcrank.surrogate.backend import find_precision
from bellcrank.surrogate.trained_model import METADATA_KEY, lattice_hash, read_model

from .helpers import random_masks, same_weights, untrained

if TYPE_CHECKING:
    from pathlib import Path

    from bellcrank.model import Problem
    from bellcrank.surrogate.trained_model import TrainedModel


@pytest.fixture(scope="module")
def model(problem: Problem) -> TrainedModel:
    return untrained(problem)


def rewritten(model: TrainedModel, **changes: Any) -> bytes:
    """The content of a file that says something else about itself; None leaves it out."""
    told = {key: value for key, value in (model.describe() | changes).items() if value is not None}
    return save(model.network.state_dict(), {METADATA_KEY: json.dumps(told)})


@pytest.mark.parametrize("name", ["mlp", "resnet18-w16"])
def test_a_model_comes_back_with_all_that_it_knows(
    problem: Problem, tmp_path: Path, name: str
) -> None:
    canvas = {"width": 64, "height": 48} if name == "resnet18-w16" else {}
    model = untrained(problem, name, **canvas)
    path = tmp_path / "model.safetensors"
    model.write(path)
    again = read_model(path)
    assert same_weights(again, model)
    assert again.describe() == model.describe()
    assert problem_to_dict(again.problem) == problem_to_dict(problem)
    assert again.record == {"note": "untrained"}
    packed = np.packbits(random_masks(problem, 7), axis=1)
    expected = model.predict(packed, device="cpu")
    assert np.array_equal(again.predict(packed, device="cpu"), expected)
    assert expected.std() > 0.0
    with pytest.raises(OutputExists):
        model.write(path)


def test_no_designs_have_no_efficiencies_and_wrong_masks_are_refused(model: TrainedModel) -> None:
    assert model.predict(np.zeros((0, 28), np.uint8), device="cpu").shape == (0,)
    for count in (0, 3):
        with pytest.raises(InvalidDataset, match="packed: expected masks of 28 bytes"):
            model.predict(np.zeros((count, 44), np.uint8), device="cpu")


def test_precision_is_one_that_there_is(model: TrainedModel, problem: Problem) -> None:
    packed = np.packbits(random_masks(problem, 3), axis=1)
    exact = model.predict(packed, device="cpu")
    rough = model.predict(packed, device="cpu", precision="bfloat16")
    assert not np.array_equal(exact, rough)
    assert np.allclose(exact, rough, atol=0.02)
    assert find_precision("auto", torch.device("cpu")) in ("float32", "bfloat16")
    with pytest.raises(InvalidSettings, match="precision: expected auto, float32, bfloat16, got"):
        model.predict(packed, device="cpu", precision="float8")


def test_truncated_and_other_files_are_refused(
    model: TrainedModel, tmp_path: Path, problem: Problem
) -> None:
    path = tmp_path / "model.safetensors"
    content = model.to_bytes()
    for damaged in (b"", content[:5], content[:300], content[:-1], content + b"x", b"\xff" * 99):
        path.write_bytes(damaged)
        with pytest.raises(InvalidModel, match=r"model\.safetensors: not a trained model, or trun"):
            read_model(path)
    for other in (save({"a": torch.zeros(3)}), save({"a": torch.zeros(3)}, {"by": "others"})):
        path.write_bytes(other)
        with pytest.raises(InvalidModel, match="not a model of bellcrank"):
            read_model(path)
    with pytest.raises(InvalidFile, match="cannot be read"):
        read_model(tmp_path / "absent.safetensors")
    with pytest.raises(InvalidFile, match="cannot be read"):
        read_model(tmp_path)


def test_weights_that_are_no_numbers_are_refused(model: TrainedModel, tmp_path: Path) -> None:
    broken = copy.deepcopy(model.network)
    name, weights = next(iter(broken.named_parameters()))
    with torch.no_grad():
        weights.view(-1)[0] = math.nan
    path = tmp_path / "model.safetensors"
    path.write_bytes(replace(model, network=broken).to_bytes())
    with pytest.raises(InvalidModel, match=f"'{name}'"):
        read_model(path)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"schema": "bellcrank/model/9"}, "expected schema 'bellcrank/model/1', got 'bellcrank/m"),
        ({"lattice": "0123456789abcdef"}, "0123456789abcdef"),
        ({"architecture": "vgg"}, "unknown model 'vgg'"),
        ({"architecture": "resnet18-w16", "looks_at": "picture"}, "not those of 'resnet18-w16'"),
        ({"problem": {"schema": "nothing"}}, "model.safetensors"),
        ({"problem": None}, "damaged"),
        ({"mean": "nan"}, "got nan and 0.5"),
        ({"deviation": 0.0}, "got 0.25 and 0.0"),
        ({"view": {"colour": 3}}, "damaged"),
        ({"record": 5}, "damaged"),
    ],
)
def test_what_a_file_says_about_itself_has_to_fit(
    model: TrainedModel, tmp_path: Path, changes: dict[str, Any], message: str
) -> None:
    path = tmp_path / "model.safetensors"
    path.write_bytes(rewritten(model, **changes))
    with pytest.raises(InvalidModel) as refusal:
        read_model(path)
    assert message in str(refusal.value)
    assert "\n" not in str(refusal.value)


def test_the_hash_of_a_lattice_tells_lattices_apart(problem: Problem, crane: Problem) -> None:
    assert lattice_hash(problem.lattice) != lattice_hash(crane.lattice)


@pytest.mark.parametrize("missing", ["torch", "safetensors"])
def test_without_pytorch_one_sentence_says_how_to_install_it(
    model: TrainedModel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, missing: str
) -> None:
    path = tmp_path / "model.safetensors"
    model.write(path)
    monkeypatch.setitem(sys.modules, missing, None)
    with pytest.raises(InvalidSettings, match=r"install them with: pip install 'bellcrank\[ml\]'"):
        read_model(path)
