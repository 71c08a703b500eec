"""`bellcrank surrogate-search`: results and refused input."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import numpy as np
import pytest

from bellcrank.mechanics import VERIFICATION_INCREMENT, SpringEvaluator
from bellcrank.model import find_problem, read_design
from bellcrank.surrogate.dataset import Dataset
from tests.surrogate.helpers import random_dataset, untrained

from .helpers import call, refusal

if TYPE_CHECKING:
    from pathlib import Path

PROBLEM = "scaling-8"
QUICK = ("--chains", "3", "--steps", "25", "--verified", "2", "--seed", "5", "--device", "cpu")
RESULTS = ["design.json", "surrogate-search.json", "surrogate-search.png"]


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("model") / "model.safetensors"
    untrained(find_problem(PROBLEM)).write(path)
    return path


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("dataset") / "dataset.parquet"
    random_dataset(find_problem(PROBLEM)).write(path)
    return path


def test_designs_are_verified_printed_and_stored(here: Path, model: Path, dataset: Path) -> None:
    words = ("surrogate-search", PROBLEM, "--model", model, "--dataset", dataset, *QUICK)
    outcome = call(*words)
    assert outcome.code == 0, outcome.err
    folder = here / f"{PROBLEM}-surrogate-search"
    assert sorted(path.name for path in folder.iterdir()) == RESULTS
    for fact in ("with the network", "with the mechanics", "beams from the dataset", "best: "):
        assert fact in outcome.out
    design = read_design(folder / "design.json")
    response = SpringEvaluator(design.problem).evaluate(design.mask, VERIFICATION_INCREMENT)
    assert design.efficiency == response.efficiency
    assert f"{response.efficiency:.4f}" in outcome.out
    assert "scaling-8-surrogate-search" in refusal(*words)


def test_the_record_is_printed_as_json(here: Path, model: Path) -> None:
    outcome = call(
        "surrogate-search", PROBLEM, "--model", model, "--no-compare", "--json", "--out", "made",
        *QUICK,
    )  # fmt: skip
    assert outcome.code == 0, outcome.err
    assert outcome.data == json.loads((here / "made" / "surrogate-search.json").read_text())
    assert outcome.data["by_mechanics"] == []
    assert len(outcome.data["by_network"]) == 6
    assert outcome.data["architecture"] == "mlp"


@pytest.mark.parametrize(
    ("words", "facts"),
    [
        (("--chains", 0), ["chains", "at least 1", "0"]),
        (("--steps", 0), ["steps", "at least 1", "0"]),
        (("--verified", 0), ["verified", "at least 1", "0"]),
        (("--dataset", "none.parquet"), ["none.parquet", "no such file"]),
        (("--model", "none.safetensors"), ["none.safetensors"]),
    ],
)
@pytest.mark.usefixtures("here")
def test_invalid_input_is_refused(model: Path, words: tuple[object, ...], facts: list[str]) -> None:
    message = refusal("surrogate-search", PROBLEM, "--model", model, *words)
    assert all(fact in message for fact in facts), message


def test_networks_and_data_of_another_problem_are_refused(here: Path, model: Path) -> None:
    assert "'scaling-8'" in refusal("surrogate-search", "crane", "--model", model)
    other = find_problem("scaling-9")
    packed = np.packbits(other.initial[None], axis=1)
    Dataset(other, packed, np.zeros(1), np.zeros(1)).write(here / "other.parquet")
    message = refusal(
        "surrogate-search", PROBLEM, "--model", model, "--dataset", "other.parquet", *QUICK
    )
    assert "'scaling-9'" in message
