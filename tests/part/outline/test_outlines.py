"""Outlines of struts against closed forms, slow polygons, and what no movement may change."""

from __future__ import annotations

import math
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
import pytest
import shapely

from bellcrank.part.outline import (
    Outline,
    expected_holes,
    room_for_fillet,
    strut_outline,
)
from tests.part.outline.layouts import filled_by_polygons, random_layout, triangular

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tests.part.outline.layouts import Layout

TRIANGLE = (
    np.array([[0.0, 0.0], [12.0, 0.0], [6.0, 108.0**0.5]]),
    np.array([[0, 1], [1, 2], [2, 0]]),
)
LAYOUTS = [(kind, seed) for kind in ("regular", "jittered", "scattered") for seed in range(10)]
FILLETS = [0.0, 0.02, 0.4, 0.97]


@cache
def random_outline(kind: str, seed: int, part: float) -> tuple[Layout, float, float, Outline]:
    """A layout with the width and the fillet of its outline, as a part of the room there is."""
    layout = random_layout(kind, seed)
    swollen = room_for_fillet(*layout, width=1e-3)
    width = float(np.random.default_rng(seed).uniform(0.2, 1.0)) * min(swollen, 4.0)
    fillet = part * min(room_for_fillet(*layout, width), 6.0)
    return layout, width, fillet, strut_outline(*layout, width, fillet)


def directions(outline: Outline) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Angles at which each edge of each loop arrives at its end, and the next one leaves it."""
    arriving, leaving = [], []
    for loop in outline.loops:
        chord = np.arctan2(*loop.chords.T[::-1])
        arriving.append(chord + 0.5 * loop.turns)
        leaving.append(np.roll(chord - 0.5 * loop.turns, -1))
    return np.concatenate(arriving), np.concatenate(leaving)


def kinks(outline: Outline) -> NDArray[np.float64]:
    """Angle by which each corner turns, positive to the left."""
    arriving, leaving = directions(outline)
    return (leaving - arriving + math.pi) % (2.0 * math.pi) - math.pi


@pytest.mark.parametrize("fillet", [0.0, 0.7])
@pytest.mark.parametrize("angle", [0.0, 0.3, 2.0])
def test_one_strut_is_a_rectangle_with_two_half_discs(fillet: float, angle: float) -> None:
    end = 10.0 * np.array([math.cos(angle), math.sin(angle)])
    outline = strut_outline([[0.0, 0.0], end], [[0, 1]], width=2.0, fillet=fillet)
    assert outline.area == pytest.approx(20.0 + math.pi, rel=1e-14)
    assert outline.outer[0].length == pytest.approx(20.0 + 2.0 * math.pi, rel=1e-14)
    assert sorted(outline.outer[0].turns) == pytest.approx([0.0, 0.0, math.pi, math.pi])
    assert room_for_fillet([[0.0, 0.0], end], [[0, 1]], width=2.0) == math.inf


@pytest.mark.parametrize("fillet", [0.0, 0.3, 2.0])
def test_the_hole_of_a_triangle_is_a_triangle_with_rounded_corners(fillet: float) -> None:
    outline = strut_outline(*TRIANGLE, width=2.0, fillet=fillet)
    inscribed = 12.0**0.5 - 1.0
    corners = 27.0**0.5 - math.pi
    expected = 27.0**0.5 * inscribed**2 - corners * fillet**2
    assert outline.holes[0].area == pytest.approx(-expected, rel=1e-13)
    assert outline.outer[0].area == pytest.approx(36.0 * 3.0**0.5 + 36.0 + math.pi, rel=1e-14)


def test_fillets_touch_struts_where_a_circle_in_their_corner_does() -> None:
    """In a corner of angle a, at the distance radius / tan(a / 2) from it."""
    corner = [[0.0, 0.0], [20.0, 0.0], [10.0, 300.0**0.5]]
    outline = strut_outline(corner, [[0, 1], [0, 2]], width=2.0, fillet=1.5)
    loop = outline.outer[0]
    arc = int(np.flatnonzero(loop.turns < 0.0)[0])
    foot = (1.0 + 1.5) / math.tan(math.pi / 6.0)
    assert loop.turns[arc] == pytest.approx(-2.0 * math.pi / 3.0)
    assert loop.centres[arc] == pytest.approx([foot, 2.5])
    ends = loop.points[[arc, (arc + 1) % len(loop.points)]]
    assert ends[0] == pytest.approx([foot, 1.0])
    assert ends[1] == pytest.approx([foot / 2.0 + 0.75**0.5, 0.75**0.5 * foot - 0.5])


def test_the_fillet_of_an_acute_corner_reaches_beyond_the_shorter_strut() -> None:
    tip = 5.0 * np.array([math.cos(0.2), math.sin(0.2)])
    outline = strut_outline([[0.0, 0.0], [30.0, 0.0], tip], [[0, 1], [0, 2]], 1.0, 2.0)
    loop = outline.outer[0]
    arc = int(np.flatnonzero(loop.turns < 0.0)[0])
    assert loop.centres[arc, 1] == pytest.approx(2.5, rel=1e-13)
    assert np.linalg.norm(loop.centres[arc] - tip) == pytest.approx(2.5, rel=1e-13)
    assert np.abs(kinks(outline)).max() < 1e-12


@pytest.mark.parametrize(("kind", "seed"), LAYOUTS)
def test_areas_agree_with_ever_finer_polygons(kind: str, seed: int) -> None:
    layout, width, fillet, outline = random_outline(kind, seed, FILLETS[seed % 4])
    coarse, fine = (
        filled_by_polygons(layout, width, fillet, segments).area for segments in (8, 48)
    )
    # Their error falls as the square of the number of segments.
    assert abs(fine - outline.area) < max(0.1 * abs(coarse - outline.area), 5e-6 * fine)


@pytest.mark.parametrize("part", FILLETS)
@pytest.mark.parametrize(("kind", "seed"), LAYOUTS)
def test_every_edge_lies_on_a_strut_or_a_disc_that_touches_no_strut(
    kind: str, seed: int, part: float
) -> None:
    (positions, beams), width, fillet, outline = random_outline(kind, seed, part)
    tree = shapely.STRtree(shapely.linestrings(positions[beams]))

    def distance(points: NDArray[np.float64]) -> NDArray[np.float64]:
        return tree.query_nearest(shapely.points(points), all_matches=False, return_distance=True)[
            1
        ]

    for loop in outline.loops:
        line, tip, corner = loop.turns == 0.0, loop.turns > 0.0, loop.turns < 0.0
        middle = loop.points[line] + 0.5 * loop.chords[line]
        assert distance(middle) == pytest.approx(0.5 * width, rel=1e-7)
        assert distance(loop.points).min() > (0.5 - 1e-7) * width
        assert loop.radii[tip] == pytest.approx(0.5 * width, rel=1e-7)
        assert distance(loop.centres[tip]) == pytest.approx(0.0, abs=1e-7 * width)
        assert distance(loop.centres[corner]) == pytest.approx(0.5 * width + fillet, rel=1e-7)


@pytest.mark.parametrize("part", FILLETS)
@pytest.mark.parametrize(("kind", "seed"), LAYOUTS)
def test_outlines_are_simple_and_have_all_holes(kind: str, seed: int, part: float) -> None:
    layout, width, fillet, outline = random_outline(kind, seed, part)
    assert outline.polygon(1e-3 * width).is_valid
    assert outline.piece_count == 1
    assert outline.hole_count == expected_holes(*layout)
    assert all(loop.area > 0.0 for loop in outline.outer)
    assert all(loop.area < 0.0 for loop in outline.holes)
    turned = kinks(outline)
    if fillet > 0.0:
        # Edges left out may leave kinks, but not where lattices are this ordinary.
        assert np.abs(turned).max() < 1e-6
    else:
        assert turned.max() < 1e-6


@pytest.mark.parametrize("part", [0.0, 0.4])
@pytest.mark.parametrize("seed", range(4))
def test_moving_turning_and_mirroring_change_no_area(seed: int, part: float) -> None:
    (positions, beams), width, fillet, outline = random_outline("jittered", seed, part)
    turn = np.array([[math.cos(1.1), -math.sin(1.1)], [math.sin(1.1), math.cos(1.1)]])
    rng = np.random.default_rng(seed)
    away, mirror = np.array([300.0, -70.0]), np.array([-1.0, 1.0])
    for moved in (positions + away, positions @ turn.T, positions * mirror):
        other = strut_outline(moved, rng.permutation(beams)[:, ::-1], width, fillet)
        assert other.area == pytest.approx(outline.area, rel=1e-11)
        assert other.edge_count == outline.edge_count


@pytest.mark.parametrize("angle", [0.0, 0.3, 1.9])
@pytest.mark.parametrize("noise", [0.0, 1e-12, 1e-7])
def test_struts_along_one_line_leave_no_tiny_edges(angle: float, noise: float) -> None:
    """The shortest edges are arcs of 60 degrees and lines of millimetres."""
    rng = np.random.default_rng(7)
    corners, beams = TRIANGLE
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    shares = np.linspace(0.0, 1.0, 8)[:-1, None]
    sides = [corners[a] + shares * (corners[b] - corners[a]) for a, b in beams]
    ring = np.vstack(sides) @ turn.T
    ring += noise * rng.standard_normal(ring.shape)
    count = np.arange(len(ring))
    outline = strut_outline(ring, np.column_stack([count, np.roll(count, -1)]), 2.0, 0.5)
    assert min(loop.edge_lengths.min() for loop in outline.loops) > 0.5
    assert outline.area == pytest.approx(strut_outline(*TRIANGLE, 2.0, 0.5).area, rel=1e-6)
    if noise < 1e-10:
        assert outline.edge_count == strut_outline(*TRIANGLE, 2.0, 0.5).edge_count


def test_struts_that_overlap_or_come_twice_count_once() -> None:
    positions = np.array([[0.0, 0.0], [4.0, 3.0], [8.0, 6.0], [12.0, 9.0], [4.0, 3.0]])
    one = strut_outline(positions[[0, 3]], [[0, 1]], 1.0, 0.2)
    many = strut_outline(positions, [[0, 2], [1, 3], [0, 3], [3, 0], [4, 0]], 1.0, 0.2)
    assert many.area == pytest.approx(one.area, rel=1e-12)
    assert many.edge_count == 4


def test_a_strut_that_ends_on_another_joins_it() -> None:
    tee = [[0.0, 0.0], [20.0, 0.0], [8.0, 0.0], [8.0, 10.0]]
    outline = strut_outline(tee, [[0, 1], [2, 3]], 2.0, 1.0)
    assert outline.piece_count == 1
    assert outline.area == pytest.approx(
        60.0 - 1.0 + 1.5 * math.pi - 1.0 + 2.0 * (1.0 - math.pi / 4.0)
    )
    assert np.abs(kinks(outline)).max() < 1e-12


def test_beams_that_cross_bound_holes_of_their_own() -> None:
    corners = [[0.0, 0.0], [20.0, 0.0], [20.0, 20.0], [0.0, 20.0]]
    beams = [[0, 1], [1, 2], [2, 3], [3, 0], [0, 2], [1, 3]]
    outline = strut_outline(corners, beams, 1.0, 0.5)
    assert expected_holes(corners, beams) == 3
    assert outline.hole_count == 4
    inscribed = 10.0 * (2.0**0.5 - 1.0) - 0.5
    hole = (2.0**0.5 + 1.0) ** 2 * inscribed**2
    rounded = 1.0 + 2.0 * (2.0**0.5 + 1.0) - math.pi
    assert [loop.area for loop in outline.holes] == pytest.approx([-hole + rounded * 0.25] * 4)


def test_separate_pieces_have_outlines_of_their_own() -> None:
    corners, beams = TRIANGLE
    positions = np.vstack([corners, 0.2 * (corners - corners.mean(axis=0)) + corners.mean(axis=0)])
    outline = strut_outline(positions, np.vstack([beams, beams + 3]), 0.2, 0.1)
    assert (outline.piece_count, outline.hole_count) == (2, 2)
    assert outline.polygon().is_valid
    assert expected_holes(positions, np.vstack([beams, beams + 3])) == 2


def test_a_lattice_of_hundreds_of_struts_has_all_its_holes() -> None:
    layout = triangular(10, 12)
    outline = strut_outline(*layout, 2.0, 0.5)
    assert outline.hole_count == expected_holes(*layout) == 9 * 11 * 2
    hole = 27.0**0.5 * (10.0 / 12.0**0.5 - 1.0) ** 2 - (27.0**0.5 - math.pi) * 0.25
    assert -outline.area + outline.outer[0].area == pytest.approx(198 * hole, rel=1e-12)
