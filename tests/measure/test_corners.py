"""Corners of markers: exact positions, blur, uneven light."""

from __future__ import annotations

import numpy as np
import pytest

from bellcrank.measure.films import edge_width

cv2 = pytest.importorskip("cv2")

from bellcrank.measure.corners import detect_markers, marker_modules  # noqa: E402

FINE = 10


def picture(
    shift: tuple[float, float], blur: float = 0.8, gamma: float = 2.2, number: int = 11,
    pixels: int = 48,
) -> np.ndarray:  # fmt: skip
    """A marker, moved by parts of a pixel, in light that rises from left to right."""
    side = pixels * FINE
    canvas = np.full((120 * FINE, 140 * FINE), 0.8, dtype=np.float32)
    left, top = round((40 + shift[0]) * FINE), round((36 + shift[1]) * FINE)
    cells = np.kron(marker_modules(number), np.ones((side // 6, side // 6)))
    canvas[top : top + side, left : left + side] = np.where(cells, 0.8, 0.05)
    small = cv2.resize(canvas, (140, 120), interpolation=cv2.INTER_AREA)
    small = cv2.GaussianBlur(small, (0, 0), blur) * np.linspace(0.9, 1.0, 140)
    return np.round(255 * small ** (1 / gamma)).astype(np.uint8)


@pytest.mark.parametrize("shift", [(0.0, 0.0), (0.3, 0.6), (0.5, 0.2)])
@pytest.mark.parametrize("blur", [0.6, 1.2])
def test_corners_are_found_within_a_tenth_of_a_pixel(
    shift: tuple[float, float], blur: float
) -> None:
    found = detect_markers(picture(shift, blur))
    assert found.ids.tolist() == [11]
    corner = np.array([39.5, 35.5]) + shift
    square = corner + 48.0 * np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    assert found.corners[0] == pytest.approx(square, abs=0.1)


@pytest.mark.parametrize("number", [30, 38, 39])
def test_white_modules_beside_an_edge_do_not_move_it(number: int) -> None:
    """Modules of 6 pixels and a blur of a quarter of that."""
    found = detect_markers(picture((0.3, 0.6), 1.5, number=number, pixels=36))
    assert found.ids.tolist() == [number]
    square = np.array([39.8, 36.1]) + 36.0 * np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    assert found.corners[0] == pytest.approx(square, abs=0.5)


def test_another_response_of_the_camera_moves_corners_but_not_the_centre() -> None:
    found = detect_markers(picture((0.25, 0.5), 1.2, gamma=1.7))
    centre = [63.75, 60.0]
    assert found.corners[0].mean(axis=0) == pytest.approx(centre, abs=0.1)


def test_the_blur_of_edges_is_measured() -> None:
    sharp, blurred = (float(detect_markers(picture((0, 0), each)).blur[0]) for each in (0.8, 1.3))
    assert 0.6 < sharp < 1.1
    assert 1.15 < blurred < 1.7
    assert edge_width(picture((0, 0), 0.8)) < edge_width(picture((0, 0), 3.0))


def test_a_number_that_is_seen_twice_is_left_out() -> None:
    one = picture((0.0, 0.0))
    assert detect_markers(np.hstack([one, one])).ids.size == 0


def test_an_empty_picture_has_no_markers() -> None:
    assert detect_markers(np.full((80, 80), 128, dtype=np.uint8)).corners.shape == (0, 4, 2)
