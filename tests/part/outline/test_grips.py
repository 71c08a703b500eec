"""Plates, screw holes and pointers: exact changes of an outline."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely

from bellcrank.errors import InvalidSettings
from bellcrank.model import find_problem, human_design
from bellcrank.part import PartSpec
from bellcrank.part.outline import Loop, Outline, room_for_fillet, strut_outline
from bellcrank.part.outline.grips import filled, with_pointer
from bellcrank.part.outline.outer_rows import with_outer_rows
from bellcrank.part.outline.screws import clearance, drilled, screw_positions
from tests.part.outline.layouts import random_layout, triangular

SHEET = Outline((Loop([[0, 0], [40, 0], [40, 12], [0, 12]], [0, 0, 0, 0]),))
CORNERS = [[0, 0], [40, 0], [40, 12], [0, 12]]


def holes_by_triangles(positions: np.ndarray, beams: np.ndarray, nodes: list[int]) -> int:
    """Triangles of struts whose corners are all among some nodes."""
    present = {tuple(sorted(beam)) for beam in beams.tolist()}
    inside = [beam for beam in present if set(beam) <= set(nodes)]
    return sum((a, c) in present and (b, c) in present for a, b in inside for c in nodes if c > b)


@pytest.mark.parametrize("fillet", [0.0, 0.5, 1.87])
def test_filled_blocks_lose_just_the_holes_between_their_nodes(fillet: float) -> None:
    layout = triangular(6, 5)
    outline = strut_outline(*layout, 2.0, fillet)
    rng = np.random.default_rng(1)
    for count in (3, 8, 20):
        nodes = rng.choice(30, count, replace=False).tolist()
        plate = filled(outline, *layout, nodes)
        assert outline.hole_count - plate.hole_count == holes_by_triangles(*layout, nodes)
        assert plate.outer == outline.outer
        assert set(plate.holes) <= set(outline.holes)


def test_all_nodes_fill_all_holes() -> None:
    for kind in ("regular", "jittered", "scattered"):
        layout = random_layout(kind, 3)
        outline = strut_outline(*layout, 0.1, 0.2 * min(room_for_fillet(*layout, 0.1), 5.0))
        everything = filled(outline, *layout, range(len(layout[0])))
        assert (everything.hole_count, everything.piece_count) == (0, 1)
        assert everything.area == pytest.approx(outline.outer[0].area)


def test_a_hole_stays_if_one_strut_that_ends_in_it_leads_elsewhere() -> None:
    positions = [[0, 0], [20, 0], [20, 20], [0, 20], [10, 8]]
    beams = [[0, 1], [1, 2], [2, 3], [3, 0], [0, 4]]
    outline = strut_outline(positions, beams, 1.0, 0.5)
    assert filled(outline, positions, beams, [0, 1, 2, 3]).hole_count == 1
    assert filled(outline, positions, beams, [0, 1, 2, 3, 4]).hole_count == 0


def test_what_lies_in_a_filled_hole_becomes_part_of_the_plate() -> None:
    square = np.array([[0.0, 0.0], [20.0, 0.0], [20.0, 20.0], [0.0, 20.0]])
    positions = np.vstack([square, 0.4 * square + 6.0])
    beams = np.array([[k + 4 * ring, (k + 1) % 4 + 4 * ring] for ring in (0, 1) for k in range(4)])
    outline = strut_outline(positions, beams, 1.0, 0.2)
    assert (outline.piece_count, outline.hole_count) == (2, 2)
    inner = filled(outline, positions, beams, [4, 5, 6, 7])
    assert (inner.piece_count, inner.hole_count) == (2, 1)
    ring = outline.holes[0]
    outer = filled(outline, positions, beams, [0, 1, 2, 3])
    assert (outer.piece_count, outer.hole_count) == (1, 0), ring.area
    assert outer.area == pytest.approx(outline.outer[0].area)


def test_supports_of_the_crane_become_a_plate_for_screws() -> None:
    design = human_design("crane")
    assert design is not None
    part = PartSpec().of(design)
    nodes = design.problem.supports.nodes
    plate = filled(part.outline(), part.positions, part.struts, nodes)
    assert plate.hole_count < part.outline().hole_count
    places = screw_positions(plate, part.positions, nodes, 2, 3.2, 2.0)
    assert np.linalg.norm(places[1] - places[0]) > 50.0
    screwed = drilled(plate, places, 3.2, 2.0)
    assert screwed.hole_count == plate.hole_count + 2
    assert screwed.area == pytest.approx(plate.area - 2.0 * math.pi * 1.6**2)
    assert screwed.polygon(1e-3).is_valid


def test_a_row_of_nodes_at_the_boundary_gets_a_plate_outside_of_the_part() -> None:
    positions, beams = triangular(6, 4)
    bottom = np.flatnonzero(np.asarray(positions)[:, 1] < 1e-9).tolist()
    whole, struts, block = with_outer_rows(positions, beams, bottom, depth=6.0, reach=18.0)
    added = whole[len(positions) :]
    assert added[:, 1] == pytest.approx(np.full(len(bottom), -6.0))
    assert sorted(added[:, 0]) == pytest.approx(sorted(np.asarray(positions)[bottom, 0]))
    width = np.full(len(struts), 2.0)
    # A wide strut rounds its node; the plate is closed there, too.
    width[
        [k for k, pair in enumerate(struts) if (pair[0] in bottom) != (pair[1] in bottom)][:3]
    ] = 5
    outline = strut_outline(whole, struts, width, 0.2)
    plate = filled(outline, whole, struts, block, width)
    holes = strut_outline(positions, beams, 2.0, 0.2).hole_count
    assert plate.hole_count == holes
    low, high = whole[block].min(axis=0), whole[block].max(axis=0)
    grid = np.stack(np.meshgrid(*np.linspace(low, high, 40).T), axis=-1).reshape(-1, 2)
    assert (clearance(plate, grid) > 0.5).all()


def test_each_row_gets_its_own_plate() -> None:
    positions, beams = triangular(8, 4)
    x, y = np.asarray(positions).T
    bottom = np.flatnonzero(y < 1e-9)
    left, right = bottom[np.argsort(x[bottom])[:3]], bottom[np.argsort(x[bottom])[-2:]]
    top = np.flatnonzero(y > y.max() - 1e-9)[:2]
    nodes = [*left, *right, *top]
    whole, struts, block = with_outer_rows(positions, beams, nodes, depth=6.0, reach=18.0)
    added = whole[len(positions) :]
    assert np.array_equal(block, [*nodes, *range(len(positions), len(whole))])
    assert sorted(added[:, 1].round(6)) == pytest.approx([-6.0] * 5 + [y.max() + 6.0] * 2)
    outline = strut_outline(whole, struts, 2.0, 0.2)
    plates = filled(outline, whole, struts, block)
    holes = strut_outline(positions, beams, 2.0, 0.2).hole_count
    assert (plates.piece_count, plates.hole_count) == (1, holes)


def test_nodes_inside_of_a_part_or_in_several_rows_get_no_row() -> None:
    positions, beams = triangular(6, 4)
    heights = np.unique(np.round(np.asarray(positions)[:, 1], 6))
    middle = np.flatnonzero(np.isclose(np.asarray(positions)[:, 1], heights[2]))
    two = np.flatnonzero(np.asarray(positions)[:, 1] < heights[1] + 1.0)
    for nodes in (middle, two, [0]):
        whole, struts, block = with_outer_rows(positions, beams, nodes, depth=6.0, reach=18.0)
        assert (len(whole), len(struts), len(block)) == (len(positions), len(beams), len(nodes))


def test_drilled_holes_are_circles_that_run_clockwise() -> None:
    (hole,) = drilled(SHEET, [[20, 6]], 3.0, 2.0).holes
    assert hole.turns == pytest.approx([-math.pi, -math.pi])
    assert hole.radii == pytest.approx([1.5, 1.5])
    assert hole.centres == pytest.approx(np.array([[20.0, 6.0], [20.0, 6.0]]))
    assert hole.area == pytest.approx(-math.pi * 2.25)


@pytest.mark.parametrize(
    ("centres", "diameter", "wall", "message"),
    [
        ([[20, 6], [2, 6]], 3.0, 1.5, r"centres\[1\]: .* \(2, 6\) mm .* a wall of 0.5 mm"),
        ([[20, 6], [24, 6]], 3.0, 1.5, r"centres\[0\]: .* a wall of 1 mm, less than 1.5 mm"),
        ([[50, 6]], 3.0, 1.5, r"centres\[0\]: .* leave no wall, less than 1.5 mm; move it"),
        ([[20, 6]], 13.0, 0.0, r"would leave no wall, less than 0 mm"),
        ([[20, 6]], 0.0, 1.0, "diameter: expected a length above 0 mm, got 0.0"),
        ([[20, 6]], 1.0, math.nan, "wall: expected a length of 0 mm or more, got nan"),
    ],
)
def test_holes_with_too_thin_a_wall_are_refused_with_their_place(
    centres: list, diameter: float, wall: float, message: str
) -> None:
    with pytest.raises(InvalidSettings, match=message):
        drilled(SHEET, centres, diameter, wall)


@pytest.mark.parametrize("count", [1, 2, 3, 4])
def test_screws_are_far_apart_and_well_inside(count: int) -> None:
    places = screw_positions(SHEET, CORNERS, [0, 1, 2, 3], count, 3.0, 1.5)
    assert places.shape == (count, 2)
    assert clearance(SHEET, places).min() >= 4.5 - 1e-9
    apart = [math.dist(a, b) for k, a in enumerate(places) for b in places[:k]]
    assert min(apart, default=31.0) > {1: 30.0, 2: 30.0, 3: 14.0, 4: 9.9}[count]
    assert drilled(SHEET, places, 3.0, 1.5).hole_count == count
    assert np.ptp(places[:, 1]) < 1e-9  # in one row


def test_screws_stay_in_the_plate_that_they_are_for() -> None:
    layout = triangular(8, 3)
    outline = strut_outline(*layout, 2.0, 0.5)
    left = [k for k, (x, _) in enumerate(layout[0]) if x < 22.0]
    right = [k for k, (x, _) in enumerate(layout[0]) if x > 44.0]
    plates = filled(filled(outline, *layout, left), *layout, right)
    assert screw_positions(plates, layout[0], left, 2, 3.0, 1.0)[:, 0].max() < 25.0
    assert screw_positions(plates, layout[0], right, 2, 3.0, 1.0)[:, 0].min() > 40.0


def test_plates_without_room_for_screws_are_refused() -> None:
    with pytest.raises(InvalidSettings, match=r"no room for 2 screw holes of 8 mm .* 12 mm"):
        screw_positions(SHEET, CORNERS, [0, 1, 2, 3], 2, 8.0, 3.0)
    with pytest.raises(InvalidSettings, match="no room for 30 screw holes"):
        screw_positions(SHEET, CORNERS, [0, 1, 2, 3], 30, 5.0, 2.0)
    with pytest.raises(InvalidSettings, match="count: expected at least 1 screw, got 0"):
        screw_positions(SHEET, CORNERS, [0, 1, 2, 3], 0, 3.0, 2.0)


@pytest.mark.parametrize("seed", range(3))
def test_clearance_agrees_with_fine_polygons(seed: int) -> None:
    layout = random_layout("jittered", seed)
    outline = strut_outline(*layout, 2.0, 0.4 * min(room_for_fillet(*layout, 2.0), 4.0))
    points = np.random.default_rng(seed).uniform(-3.0, 40.0, (400, 2))
    fine = outline.polygon(1e-6)
    expected = shapely.distance(shapely.boundary(fine), shapely.points(points))
    inside = shapely.contains_xy(fine, *points.T)
    found = clearance(outline, points)
    assert found == pytest.approx(np.where(inside, expected, -expected), abs=2e-6)


def test_a_pointer_is_a_strut_along_the_wanted_motion() -> None:
    crane = find_problem("crane")
    part = PartSpec().of(crane.full_design())
    node, direction = int(crane.output.nodes[0]), crane.output.direction[0]
    positions, beams = with_pointer(part.positions, part.struts, node, direction, 15.0)
    outline = strut_outline(positions, beams, 2.0, 0.5)
    assert outline.piece_count == 1
    assert outline.hole_count == part.outline().hole_count
    assert positions[-1] - positions[node] == pytest.approx([-15.0, 0.0])
    assert beams[-1].tolist() == [node, len(positions) - 1]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"node": 9}, r"nodes\[0\]: got node 9, but nodes are 0 to 3"),
        ({"direction": [0, 0]}, "direction: expected two numbers, not both 0"),
        ({"direction": [0, 1, 2]}, "direction: expected two numbers"),
        ({"length": 0.0}, "length: expected a length above 0 mm, got 0.0"),
    ],
)
def test_pointers_that_point_nowhere_are_refused(change: dict, message: str) -> None:
    given = {"node": 1, "direction": [0.0, 1.0], "length": 5.0} | change
    with pytest.raises(InvalidSettings, match=message):
        with_pointer(CORNERS, [[0, 1]], **given)


def test_nodes_that_do_not_exist_are_refused() -> None:
    outline = strut_outline(*triangular(3, 3), 2.0, 0.5)
    with pytest.raises(InvalidSettings, match=r"nodes\[1\]: got node 9, but nodes are 0 to 8"):
        filled(outline, *triangular(3, 3), [0, 9])
    with pytest.raises(InvalidSettings, match="nodes: expected one or more numbers of nodes"):
        filled(outline, *triangular(3, 3), [])


@pytest.mark.parametrize("inclined", [False, True])
def test_the_left_side_of_a_triangular_lattice_gets_a_straight_plate(inclined: bool) -> None:
    """Its nodes are alternately half a spacing inside."""
    rows = np.arange(6)
    side = np.column_stack([5.0 * (rows % 2), 8.66 * rows])
    positions = np.vstack([side, [[20.0, 8.66], [20.0, 30.0]]])
    if inclined:
        turn = np.array([[0.8, -0.6], [0.6, 0.8]])
        positions = positions @ turn.T
    beams = [[k, k + 1] for k in range(5)] + [[1, 6], [3, 7], [6, 7]]
    places, pairs, block = with_outer_rows(positions, beams, rows, depth=6.0, reach=18.0)
    added = places[len(positions) :]
    if inclined:
        added = added @ turn
    assert added == pytest.approx(np.column_stack([np.full(6, -6.0), 8.66 * rows]))
    assert block.tolist() == [*range(6), *range(8, 14)]
    before = strut_outline(positions, beams, 2.0, 0.2)
    outline = strut_outline(places, pairs, 2.0, 0.2)
    assert filled(before, positions, beams, rows, 2.0).hole_count == before.hole_count == 1
    assert filled(outline, places, pairs, block, 2.0).hole_count == 1
