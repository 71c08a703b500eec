"""Motion of nodes, phases of a film, curves and intervals without any picture."""

from __future__ import annotations

import numpy as np
import pytest

from bellcrank.errors import InvalidFile, InvalidSettings, UnreadableFilm
from bellcrank.measure import MarkerLayout, MeasureSettings, Motion, marker_layout
from bellcrank.measure.curves import basis_for, phases_of
from bellcrank.measure.measurement import Recording, interval, measured
from bellcrank.measure.motion import node_motion, rigid_motion
from bellcrank.model import human_design
from bellcrank.part import PartSpec

PART = PartSpec().of(human_design("crane"))


def motion_of(pushed: np.ndarray, gain: float = 3.0) -> Motion:
    zero = np.zeros_like(pushed)
    path = np.column_stack([-gain * pushed, zero])
    return Motion(pushed, gain * pushed, np.column_stack([zero, zero]), zero, path)


def measure(pushed: np.ndarray, noise: float = 0.01, seed: int = 0, **settings: object):
    """Measure a motion with a gain of 3 and noise in input and output."""
    rng = np.random.default_rng(seed)
    exact = motion_of(pushed)
    seen = Motion(
        pushed + noise * rng.standard_normal(len(pushed)),
        exact.along + noise * rng.standard_normal(len(pushed)), exact.across, exact.rotation,
        exact.path,
    )  # fmt: skip
    chosen = MeasureSettings(samples=100, **settings)
    film = Recording("film", np.arange(len(pushed)), 5.0, 0.5 * noise)
    return measured(film, 4.0, lambda _rng, _rest: seen, chosen)


STROKE = np.concatenate([np.zeros(4), np.linspace(0.2, 4.0, 20), np.full(3, 4.0)])


def test_a_node_beside_its_marker_moves_with_its_rotation() -> None:
    layout = marker_layout(PART, PART.positions[None])
    (marker,) = layout.of_role("output")
    angle = np.radians(30.0)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    rest = marker.corners
    moved = (rest - marker.centre) @ turn.T + marker.centre + [5.0, -2.0]
    shift, turned = rigid_motion(moved[None], rest)
    assert shift[0] == pytest.approx([5.0, -2.0])
    assert turned[0] == pytest.approx(angle)
    found = node_motion(
        [marker], moved[None, None], rest[None], marker.nodes, PART.positions, np.zeros((1, 2))
    )
    arms = PART.positions[marker.nodes] - marker.centre
    assert found[0] == pytest.approx(arms @ turn.T - arms + [5.0, -2.0])


def test_frames_at_rest_and_after_the_hold_are_recognised() -> None:
    pushed = np.concatenate([STROKE, np.linspace(3.5, 0.0, 8)])
    phases = phases_of(pushed, 4.0 * pushed)
    assert (phases.rest, phases.loading) == (4, len(STROKE))


def test_a_steep_curve_is_followed_in_spite_of_noise_of_the_input() -> None:
    """The output moves up to 62 times as fast as the input; the noise of the input is 1 %."""
    exact, at = np.linspace(0.0, 1.0, 40), np.array([0.25, 0.6, 1.0])

    def steep(pushed: np.ndarray) -> np.ndarray:
        return 5.0 * (1.0 + np.tanh((pushed - 0.6) / 0.08))

    deviations = []
    for seed in range(30):
        noise = 0.01 * np.random.default_rng(seed).standard_normal(40)
        moved = np.stack([exact + noise, steep(exact)], axis=1)
        progress = moved.sum(axis=1)
        basis = basis_for(progress, moved[:, 0])
        found = basis.at_strokes(basis.fitted(progress, moved, np.ones(40)), at)
        assert found[:, 0] == pytest.approx(at, abs=1e-3)
        deviations.append(found[:, 1] - steep(at))
    # Where the curve is steepest, the noise of a frame is 0.62 in the output, and frames are few.
    assert (np.sqrt(np.mean(np.square(deviations), axis=0)) < [0.02, 1.0, 0.02]).all()


def test_a_return_on_which_the_output_is_lost_is_left_out() -> None:
    pushed = np.concatenate([STROKE, np.linspace(3.5, 0.5, 6)])
    moved = motion_of(pushed)
    lost = 3.0 * pushed
    lost[len(STROKE) :] = np.linspace(12.0, 20.0, 6)
    seen = Motion(pushed, lost, moved.across, moved.rotation, moved.path)
    found = measured(
        Recording("film", np.arange(len(pushed)), 5.0, 0.005), 4.0, lambda _rng, _rest: seen,
        MeasureSettings(samples=20),
    )  # fmt: skip
    assert found.frames == len(STROKE)
    assert found.efficiency[-1, 0] == pytest.approx(3.0, rel=0.005)


def test_intervals_contain_the_truth_as_often_as_they_say() -> None:
    hits = []
    for seed in range(60):
        low, high = interval(measure(STROKE, seed=seed).efficiency[-1])
        hits.append(low <= 3.0 <= high)
    # 95 % of 60, less three standard deviations of that number.
    assert sum(hits) >= 52


def test_intervals_are_not_much_wider_than_the_scatter_of_results() -> None:
    found = np.stack([measure(STROKE, seed=seed).efficiency[-1] for seed in range(60)])
    assert found[:, 1].mean() < 2.5 * found[:, 0].std()


def test_more_noise_makes_wider_intervals() -> None:
    narrow, wide = (measure(STROKE, noise).efficiency[-1, 1] for noise in (0.005, 0.05))
    assert wide > 4.0 * narrow


def test_figures_are_at_the_stroke_that_was_reached() -> None:
    assert measure(0.7 * STROKE).stroke[-1] == pytest.approx(2.8, abs=0.03)
    assert measure(1.2 * STROKE).stroke[-1] == pytest.approx(4.0)


@pytest.mark.parametrize(
    ("pushed", "word"),
    [
        (0.05 * STROKE, "motion too small"),
        (np.zeros(20), "motion too small"),
        (-STROKE, "against its direction"),
    ],
)
def test_a_motion_that_cannot_be_measured_is_refused(pushed: np.ndarray, word: str) -> None:
    with pytest.raises(UnreadableFilm, match=word):
        measure(pushed)


def test_a_layout_is_stored_and_read() -> None:
    layout = marker_layout(PART, PART.positions[None])
    again = MarkerLayout.from_dict(layout.to_dict())
    assert again.to_dict() == layout.to_dict()
    assert len({marker.id for marker in layout.markers}) == len(layout.markers)


def test_markers_of_the_sheet_are_clear_of_the_moving_part() -> None:
    swept = PART.positions + np.array([[[0.0, 0.0]], [[-40.0, -20.0]]])
    layout = marker_layout(PART, swept)
    low, high = swept.min(axis=(0, 1)), swept.max(axis=(0, 1))
    for marker in layout.reference:
        outside = (marker.corners.max(axis=0) < low) | (marker.corners.min(axis=0) > high)
        assert outside.any(), marker.id


@pytest.mark.parametrize(
    "change",
    [{"schema": "other/1"}, {"dictionary": "DICT_5X5_50"}, {"markers": [{"id": 3}]},
     {"markers": [{"id": 3, "role": "input", "centre_mm": [0, 0], "size_mm": 1, "nodes": []}]}],
)  # fmt: skip
def test_a_file_that_is_no_layout_is_refused(change: dict[str, object]) -> None:
    layout = marker_layout(PART, PART.positions[None])
    with pytest.raises(InvalidFile):
        MarkerLayout.from_dict(layout.to_dict() | change)


def test_sizes_out_of_range_are_refused() -> None:
    with pytest.raises(InvalidSettings, match="marker size"):
        marker_layout(PART, PART.positions[None], size=2.0)
    with pytest.raises(InvalidSettings, match="placement"):
        MeasureSettings(placement=-1.0)
