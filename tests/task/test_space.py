"""Tasks in space: domains, shapes, regions of nodes, directions."""

from __future__ import annotations

import copy
import json
import re
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import meshio
import numpy as np
import pytest
import trimesh

from bellcrank.errors import InvalidFile, InvalidProblem, InvalidSettings
from bellcrank.mechanics import VERIFICATION_INCREMENT, FrameEvaluator, Status
from bellcrank.model import read_problem, unpack_mask, write_problem
from bellcrank.search import read_settings
from bellcrank.task import read_task, task_from_dict
from bellcrank.task.schema import DomainSection, Shape
from bellcrank.task.space import body_of
from bellcrank.task.surfaces import Surface, read_surface
from bellcrank.workflows import complete_design, start_design

if TYPE_CHECKING:
    from bellcrank.task import Task

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "tasks.md").read_text(encoding="utf-8")
TASK: dict[str, Any] = {
    "name": "orthogonal",
    "domain": {"size": ["46 mm", "46 mm", "46 mm"]},
    "supports": [{"at": {"face": "bottom"}}],
    "cases": [
        {
            "inputs": [
                {"at": {"point": [44, 23, 45], "count": 3}, "direction": "down", "displacement": 3},
            ],
            "outputs": [
                {"at": {"point": [2, 23, 45], "count": 3}, "direction": "left", "gain": "maximise"},
            ],
        }
    ],
}


def task(**domain: Any) -> Task:
    data = copy.deepcopy(TASK)
    if domain:
        data["domain"] = {**data["domain"], **domain}
    return task_from_dict({key: value for key, value in data.items() if value is not None})


def struts(made: Task) -> np.ndarray:
    """Return (M, 2, 3) the ends of the struts, mm."""
    lattice = made.problem.lattice
    return lattice.positions[lattice.beams] * made.part.scale


def test_a_size_of_three_lengths_is_filled_with_octets() -> None:
    made = task()
    lattice = made.problem.lattice
    assert lattice.dimension == 3
    assert lattice.rest_length == pytest.approx(1.0)
    ends = struts(made)
    # The struts, with their radius of 1 mm, lie inside.
    assert ends.min() >= 1.0
    assert ends.max() <= 45.0
    assert made.problem.section.shape == "round"
    assert np.array_equal(made.problem.input.direction[0], [0, 0, -1])
    assert np.array_equal(made.problem.output.direction[0], [-1, 0, 0])
    assert FrameEvaluator(made.problem).evaluate(made.problem.initial).status is Status.CONVERGED


@pytest.mark.parametrize(
    "cells",
    [
        "octet", "cubic", "body-centred", "kelvin", {"kind": "octet", "up": [1, 1, 1]},
        {"kind": "cubic", "diagonals": "faces"}, {"kind": "octet", "envelope": "cylinder"},
        {"kind": "displaced-delaunay-space", "seed": 3},
    ],
)  # fmt: skip
def test_a_domain_is_filled_with_other_cells(cells: Any) -> None:
    data = copy.deepcopy(TASK)
    data["domain"]["cells"] = cells
    data["cases"][0]["inputs"][0]["at"] = {"box": [0, 0, 30, 46, 23, 46]}
    data["cases"][0]["outputs"][0]["at"] = {"box": [0, 24, 30, 46, 46, 46]}
    made = task_from_dict(data)
    assert made.problem.lattice.beam_count > 20
    assert FrameEvaluator(made.problem).evaluate(made.problem.initial).status is Status.CONVERGED


def test_no_strut_is_in_a_hole() -> None:
    made = task(
        holes=[{"sphere": [23, 23, 23], "radius": 9}], keep_out=[{"box": [0, 0, 0, 9, 9, 46]}]
    )
    first, second = struts(made).transpose(1, 0, 2)
    for share in np.linspace(0.0, 1.0, 21):
        points = first + share * (second - first)
        assert np.linalg.norm(points - 23.0, axis=1).min() > 9.9  # the radius of a strut is 1 mm
        assert not (points[:, :2] < 9.0).all(axis=1).any()
    assert made.problem.lattice.beam_count < task().problem.lattice.beam_count


def volume_of(triangles: np.ndarray) -> float:
    return float(np.linalg.det(triangles).sum()) / 6.0


def test_the_boundary_of_a_domain_is_that_of_its_box_without_holes() -> None:
    made = task(
        holes=[{"sphere": [23, 23, 46], "radius": 9}],
        keep_out=[{"box": [0, 0, 0, 9, 9, 46]}, {"cylinder": [40, 40], "radius": 3}],
    )
    (triangles,) = made.problem.specification.domain
    half_ball, column = 2.0 / 3.0 * np.pi * 0.9**3, np.pi * 0.3**2 * 4.6
    wanted = 4.6**3 - half_ball - 0.9**2 * 4.6 - column
    assert volume_of(triangles) == pytest.approx(wanted, rel=2e-3)
    assert volume_of(triangles) > wanted  # holes are polyhedra within the round ones
    (plain,) = task().problem.specification.domain
    assert volume_of(plain) == pytest.approx(4.6**3)


@pytest.mark.parametrize("turned", [False, True])
def test_the_boundary_of_an_outline_is_its_surface(tmp_path: Path, turned: bool) -> None:
    """Fine triangles are joined; a surface whose triangles are turned is one, too."""
    ball = trimesh.creation.icosphere(subdivisions=4, radius=25.0)
    ball.apply_translation([30.0, 20.0, 25.0])
    faces = ball.faces[:, ::-1] if turned else ball.faces
    meshio.write(tmp_path / "ball.stl", meshio.Mesh(ball.vertices, [("triangle", faces)]))
    body = body_of(DomainSection(outline="ball.stl"), tmp_path)
    triangles = body.boundary(10.0, 0.1)
    assert volume_of(triangles) == pytest.approx(ball.volume / 1000.0, rel=0.01)
    assert len(triangles) < len(ball.faces)
    holes = {"hole": Shape(sphere=[30, 20, 25], radius=5)}
    whole, cut = (each.boundary(10.0, 0.01) for each in (body, replace(body, holes=holes)))
    assert volume_of(whole) - volume_of(cut) == pytest.approx(4 / 3 * np.pi * 0.5**3, rel=0.02)


def test_the_boundary_is_written_and_read(tmp_path: Path) -> None:
    problem = task(holes=[{"sphere": [23, 23, 46], "radius": 9}]).problem
    write_problem(problem, tmp_path / "problem.json")
    again = read_problem(tmp_path / "problem.json")
    (before,), (after,) = problem.specification.domain, again.specification.domain
    assert np.array_equal(before, after)


def test_only_beams_between_two_ports_stay() -> None:
    problem = task().problem
    kept = np.setdiff1d(np.arange(problem.lattice.beam_count), problem.designable)
    ports = np.isin(problem.lattice.beams, problem.special_nodes_of_all_cases)
    assert np.array_equal(kept, np.flatnonzero(ports.all(axis=1)))


def test_a_region_may_leave_out_the_nodes_of_a_shape() -> None:
    data = copy.deepcopy(TASK)
    data["supports"] = [{"at": {"face": "bottom"}}]
    whole = task_from_dict(data).problem
    data["supports"][0]["at"]["without"] = {"cylinder": [23, 23], "radius": "15 mm"}
    ring = task_from_dict(data).problem
    away = np.linalg.norm(10.0 * whole.lattice.positions[:, :2] - 23.0, axis=1)
    held = whole.supports.fixed
    assert np.array_equal(ring.supports.fixed, held[away[held] > 15.0])
    assert 0 < len(ring.supports.fixed) < len(held)


def test_beams_of_solid_regions_stay() -> None:
    made = task(solid=[{"box": [0, 0, 30, 46, 46, 46]}])
    problem = made.problem
    kept = np.setdiff1d(np.arange(problem.lattice.beam_count), problem.designable)
    inside = (struts(made)[..., 2] >= 30.0).all(axis=1)
    assert inside.any()
    assert np.isin(np.flatnonzero(inside), kept).all()
    free = task().problem.designable
    assert np.array_equal(problem.designable, free[~inside[free]])


def test_a_surface_of_triangles_is_filled(tmp_path: Path) -> None:
    ball = trimesh.creation.icosphere(subdivisions=3, radius=25.0)
    ball.apply_translation([30.0, 20.0, 25.0])
    meshio.write(tmp_path / "ball.stl", meshio.Mesh(ball.vertices, [("triangle", ball.faces)]))
    data = copy.deepcopy(TASK)
    data["domain"] = {"outline": "ball.stl"}
    data["supports"] = [{"at": {"sphere": [30, 20, 2], "radius": 15}}]
    data["cases"][0]["inputs"][0]["at"] = {"point": [48, 20, 25]}
    data["cases"][0]["outputs"][0]["at"] = {"point": [12, 20, 25]}
    (tmp_path / "task.json").write_text(json.dumps(data))
    made = read_task(tmp_path / "task.json")
    distance = np.linalg.norm(struts(made) - [30.0, 20.0, 25.0], axis=2)
    assert distance.max() <= 24.0
    assert made.problem.lattice.node_count > 40


def test_points_in_a_surface_are_those_of_another_program() -> None:
    torus = trimesh.creation.torus(10.0, 4.0, major_sections=24, minor_sections=12)
    points = np.random.default_rng(0).uniform(-15.0, 15.0, (3000, 3))
    points[:, 2] *= 0.3
    around = np.hypot(np.hypot(points[:, 0], points[:, 1]) - 10.0, points[:, 2])
    clear = np.abs(around - 4.0) > 0.4  # the torus is a polyhedron
    found = Surface(np.asarray(torus.triangles)).contains(points)
    assert np.array_equal(found[clear], around[clear] < 4.0)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("none.stl", None, "no such file"),
        ("words.stl", b"not a surface", "not a valid STL file|expected a closed surface"),
        ("open.stl", "open", "expected a closed surface"),
        ("part.obj", b"", "expected an STL file"),
    ],
)
def test_what_is_no_closed_surface_is_refused(
    tmp_path: Path, name: str, content: Any, message: str
) -> None:
    if content == "open":
        box = trimesh.creation.box((10, 10, 10))
        meshio.write(tmp_path / name, meshio.Mesh(box.vertices, [("triangle", box.faces[:-1])]))
    elif content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(InvalidFile, match=message):
        read_surface(tmp_path / name)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"domain.size": [46, 46, 0]}, r"domain.size: expected lengths above 0, got \[46"),
        ({"domain.size": [46, 46, 2]}, "domain: no strut of 2 mm fits into it"),
        ({"domain.size": [46]}, "domain.size: expected two lengths, or three in space"),
        ({"domain.cells": "diamond"}, "domain.cells: expected one of octet, .* got 'diamond'"),
        ({"domain.cells": {"kind": "octet", "size": [1, 1, 1]}}, "domain.cells.size: expected"),
        ({"domain.cells": {"kind": "octet", "upp": [0, 0, 1]}}, "domain.cells.*upp"),
        ({"domain.holes": [{"circle": [5, 5], "radius": 3}]}, "expected one of sphere, cylinder"),
        (
            {"domain.holes": [{"sphere": [5, 5, 5]}]},
            r"domain.holes\[0\]: expected sphere or cylinder and radius together",
        ),
        ({"domain.holes": [{"sphere": [5, 5], "radius": 3}]}, r"sphere: expected \[x, y, z\]"),
        ({"domain.holes": [{"box": [0, 0, 9, 9]}]}, r"box: expected \[x_min, y_min, z_min"),
        ({"domain.holes": [{"box": [0, 0, 0, 46, 46, 46]}]}, "domain: no strut of the lattice"),
        ({"domain.solid": [{"sphere": [0, 0, 0], "radius": 1}]}, "no beam lies in this region"),
        ({"supports.0.at": {"edge": "bottom"}}, "supports.*: expected one of point, face, nodes"),
        ({"supports.0.at": {"point": [1, 1]}}, r"point: expected \[x, y, z\], got \[1.0, 1.0\]"),
        (
            {"supports.0.at": {"sphere": [0, 0, 90], "radius": 2}},
            "no node lies in this sphere; the lattice extends from x = ",
        ),
        (
            {"supports.0.at": {"face": "bottom", "without": {"box": [0, 0, 0, 46, 46, 46]}}},
            "supports.*without: all nodes of the region lie in this shape",
        ),
        (
            {"supports.0.at": {"face": "bottom", "without": {"circle": [5, 5], "radius": 3}}},
            "supports.*without: expected one of sphere, cylinder",
        ),
        ({"cases.0.inputs.0.direction": [0, 1]}, r"direction: expected .* a vector \[x, y, z\]"),
        ({"cases.0.inputs.0.direction": "30 deg"}, r"direction: expected right, left, back"),
        ({"cases.0.outputs.0.path": {"arc": [20, 60]}}, "path.arc: expected points in space"),
        ({"cases.0.outputs.0.path": {"points": [[0, 0], [5, 0]]}}, r"points \[x, y, z\]"),
    ],
)  # fmt: skip
def test_wrong_tasks_in_space_give_one_clear_error(changes: dict[str, Any], message: str) -> None:
    data = copy.deepcopy(TASK)
    for path, value in changes.items():
        *folders, last = (int(key) if key.isdigit() else key for key in path.split("."))
        place: Any = data
        for key in folders:
            place = place[key]
        place[last] = value
    with pytest.raises((InvalidFile, InvalidProblem), match=message) as caught:
        task_from_dict(data)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"supports": [{"at": {"face": "bottom"}}]}, "expected one of point, edge, nodes, circle"),
        (
            {"supports": [{"at": {"edge": "bottom"}, "hold": "z"}]},
            "hold: expected 'all', 'x' or 'y'",
        ),
        (
            {"domain": {"size": [62, 54], "cells": "octet"}},
            "domain.cells: expected a domain in space",
        ),
    ],
)
def test_what_is_of_space_is_refused_in_the_plane(changes: dict[str, Any], message: str) -> None:
    data: dict[str, Any] = {
        "name": "slider",
        "domain": {"size": [62, 54]},
        "supports": [{"at": {"edge": "bottom"}}],
        "cases": [
            {
                "inputs": [{"at": {"point": [51, 53]}, "direction": "down", "displacement": 3}],
                "outputs": [{"at": {"point": [11, 53]}, "direction": "left", "gain": "maximise"}],
            }
        ],
    }
    with pytest.raises(InvalidProblem, match=message):
        task_from_dict({**data, **changes})


def column_of_the_page(**limits: Any) -> Task:
    (text,) = [
        each
        for each in re.findall(r"```toml\n(.*?)```", PAGE, flags=re.DOTALL)
        if 'name = "twist-column"' in each
    ]
    data = tomllib.loads(text)
    data["limits"].update(limits)
    return task_from_dict(data)


def test_the_column_of_the_record_turns_as_the_page_says() -> None:
    problem = column_of_the_page().problem
    record = json.loads((DOCS / "space" / "runs.json").read_text())["runs"]["tasks twist-column"]
    moved = problem.with_geometry(np.array(record["positions"]), np.array(record["widths"]))
    mask = unpack_mask(record["mask"], problem.lattice.beam_count)
    evaluator = FrameEvaluator(moved, elements=8)
    assert evaluator.evaluate(mask, VERIFICATION_INCREMENT).status is Status.CONVERGED
    found = evaluator.output_motion()
    turn = float(np.linalg.norm(found.rotation))
    assert f"the plate turns by {turn:.1f} degrees by frames" in PAGE
    assert f"by {record['objective_in_solid']:.1f} degrees in the solid" in PAGE
    assert found.off_axis < 1e-6  # positions of the record are rounded


@pytest.mark.slow
def test_a_short_search_finds_a_column_that_turns(tmp_path: Path) -> None:
    """That of the tutorial, which bounds the strain by the limit of the material alone."""
    made = column_of_the_page(strain=True)
    settings = read_settings({"steps": 300, "chains": 1, "seed": 0})
    folder = start_design(made.problem, settings, tmp_path / "run", made.part, refine=False)
    report = complete_design(folder)
    assert report is not None
    (figures,) = report.part_figures
    assert figures["rotation_deg"] == pytest.approx(46.0, abs=0.5)
    assert figures["off_axis"] < 1e-9
    assert all(item.met for item in dict(report.items)["frames, 8 elements"])
    assert (folder.path / "motion.png").stat().st_size > 50_000


@pytest.mark.parametrize(
    ("supports", "changes"),
    [
        # Rollers on a plane leave two translations and a rotation free, those on two planes a
        # translation; an input of one node holds no rotation.
        ([{"at": {"face": "bottom"}, "hold": "z"}], {"displacement": 3, "count": 1}),
        ([{"at": {"face": "bottom"}, "hold": "z"}], {"force": "0.1 N"}),
        (
            [{"at": {"face": "bottom"}, "hold": "z"}, {"at": {"face": "left"}, "hold": "x"}],
            {"force": "0.1 N"},
        ),
        ([{"at": {"point": [9, 2, 2]}, "hold": "z"}], {"force": "0.1 N"}),
    ],
)
def test_supports_that_leave_a_motion_free_are_refused(
    tmp_path: Path, supports: Any, changes: dict[str, Any]
) -> None:
    data = copy.deepcopy(TASK)
    data["supports"] = supports
    given = data["cases"][0]["inputs"][0]
    given["at"]["count"] = changes.pop("count", 3)
    del given["displacement"]
    given.update(changes)
    made = task_from_dict(data)
    with pytest.raises(InvalidSettings, match="not supported against rigid-body motion"):
        start_design(made.problem, read_settings({"steps": 10}), tmp_path / "run", made.part)


@pytest.mark.parametrize(
    ("domain", "message"),
    [
        ({"problem": "crane"}, "expected one of point, edge, .* in the plane, got face"),
        ({"size": ["46 mm", "46 mm"]}, "in the plane, got face"),
        (
            {"size": ["46 mm", "46 mm"], "cells": "octet"},
            "domain.cells: expected a domain in space",
        ),
        ({"outline": "part.dxf"}, "part.dxf: no such file"),
    ],
)
def test_a_domain_in_the_plane_for_a_task_in_space_is_refused(domain: Any, message: str) -> None:
    data = copy.deepcopy(TASK)
    data["domain"] = domain
    with pytest.raises((InvalidFile, InvalidProblem), match=message):
        task_from_dict(data)
