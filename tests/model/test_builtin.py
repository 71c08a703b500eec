from __future__ import annotations

import numpy as np
import pytest

from bellcrank.errors import InvalidFile, UnknownName
from bellcrank.model import (
    builtin,
    find_problem,
    gallery,
    gallery_design,
    human_design,
    read_problem,
    write_problem,
)
from bellcrank.part import PartSpec, frame_problem

# Committed designs rely on this numbering.
INPUT = [106, 107, 108, 117, 118, 119, 120, 130, 131, 132]
OUTPUT = [97, 98, 99, 109, 110, 111, 121, 122, 123]


def directions(region, place):
    return {
        place[node]: tuple(direction)
        for node, direction in zip(region.nodes, region.direction, strict=True)
    }


def geometry(problem):
    """Say what a problem is without node numbers or an origin."""
    lattice = problem.lattice
    half_steps = (lattice.positions - lattice.positions.min(axis=0)) * [2.0, 2.0 / np.sqrt(3.0)]
    place = [tuple(p) for p in np.rint(half_steps).astype(int).tolist()]
    assert np.abs(half_steps - np.rint(half_steps)).max() < 1e-3
    beams = [frozenset((place[a], place[b])) for a, b in lattice.beams]
    return {
        "nodes": set(place),
        "beams": set(beams),
        "designable": {beams[m] for m in problem.designable},
        "supports": {place[n] for n in problem.supports.fixed},
        "rollers": {place[n] for n in (*problem.supports.fixed_x, *problem.supports.fixed_y)},
        "input": {
            place[n]: tuple(d)
            for n, d in zip(problem.input.nodes, problem.input.direction, strict=True)
        },
        "output": {
            place[n]: tuple(d)
            for n, d in zip(problem.output.nodes, problem.output.direction, strict=True)
        },
    }


@pytest.mark.parametrize(
    ("name", "file"),
    [
        ("crane", "crane"),
        ("scaling-8", "scaling8"),
        ("scaling-12", "scaling12"),
        ("scaling-16", "scaling16"),
        ("scaling-20", "scaling20"),
    ],
)
def test_generated_problems_are_the_reference_ones_up_to_numbering(reference, name, file):
    ours, theirs = builtin[name](), read_problem(reference / f"{file}.problem.json")
    assert geometry(ours) == geometry(theirs)
    assert ours.input.amount == pytest.approx(theirs.input.amount, rel=1e-6)
    assert ours.input.drive == theirs.input.drive
    assert ours.aggregate == theirs.aggregate
    assert (ours.stiffness.bond, ours.stiffness.angle) == (5.0, 0.1)


def test_crane_has_the_size_the_paper_gives():
    crane = builtin["crane"]()
    assert crane.lattice.node_count == 133
    assert crane.lattice.beam_count == 352
    assert len(crane.designable) == 203
    assert crane.supports.fixed.tolist() == list(range(34))
    assert crane.input.nodes.tolist() == INPUT
    assert crane.output.nodes.tolist() == OUTPUT


def test_anti_parallel_differs_from_crane_in_the_output_direction_only():
    crane, anti_parallel = geometry(builtin["crane"]()), geometry(builtin["anti-parallel"]())
    assert set(crane.pop("output").values()) == {(-1.0, 0.0)}
    assert set(anti_parallel.pop("output").values()) == {(0.0, 1.0)}
    assert crane == anti_parallel


def test_scaling_problems_come_in_all_sizes_from_8_to_20():
    counts = [builtin[f"scaling-{n}"]().lattice.beam_count for n in range(8, 21)]
    assert counts == sorted(counts)
    assert (counts[0], counts[-1]) == (219, 1269)


def test_problems_in_space_are_boxes_of_octets_whose_edges_are_input_and_output():
    counts = [builtin[f"space-{n}"]().lattice.beam_count for n in (6, 8, 10, 12, 14)]
    assert counts == [516, 896, 1380, 1968, 2660]
    problem, other = builtin["orthogonal"](), builtin["space-anti-parallel"]()
    size = problem.lattice.positions.max(axis=0)
    assert size == pytest.approx(np.sqrt(0.5) * np.array([6.0, 4.0, 6.0]))
    for region, side in ((problem.input, 1.0), (problem.output, -1.0)):
        ports = problem.lattice.positions[region.nodes] / size
        assert ports[:, 2] == pytest.approx(1.0)
        assert (side * (ports[:, 0] - 0.5) > 0.3).all()
        assert ports[:, 1].mean() == pytest.approx(0.5)
    assert problem.lattice.beams.tolist() == other.lattice.beams.tolist()
    assert other.output.direction[0].tolist() == [0.0, 0.0, 1.0]
    assert builtin["space-6"]().lattice.beams.tolist() == problem.lattice.beams.tolist()


@pytest.mark.parametrize("name", builtin.names())
def test_every_builtin_problem_carries_its_name_and_is_made_anew_identically(name):
    problem = builtin[name]()
    assert problem.name == name
    assert builtin[name]().hash == problem.hash


@pytest.mark.parametrize("name", builtin.names())
def test_nodes_are_numbered_from_the_bottom_and_beams_sorted(name):
    lattice = builtin[name]().lattice
    assert (np.diff(lattice.positions[:, -1]) >= -1e-9).all()
    assert lattice.beams.tolist() == sorted(lattice.beams.tolist())


def test_discs_are_the_same_on_every_machine():
    # Pinned so that designs made for this lattice stay valid; the generator
    # uses only exactly defined operations.
    discs = builtin["discs"]()
    assert (discs.lattice.node_count, discs.lattice.beam_count) == (96, 196)
    assert len(discs.designable) == 160
    assert discs.hash.startswith("3b59d860c86c169a")


def test_pliers_close_on_rollers_around_one_pivot():
    pliers = builtin["pliers"]()
    on_line = np.flatnonzero(pliers.lattice.positions[:, 1] == 0.0)
    assert len(pliers.supports.fixed) == 1
    assert pliers.supports.nodes.tolist() == on_line.tolist()
    assert pliers.output.spring == 10.0
    assert 300 <= len(pliers.designable) <= 500


def test_unknown_problems_list_the_known_ones_and_say_there_is_no_such_file():
    with pytest.raises(UnknownName, match=r"'nope'; known: crane.*; and there is no such file"):
        find_problem("nope")


def test_a_file_is_found_by_its_path(tmp_path):
    path = tmp_path / "problem.json"
    write_problem(builtin["scaling-8"](), path)
    assert find_problem(path).name == "scaling-8"
    assert find_problem(str(path)).hash == builtin["scaling-8"]().hash


def test_machine_designs_are_frames_of_their_parts():
    found = [gallery_design("machine", name) for name in builtin]
    assert any(found)
    for design in filter(None, found):
        assert design.provenance["kind"] == "machine"
        part = PartSpec(**design.provenance["part"])
        expected = frame_problem(builtin[design.problem.name](), part)
        assert design.problem.section == expected.section
        assert design.problem.material == expected.material


def test_human_designs_leave_alone_what_is_not_designable():
    for design in filter(None, map(human_design, builtin)):
        kept = np.setdiff1d(np.arange(len(design.mask)), design.problem.designable)
        assert (design.mask[kept] == design.problem.initial[kept]).all()
        assert design.provenance["kind"] == "human"
        assert design.provenance["origin"]


def test_a_human_design_is_read_from_its_file(tmp_path, monkeypatch):
    monkeypatch.setattr(gallery, "FOLDER", tmp_path)
    assert human_design("scaling-8") is None
    (tmp_path / "human").mkdir()
    mask = builtin["scaling-8"]().full_design().mask_hex
    text = '{"schema": "bellcrank/gallery/1", "problem": "%s", "origin": "none", "mask": "%s"}'
    (tmp_path / "human" / "scaling-8.json").write_text(text % ("scaling-8", mask))
    design = human_design("scaling-8")
    assert design is not None
    assert design.mask_hex == mask
    (tmp_path / "human" / "scaling-8.json").write_text(text % ("crane", mask))
    with pytest.raises(InvalidFile, match=r"scaling-8.json: problem: expected 'scaling-8'"):
        human_design("scaling-8")
