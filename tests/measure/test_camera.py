"""Homographies and distortion: closed forms, noise, and weights of markers."""

from __future__ import annotations

import numpy as np
import pytest

from bellcrank.measure.by_markers import similarity
from bellcrank.measure.camera import Lens, fitted_homography, fitted_views, transformed

CORNERS = 7.5 * np.array([[-1.0, 1.0], [1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]])
PLACES = np.stack(np.meshgrid([0.0, 70.0, 140.0, 210.0], [0.0, 75.0, 150.0]), axis=-1)
POINTS = PLACES.reshape(-1, 1, 2) + CORNERS
SIZE = (1280, 720)
VIEWS = np.array(
    [
        [[7e-3, 2e-4, -0.7], [-1e-4, -7e-3, 0.5], [1e-4, 3e-4, 1.0]],
        [[6e-3, -9e-4, -0.6], [4e-4, -6e-3, 0.4], [-4e-4, 2e-4, 1.0]],
        [[5e-3, 1e-3, -0.5], [8e-4, -5e-3, 0.4], [6e-4, -5e-4, 1.0]],
    ]
)


def seen(radial: list[float], noise: float = 0.0, seed: int = 0) -> np.ndarray:
    lens = Lens.of_size(SIZE, np.array(radial))
    flat = transformed(VIEWS, np.broadcast_to(POINTS.reshape(-1, 2), (3, 48, 2)))
    pixels = lens.pixels(flat).reshape(3, -1, 4, 2)
    return pixels + noise * np.random.default_rng(seed).standard_normal(pixels.shape)


def test_a_homography_maps_a_unit_square_to_a_given_quadrilateral() -> None:
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    image = np.array([[0.0, 0.0], [2.0, 0.0], [1.5, 1.0], [0.5, 1.0]])
    found = fitted_homography(square, image)
    # The trapezium is symmetric about x = 1: (1/2, 1/2) goes to where its diagonals meet.
    assert transformed(found, square) == pytest.approx(image, abs=1e-12)
    assert transformed(found, np.array([[0.5, 0.5]]))[0] == pytest.approx([1.0, 2.0 / 3.0])


@pytest.mark.parametrize("radial", [[0.0, 0.0], [-0.1, 0.02], [0.08, -0.01]])
def test_homographies_and_distortion_are_found_exactly(radial: list[float]) -> None:
    views = fitted_views(seen(radial), POINTS, SIZE)
    assert views.lens.radial == pytest.approx(radial, abs=2e-4)
    assert np.abs(views.residual).max() < 0.02
    ahead = views.plane(seen(radial))
    assert np.abs(ahead - POINTS).max() < 0.005


@pytest.mark.parametrize("radial", [[-0.25, 0.05], [0.2, 0.0]])
def test_the_lens_is_inverted(radial: list[float]) -> None:
    lens = Lens.of_size(SIZE, np.array(radial))
    points = np.random.default_rng(1).uniform(-0.8, 0.8, (200, 2))
    assert lens.ideal(lens.pixels(points)) == pytest.approx(points, abs=1e-7)


def test_hidden_and_wrong_markers_do_not_matter() -> None:
    pixels = seen([-0.05, 0.0])
    pixels[0, 3], pixels[1, 5] = np.nan, pixels[1, 5] + 30.0
    views = fitted_views(pixels, POINTS, SIZE)
    known = np.isfinite(views.residual[..., 0, 0])
    known[1, 5] = False
    assert np.abs(views.residual[known]).max() < 0.02


def test_the_plane_is_found_within_the_noise_of_the_corners() -> None:
    noise, scale = 0.1, 4.0
    deviations = []
    for seed in range(12):
        views = fitted_views(seen([-0.05, 0.01], noise, seed), POINTS, SIZE)
        middle = np.full((3, 1, 2), 100.0)
        exact = np.stack([
            Lens.of_size(SIZE, np.array([-0.05, 0.01])).pixels(transformed(view, middle[0]))
            for view in VIEWS
        ])  # fmt: skip
        deviations.append(views.plane(exact) - 100.0)
    # 48 corners determine 8 numbers of each view: the middle is known much better than a corner.
    assert np.sqrt(np.mean(np.square(deviations))) < 0.5 * noise / scale


def test_weights_of_one_change_nothing_and_others_little() -> None:
    pixels = seen([-0.05, 0.01], 0.1)
    views = fitted_views(pixels, POINTS, SIZE)
    same = views.resampled(np.ones(len(POINTS)))
    assert same.plane(pixels) == pytest.approx(views.plane(pixels), abs=1e-4)
    rng = np.random.default_rng(3)
    other = views.resampled(len(POINTS) * rng.dirichlet(np.ones(len(POINTS))))
    moved = np.abs(other.plane(pixels) - views.plane(pixels)).max()
    assert 1e-4 < moved < 0.3


def test_a_similarity_is_recovered_from_noisy_points() -> None:
    rng = np.random.default_rng(0)
    points = rng.uniform(0.0, 100.0, (6, 2))
    turn = 1.0125 * np.array([[np.cos(0.3), -np.sin(0.3)], [np.sin(0.3), np.cos(0.3)]])
    image = points @ turn.T + [3.0, -4.0] + 1e-3 * rng.standard_normal((6, 2))
    found = similarity(points, image)
    assert found[:2, :2] == pytest.approx(turn, abs=1e-4)
