"""Values and violations of items from channels along the stroke."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from bellcrank.mechanics import (
    Channel,
    StrokeRecord,
    item_results,
    objective_value,
    quantity_values,
    reduced,
    tightened,
    violation,
)
from bellcrank.mechanics.items import MOST_LOADS, Bounds, path_deviation, path_error
from bellcrank.model import Item, ObjectiveTerm

FRACTIONS = np.array([0.25, 0.5, 0.75, 1.0])
ALONG = np.array([0.1, 0.3, 0.6, 1.0])
NORMAL = np.array([0.0, 0.08, -0.02, 0.01])
RECORD = StrokeRecord(
    FRACTIONS,
    {
        Channel("motion", "tip"): np.stack([ALONG, NORMAL, 0.0 * NORMAL], axis=-1),
        Channel("displacement", "tip"): np.stack([ALONG, NORMAL], axis=-1),
        Channel("loaded_motion", "tip"): np.array([[0.8, 0.0, 0.0]]),
        Channel("carried_motion", "tip"): np.array([[-0.6, 0.0, 0.0]]),
        Channel("input_motion"): 0.5 * FRACTIONS,
        Channel("rotation", "tip"): np.array([1.0, -6.0, 2.0, 3.0]),
        Channel("input_force"): np.array([0.4, 0.9, -0.2, 0.3]),
        Channel("strain"): np.array([0.05]),
        Channel("stiffness", "tip"): np.array([2.0]),
        Channel("sag", "tip"): np.array([0.25]),
    },
    {"clearance": math.inf, "mass": 12.0},
    {Channel("loaded_motion", "tip"): 0.04, Channel("carried_motion", "tip"): 0.04},
)


def item(quantity: str, **bounds: Any) -> Item:
    own = {} if quantity in {"strain", "input_force", "clearance"} else {"output": "tip"}
    return Item(quantity=quantity, case="" if quantity == "mass" else "push", **own, **bounds)


@pytest.mark.parametrize(
    ("wanted", "value", "expected"),
    [
        (item("gain", at_least=2.5), 2.0, 0.5 / 2.5),
        (item("gain", at_least=1.0, start=0.0), 0.8, 0.2),
        (item("travel", at_least=-0.2, at_most=0.2, start=0.0, stop=0.5), 0.3, 0.1 / 0.2),
        (item("off_axis", at_most=0.1), 0.08, 0.0),
        (item("rotation", at_least=-5.0, at_most=5.0, start=0.0), -6.0, 1.0 / 5.0),
        (item("rotation", at_least=-5.0, at_most=5.0), 3.0, 0.0),
        (item("travel", at_least=1.2, at_most=40.0), 1.0, 0.2 / 1.2),
        (item("travel", at_least=0.0, at_most=0.8), 1.0, 0.2 / 0.8),
        (item("payload", at_least=0.2), 0.1, 0.1 / 0.2),
        (item("dead_load", at_least=0.04), 0.0125, 0.0275 / 0.04),
        (item("sag", at_most=0.1), 0.25, 0.15 / 0.1),
        (item("input_force", of="largest", at_most=0.6, start=0.0), 0.9, 0.3 / 0.6),
        (item("input_force", of="smallest", at_most=-0.1, start=0.0), -0.2, 0.0),
        (item("input_force", of="spread", at_most=0.5, start=0.0), 1.1 / 0.35, None),
        (item("strain", at_most=0.1), 0.05, 0.0),
        (item("stiffness", at_least=4.0), 2.0, 2.0 / 4.0),
        (item("clearance", at_least=0.1), math.inf, 0.0),
        (item("mass", at_most=10.0), 12.0, 2.0 / 10.0),
    ],
)
def test_an_item_has_its_worst_value_and_a_normalised_violation(
    wanted: Item, value: float, expected: float | None
) -> None:
    (found,) = item_results([wanted], {"push": RECORD})
    assert found.value == pytest.approx(value)
    if expected is not None:
        assert found.violation == pytest.approx(math.log1p(expected))
    assert found.met == (found.violation == 0.0)
    assert (found.margin < 0.0) == (not found.met)


def test_a_value_that_is_unknown_violates_its_item_entirely() -> None:
    unstable = StrokeRecord(FRACTIONS, {Channel("strain"): np.array([np.nan])})
    wanted = item("strain", at_most=0.1)
    assert violation(Bounds.of(wanted), *reduced(wanted, unstable)) == math.log1p(1e3)


def test_violations_of_many_flips_are_computed_at_once() -> None:
    many = StrokeRecord(
        FRACTIONS,
        {
            channel: np.stack([values, 1.1 * values, 2.0 * values])
            for channel, values in RECORD.channels.items()
        },
    )
    wanted = item("rotation", at_least=-5.0, at_most=5.0, start=0.0)
    found = violation(Bounds.of(wanted), *reduced(wanted, many))
    assert found == pytest.approx(np.log1p([1.0 / 5.0, 1.6 / 5.0, 7.0 / 5.0]))
    assert quantity_values(many, "off_axis", "tip")[:, 0] == pytest.approx([0.08, 0.08, 0.08])


def test_a_path_that_is_followed_at_another_pace_has_no_error() -> None:
    corners = np.array([[0.0, 0.0], [2.0, 1.0], [4.0, 2.0]])
    pace = FRACTIONS**2
    motion = pace[:, None] * np.array([4.0, 2.0])
    assert float(path_error(FRACTIONS, motion, corners)) < 1e-9


def test_an_offset_circle_has_the_error_of_its_distance() -> None:
    angle = np.linspace(0.0, np.pi / 2.0, 9)[1:]
    fractions = np.arange(1, 9) / 8.0
    motion = np.stack([np.sin(angle), 1.0 - np.cos(angle)], axis=-1)
    fine = np.linspace(0.0, np.pi / 2.0, 200)
    wanted = np.stack([1.1 * np.sin(fine), 1.1 * (1.0 - np.cos(fine))], axis=-1)
    angles = np.arange(1, 49) / 48.0 * np.pi / 2.0
    distance = 0.1 * np.sqrt(np.sin(angles) ** 2 + (1.0 - np.cos(angles)) ** 2)
    expected = math.sqrt((distance**2).mean()) / (1.1 * np.pi / 2.0)
    assert float(path_error(fractions, motion, wanted)) == pytest.approx(expected, rel=1e-3)


def test_a_motion_that_ends_beside_the_path_deviates_across_it() -> None:
    corners = np.array([[0.0, 0.0], [4.0, 0.0]])
    motion = FRACTIONS[:, None] * np.array([4.0, 0.04])
    apart = path_deviation(FRACTIONS, np.stack([motion, 0.0 * motion]), corners)
    assert apart[0, -1] == pytest.approx([0.0, 0.01], abs=1e-6)
    assert np.isinf(apart[1]).all()
    assert path_deviation(FRACTIONS, motion, corners) == pytest.approx(apart[0])


def test_a_right_angle_that_is_cut_has_a_large_error() -> None:
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]])
    straight = FRACTIONS[:, None] * np.array([1.0, 1.0])
    assert float(path_error(FRACTIONS, straight, corners)) > 0.15


@pytest.mark.parametrize(
    ("wanted", "bounds"),
    [
        (item("sag", at_most=0.2), (None, 0.19)),
        (item("strain", at_most=0.2), (None, 0.16)),
        (item("gain", at_least=2.0), (2.1, None)),
        (item("gain", at_least=2.0, at_most=4.0), (2.2, 3.8)),
        (item("input_force", at_most=-0.2), (None, -0.21)),
        (item("clearance", at_least=0.0), (0.02, None)),
    ],
)
def test_a_reserve_tightens_bounds(wanted: Item, bounds: tuple[float, float]) -> None:
    tight = tightened(wanted, 0.05)
    assert (tight.at_least, tight.at_most) == pytest.approx(bounds)


@pytest.mark.parametrize(
    ("free", "loaded", "expected"),
    [
        (1.0, 0.8, 0.1),  # a fifth of the motion is lost to 0.04
        (1.0, 1.1, 0.04 * MOST_LOADS),  # the load increases the motion
        (-1.0, -1.2, 0.0),  # the output moves against its direction, and further by the load
        (-1.0, -0.8, 0.0),
        (0.0, -0.1, 0.0),
    ],
)
def test_a_payload_as_an_objective_is_finite(free: float, loaded: float, expected: float) -> None:
    channels = {
        Channel("motion", "tip"): np.array([[free, 0.0, 0.0]]),
        Channel("loaded_motion", "tip"): np.array([[loaded, 0.0, 0.0]]),
    }
    forces = {Channel("loaded_motion", "tip"): 0.04}
    record = StrokeRecord(np.ones(1), channels, forces=forces)
    term = ObjectiveTerm(quantity="payload", case="push", output="tip", scale=0.5)
    assert float(objective_value(record, term)) == pytest.approx(expected / 0.5)


def test_other_objectives_are_finite_too() -> None:
    motion = {Channel("motion", "tip"): np.array([[0.0, 0.2, 0.0]])}
    record = StrokeRecord(np.ones(1), motion)
    term = ObjectiveTerm(quantity="off_axis", case="push", output="tip", scale=-0.1)
    assert -1e7 < float(objective_value(record, term)) < -1e5
