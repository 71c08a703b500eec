"""Frame problems, in the plane and in space."""

from __future__ import annotations

import json
import pickle
from dataclasses import replace

import numpy as np
import pytest

from bellcrank.errors import InvalidFile, InvalidProblem
from bellcrank.mechanics import SpringEvaluator
from bellcrank.model import (
    Elasticity,
    Input,
    Lattice,
    Output,
    Section,
    Supports,
    find_problem,
    problem_from_dict,
    problem_to_dict,
    read_problem,
    regions,
    require_plane,
    write_problem,
)
from bellcrank.web.task_files import to_toml
from tests.model.test_bad_files import MISSING, assert_one_sentence, spoil
from tests.reference3d import NAMES, SAME_KEYS, read_reference

RECTANGLE = Section(0.2, 0.5)

# ---- frame problems


def test_a_problem_with_a_section_is_a_frame_problem_with_a_default_material():
    crane = find_problem("crane")
    assert crane.section is crane.material is None
    frame = replace(crane, section=RECTANGLE)
    assert frame.material == Elasticity(young=1.0, poisson=0.48)
    assert replace(frame, section=None, material=None).hash == crane.hash


def test_the_hash_of_a_frame_problem_depends_on_section_and_material():
    crane = find_problem("crane")
    frames = [
        replace(crane, section=section, material=material)
        for section in (None, RECTANGLE, Section(0.2, 0.6), Section.round(0.2))
        for material in (None, Elasticity(1.0, 0.48), Elasticity(2.0, 0.48), Elasticity(1.0, 0.3))
        if section is not None or material is None
    ]
    # The default material is one of the given ones.
    assert len({frame.hash for frame in frames}) == 1 + 3 * 3


def test_the_hashes_of_bundled_problems_are_those_of_the_first_version():
    hashes = {
        "crane": "2982fde7c76bac8e1329038c3c23d65642af11622709024c3373645137116ed7",
        "anti-parallel": "b46a358ee1c478130d0eb92d30c7a07adf6b68d8fe5849e11c5469391dabb93f",
        "pliers": "d7b10e8d08a6ec3123aeb8af5ddb2eae8acc933b689c0dae9058e097ef1516f7",
        "scaling-8": "89c7f55c10f98dd3755f4f5b4cab221d2bae8c6e3e8a758a3fbe4ad8e0725d11",
    }
    assert {name: find_problem(name).hash for name in hashes} == hashes


def test_a_planar_file_names_no_third_coordinate(small):
    written = problem_to_dict(problem_from_dict(small))
    assert written == small
    assert "fixed_z" not in written["supports"]


@pytest.mark.parametrize("section", [RECTANGLE, Section.round(0.3)])
@pytest.mark.parametrize("suffix", [".json", ".toml"])
def test_frame_problems_in_the_plane_survive_writing_and_reading(tmp_path, small, section, suffix):
    problem = replace(
        problem_from_dict(small), section=section, material=Elasticity(young=2.5, poisson=0.3)
    )
    path = tmp_path / f"frame{suffix}"
    data = problem_to_dict(problem)
    path.write_text(json.dumps(data) if suffix == ".json" else to_toml(data))
    again = read_problem(path)
    assert again.hash == problem.hash
    assert (again.section, again.material) == (section, Elasticity(2.5, 0.3))


# ---- space


@pytest.mark.parametrize("suffix", [".json", ".toml"])
def test_problems_in_space_survive_writing_and_reading(tmp_path, space, suffix):
    problem = problem_from_dict(space)
    assert problem_to_dict(problem) == space
    path = tmp_path / f"space{suffix}"
    if suffix == ".json":
        write_problem(problem, path)
    else:
        path.write_text(to_toml(problem_to_dict(problem)))
    again = read_problem(path)
    assert again.hash == problem.hash
    assert problem_to_dict(again) == space
    assert pickle.loads(pickle.dumps(problem)).hash == problem.hash


def test_rollers_in_space_hold_one_or_two_coordinates(space):
    problem = problem_from_dict(space)
    assert problem.supports.fixed.tolist() == [0]
    assert [nodes.tolist() for nodes in problem.supports.rollers(3)] == [[1], [1, 2], [2]]
    assert problem.supports.nodes.tolist() == [0, 1, 2]


def test_a_node_held_in_three_coordinates_is_fixed_in_space(space):
    space["supports"] = {"fixed": [0], "fixed_x": [1, 2], "fixed_y": [2, 1], "fixed_z": [2]}
    supports = problem_from_dict(space).supports
    assert supports.fixed.tolist() == [0, 2]
    assert [nodes.tolist() for nodes in supports.rollers(3)] == [[1], [1], []]


def test_beams_at_rollers_in_space_are_not_designable_by_default(space):
    del space["designable"]
    space["supports"] = {"fixed": [0, 1], "fixed_z": [2]}
    touched = [[3, 4], [4, 5], [5, 3]]
    beams = problem_from_dict(space).lattice.beams
    assert beams[problem_from_dict(space).designable].tolist() == touched


def test_one_direction_serves_all_nodes_in_space():
    assert Output([4, 2], [0.0, 0.6, 0.8]).direction.tolist() == [[0.0, 0.6, 0.8]] * 2
    each = Input([4, 2], [[0, 0, 1], [0, 1, 0]], "force", 1.0).direction
    assert each.tolist() == [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0]]


def test_regions_in_space_have_three_coordinates(space):
    lattice = problem_from_dict(space).lattice
    assert regions["box"](lattice, [0, 0, 0.9, 1, 0.5, 1.1]).tolist() == [3, 4]
    assert regions["nearest"](lattice, [0.9, 0.2, 2.1]).tolist() == [7]
    space["supports"] = {"fixed": [{"box": [0, 0, 0, 1, 1, 0]}]}
    assert problem_from_dict(space).supports.fixed.tolist() == [0, 1, 2]


@pytest.mark.parametrize(
    ("kind", "value", "message"),
    [
        (
            "row",
            0,
            "row: expected a lattice in the plane; in space use layer, box, sphere or nearest",
        ),
        ("rows", [0], "row: expected a lattice in the plane"),
        ("box", [0, 0, 1, 1], r"box: expected \[x_min, y_min, z_min, x_max, y_max, z_max\]"),
        ("box", [0, 0, 1, 1, 1, 0], r"box: expected \[x_min, y_min, z_min, x_max, y_max, z_max\]"),
        ("nearest", [0, 0], r"nearest: expected a point \[x, y, z\], got \[0, 0\]"),
        ("nearest", [0, 0, 9], "x = 0 to 1 and y = 0 to 1 and z = 0 to 2"),
    ],
)
def test_regions_that_cannot_be_in_space_are_refused(space, kind, value, message):
    lattice = problem_from_dict(space).lattice
    with pytest.raises(InvalidProblem, match=message):
        regions[kind](lattice, value)


# ---- bad input


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("section.diameter", MISSING, "key 'section.diameter' is missing (section.shape is 'round"),
        ("section.shape", "rectangle", "key 'section.width' is missing (section.shape is 'rectan"),
        ("section.width", 0.1, "unknown key 'section.width' (section.shape is 'round', whose keys"),
        ("section.shape", "oval", "section.shape: expected 'rectangle' or 'round', got 'oval'"),
        ("section.shape", MISSING, "key 'section.shape' is missing"),
        ("section.size", 1.0, "unknown key 'section.size'; known here: shape, width, thickness"),
        ("section.diameter", float("nan"), "section.diameter: expected a finite number, got nan"),
        ("section.diameter", "0.2", "section.diameter: expected a valid number, got '0.2'"),
        ("section", 0.2, "section: expected a table, got 0.2"),
        ("material.young", MISSING, "key 'material.young' is missing"),
        ("material.density", 1.0, "unknown key 'material.density'; known here: young, poisson"),
        ("supports.fixed_w", [1], "unknown key 'supports.fixed_w'; known here: fixed, fixed_x"),
    ],
)
def test_files_of_frames_that_break_the_schema_are_refused(write, space, key, value, message):
    spoil(space, key, value)
    assert_one_sentence(InvalidFile, message, read_problem, write(space))


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("section.diameter", -0.2, "section.diameter: expected a number greater than 0, got -0.2"),
        ("section.diameter", 1.0, "section.diameter: beams 1 wide are not slender where beams[0]"),
        ("section", {"shape": "rectangle", "width": 0.1, "thickness": 0.1}, "section.shape: exp"),
        ("section", MISSING, "material: given without section"),
        ("material.young", 0.0, "material.young: expected a number greater than 0, got 0.0"),
        ("material.poisson", 0.6, "material.poisson: expected a ratio greater than -1"),
        ("input.direction", [0, -1], "input.direction: expected vectors of 3 coordinates like th"),
        ("output.direction", [1, 0], "output.direction: expected vectors of 3 coordinates like t"),
        ("input.direction", [0, 1, 1], "input.direction: expected unit vectors, got [0.0, 1.0, 1"),
        ("input.amount", 2.5, "input.amount: 2.5 lattice units are"),
        ("supports.fixed_z", [6], "input.nodes: node 6 is also in supports.fixed_z"),
        ("supports.fixed_z", [9], "supports.fixed_z[0]: expected a node from 0 to 8, got 9"),
        ("supports.fixed", [{"row": 0}], "supports.fixed[0].row: expected a lattice in the plane"),
        ("positions.2", [0.0, 1.0], "positions[2]: expected 3 numbers as in positions[0]"),
        ("positions.3", [0.0, 0.0, 0.0], "beams[0]: has no length, nodes 0 and 3 coincide"),
        ("beams.17", [3, 0], "beams[17]: [3, 0] is the same beam as beams[0]"),
    ],
)
def test_files_of_impossible_frames_are_refused(write, space, key, value, message):
    spoil(space, key, value)
    assert_one_sentence(InvalidProblem, message, read_problem, write(space))


def test_positions_in_space_need_a_section(write, space):
    del space["section"], space["material"]
    message = "positions: positions in space need a section, because the spring model is planar"
    assert_one_sentence(InvalidProblem, message, read_problem, write(space))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"material": Elasticity(1.0, 0.3)}, "material: given without section"),
        ({"section": 0.2}, "section: expected a Section, got 0.2"),
        ({"section": RECTANGLE, "material": 1.0}, "material: expected an Elasticity, got 1.0"),
        ({"section": Section(1.5, 0.5)}, "section.width: beams 1.5 wide are not slender where"),
        (
            {"input": Input([5], [0, 0, -1], "force", 1.0)},
            r"input.direction: expected vectors of 2 coordinates .* got \[0.0, 0.0, -1.0\]",
        ),
        ({"output": Output([4], [0, 0, 1])}, "output.direction: expected vectors of 2 coord"),
        ({"supports": Supports(fixed_z=[0])}, "supports.fixed_z: expected no nodes in the plane"),
    ],
)
def test_impossible_frames_in_the_plane_are_refused(small, change, message):
    with pytest.raises(InvalidProblem, match=message):
        replace(problem_from_dict(small), **change)


def test_a_beam_that_is_never_present_may_be_shorter_than_wide(small):
    small["initial"] = "7f"  # without the first beam, which no search may change
    problem = problem_from_dict(small)
    positions = problem.lattice.positions.copy()
    positions[1] = [0.1, 0.0]
    problem = replace(problem, lattice=Lattice(positions, problem.lattice.beams))
    assert replace(problem, section=RECTANGLE).lattice.rest_length[0] < RECTANGLE.width
    with pytest.raises(InvalidProblem, match=r"beams 0.2 wide are not slender where beams\[0\]"):
        replace(problem, initial=np.ones(8, dtype=np.bool_), section=RECTANGLE)


def test_work_in_the_plane_refuses_problems_in_space_by_name(space):
    problem = problem_from_dict(space)
    with pytest.raises(InvalidProblem, match=r"^outline: problem 'small-space' is in space; only"):
        require_plane(problem, "outline")
    with pytest.raises(InvalidProblem, match=r"^spring model: problem 'small-space' is in space"):
        SpringEvaluator(problem)


# ---- problems of the independent code


@pytest.mark.parametrize("name", NAMES)
def test_the_keys_of_reference_frames_are_the_keys_of_problems(name):
    problem, data = read_reference(name)
    written = problem_to_dict(problem)
    assert written["supports"]["fixed"] == data["supports"]
    dimension = problem.lattice.dimension
    assert dimension == (2 if name == "planar-crane" else 3)
    assert (problem.lattice.positions == np.array(data["positions"])[:, :dimension]).all()
    for key in set(SAME_KEYS) - {"positions", "input", "output"}:
        assert written[key] == data[key]
    for region in ("input", "output"):
        expected = dict(data[region])
        nodes = len(expected["nodes"])
        direction = np.broadcast_to(expected.pop("direction"), (nodes, 3))[:, :dimension]
        assert getattr(problem, region).direction == pytest.approx(direction, abs=1e-12)
        assert written[region].items() >= expected.items()
