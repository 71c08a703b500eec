"""Pictures as products of single beams, against matplotlib drawing the whole design."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from bellcrank.errors import InvalidDataset, InvalidSettings
from bellcrank.model import Problem, find_problem
from bellcrank.surrogate.pictures import Canvas, Renderer, draw_lines
from bellcrank.surrogate.views import PictureView

from .helpers import random_masks

TOLERANCE = 3
"""Grey levels of 255 by which eight-bit blending differs from the product."""


@pytest.mark.parametrize("name", ["crane", "scaling-8", "discs"])
def test_a_product_of_beams_is_what_one_pass_of_agg_draws(name: str) -> None:
    problem = find_problem(name)
    renderer = Renderer(problem.lattice)
    lines = renderer.canvas.pixels_of(problem.lattice.positions)[problem.lattice.beams]
    rng = np.random.default_rng(2)
    for _ in range(6):
        mask = rng.random(len(lines)) < rng.random()
        expected = draw_lines(renderer.canvas, lines[mask]).astype(int)
        found = renderer.render(np.packbits(mask)[None])[0].astype(int)
        assert np.abs(found - expected).max() <= TOLERANCE


def test_the_background_is_drawn_at_once_or_beam_by_beam_to_the_same_bit(crane: Problem) -> None:
    usual = crane.initial.copy()
    usual[crane.designable] = False
    masks = random_masks(crane, 20)
    masks[::2, np.flatnonzero(usual)[3]] = False  # so that the background is not whole
    packed = np.packbits(masks, axis=1)
    renderer = Renderer(crane.lattice, common=usual)
    found = renderer.render(packed)
    # Without the shortcut: no design has all beams of a background that holds one more.
    renderer.background.passed[:] = np.nan
    slow = renderer.render(packed[::2])
    assert np.array_equal(found[::2], slow)
    plain = Renderer(crane.lattice).render(packed)
    assert np.abs(found.astype(int) - plain.astype(int)).max() <= 1


def test_shortcut_and_detour_agree_on_the_same_design(crane: Problem) -> None:
    usual = crane.initial.copy()
    usual[crane.designable] = False
    packed = np.packbits(random_masks(crane, 20), axis=1)
    fast = Renderer(crane.lattice, common=usual)
    expected = fast.render(packed)
    lattice_order = np.argsort(~usual, kind="stable")  # background first, as the kernel draws
    for design, picture in zip(packed, expected, strict=True):
        present = np.unpackbits(design, count=len(usual)).astype(bool)
        passed = np.ones(picture.size, np.float32)
        start, pixel, through = fast.strokes
        for beam in lattice_order[present[lattice_order]]:
            touched = slice(start[beam], start[beam + 1])
            passed[pixel[touched]] *= through[touched]
        ink = (np.float32(255.5) - np.float32(255.0) * passed).astype(np.uint8)
        assert np.array_equal(ink, picture.ravel())


def test_a_picture_does_not_depend_on_the_batch_it_is_drawn_in(problem: Problem) -> None:
    packed = np.packbits(random_masks(problem, 17), axis=1)
    view = PictureView(problem)
    whole = view.arrays(packed)
    for size in (1, 5, 16):
        parts = [view.arrays(packed[first : first + size]) for first in range(0, 17, size)]
        assert np.array_equal(np.concatenate(parts), whole)
    assert np.array_equal(view.arrays(packed[::-1])[::-1], whole)
    assert view.arrays(packed[:0]).shape == (0, 1, 128, 192)


def test_the_uppermost_row_of_pixels_shows_the_uppermost_nodes(crane: Problem) -> None:
    canvas = Canvas()
    renderer = Renderer(crane.lattice, canvas)
    place = canvas.pixels_of(crane.lattice.positions)
    for beam in (0, 100, 351):
        alone = np.zeros(352, bool)
        alone[beam] = True
        rows, columns = np.nonzero(renderer.render(np.packbits(alone)[None])[0])
        middle = place[crane.lattice.beams[beam]].mean(axis=0)
        assert columns.mean() + 0.5 == pytest.approx(middle[0], abs=0.6)
        assert canvas.height - (rows.mean() + 0.5) == pytest.approx(middle[1], abs=0.6)
    top = int(np.argmax(crane.lattice.positions[:, 1]))
    touching = crane.lattice.beams_touching(np.array([top]))
    rows, _ = np.nonzero(renderer.render(np.packbits(touching)[None])[0])
    assert rows.max() < canvas.height / 4


@pytest.mark.parametrize("size", [(192, 128), (64, 64), (40, 200)])
@pytest.mark.parametrize("name", ["crane", "scaling-8", "discs"])
def test_the_lattice_fits_and_keeps_its_shape(name: str, size: tuple[int, int]) -> None:
    lattice = find_problem(name).lattice
    canvas = Canvas(*size, line=1.5, margin=3.0)
    place = canvas.pixels_of(lattice.positions)
    room = 3.0 + 0.75 - 1e-9
    assert place.min() >= room
    assert (np.array(size) - place >= room).all()
    lengths = np.linalg.norm(np.diff(place[lattice.beams], axis=1), axis=2).ravel()
    assert np.ptp(lengths / lattice.rest_length) < 1e-9
    assert np.isclose(np.array(size) - np.ptp(place, axis=0), canvas.border).any()
    full = Renderer(lattice, canvas).render(np.packbits(np.ones(lattice.beam_count, bool))[None])
    border = np.ones(size[::-1], bool)
    border[2:-2, 2:-2] = False
    assert not full[0][border].any()


@pytest.mark.parametrize(
    "given",
    [
        {"width": 4}, {"height": 0}, {"width": 192.5}, {"width": 10**6}, {"line": 0.0},
        {"line": float("nan")}, {"line": float("inf")}, {"margin": -1.0},
        {"margin": float("nan")}, {"margin": 64.0}, {"width": 8, "height": 8, "line": 6.0},
    ],
)  # fmt: skip
def test_a_canvas_that_nothing_fits_on_is_refused(given: dict[str, Any]) -> None:
    with pytest.raises(InvalidSettings, match=r"^canvas: "):
        Canvas(**given)


def test_masks_of_another_lattice_are_refused(problem: Problem) -> None:
    renderer = Renderer(problem.lattice)
    for wrong in (np.zeros((2, 27), np.uint8), np.zeros(28, np.uint8), np.zeros((2, 28), bool)):
        with pytest.raises(InvalidDataset, match="packed: expected masks of 28 bytes"):
            renderer.render(wrong)  # type: ignore[arg-type]


def test_masks_that_are_not_contiguous_are_drawn_the_same(problem: Problem) -> None:
    packed = np.packbits(random_masks(problem, 6), axis=1)
    renderer = Renderer(problem.lattice)
    assert np.array_equal(renderer.render(packed[::2]), renderer.render(packed[::2].copy()))
    columns = np.asfortranarray(packed)
    assert np.array_equal(renderer.render(columns), renderer.render(packed))
