"""What `bellcrank surrogate-search` makes, says and refuses."""

from __future__ import annotations

import json
import os
import signal
from typing import TYPE_CHECKING
from unittest import mock

import numpy as np
import pytest

from bellcrank.learning import finding
from bellcrank.mechanics import VERIFICATION_INCREMENT, SpringEvaluator
from bellcrank.model import find_problem, read_design, write_problem
from bellcrank.surrogate.beginning import begin
from bellcrank.surrogate.dataset import Dataset
from bellcrank.surrogate.recipes import Recipe

from .helpers import PROBLEM, call, refusal

if TYPE_CHECKING:
    from pathlib import Path

QUICK = ("--chains", 3, "--steps", 25, "--checked", 2, "--device", "cpu")
RESULTS = ["design.json", "driven.json", "driven.png"]


@pytest.fixture(scope="module")
def data() -> Dataset:
    """Designs with some of the beams missing, four runs of them."""
    problem = find_problem(PROBLEM)
    rng = np.random.default_rng(2)
    masks = np.repeat(problem.initial[None], 80, axis=0)
    masks[:, problem.designable] = rng.random((80, len(problem.designable))) < 0.9
    evaluator = SpringEvaluator(problem)
    efficiency = [evaluator.evaluate(mask).efficiency for mask in masks]
    return Dataset(problem, np.packbits(masks, axis=1), np.array(efficiency), np.arange(80) // 20)


@pytest.fixture(scope="module")
def model(data: Dataset, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A file with a network that has hardly learnt anything."""
    recipe = Recipe(model="mlp", epochs=1, batch=16)
    training = begin(data, recipe, device="cpu")
    for _ in training.run():
        pass
    path = tmp_path_factory.mktemp("model") / "mlp.safetensors"
    training.finish().write(path)
    return path


@pytest.fixture(scope="module")
def dataset(data: Dataset, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("data") / "few.parquet"
    data.write(path)
    return path


def test_a_search_leaves_record_design_and_picture(here: Path, model: Path, dataset: Path) -> None:
    outcome = call("surrogate-search", PROBLEM, "--model", model, "--dataset", dataset, *QUICK)
    assert outcome.code == 0, outcome.err
    folder = here / f"{PROBLEM}-network"
    assert sorted(path.name for path in folder.iterdir()) == RESULTS
    for words in ("as predicted", "as checked", "by mechanics", "beams from the dataset", "best: "):
        assert words in outcome.out
    design = read_design(folder / "design.json")
    response = SpringEvaluator(design.problem).evaluate(design.mask, VERIFICATION_INCREMENT)
    assert design.efficiency == response.efficiency
    assert f"{response.efficiency:.4f}" in outcome.out
    refused = refusal("surrogate-search", PROBLEM, "--model", model, *QUICK)
    assert "scaling-8-network" in refused


def test_the_record_is_printed_as_json(here: Path, model: Path) -> None:
    outcome = call(
        "surrogate-search", PROBLEM, "--model", model, "--model", model, "--caution", 0.5,
        "--no-compare", "--json", "--out", "made", *QUICK,
    )  # fmt: skip
    assert outcome.code == 0, outcome.err
    assert outcome.data == json.loads((here / "made" / "driven.json").read_text())
    assert outcome.data["schema"] == "bellcrank/driven/1"
    assert outcome.data["by_mechanics"] == []
    assert len(outcome.data["by_network"]) == 9
    assert outcome.data["settings"]["networks"] == ["mlp", "mlp"]
    assert all(made["spread"] == 0.0 for made in outcome.data["by_network"])


def test_an_exact_search_says_what_the_mechanics_was_spared(here: Path, model: Path) -> None:
    outcome = call(
        "surrogate-search", PROBLEM, "--model", model, "--exact", "--set", "doubt=0.0002",
        "--set", "least_chance=0.1", "--set", "hot=0.0002", *QUICK,
    )  # fmt: skip
    assert outcome.code == 0, outcome.err
    folder = here / f"{PROBLEM}-network"
    assert sorted(path.name for path in folder.iterdir()) == RESULTS
    record = json.loads((folder / "driven.json").read_text())
    told = record["settings"]["search"]
    assert (told["search"], told["doubt"], told["least_chance"]) == ("screened", 0.0002, 0.1)
    efforts = record["effort"]
    assert efforts["mechanics"]["responses"] == [25, 25, 25]
    assert max(efforts["network"]["responses"]) < 25
    for row, name in (
        ("responses of the mechanics", "responses"),
        ("looks by the network", "scored"),
    ):
        medians = [efforts[who]["medians"][name] for who in ("network", "mechanics")]
        (line,) = (line for line in outcome.out.splitlines() if row in line)
        assert line.split()[-2:] == [f"{median:.0f}" for median in medians]
    for words in ("screened", "by mechanics", "as computed", "proposals accepted", "seconds, all"):
        assert words in outcome.out


@pytest.mark.parametrize(
    ("words", "steps"), [((), "population_steps"), (("--exact",), "screened_steps")]
)
def test_an_interrupted_search_keeps_what_it_has(
    here: Path, model: Path, words: tuple[str, ...], steps: str
) -> None:
    made = getattr(finding, steps)

    def interrupted(*words, **options):
        for number, step in enumerate(made(*words, **options)):
            if number == 10:
                os.kill(os.getpid(), signal.SIGINT)
            yield step

    with mock.patch.object(finding, steps, interrupted):
        outcome = call(
            "surrogate-search", PROBLEM, "--model", model, *QUICK, *words, "--out", "cut"
        )
    assert outcome.code == 130
    assert "Stopped after 11 of 25 steps; what the chains offered by then is" in outcome.err
    assert sorted(path.name for path in (here / "cut").iterdir()) == RESULTS
    assert json.loads((here / "cut" / "driven.json").read_text())["stopped"] is True
    assert "Traceback" not in outcome.err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--chains", 0), "chains: expected a whole number of at least 1, got 0"),
        (("--steps", 0), "steps: expected a whole number of at least 1, got 0"),
        (("--checked", 0), "checked: expected at least 1 design, got 0"),
        (("--caution", 1), "caution: takes off what several networks dispute"),
        (("--caution", -1), "caution: expected at least 0, got -1.0"),
        (("--dataset", "none.parquet"), "none.parquet: no such file"),
        (("--set", "moves=swap"), "moves: a search driven by networks can change only"),
        (("--set", "cost=dear"), "unknown cost 'dear'"),
        (("--set", 'cost={"dear": 1}'), "unknown cost {'dear': 1}"),
        (("--set", "doubt=0.1"), "doubt: how networks screen belongs to an exact search"),
        (("--exact", "--confirm", 5), "confirm: in an exact search the mechanics decides on every"),
        (("--exact", "--set", "doubt=much"), "doubt: expected a cost of at least 0, got 'much'"),
        (("--exact", "--set", "least_chance=0"), "least_chance: expected a probability above 0"),
        (("--exact", "--set", "lookahead=0"), "lookahead: expected a whole number of at least 1"),
        (("--exact", "--set", "moves=swap"), "moves: a search driven by networks can change only"),
        (("--model", "none.safetensors"), "none.safetensors: cannot be read"),
    ],
)
@pytest.mark.usefixtures("here")
def test_what_makes_no_sense_is_refused(model: Path, words: tuple[object, ...], said: str) -> None:
    assert said in refusal("surrogate-search", PROBLEM, "--model", model, *words)


def test_networks_and_data_for_another_problem_are_refused(
    here: Path, model: Path, dataset: Path
) -> None:
    assert "'scaling-8'" in refusal("surrogate-search", "crane", "--model", model)
    backward = find_problem(PROBLEM)
    other = find_problem("scaling-9")
    packed = np.packbits(other.initial[None], axis=1)
    Dataset(other, packed, np.zeros(1), np.zeros(1)).write(here / "other.parquet")
    said = refusal(
        "surrogate-search", PROBLEM, "--model", model, "--dataset", "other.parquet", *QUICK
    )
    assert "'scaling-9'" in said
    write_problem(backward, here / "again.json")
    outcome = call(
        "surrogate-search", "again.json", "--model", model, "--dataset", dataset, *QUICK,
        "--no-compare", "--out", "again",
    )  # fmt: skip
    assert outcome.code == 0, outcome.err
