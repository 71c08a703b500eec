"""The measured lattice: set-up, models, and what the record says about their agreement."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from reproduction.measured.comparison import (
    agreement,
    compared,
    effect,
    gradients,
    noise,
    outputs,
    own_weight,
    products,
    scattered,
)
from reproduction.measured.lattice import (
    MODELS,
    Force,
    Model,
    Sample,
    data,
    displacement_of,
    elongations,
    mirrored,
)

RECORD = Path(__file__).parents[2] / "docs" / "studies" / "measured.json"


@pytest.fixture(scope="module")
def figures() -> dict[str, Any]:
    return json.loads(RECORD.read_text(encoding="utf-8"))["figures"]


def respond(name: str, force: Force) -> np.ndarray:
    return displacement_of(MODELS[name], Sample(), force)


def hinged_bars(force: Force) -> np.ndarray:
    """Displacements of bars that are hinged in the nodes, assembled here, m."""
    given = data()
    rest, beams = np.array(given["positions"]), np.array(given["beams"])
    axial = given["young"] * given["width"] * given["thickness"]
    stiffness = np.zeros((2 * len(rest), 2 * len(rest)))
    for first, last in beams:
        along = rest[last] - rest[first]
        length = np.linalg.norm(along)
        row = np.zeros(2 * len(rest))
        row[[2 * first, 2 * first + 1]], row[[2 * last, 2 * last + 1]] = -along, along
        stiffness += axial / length**3 * np.outer(row, row)
    held = [2 * node + axis for node in given["supports"] for axis in (0, 1)]
    free = np.setdiff1d(np.arange(2 * len(rest)), held)
    load, motion = np.zeros(2 * len(rest)), np.zeros(2 * len(rest))
    load[[2 * force[0], 2 * force[0] + 1]] = force[1]
    motion[free] = np.linalg.solve(stiffness[np.ix_(free, free)], load[free])
    return motion.reshape(-1, 2)


def test_bars_are_those_of_the_source_and_of_an_assembly_by_hand() -> None:
    for each, given in zip(gradients(), data()["measured_gradients"], strict=True):
        model = products(lambda force: respond("bars", force), each, nonlinear=False)
        by_hand = products(hinged_bars, each, nonlinear=False)
        # The source has three digits; its smallest products agree less well.
        source = np.array(given["linear_springs"])
        assert np.abs(model / source - 1.0).max() < 4e-3
        assert np.abs(model - source).max() < 2e-3 * np.abs(source).max()
        assert model == pytest.approx(by_hand, rel=1e-5, abs=1e-5 * np.abs(by_hand).max())


@pytest.mark.parametrize(
    ("name", "expected"),
    [("bars", 0.5243), ("frame-free-linear", 0.519), ("frame-clamped-linear", 0.513)],
)
def test_linear_outputs_are_those_that_were_known(name: str, expected: float) -> None:
    vertical = respond(name, outputs().force)[list(outputs().nodes), 1]
    assert -1e3 * vertical == pytest.approx(expected, abs=5e-4)


def test_mirror_images_have_equal_products_in_a_linear_model() -> None:
    image = mirrored()
    assert (image[image] == np.arange(len(image))).all()
    first = products(lambda force: respond("frame-clamped-linear", force), gradients()[0],
                     nonlinear=False)  # fmt: skip
    assert first == pytest.approx(first[image], rel=1e-9, abs=1e-18)


def test_elongations_to_first_order_are_those_of_small_displacements() -> None:
    rng = np.random.default_rng(0)
    motion = 1e-8 * rng.standard_normal((14, 2))
    linear, whole = (elongations(motion, nonlinear=each) for each in (False, True))
    assert whole == pytest.approx(linear, abs=1e-13)


def test_the_modulus_from_the_outputs_gives_the_measured_mean() -> None:
    found = compared(Model(kind="frame", clamped=True, nonlinear=True))
    vertical = np.array(found["matching"]["outputs_mm"])
    assert vertical == pytest.approx(1e3 * outputs().mean, rel=1e-6)


def test_models_and_changes_agree_with_the_record(figures: dict[str, Any]) -> None:
    for name in ("bars", "springs", "frame-clamped-linear", "frame-free-nonlinear"):
        model = MODELS[name]
        found = agreement(
            lambda force, model=model: displacement_of(model, Sample(), force),
            nonlinear=model.nonlinear,
        )
        recorded = figures["models"][name]["nominal"]
        assert found["outputs_mm"] == pytest.approx(recorded["outputs_mm"], rel=2e-5)
        for each in gradients():
            assert found[each.name]["rms"] == pytest.approx(recorded[each.name]["rms"], rel=1e-4)
    by_title = {row["title"]: row for row in figures["effects"]}
    for found in (effect("joint"), effect("offset"), own_weight(1.1)):
        recorded = by_title[found["title"]]
        assert found["output_mm"] == pytest.approx(recorded["output_mm"], rel=2e-5)
        assert found["main"]["rms"] == pytest.approx(recorded["main"]["rms"], rel=1e-4)
    assert noise()["mirror_floor"] == pytest.approx(figures["noise"]["mirror_floor"], rel=1e-5)


def test_random_lattices_scatter_about_the_drawn_one() -> None:
    widths, nodes = scattered(12, 0.05, 0.1)
    for found in (widths, nodes):
        assert found["output_mm"] == pytest.approx(-0.5126, rel=0.03)
        assert 0.0 < found["output_sd_mm"] < 0.03


def test_frames_agree_with_the_measurement_better_than_bars(figures: dict[str, Any]) -> None:
    """Outputs within the stated uncertainties, and smaller errors of both gradients.

    The modulus is that with which the mean output is the measured one. With the modulus of the
    source, frames have a smaller error of the first data set only.
    """
    bars, frames = (figures["models"][name] for name in ("bars", "frame-clamped-linear"))
    assert bars["nominal"]["main"]["rms"] == pytest.approx(3.1e-9, abs=5e-11)
    assert bars["nominal"]["supplement"]["rms"] == pytest.approx(1.5e-8, abs=5e-10)
    for key in ("nominal", "matching"):
        assert np.abs(frames[key]["deviation"]).max() < 1.0
        assert frames[key]["main"]["rms"] < bars[key]["main"]["rms"]
    assert frames["matching"]["supplement"]["rms"] < bars["nominal"]["supplement"]["rms"]
    assert frames["matching"]["main"]["rms"] < bars["matching"]["main"]["rms"]
    assert frames["matching"]["supplement"]["rms"] < bars["matching"]["supplement"]["rms"]
