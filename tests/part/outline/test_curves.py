"""Closed curves of lines and arcs against closed forms."""

from __future__ import annotations

import math
import pickle

import numpy as np
import pytest

from bellcrank.errors import InvalidSettings
from bellcrank.part.outline import Loop, Outline

QUARTER = math.tan(math.pi / 8.0)


def rounded_square(side: float, radius: float) -> Loop:
    """A square with rounded corners round the origin, counterclockwise."""
    far, near = 0.5 * side, 0.5 * side - radius
    corner = np.array([[far, -near], [far, near]])
    turns = [np.array([[0, -1], [1, 0]])] * 3
    points = [corner]
    for turn in turns:
        points.append(points[-1] @ turn.T)
    return Loop(np.vstack(points), np.tile([0.0, QUARTER], 4))


def test_a_rounded_square_has_the_area_and_length_of_the_textbook() -> None:
    loop = rounded_square(4.0, 0.5)
    assert loop.area == pytest.approx(16.0 - (4.0 - math.pi) * 0.25, rel=1e-14)
    assert loop.length == pytest.approx(12.0 + math.pi, rel=1e-14)
    assert loop.radii == pytest.approx([math.inf, 0.5] * 4, rel=1e-14)
    assert loop.centres[1::2] == pytest.approx(
        np.array([[1.5, 1.5], [-1.5, 1.5], [-1.5, -1.5], [1.5, -1.5]]), rel=1e-14
    )
    assert np.isnan(loop.centres[::2]).all()


def test_a_loop_the_other_way_round_has_the_opposite_area() -> None:
    loop = rounded_square(4.0, 0.5)
    back = Loop(loop.points[::-1], -np.roll(loop.bulge[::-1], -1))
    assert back.area == pytest.approx(-loop.area, rel=1e-14)
    assert back.length == pytest.approx(loop.length, rel=1e-14)


def test_a_small_loop_far_from_the_origin_keeps_its_area() -> None:
    loop = Loop(np.array([[-1.0, 0.0], [1.0, 0.0]]) + 1e6, [1.0, 1.0])
    assert loop.area == pytest.approx(math.pi, rel=1e-12)


@pytest.mark.parametrize("angle", [0.0, 0.4, 1.9, 3.0, 5.5])
def test_bounds_include_the_extremes_of_arcs(angle: float) -> None:
    ends = np.array([[math.cos(angle), math.sin(angle)], [-math.cos(angle), -math.sin(angle)]])
    assert Loop(ends, [1.0, 1.0]).bounds == pytest.approx((-1.0, -1.0, 1.0, 1.0), abs=1e-15)
    assert Loop(ends, [-1.0, -1.0]).bounds == pytest.approx((-1.0, -1.0, 1.0, 1.0), abs=1e-15)


def test_an_arc_that_misses_an_extreme_is_bounded_by_its_ends() -> None:
    ends = np.array([[math.cos(0.1), math.sin(0.1)], [math.cos(1.4), math.sin(1.4)]])
    low_x, low_y, high_x, high_y = Loop(ends, [math.tan(1.3 / 4.0), 0.0]).bounds
    assert (low_x, high_x) == pytest.approx((math.cos(1.4), math.cos(0.1)))
    assert (low_y, high_y) == pytest.approx((math.sin(0.1), math.sin(1.4)))


@pytest.mark.parametrize("sagitta", [0.3, 0.01, 1e-4])
def test_chords_depart_from_arcs_by_no_more_than_the_sagitta(sagitta: float) -> None:
    flat = Loop([[-2.0, 0.0], [2.0, 0.0]], [1.0, 1.0]).flattened(sagitta)
    assert np.linalg.norm(flat, axis=1) == pytest.approx(2.0, rel=1e-14)
    middles = 0.5 * (flat + np.roll(flat, -1, axis=0))
    depth = 2.0 - np.linalg.norm(middles, axis=1)
    assert depth.max() <= sagitta * (1.0 + 1e-9)
    assert depth.max() > 0.3 * sagitta


def test_arcs_flatter_than_the_sagitta_become_their_chords() -> None:
    loop = Loop([[0.0, 0.0], [1.0, 0.0], [0.5, 1.0]], [1e-12, 0.0, 1e-9])
    assert np.array_equal(loop.flattened(1e-3), loop.points)


def test_pieces_in_holes_of_others_keep_their_own_holes() -> None:
    def washer(outside: float, inside: float) -> tuple[Loop, Loop]:
        ends = np.array([[-1.0, 0.0], [1.0, 0.0]])
        return Loop(outside * ends, [1.0, 1.0]), Loop(inside * ends, [-1.0, -1.0])

    large, small = washer(5.0, 4.0), washer(2.0, 1.0)
    outline = Outline((small[0], large[0]), (large[1], small[1]))
    polygon = outline.polygon(1e-5)
    assert polygon.is_valid
    assert sorted(len(piece.interiors) for piece in polygon.geoms) == [1, 1]
    assert outline.area == pytest.approx(12.0 * math.pi, rel=1e-14)
    assert polygon.area == pytest.approx(outline.area, rel=1e-4)


def test_scaling_and_moving_keep_the_shape() -> None:
    outline = Outline((rounded_square(4.0, 0.5),))
    larger = outline.scaled(3.0).translated([7.0, -1.0])
    assert larger.area == pytest.approx(9.0 * outline.area, rel=1e-14)
    assert larger.bounds == pytest.approx((1.0, -7.0, 13.0, 5.0))
    assert (larger.piece_count, larger.hole_count, larger.edge_count) == (1, 0, 8)


def test_loops_cannot_be_written_to_and_survive_pickling() -> None:
    outline = Outline((rounded_square(4.0, 0.5),))
    with pytest.raises(ValueError, match="read-only"):
        outline.outer[0].points[0] = 0.0
    assert pickle.loads(pickle.dumps(outline)).area == outline.area


@pytest.mark.parametrize(
    ("points", "bulge", "message"),
    [
        ([[0.0, 0.0]], [0.0], r"points: expected shape \(n, 2\) with n >= 2, got shape \(1, 2\)"),
        ([[0, 0], [1, 0]], [0.0], r"bulge: expected shape \(2,\)"),
        ([[0, 0], [1, np.nan]], [0.0, 1.0], r"points\[1\]\[1\]: expected a finite number"),
        ([[0, 0], [1, 0]], [0.0, -1.1], r"bulge\[1\]: expected at most 1 .* got -1.1; split"),
    ],
)
def test_a_loop_that_is_none_is_refused(points: list, bulge: list, message: str) -> None:
    with pytest.raises(InvalidSettings, match=message):
        Loop(points, bulge)


def test_an_outline_that_is_none_is_refused() -> None:
    loop = rounded_square(4.0, 0.5)
    with pytest.raises(InvalidSettings, match="outer: expected one loop or more"):
        Outline(())
    with pytest.raises(InvalidSettings, match=r"holes\[0\]: expected a clockwise loop"):
        Outline((loop,), (loop,))
    with pytest.raises(InvalidSettings, match="sagitta: expected a length above 0 mm, got 0"):
        loop.flattened(0.0)
    with pytest.raises(InvalidSettings, match="factor: expected a number above 0, got -1"):
        Outline((loop,)).scaled(-1.0)
