"""Polygons with the area of arcs, and prisms over them."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely

from bellcrank.errors import InvalidSettings
from bellcrank.export import Solid, extruded, whole_layers
from bellcrank.export.flattening import polygons_of
from bellcrank.part.outline import Loop, Outline, room_for_fillet, strut_outline
from tests.part.outline.layouts import random_layout, triangular

TRIANGLE = ([[0.0, 0.0], [12.0, 0.0], [6.0, 108.0**0.5]], [[0, 1], [1, 2], [2, 0]])


def shoelace(ring: np.ndarray) -> float:
    x, y = (ring - ring[0]).T
    return 0.5 * float(x @ np.roll(y, -1) - np.roll(x, -1) @ y)


@pytest.mark.parametrize("turn", [1e-9, 1e-3, 0.3, 2.0, math.pi])
@pytest.mark.parametrize("sagitta", [1e-4, 0.01, 1.0, 100.0])
def test_polygons_have_the_area_of_arcs_whatever_their_angle(turn: float, sagitta: float) -> None:
    """A lens of two arcs on a chord of 2 mm, or a square with an arc for a side."""
    bulge = math.tan(0.25 * turn)
    corners = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]]
    for sign in (1.0, -1.0):
        if sign < 0.0 and sagitta > 0.1:
            continue  # what bends inwards must not be cruder than what it bends into
        outline = Outline((Loop(corners, [sign * bulge, 0.0, 0.0, 0.0]),))
        (ring,) = polygons_of(outline, sagitta)
        assert shoelace(ring) == pytest.approx(outline.area, rel=1e-7)


@pytest.mark.parametrize("sagitta", [1e-3, 0.01, 0.1])
def test_no_point_of_a_polygon_is_farther_from_its_arc_than_the_sagitta(sagitta: float) -> None:
    outline = strut_outline(*TRIANGLE, width=2.0, fillet=0.7)
    exact = shapely.union_all([shapely.LinearRing(loop.flattened(1e-6)) for loop in outline.loops])
    for ring in polygons_of(outline, sagitta):
        chords = shapely.LinearRing(ring)
        fine = shapely.get_coordinates(shapely.segmentize(chords, 0.01))
        assert shapely.distance(shapely.points(fine), exact).max() <= 1.001 * sagitta


def test_polygons_meet_lines_with_smaller_kinks_than_chords_in_the_circle_do() -> None:
    outline = strut_outline([[0.0, 0.0], [9.0, 0.0]], [[0, 1]], width=2.0, fillet=0.0)
    (ring,) = polygons_of(outline, 0.02)
    side = np.roll(ring, -1, axis=0) - ring
    angle = np.arctan2(side[:, 1], side[:, 0])
    kinks = (np.roll(angle, -1) - angle) % (2.0 * math.pi)
    # All turn the same way: nothing sticks out anywhere.
    assert kinks.max() < math.pi
    assert kinks.sum() == pytest.approx(2.0 * math.pi)
    long_sides = np.linalg.norm(side, axis=1) > 5.0
    assert (kinks[long_sides] < 0.5 * kinks.max()).all()


@pytest.mark.parametrize("kind", ["regular", "jittered", "scattered"])
@pytest.mark.parametrize("seed", range(4))
def test_polygons_are_finer_where_surfaces_almost_touch(kind: str, seed: int) -> None:
    layout = random_layout(kind, seed)
    width = 0.9 * min(2.0 * room_for_fillet(*layout, width=1e-3), 4.0)
    outline = strut_outline(*layout, width, 0.999 * min(room_for_fillet(*layout, width), 6.0))
    rings = polygons_of(outline, 2.0)
    polygon = shapely.Polygon(rings[0], rings[1:])
    assert polygon.is_valid
    assert len(rings) == 1 + outline.hole_count
    assert polygon.area == pytest.approx(outline.area, rel=1e-8)


def test_corners_lie_where_numbers_of_single_precision_hold_them() -> None:
    outline = strut_outline(*triangular(12, 9), 2.0, 0.5).translated([-20.2, 1.0 / 3.0])
    on_bed = extruded(outline, 5.12).on_bed()
    flat = on_bed.vertices[:, :2]
    assert (flat.astype(np.float32) == flat).all()
    assert on_bed.vertices.min(axis=0).tolist() == [0.0, 0.0, 0.0]


def test_lines_along_the_grid_do_not_add_up_their_rounding() -> None:
    """In a regular lattice all lines of a row are rounded alike."""
    outline = strut_outline(*triangular(9, 10, side=10.0), 0.31, 0.02)
    assert extruded(outline, 1.0).volume == pytest.approx(outline.area, rel=1e-9)


def test_separate_pieces_and_pieces_within_holes_become_one_closed_surface() -> None:
    corners = np.array(TRIANGLE[0])
    inner = 0.2 * (corners - corners.mean(axis=0)) + corners.mean(axis=0)
    positions = np.vstack([corners, inner, corners + np.array([20.0, 0.0])])
    beams = np.vstack([np.array(TRIANGLE[1]) + k for k in (0, 3, 6)])
    outline = strut_outline(positions, beams, 0.3, 0.1)
    solid = extruded(outline, 2.0)
    assert (outline.piece_count, outline.hole_count, solid.euler_number) == (3, 3, 0)
    assert solid.volume == pytest.approx(2.0 * outline.area, rel=1e-8)


def test_surfaces_are_accepted_by_a_kernel_of_solids() -> None:
    import manifold3d

    outline = strut_outline(*triangular(6, 5), 2.0, 0.5)
    solid = extruded(outline, 4.8)
    mesh = manifold3d.Mesh64(solid.vertices.copy(), solid.triangles.astype(np.uint64))
    body = manifold3d.Manifold(mesh)
    assert body.status() == manifold3d.Error.NoError
    assert body.genus() == outline.hole_count == 40
    assert body.volume() == pytest.approx(4.8 * outline.area, rel=1e-8)


def test_moving_a_part_far_away_changes_its_volume_by_nothing() -> None:
    outline = strut_outline(*TRIANGLE, width=2.0, fillet=0.5)
    far = extruded(outline.translated([5e5, -3e5]), 2.0)
    assert far.volume == pytest.approx(2.0 * outline.area, rel=1e-8)


@pytest.mark.parametrize(
    ("thickness", "layer", "expected"),
    [(5.0, 0.32, 5.12), (4.9, 0.32, 4.8), (0.32, 0.32, 0.32), (5.0, 0.2, 5.0), (0.47, 0.32, 0.32)],
)
def test_parts_are_whole_layers_thick(thickness: float, layer: float, expected: float) -> None:
    assert whole_layers(thickness, layer) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(
    ("thickness", "layer", "message"),
    [
        (0.3, 0.32, "thickness: 0.3 mm is less than one layer of 0.32 mm; choose a thicker part"),
        (0.0, 0.32, "thickness: expected a length above 0 mm, got 0.0"),
        (5.0, math.nan, "layer: expected a length above 0 mm, got nan"),
    ],
)
def test_less_than_one_layer_is_refused(thickness: float, layer: float, message: str) -> None:
    with pytest.raises(InvalidSettings, match=message):
        whole_layers(thickness, layer)


def test_what_cannot_be_extruded_is_refused() -> None:
    outline = strut_outline(*TRIANGLE, width=2.0, fillet=0.5)
    with pytest.raises(InvalidSettings, match="thickness: expected a length above 0 mm"):
        extruded(outline, -1.0)
    with pytest.raises(InvalidSettings, match=r"sagitta: expected a length above 0 mm"):
        extruded(outline, 1.0, 0.0)
    with pytest.raises(InvalidSettings, match=r"vertices: expected shape \(n, 3\)"):
        Solid(np.zeros((3, 2)), np.zeros((1, 3), dtype=np.int64))


def test_surfaces_that_touch_are_refused_with_the_place() -> None:
    square = Loop([[0, 0], [4, 0], [4, 4], [0, 4]], [0, 0, 0, 0])
    hole = Loop([[1, 1], [1, 3], [4 - 1e-9, 2]], [0, 0, 0])
    with pytest.raises(InvalidSettings, match=r"surfaces .* touch at \(4, [0-9.]+\) mm"):
        extruded(Outline((square,), (hole,)), 1.0)
