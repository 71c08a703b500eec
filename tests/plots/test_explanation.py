from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.image import imread

from bellcrank.errors import InvalidSettings, OutputExists
from bellcrank.model import find_problem
from bellcrank.plots.agreements import Measure, ticks_up_to
from bellcrank.plots.explanation import Explained, draw_explanation
from bellcrank.plots.shadings import REGIONS, HeatMap, Shading


@pytest.fixture(scope="module")
def explained():
    problem = find_problem("scaling-8")
    design = problem.full_design()
    beams = problem.designable
    rng = np.random.default_rng(0)
    exact = rng.normal(0.0, 0.1, len(beams)) ** 3
    exact[3] = np.nan
    region = rng.integers(0, len(REGIONS), len(beams))
    low, high = problem.lattice.positions.min(axis=0), problem.lattice.positions.max(axis=0)
    values = rng.normal(0.0, 1e-3, (8, 12))
    return Explained(
        design=design,
        title="scaling-8: what it sees",
        note="efficiency 1.000",
        beams=beams,
        exact=exact,
        changes=[
            Shading("one", "a", exact),
            Shading("two", "b", -exact),
            Shading("three", "", exact),
        ],
        regions=[Shading("four", "c", region), Shading("five", "", region)],
        maps=[HeatMap("six", "d", values, low, high), HeatMap("seven", "e", -values, low, high)],
        measures=[
            Measure("network", 0.9, 0.8, 0.5, 1.1 * exact),
            Measure("block", 0.1, -0.4, np.nan),
            Measure("nothing", np.nan, np.nan, np.nan, np.full(len(beams), np.nan)),
        ],
    )


def ink(path):
    return imread(path)[..., :3]


def test_a_sheet_has_three_rows_and_two_without_maps(explained, tmp_path):
    draw_explanation(explained, tmp_path / "all.png")
    draw_explanation(replace(explained, maps=[]), tmp_path / "two.png")
    tall, short = ink(tmp_path / "all.png"), ink(tmp_path / "two.png")
    assert tall.shape[1] == short.shape[1] == 2200
    assert 0.6 < short.shape[0] / tall.shape[0] < 0.75
    for picture in (tall, short):
        assert picture.min() < 0.2
        for edge in (picture[:8], picture[-8:], picture[:, :8], picture[:, -8:]):
            assert edge.min() == 1.0  # nothing is cut off


def test_nothing_that_changes_anything_can_be_drawn_too(explained, tmp_path):
    flat = np.zeros(len(explained.beams))
    still = [replace(each, values=flat) for each in explained.changes]
    draw_explanation(replace(explained, exact=flat, changes=still, maps=[]), tmp_path / "flat.svg")
    assert (tmp_path / "flat.svg").read_bytes().startswith(b"<?xml")


def test_pictures_are_neither_misnamed_nor_lost(explained, tmp_path):
    with pytest.raises(InvalidSettings, match="ending in"):
        draw_explanation(explained, tmp_path / "a.jpg")
    taken = tmp_path / "a.png"
    taken.write_text("mine")
    with pytest.raises(OutputExists):
        draw_explanation(explained, taken)
    assert taken.read_text() == "mine"


@pytest.mark.parametrize(
    ("largest", "least", "expected"),
    [
        (2.0, 0.02, [-1.0, -0.1, 0.0, 0.1, 1.0]),
        (1.0, 0.01, [-1.0, -0.1, -0.01, 0.0, 0.01, 0.1, 1.0]),
        (3e-4, 3e-6, [-1e-4, -1e-5, 0.0, 1e-5, 1e-4]),
    ],
)
def test_ticks_are_powers_of_ten_on_both_sides(largest, least, expected):
    assert ticks_up_to(largest, least) == pytest.approx(expected)
