"""Struts stay inside the domain of their task."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import shapely
import trimesh

from bellcrank.errors import InvalidProblem
from bellcrank.model import Design, Problem, Specification
from bellcrank.refine import RefinementSettings, refine_design
from bellcrank.refine.domain import distances_inside
from bellcrank.refine.shape import shape_rows
from bellcrank.task import find_task, task_from_dict


def region() -> tuple[shapely.Polygon, list[np.ndarray]]:
    """Return an L with a round hole, and its rings."""
    corners = [(0, 0), (8, 0), (8, 3), (3, 3), (3, 8), (0, 8)]
    made = shapely.Polygon(corners).difference(shapely.Point(1.5, 1.5).buffer(0.8))
    return made, [np.array(made.exterior.coords)[:-1], np.array(made.interiors[0].coords)[:-1]]


def nearest(points: np.ndarray, boundary: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Return the distances of points from the nearest face, and their derivatives."""
    found = distances_inside(points, boundary, 0.5)
    _, first = np.unique(found.point, return_index=True)
    assert len(first) == len(points)
    return found.value[first], found.slopes[first]


def test_distances_are_those_of_shapely() -> None:
    polygon, boundary = region()
    points = np.random.default_rng(0).uniform(-1.0, 9.0, (400, 2))
    distance, slopes = nearest(points, boundary)
    for point, value in zip(points, distance, strict=True):
        at = shapely.Point(point)
        sign = 1.0 if polygon.contains(at) else -1.0
        assert value == pytest.approx(sign * polygon.boundary.distance(at), abs=1e-12)
    step = 1e-6
    for axis in range(2):
        moved = points.copy()
        moved[:, axis] += step
        rate = (nearest(moved, boundary)[0] - distance) / step
        smooth = np.abs(rate - slopes[:, axis]) < 1e-4
        assert smooth.mean() > 0.98


def box_with_a_ball() -> tuple[trimesh.Trimesh, trimesh.Trimesh]:
    return (
        trimesh.creation.box((8.0, 6.0, 5.0)),
        trimesh.creation.icosphere(subdivisions=2, radius=1.7),
    )


def test_distances_from_surfaces_are_those_of_another_program() -> None:
    """The ball is convex: a point is inside if it is below the planes of all its triangles."""
    box, ball = box_with_a_ball()
    points = np.random.default_rng(0).uniform(-5.0, 5.0, (300, 3))
    surfaces = [np.asarray(box.triangles), np.asarray(ball.triangles)]
    distance, slopes = nearest(points, surfaces)
    triangles = np.concatenate(surfaces)
    below = ((points[:, None] - ball.triangles[:, 0]) * ball.face_normals).sum(axis=2)
    inside = (np.abs(points) < [4.0, 3.0, 2.5]).all(axis=1) & (below.max(axis=1) > 0.0)
    assert np.array_equal(distance > 0.0, inside)
    for point, value in zip(points, distance, strict=True):
        every = np.tile(point, (len(triangles), 1))
        feet = trimesh.triangles.closest_point(triangles, every)
        least = np.linalg.norm(feet - point, axis=1).min()
        assert abs(value) == pytest.approx(least, abs=1e-12)
    step = 1e-6
    for axis in range(3):
        moved = points.copy()
        moved[:, axis] += step
        rate = (nearest(moved, surfaces)[0] - distance) / step
        assert (np.abs(rate - slopes[:, axis]) < 1e-4).mean() > 0.98


def domain_values(problem: Problem, mask: np.ndarray) -> np.ndarray:
    rows = shape_rows(problem, mask, np.inf)
    return rows.values[[name == "domain" for name in rows.names]]


def block() -> Problem:
    """Return a block of octets with a hole in its middle."""
    data = {
        "name": "block",
        "domain": {
            "size": ["44.5 mm", "30.3 mm", "44.5 mm"],
            "keep_out": [{"sphere": [22, 15, 22], "radius": 7}],
        },
        "supports": [{"at": {"face": "bottom"}}],
        "cases": [
            {
                "inputs": [
                    {"at": {"point": [43, 15, 43]}, "direction": "down", "displacement": 2},
                ],
                "outputs": [
                    {"at": {"point": [1, 15, 43]}, "direction": "left", "gain": "maximise"},
                ],
            }
        ],
    }  # fmt: skip
    return task_from_dict(data).problem


def test_all_faces_of_a_corner_count_once() -> None:
    """Each face of a cube consists of two triangles, and has points on their common edge."""
    cube = [np.asarray(trimesh.creation.box((8.0, 8.0, 8.0)).triangles)]
    points = np.array([[3.5, 3.5, 3.5], [3.5, 3.0, 0.0], [3.5, 0.0, 0.0], [4.5, 3.9, 0.0]])
    found = distances_inside(points, cube, 2.0)
    values = [np.sort(found.value[found.point == k]).tolist() for k in range(len(points))]
    assert values == [[0.5, 0.5, 0.5], [0.5, 1.0], [0.5], [-0.5]]
    corner = found.slopes[found.point == 0]
    assert np.array_equal(np.sort(corner, axis=0), [[-1, -1, -1], [0, 0, 0], [0, 0, 0]])


@pytest.mark.parametrize("name", ["gripper", "block"])
def test_the_derivatives_are_those_of_the_constraints(name: str) -> None:
    task = find_task(name)
    problem = block() if task is None else task.problem
    rng = np.random.default_rng(1)
    lattice = problem.lattice
    positions = lattice.positions + 0.05 * rng.standard_normal(lattice.positions.shape)
    widths = problem.beam_widths * rng.uniform(1.0, 1.5, lattice.beam_count)
    change = 1e-6 * rng.standard_normal(positions.shape)
    wider = 1e-6 * rng.standard_normal(widths.shape)
    here, there = (
        shape_rows(problem.with_geometry(*each), problem.initial, np.inf)
        for each in ((positions, widths), (positions + change, widths + wider))
    )
    after = {
        key: value
        for key, name, value in zip(there.keys, there.names, there.values, strict=True)
        if name == "domain"
    }
    linear = np.einsum("rnd,nd->r", here.positions, change) + here.widths @ wider
    found = [
        after[key] - value - rate
        for key, name, value, rate in zip(here.keys, here.names, here.values, linear, strict=True)
        if name == "domain" and key in after
    ]
    assert len(found) > 50
    assert np.abs(found).max() < 1e-9


def test_a_refined_part_stays_inside_its_domain() -> None:
    """The bound on nodes and the larger gain would lead the struts outside otherwise."""
    task = find_task("lever")
    assert task is not None
    problem = task.problem
    wanted = problem.specification
    assert wanted is not None
    settings = RefinementSettings(evaluations=25)
    outside = {}
    for domain in (wanted.domain, ()):
        own = replace(problem, specification=replace(wanted, domain=domain))
        found = refine_design(Design(own, problem.initial), settings)
        back = replace(found.design.problem, specification=wanted)
        outside[bool(domain)] = domain_values(back, problem.initial).max()
    assert outside[True] < 0.01
    assert outside[False] > 0.02


def test_a_refined_part_stays_inside_its_domain_in_space() -> None:
    problem = block()
    assert domain_values(problem, problem.initial).max() < 1e-9
    wanted = problem.specification
    assert wanted is not None
    outside = {}
    for domain in (wanted.domain, ()):
        own = replace(problem, specification=replace(wanted, domain=domain))
        found = refine_design(Design(own, problem.initial), RefinementSettings(evaluations=10))
        back = replace(found.design.problem, specification=wanted)
        outside[bool(domain)] = domain_values(back, problem.initial).max()
    assert outside[True] < 0.01
    assert outside[False] > 0.05


def test_struts_at_held_ends_on_the_boundary_are_not_wider_than_the_section() -> None:
    task = find_task("lever")
    assert task is not None
    problem = task.problem
    assert domain_values(problem, problem.initial).max() < 1e-9
    lattice = problem.lattice
    wide = problem.with_geometry(lattice.positions, 1.5 * problem.beam_widths)
    rows = shape_rows(wide, wide.initial, np.inf)
    at_ends = [
        (lattice.beams[key[0], key[1] // 4], value)
        for key, name, value in zip(rows.keys, rows.names, rows.values, strict=True)
        if name == "domain" and key[1] in {0, 4}
    ]
    held = problem.special_nodes_of_all_cases
    at_held_ends = [value for node, value in at_ends if node in held]
    assert max(at_held_ends) == pytest.approx(0.5 - 0.5 / 1.5)
    assert max(value for _, value in at_ends) == pytest.approx(0.5 - 0.5 / 1.5)


def test_rings_have_three_points() -> None:
    with pytest.raises(InvalidProblem, match="domain: expected rings of at least 3 points"):
        Specification(domain=[[[0.0, 0.0], [1.0, 0.0]]])
    with pytest.raises(InvalidProblem, match=r"triangles with corners \[x, y, z\]"):
        Specification(domain=[[[0.0, 0.0, 0.0]] * 4])
