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
    """A folder with untrained networks for the crane, named by architecture."""
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


def test_a_design_is_explained_in_text_and_a_picture(here: Path, pictures: Path) -> None:
    outcome = call("explain", "human:crane", "--model", pictures)
    assert outcome.code == 0, outcome.err
    assert "efficiency 1.0105 by mechanics" in outcome.out
    assert "low-rank update" in outcome.out
    assert "white block" in outcome.out
    assert outcome.err == "wrote crane-explained.png\n"
    assert list(files(here)) == ["crane-explained.png"]
    assert colours(here / "crane-explained.png") > 100


def test_json_is_all_that_is_printed_and_draws_nothing(here: Path, pictures: Path) -> None:
    outcome = call("explain", "human:crane", "--model", pictures, "--json", "--stride", 8)
    assert outcome.code == 0, outcome.err
    assert outcome.err == ""
    assert files(here) == {}
    found = outcome.data
    design = human_design("crane")
    assert found["mask"] == design.mask_hex
    assert found["beams"] == design.problem.designable.tolist()
    assert len(found["present"]) == len(found["changes"]["exact"]) == 203
    assert found["correlations"]["low_rank"] > 0.95
    assert len(found["maps"]["white"]) == 5


def test_a_design_for_a_part_is_explained_and_predicted_with_the_springs_of_the_training(
    pictures: Path,
) -> None:
    outcome = call("explain", "machine:crane", "--model", pictures, "--json", "--stride", 16)
    assert outcome.code == 0, outcome.err
    assert "the design is a frame" in outcome.err
    assert "5 and 0.1" in outcome.err
    predicted = call("predict", "machine:crane", "--model", pictures, "--json")
    assert predicted.code == 0, predicted.err
    assert "5 and 0.1" in predicted.err
    (row,) = predicted.data["results"]
    assert row["mask"] == outcome.data["mask"]
    assert row["efficiency"] == pytest.approx(outcome.data["predicted"], abs=1e-5)
    assert call("predict", "crane", "--model", pictures, "--json").err == ""


def test_what_cannot_be_explained_is_refused(here: Path, pictures: Path, bits: Path) -> None:
    taken = write(here / "taken.png", "mine")
    small = write(here / "small.json", SMALL)
    empty = here / "empty"
    empty.mkdir()
    broken = here / "broken.safetensors"
    broken.write_bytes(pictures.read_bytes()[:5000])
    for words, fact in (
        (("crane", "--model", bits), "'mlp'"),
        (("crane", "--model", pictures, "--stride", 0), "stride"),
        (("nothing", "--model", bits), "nothing"),
        (("human:scaling-8", "--model", bits), "no human design"),
        ((small, "--model", bits), "'crane'"),
        (("anti-parallel", "--model", bits), "'crane'"),
        (("crane", "--model", here / "none.safetensors"), "cannot be read"),
        (("crane", "--model", empty), "model.safetensors"),
        (("crane", "--model", broken), "truncated"),
        (("crane", "--model", bits, "--out", taken), "exists"),
        (("crane", "--model", bits, "--out", "a.jpg"), "ending in"),
        (("crane", "--model", pictures, "--device", "abacus"), "device"),
    ):
        assert fact in refusal("explain", *words), words


def test_a_picture_is_replaced_with_the_option(here: Path, pictures: Path) -> None:
    taken = write(here / "taken.png", "mine")
    assert call("explain", "crane", "--model", pictures, "--out", taken, "--overwrite").code == 0
    assert colours(taken) > 100


@pytest.mark.skipif(not SHIPPED.is_file(), reason="no trained model comes with bellcrank yet")
def test_the_bundled_network_is_the_default(here: Path) -> None:
    outcome = call("explain", "machine:crane", "--json", "--stride", 32)
    assert outcome.code == 0, outcome.err
    assert outcome.data["architecture"] == "resnet18-w16"
    assert "'anti-parallel'" in refusal("explain", "anti-parallel")
