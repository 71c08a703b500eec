"""Outlines of struts of different widths, against polygons and distances to the centre lines."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest
import shapely

from bellcrank.errors import InvalidSettings
from bellcrank.part.outline import (
    Outline,
    expected_holes,
    room_for_fillet,
    strut_outline,
)
from tests.part.outline.layouts import filled_by_polygons, random_layout, triangular

LAYOUTS = [(kind, seed) for kind in ("regular", "jittered", "scattered") for seed in range(6)]
FILLETS = [0.0, 0.02, 0.4, 0.97]


@cache
def random_outline(kind: str, seed: int, part: float) -> tuple[np.ndarray, float, Outline]:
    """Widths that differ by factors of up to 2.5, and the fillet as a part of the room there is."""
    layout, rng = random_layout(kind, seed), np.random.default_rng(seed)
    widths = rng.uniform(0.2, 0.5, len(layout[1])) * min(room_for_fillet(*layout, 1e-3), 4.0)
    fillet = part * min(room_for_fillet(*layout, widths), 6.0)
    return widths, fillet, strut_outline(*layout, widths, fillet)


@pytest.mark.parametrize("fillet", [0.0, 0.3])
def test_a_wide_and_a_narrow_strut_in_line(fillet: float) -> None:
    positions, beams = [[0.0, 0.0], [10.0, 0.0], [20.0, 0.0]], [[0, 1], [1, 2]]
    outline = strut_outline(positions, beams, [4.0, 2.0], fillet)
    # Two rectangles, a disc of radius 2 and half a disc of radius 1; the narrow rectangle begins
    # within the disc.
    both = math.sqrt(3.0) + 4.0 * math.asin(0.5)
    bare = 10.0 * 4.0 + 4.0 * math.pi + 10.0 * 2.0 + 0.5 * math.pi - both
    if fillet == 0.0:
        assert outline.area == pytest.approx(bare, rel=1e-9)
    else:
        assert bare < outline.area < bare + 2.0 * fillet**2
    assert outline.piece_count == 1
    assert outline.hole_count == 0


@pytest.mark.parametrize(("kind", "seed"), LAYOUTS)
def test_areas_agree_with_ever_finer_polygons(kind: str, seed: int) -> None:
    widths, fillet, outline = random_outline(kind, seed, FILLETS[seed % 4])
    coarse, fine = (
        filled_by_polygons(random_layout(kind, seed), widths, fillet, segments).area
        for segments in (8, 48)
    )
    assert abs(fine - outline.area) < max(0.1 * abs(coarse - outline.area), 5e-6 * fine)


@pytest.mark.parametrize("part", FILLETS)
@pytest.mark.parametrize(("kind", "seed"), LAYOUTS)
def test_every_edge_lies_on_a_strut_or_a_disc_that_touches_no_strut(
    kind: str, seed: int, part: float
) -> None:
    (positions, beams), (widths, fillet, outline) = (
        random_layout(kind, seed),
        random_outline(kind, seed, part),
    )
    lines = shapely.linestrings(np.asarray(positions)[np.asarray(beams)])

    def distance(points: np.ndarray) -> np.ndarray:
        away = shapely.distance(shapely.points(points)[:, None], lines[None])
        return np.asarray((away - 0.5 * widths).min(axis=1))

    for loop in outline.loops:
        line, corner = loop.turns == 0.0, loop.turns < 0.0
        middle = loop.points[line] + 0.5 * loop.chords[line]
        assert distance(middle) == pytest.approx(0.0, abs=1e-6)
        assert distance(loop.points).min() > -1e-6
        if corner.any():
            assert distance(loop.centres[corner]) == pytest.approx(fillet, rel=1e-6, abs=1e-7)


@pytest.mark.parametrize("part", FILLETS)
@pytest.mark.parametrize(("kind", "seed"), LAYOUTS)
def test_outlines_are_simple_and_have_all_holes(kind: str, seed: int, part: float) -> None:
    _, _, outline = random_outline(kind, seed, part)
    assert outline.polygon(1e-3).is_valid
    assert outline.piece_count == 1
    assert outline.hole_count == expected_holes(*random_layout(kind, seed))


# In scattered layouts the corner between the round end of a wide strut and a narrow strut is cut
# off and filled at almost the same radius.
@pytest.mark.parametrize(("kind", "seed"), [each for each in LAYOUTS if each[0] != "scattered"])
def test_a_fillet_larger_than_the_room_is_refused(kind: str, seed: int) -> None:
    layout = random_layout(kind, seed)
    widths, _, _ = random_outline(kind, seed, 0.0)
    room = room_for_fillet(*layout, widths)
    if math.isinf(room):
        return
    closed = filled_by_polygons(layout, widths, room * 1.01 + 1e-3, 48)
    topology = (
        len(shapely.get_parts(closed)),
        shapely.get_num_interior_rings(shapely.get_parts(closed)).sum(),
    )
    assert topology != (1, expected_holes(*layout))
    with pytest.raises(InvalidSettings, match="fillet: a radius of"):
        strut_outline(*layout, widths, room * 1.01 + 1e-3)


def test_equal_widths_give_the_outline_of_one_width() -> None:
    layout = triangular(6, 5)
    one, many = (
        strut_outline(*layout, 2.0, 0.3),
        strut_outline(*layout, [2.0] * len(layout[1]), 0.3),
    )
    assert one.area == many.area
    assert one.edge_count == many.edge_count


def test_the_wider_of_two_struts_that_overlap_counts() -> None:
    outline = strut_outline([[0.0, 0.0], [10.0, 0.0]], [[0, 1], [1, 0]], [1.0, 2.0], 0.0)
    assert outline.area == pytest.approx(20.0 + math.pi, rel=1e-9)


def test_wrong_widths_are_refused() -> None:
    layout = triangular(3, 3)
    with pytest.raises(InvalidSettings, match="width: expected one, or"):
        strut_outline(*layout, [1.0, 2.0], 0.3)
    with pytest.raises(InvalidSettings, match="width: expected a length above 0 mm"):
        strut_outline(*layout, [0.0] + [1.0] * (len(layout[1]) - 1), 0.3)
    wide = np.ones(len(layout[1]))
    wide[3] = 20.0
    with pytest.raises(InvalidSettings, match="width: struts of these widths"):
        strut_outline(*layout, wide, 0.1)


@pytest.mark.parametrize("kink", [0.0, 1e-12, 1e-9, 1e-7, 2e-6, 6e-6, 2e-5, 1e-4, 1e-2])
def test_wide_struts_that_are_almost_in_line_have_an_outline(kink: float) -> None:
    """Arcs that turn by less than a limit are left out, whatever the radius of the joint."""
    positions = [[0.0, 0.0], [60.0, 30.0 * kink], [120.0, 0.0], [60.0, 90.0]]
    beams = [[0, 1], [1, 2], [2, 3], [3, 0]]
    widths = [3.6, 3.6, 2.0, 2.0]
    room = room_for_fillet(positions, beams, widths)
    outline = strut_outline(positions, beams, widths, 1.0)
    assert (outline.piece_count, outline.hole_count) == (1, 1)
    same = room_for_fillet(
        [positions[0], positions[2], positions[3]], [[0, 1], [1, 2], [2, 0]], widths[1:]
    )
    assert room == pytest.approx(same, rel=1e-2)
    assert outline.area == pytest.approx(
        filled_by_polygons((np.array(positions), np.array(beams)), np.array(widths), 1.0, 200).area,
        rel=1e-4,
    )


def test_widths_that_differ_by_rounding_are_equal() -> None:
    """At a joint of a refined inverter, one of two wide struts is wider in the last digit."""
    positions = np.array([
        [45.172370626502854, 31.555278800030955], [55.45029637656474, 32.17949192431123],
        [54.925171158104796, 40.56053914842613], [63.6843534259442, 39.5487061696909],
        [44.79004344119589, 45.0], [56.55670204119589, 45.0],
    ])  # fmt: skip
    beams = np.array([[0, 2], [1, 2], [2, 3], [2, 4], [2, 5]])
    widths = np.array([3.233298591669949, 3.2332985916699495, 2.4, 2.4, 2.4])
    outline = strut_outline(positions, beams, widths, 0.0)
    assert (outline.piece_count, outline.hole_count) == (1, 0)
    assert outline.area == pytest.approx(
        filled_by_polygons((positions, beams), widths, 0.0, 100).area, rel=1e-3
    )
    narrow = strut_outline(positions, beams, widths - 2.4 + 3e-3, 0.0)
    assert (narrow.piece_count, narrow.hole_count) == (1, 0)
