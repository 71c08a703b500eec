from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bellcrank.errors import (
    InvalidFile,
    InvalidProblem,
    InvalidSettings,
    OutputExists,
    StorageError,
)
from bellcrank.model import (
    Design,
    find_problem,
    lattices,
    problem_from_dict,
    problem_to_dict,
    read_design,
    read_masks,
    read_problem,
    write_design,
    write_problem,
)

# ---- what is written can be read


@pytest.mark.parametrize("drive", ["displacement", "force"])
def test_problems_survive_writing_and_reading(tmp_path, small, drive):
    small["input"]["drive"] = drive
    problem = problem_from_dict(small)
    write_problem(problem, tmp_path / "problem.json")
    again = read_problem(tmp_path / "problem.json")
    assert problem_to_dict(again) == problem_to_dict(problem) == small


@settings(max_examples=50, deadline=None)
@given(data=st.data())
def test_any_problem_survives_being_written_out(data):
    number = st.floats(-1e6, 1e6)
    positive = st.floats(1e-6, 1e6)
    turn = data.draw(st.floats(0.0, 6.3))
    problem = replace(
        find_problem("scaling-8"),
        name=data.draw(st.text(min_size=1).filter(str.strip)),
        lattice=replace(
            find_problem("scaling-8").lattice,
            positions=find_problem("scaling-8").lattice.positions * data.draw(positive)
            + data.draw(number),
        ),
    )
    drive = data.draw(st.sampled_from(["displacement", "force"]))
    extent = float(np.ptp(problem.lattice.positions, axis=0).max())
    fraction = st.floats(1e-6, 0.999)  # of the lattice's size, which no displacement exceeds
    problem = replace(
        problem,
        input=replace(
            problem.input,
            direction=np.array([np.cos(turn), np.sin(turn)]),
            drive=drive,
            amount=data.draw(positive) if drive == "force" else extent * data.draw(fraction),
        ),
        output=replace(problem.output, spring=data.draw(st.none() | positive)),
        initial=np.array(data.draw(st.lists(st.booleans(), min_size=219, max_size=219))),
        designable=np.array(sorted(data.draw(st.sets(st.integers(0, 218), min_size=1)))),
    )
    text = json.dumps(problem_to_dict(problem))
    assert problem_from_dict(json.loads(text)).hash == problem.hash


def test_designs_survive_writing_and_reading(tmp_path, small):
    problem = problem_from_dict(small)
    design = Design(problem, problem.initial, efficiency=0.25, provenance={"seed": 1})
    write_design(design, tmp_path / "design.json")
    again = read_design(tmp_path / "design.json")
    assert again.problem.hash == problem.hash
    assert again.mask_hex == design.mask_hex
    assert again.efficiency == 0.25
    assert again.provenance == {"seed": 1}


def test_reference_problems_are_read_and_written_back_as_they_are(reference):
    for path in sorted(reference.glob("*.problem.json")):
        theirs = json.loads(path.read_text())
        ours = problem_to_dict(read_problem(path))
        for region in ("input", "output"):  # directions come with 12 digits only
            given, kept = theirs[region].pop("direction"), ours[region].pop("direction")
            assert np.asarray(kept) == pytest.approx(np.asarray(given), abs=1e-11)
        assert ours == theirs


def test_reference_masks_fit_their_problems(reference):
    for path in sorted(reference.glob("*.problem.json")):
        problem = read_problem(path)
        results = json.loads(path.with_name(path.name.replace("problem", "results")).read_text())
        masks = read_masks(path.with_name(path.name.replace("problem", "results")), problem)
        assert [int(m.sum()) for m in masks] == [r["beams"] for r in results["results"]]


# ---- files written by people


def test_regions_in_toml_become_nodes(write, gripper):
    problem = read_problem(write(gripper, "gripper.toml"))
    assert problem.name == "my-gripper"
    assert problem.supports.fixed.tolist() == [0, 1, 2, 3, 4]
    assert problem.input.nodes.tolist() == [31, 32, 26]
    assert problem.output.nodes.tolist() == [27, 28]
    assert problem.stiffness.bond == 5.0


def test_regions_also_work_in_json_and_numbers_also_in_toml(small, write, gripper):
    small["supports"]["fixed"] = [{"nearest": [0.0, -1.0]}]
    assert read_problem(write(small)).supports.fixed.tolist() == [0]
    text = gripper.replace("{ row = 0 }", "0, 1, { ids = [2, 3, 4] }")
    assert read_problem(write(text, "a.toml")).supports.fixed.tolist() == [
        0,
        1,
        2,
        3,
        4,
    ]


def test_overlapping_regions_of_one_list_count_once(write, gripper):
    text = gripper.replace("fixed = [{ row = 0 }]", "fixed = [{ row = 0 }, { rows = [0] }]")
    problem = read_problem(write(text, "a.toml"))
    assert problem.supports.fixed.tolist() == [0, 1, 2, 3, 4]


def test_beams_at_frozen_nodes_are_not_designable(write, gripper):
    free = read_problem(write(gripper, "a.toml"))
    text = gripper.replace("[lattice]", "frozen = [{ row = 2 }]\n[lattice]")
    frozen = read_problem(write(text, "b.toml"))
    row = np.arange(11, 16)
    assert free.lattice.beams_touching(row)[free.designable].any()
    assert not frozen.lattice.beams_touching(row)[frozen.designable].any()


def test_a_seed_chooses_a_disordered_lattice(write, gripper):
    text = gripper.replace(
        'kind = "triangular-rows"\ncounts = [5, 6, 5, 6, 5, 6]\n'
        "first_x = [0.5, 0.0, 0.5, 0.0, 0.5, 0.0]",
        'kind = "displaced-delaunay"\ncolumns = 5\nrows = 6\nseed = 7',
    )
    text = text.replace("{ row = 0 }", "0, 1, 2, 3, 4")
    text = text.replace("{ row = -1, rightmost = 2 }, { row = -2, rightmost = 1 }", "31, 32")
    text = text.replace("{ box = [-0.1, 4.0, 1.1, 5.0] }", "27, 28")
    problem = read_problem(write(text, "a.toml"))
    same = lattices["displaced-delaunay"](5, 6, rng=np.random.default_rng(7))
    assert (problem.lattice.positions == same.positions).all()


# ---- what is too large


def test_a_displacement_larger_than_the_lattice_is_refused(write, gripper):
    text = gripper.replace("amount = 0.433", "amount = 43.3")
    with pytest.raises(InvalidProblem) as refused:
        read_problem(write(text, "a.toml"))
    message = str(refused.value)
    # Amount, beam lengths, size of the lattice, unit of a part.
    for fact in ("input.amount", "43.3", "43.3 beam lengths", "(5)", "10 mm"):
        assert fact in message
    force = text.replace('"displacement"', '"force"')
    assert read_problem(write(force, "b.toml")).input.amount == 43.3


def test_a_point_far_from_all_nodes_is_refused(write, gripper):
    text = gripper.replace("[{ row = 0 }]", "[{ nearest = [-500, 500] }]")
    with pytest.raises(InvalidProblem) as refused:
        read_problem(write(text, "a.toml"))
    message = str(refused.value)
    # Key, distance, extent of the lattice.
    for fact in ("supports.fixed[0].nearest", "[-500", "704.", "x = 0 to 5", "y = 0 to 4.33"):
        assert fact in message
    near = gripper.replace("[{ row = 0 }]", "[{ nearest = [-0.5, -0.5], count = 3 }]")
    assert len(read_problem(write(near, "b.toml")).supports.fixed) == 3


def test_a_text_file_of_unreasonable_size_is_refused(tmp_path):
    with (tmp_path / "huge.json").open("wb") as file:
        file.truncate(300_000_000)  # a sparse file: it needs no space
    with pytest.raises(InvalidFile, match=r"huge.json: 300 MB .* at most 256 MB"):
        read_problem(tmp_path / "huge.json")


# ---- designs and masks


def test_masks_come_from_masks_or_from_results(small, write):
    problem = problem_from_dict(small)
    for content in (
        {"masks": ["f0", "0f"]},
        {"results": [{"mask": "f0", "efficiency": 1.0}, {"mask": "0f"}], "note": "any"},
    ):
        masks = read_masks(write(content), problem)
        assert [m.tolist() for m in masks] == [[True] * 4 + [False] * 4, [False] * 4 + [True] * 4]


def test_nothing_is_overwritten_without_being_told(tmp_path, small):
    problem = problem_from_dict(small)
    path = tmp_path / "problem.json"
    write_problem(problem, path)
    with pytest.raises(OutputExists, match="exists already"):
        write_problem(replace(problem, name="other"), path)
    assert read_problem(path).name == "small"
    write_problem(replace(problem, name="other"), path, overwrite=True)
    assert read_problem(path).name == "other"


def test_what_cannot_be_written_is_said(tmp_path, small):
    problem = problem_from_dict(small)
    with pytest.raises(StorageError, match="cannot be written"):
        write_problem(problem, tmp_path / "missing" / "problem.json")
    with pytest.raises(InvalidSettings, match=r"expected a name ending in .json"):
        write_problem(problem, tmp_path / "problem.toml")
    strange = Design(problem, problem.initial, provenance={"rng": object()})
    with pytest.raises(InvalidProblem, match=r"provenance: .*JSON"):
        write_design(strange, tmp_path / "design.json")
    assert list(tmp_path.iterdir()) == []
