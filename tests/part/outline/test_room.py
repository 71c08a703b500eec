"""How much room holes leave, and what is said where they leave too little."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bellcrank.errors import InvalidSettings
from bellcrank.part.outline import expected_holes, room_for_fillet, strut_outline
from tests.part.outline.layouts import random_layout, triangular

SQUARE = ([[0, 0], [20, 0], [20, 20], [0, 20]], [[0, 1], [1, 2], [2, 3], [3, 0]])
# A ring with a waist of 4 mm between (10, 8) and (10, 12).
WAIST = (
    [[0, 0], [10, 8], [20, 0], [20, 20], [10, 12], [0, 20]],
    [[0, 1], [1, 2], [2, 3], [3, 4], [4, 5], [5, 0]],
)


@pytest.mark.parametrize("width", [0.1, 2.0, 5.0])
def test_room_in_a_triangular_lattice_is_what_its_inscribed_circles_leave(width: float) -> None:
    room = room_for_fillet(*triangular(6, 5), width)
    assert room == pytest.approx(10.0 / 12.0**0.5 - 0.5 * width, abs=1e-3)


def test_room_ends_where_a_hole_splits_at_its_waist() -> None:
    assert room_for_fillet(*WAIST, width=1.0) == pytest.approx(1.5, abs=1e-3)


def test_room_ends_where_a_dead_end_meets_what_is_opposite() -> None:
    positions = [*SQUARE[0], [12, 0], [12, 14]]
    beams = [[0, 4], [4, 1], *SQUARE[1][1:], [4, 5]]
    assert room_for_fillet(positions, beams, width=1.0) == pytest.approx(2.5, abs=1e-3)


def test_room_ends_where_the_mouth_of_a_bay_closes() -> None:
    bay = [[3, 0], [0, 4], [0, 12], [20, 12], [20, 4], [17, 0]]
    inside = room_for_fillet(bay, [[k, k + 1] for k in range(5)], width=1.0)
    assert inside == pytest.approx(7.0 - 0.5, abs=1e-3)


def test_room_ends_where_separate_pieces_join() -> None:
    pair = [[0, 0], [10, 0], [11, 3], [11, 20]]
    gap = 10.0**0.5
    assert room_for_fillet(pair, [[0, 1], [2, 3]], 1.0) == pytest.approx(gap / 2 - 0.5, abs=1e-3)


@pytest.mark.parametrize("kind", ["regular", "jittered", "scattered"])
@pytest.mark.parametrize("seed", range(8))
def test_all_the_room_can_be_used_and_no_more(kind: str, seed: int) -> None:
    layout = random_layout(kind, seed)
    width = 0.5 * min(room_for_fillet(*layout, width=1e-3), 4.0)
    room = room_for_fillet(*layout, width)
    if room == math.inf:
        assert strut_outline(*layout, width, 100.0).hole_count == expected_holes(*layout) == 0
        return
    outline = strut_outline(*layout, width, room)
    assert outline.hole_count == expected_holes(*layout)
    assert outline.polygon(1e-4 * width).is_valid
    with pytest.raises(InvalidSettings, match=r"fillet: a radius of .* would (close|join)"):
        strut_outline(*layout, width, room + 2e-3 * (room + width))


def test_struts_that_close_holes_are_refused_with_the_greatest_width() -> None:
    expected = "width: struts 7 mm wide would close 40 of 40 holes; choose at most 5.77 mm"
    with pytest.raises(InvalidSettings, match=expected):
        strut_outline(*triangular(6, 5), width=7.0, fillet=0.0)
    with pytest.raises(InvalidSettings, match=expected):
        room_for_fillet(*triangular(6, 5), width=7.0)


def test_struts_that_touch_are_refused_with_the_place() -> None:
    expected = r"width: struts 4.5 mm wide would join struts .* first at \(10, 10\)"
    with pytest.raises(InvalidSettings, match=expected):
        strut_outline(*WAIST, width=4.5, fillet=0.0)


def test_fillets_that_close_or_split_holes_are_refused_with_the_greatest_radius() -> None:
    expected = "fillet: a radius of 2 mm would close 40 of 40 holes; at most 1.88 mm leaves room"
    with pytest.raises(InvalidSettings, match=expected):
        strut_outline(*triangular(6, 5), width=2.0, fillet=2.0)
    expected = r"fillet: a radius of 2 mm would join .* \(10, 10\) mm; at most 1.49 mm leaves room"
    with pytest.raises(InvalidSettings, match=expected):
        strut_outline(*WAIST, width=1.0, fillet=2.0)


def test_holes_may_close_where_that_is_asked_for() -> None:
    positions = [*SQUARE[0], [24, 10]]
    beams = [*SQUARE[1], [1, 4], [4, 2]]
    outline = strut_outline(positions, beams, width=4.0, fillet=1.0, keep_holes=False)
    assert (outline.piece_count, outline.hole_count) == (1, 1)
    split = strut_outline(*WAIST, width=4.5, fillet=0.0, keep_holes=False)
    assert split.hole_count == 2
    with pytest.raises(InvalidSettings, match=r"fillet: .* would join"):
        strut_outline(*WAIST, width=1.0, fillet=2.0, keep_holes=False)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"width": 0.0}, "width: expected a length above 0 mm, got 0.0"),
        ({"width": math.nan}, "width: expected a length above 0 mm, got nan"),
        ({"width": math.inf}, "width: expected a length above 0 mm, got inf"),
        ({"fillet": -0.1}, "fillet: expected a radius of 0 mm or more, got -0.1"),
        ({"fillet": math.nan}, "fillet: expected a radius of 0 mm or more, got nan"),
        ({"beams": []}, "beams: expected one or more, got none"),
        ({"beams": [[0, 1, 2]]}, r"beams: expected shape \(M, 2\), got shape \(1, 3\)"),
        ({"beams": [[0.0, 1.0]]}, "beams: expected integers, got values of type float64"),
        ({"beams": [[0, 1], [1, 4]]}, r"beams\[1\]: names node 4, but nodes are 0 to 3"),
        ({"beams": [[0, 1], [2, 2]]}, r"beams\[1\]: has no length, nodes 2 and 2"),
        ({"positions": [[0, 0, 0]]}, r"positions: expected shape \(N, 2\), .* \(1, 3\)"),
        ({"positions": [[0, 0], [math.inf, 0]]}, r"positions\[1\]\[0\]: expected a finite number"),
        ({"positions": [["a", 0]]}, "positions: expected numbers"),
    ],
)
def test_what_makes_no_sense_is_refused(change: dict, message: str) -> None:
    given = {"positions": SQUARE[0], "beams": SQUARE[1], "width": 1.0, "fillet": 0.5} | change
    with pytest.raises(InvalidSettings, match=message):
        strut_outline(**given)


def test_nodes_in_one_place_are_one_node() -> None:
    positions = np.array([*SQUARE[0], [20.0, 0.0]], dtype=np.float64)
    beams = [[0, 1], [4, 2], [2, 3], [3, 0]]
    assert expected_holes(positions, beams) == 1
    assert strut_outline(positions, beams, 1.0, 0.5).hole_count == 1
    with pytest.raises(InvalidSettings, match=r"beams\[4\]: .* nodes 1 and 4"):
        strut_outline(positions, [*beams, [1, 4]], 1.0, 0.5)
