"""Every form of `bellcrank explain`."""

from __future__ import annotations

from importlib import resources
from typing import TYPE_CHECKING

import pytest

from bellcrank.model import find_problem, human_design
from bellcrank.surrogate.models import models
from bellcrank.surrogate.trained_model import TrainedModel
from bellcrank.surrogate.views import views

from .helpers import SMALL, call, colours, files, refusal, write

if TYPE_CHECKING:
    from pathlib import Path

torch = pytest.importorskip("torch")
pytestmark = pytest.mark.usefixtures("here")

SHIPPED = resources.files("bellcrank.surrogate") / "pretrained" / "crane.safetensors"
CANVAS = {"width": 60, "height": 40, "line": 1.5}


@pytest.fixture(scope="module")
def known(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with ignorant networks for the crane, named by what they are."""
    folder = tmp_path_factory.mktemp("models")
    crane = find_problem("crane")
    for name, options in (("resnet18-w16", CANVAS), ("mlp", {})):
        architecture = models[name]
        view = views[architecture.view](crane, **options)
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(0)
            network = architecture.build(view.shape)
        model = TrainedModel(
            architecture=name, problem=crane, view=view, mean=0.0, deviation=1.0, network=network
        )
        model.write(folder / f"{name}.safetensors")
    return folder


@pytest.fixture
def pictures(known: Path) -> Path:
    return known / "resnet18-w16.safetensors"


@pytest.fixture
def bits(known: Path) -> Path:
    return known / "mlp.safetensors"


def test_a_design_is_explained_in_a_table_and_a_picture(here: Path, pictures: Path) -> None:
    outcome = call("explain", "human:crane", "--model", pictures)
    assert outcome.code == 0, outcome.err
    assert "efficiency 1.0105 by mechanics" in outcome.out
    assert "low-rank update" in outcome.out
    assert "network, white block" in outcome.out
    assert outcome.err == "wrote crane-explained.png\n"
    assert list(files(here)) == ["crane-explained.png"]
    assert colours(here / "crane-explained.png") > 100


def test_json_is_all_that_is_printed_and_draws_nothing(here: Path, pictures: Path) -> None:
    outcome = call("explain", "human:crane", "--model", pictures, "--json", "--stride", 8)
    assert outcome.code == 0, outcome.err
    assert outcome.err == ""
    assert files(here) == {}
    told = outcome.data
    design = human_design("crane")
    assert told["mask"] == design.mask_hex
    assert told["beams"] == design.problem.designable.tolist()
    for name in ("present", "status", "exact"):
        assert len(told[name]) == 203
    assert set(told["measures"]) == set(told["correlations"])
    assert told["correlations"]["low_rank"]["all"]["spearman"] > 0.95
    assert (told["occlusion"]["block"], told["occlusion"]["stride"]) == (12, 8)
    assert len(told["occlusion"]["white"]) == 5


def test_a_network_on_bits_is_explained_without_blocks(here: Path, bits: Path) -> None:
    outcome = call("explain", "crane", "--model", bits, "--out", "a.svg", "--json")
    assert outcome.code == 0, outcome.err
    assert outcome.data["occlusion"] is None
    assert list(files(here)) == ["a.svg"]


def test_a_design_for_a_part_is_explained_with_the_springs_that_were_learnt(bits: Path) -> None:
    outcome = call("explain", "machine:crane", "--model", bits, "--json")
    assert outcome.code == 0, outcome.err
    assert "0.0183333" in outcome.err
    assert "5 and 0.1" in outcome.err


def test_such_a_design_is_predicted_with_those_springs_too(bits: Path) -> None:
    told = call("predict", "machine:crane", "--model", bits, "--json")
    assert told.code == 0, told.err
    assert "5 and 0.1" in told.err
    (row,) = told.data["results"]
    explained = call("explain", "machine:crane", "--model", bits, "--json").data
    assert row["mask"] == explained["mask"]
    assert row["efficiency"] == pytest.approx(explained["predicted"], abs=1e-5)
    assert call("predict", "crane", "--model", bits, "--json").err == ""


def test_what_cannot_be_explained_is_refused(here: Path, pictures: Path, bits: Path) -> None:
    taken = write(here / "taken.png", "mine")
    small = write(here / "small.json", SMALL)
    empty = here / "empty"
    empty.mkdir()
    broken = here / "broken.safetensors"
    broken.write_bytes(pictures.read_bytes()[:5000])
    for words, told in (
        (("crane", "--model", bits, "--block", 8), "'mlp'"),
        (("crane", "--model", pictures, "--block", 0), "block size"),
        (("crane", "--model", pictures, "--stride", 0), "block stride"),
        (("crane", "--model", pictures, "--block", 41), "at most 40 pixels"),
        (("nothing", "--model", bits), "nothing"),
        (("human:scaling-8", "--model", bits), "no human design"),
        ((small, "--model", bits), "'crane'"),
        (("anti-parallel", "--model", bits), "'crane'"),
        (("crane", "--model", here / "none.safetensors"), "cannot be read"),
        (("crane", "--model", empty), "model.safetensors"),
        (("crane", "--model", broken), "truncated"),
        (("crane", "--model", bits, "--out", taken), "exists"),
        (("crane", "--model", bits, "--out", "a.jpg"), "ending in"),
        (("crane", "--model", bits, "--device", "abacus"), "device"),
    ):
        assert told in refusal("explain", *words), words


def test_a_picture_is_replaced_when_that_is_asked_for(here: Path, bits: Path) -> None:
    taken = write(here / "taken.png", "mine")
    assert call("explain", "crane", "--model", bits, "--out", taken, "--overwrite").code == 0
    assert colours(taken) > 100


@pytest.mark.skipif(not SHIPPED.is_file(), reason="no trained model comes with bellcrank yet")
def test_without_a_model_the_one_that_comes_along_is_explained(here: Path) -> None:
    outcome = call("explain", "machine:crane", "--json", "--stride", 32)
    assert outcome.code == 0, outcome.err
    assert outcome.data["architecture"] == "resnet18-w16"
    assert "'anti-parallel'" in refusal("explain", "anti-parallel")
