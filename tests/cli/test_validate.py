"""Every form of `bellcrank validate`, and what it refuses."""

from __future__ import annotations

import json
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING
from unittest import mock

import meshio
import numpy as np
import pytest

from bellcrank.errors import StorageError
from bellcrank.fem import FemSettings
from bellcrank.model import Design, find_problem, human_design, read_design, write_design
from bellcrank.part import PartSpec
from bellcrank.workflows import add_to_record, find_design, validate, validation_record

from .helpers import PROBLEM, call, colours, files, refusal, write

if TYPE_CHECKING:
    from typing import Any

pytestmark = pytest.mark.usefixtures("here")

REFERENCE = Path(__file__).parents[3] / "shared" / "reference" / "crane.problem.json"
RUBBER = (
    "--young", 12, "--poisson", 0.48, "--thickness", "5mm", "--scale", "10mm", "--joint", "0mm",
)  # fmt: skip


def validated(*words: object) -> dict[str, Any]:
    outcome = call("validate", *words, "--json")
    assert outcome.code == 0, outcome.err
    return outcome.data


@pytest.mark.parametrize(
    ("words", "expected", "digits"),
    [
        (("--linear", "--width", "1mm"), (3.015062782e-2, 3.480436969e-2, -5.412679980), 5e-9),
        (("--linear", "--width", "2mm"), (3.464962720e-2, 3.261786336e-2, -11.06770131), 5e-9),
        (
            ("--linear", "--width", 2, "--theory", "timoshenko"),
            (3.392924848e-2, 3.293548739e-2, -11.02935494),
            5e-9,
        ),
        (("--width", "0.2cm"), (3.962278969e-2, 3.595412958e-2, -10.93101755), 5e-8),
    ],
)
def test_the_command_gives_the_figures_that_several_codes_agree_on(
    words: tuple[object, ...], expected: tuple[float, ...], digits: float
) -> None:
    if not REFERENCE.exists():
        pytest.skip("the node table of these figures is not in this checkout")
    data = validated(REFERENCE, *words, *RUBBER, "--stroke", "1mm", "--record", "kept.json")
    found = [*data["mean_output_displacement_mm"], data["input_force_N"][1]]
    assert found == pytest.approx(expected, rel=digits)
    assert data["status"] == "converged"
    assert data["efficiency"] == pytest.approx(-found[0])


def test_the_table_says_what_the_json_says() -> None:
    words = ("human:crane", "--theory", "euler-bernoulli,timoshenko", "--elements", 2)
    outcome = call("validate", *words)
    assert outcome.code == 0
    data = validated(*words)
    assert [entry["theory"] for entry in data["results"]] == ["euler-bernoulli", "timoshenko"]
    for entry in data["results"]:
        assert f" {entry['efficiency']:.4f} " in outcome.out
        assert f" {entry['off_axis']:.1%} " in outcome.out
        assert f" {entry['output_rotation_deg']:.2g} deg " in outcome.out
    assert f" {data['discrete_model']['efficiency']:.4f} " in outcome.out
    assert data["efficiency"] == data["results"][0]["efficiency"]


def test_a_design_keeps_its_record_beside_it(copy: Path) -> None:
    before = files(copy)
    path = copy / "design.json"
    outcome = call("validate", path, "--elements", 2)
    assert outcome.code == 0, outcome.err
    assert set(files(copy)) - set(before) == {"validation.json"}
    assert outcome.err.splitlines()[-1] == f"wrote {copy / 'validation.json'}"
    for elements in (2, 3, 2):
        call("validate", copy, "--theory", "timoshenko", "--elements", elements)
    record = json.loads((copy / "validation.json").read_text())
    assert record["schema"] == "bellcrank/validation/1"
    kept = [(entry["theory"], entry["settings"]["elements"]) for entry in record["results"]]
    assert kept == [("euler-bernoulli", 2), ("timoshenko", 3), ("timoshenko", 2)]
    assert record["mask"] == read_design(path).mask_hex
    others = {name: content for name, content in files(copy).items() if name != "validation.json"}
    assert others == before


def test_built_in_designs_leave_no_record(here: Path) -> None:
    (here / "crane").mkdir()  # the name means the problem, not this folder
    call("validate", "crane", "--elements", 1, "--linear")
    call("validate", "human:crane", "--elements", 1, "--linear")
    assert list(files(here)) == ["crane"]


@pytest.mark.parametrize(
    "content",
    [
        {"schema": "something/1"},
        {"schema": "bellcrank/validation/1"},
        {"schema": "bellcrank/validation/1", "results": [{}]},
    ],
)
def test_a_file_that_is_no_record_is_left_alone(copy: Path, content: object) -> None:
    write(copy / "validation.json", content)
    message = refusal("validate", copy, "--elements", 1, folder=copy)
    assert "validation.json: expected a record of bellcrank/validation/1" in message


def test_the_record_of_another_design_or_a_changed_problem_is_left_alone(
    here: Path, small: str
) -> None:
    words = ("--linear", "--width", "1mm", "--record", "kept.json")
    assert call("validate", small, *words).code == 0
    assert "another design" in refusal("validate", "human:crane", *words)
    data = json.loads((here / small).read_text())
    data["output"]["nodes"] = [2]
    write(here / small, data)
    assert "another design or of a changed problem" in refusal("validate", small, *words)


def test_files_of_one_stem_have_records_of_their_own(here: Path, small: str) -> None:
    words = ("--linear", "--width", "1mm")
    call("validate", small, *words)
    (here / "small.v2.json").write_bytes((here / small).read_bytes())
    call("validate", "small.v2.json", *words)
    assert (here / "small.json.validation.json").exists()
    assert (here / "small.v2.json.validation.json").exists()


def test_processes_that_keep_a_record_at_once_lose_nothing(copy: Path) -> None:
    found = validate(find_design(str(copy)), PartSpec(), [("frame", FemSettings(elements=1))])

    def keep(elements: int) -> None:
        plan = [("frame", FemSettings(elements=elements))]
        add_to_record(replace(found, plan=plan), copy / "validation.json")

    with ThreadPoolExecutor(8) as pool:
        list(pool.map(keep, range(1, 25)))
    record = json.loads((copy / "validation.json").read_text())
    assert {entry["settings"]["elements"] for entry in record["results"]} == set(range(1, 25))


def test_results_are_printed_even_where_no_record_can_be_kept(
    copy: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_words: object, **_options: object) -> None:
        raise StorageError("disk full")

    monkeypatch.setattr(validation_record, "write_text", full)
    outcome = call("validate", copy, "--elements", 1, "--json")
    assert outcome.code == 0
    assert outcome.data["status"] == "converged"
    assert "disk full" in outcome.err


@pytest.mark.parametrize(
    ("part", "word"),
    [
        ("nonsense", "provenance.part: expected a table"),
        ([1], "provenance.part: expected a table"),
        ({"material": {"E": 3}}, "provenance.part: material: "),
        ({"material": 5}, "provenance.part: material: expected a name or a table"),
        ({"girth": 1}, "girth"),
        ({"width": True}, "width: expected a length"),
    ],
)
def test_a_design_with_a_part_that_makes_no_sense_is_refused(
    here: Path, part: object, word: str
) -> None:
    design = human_design("crane")
    assert design is not None
    write_design(replace(design, provenance={"part": part}), here / "odd.json")
    assert word in refusal("validate", "odd.json")


@pytest.mark.parametrize("beside", [None, "machine:crane"])
def test_a_picture_shows_stress_in_colours(here: Path, beside: str | None) -> None:
    words = ("--compare", beside) if beside else ()
    outcome = call("validate", "human:crane", *words, "--picture", "stress.png", "--elements", 2)
    assert outcome.code == 0, outcome.err
    assert colours(here / "stress.png") > 500


def test_a_vtu_file_holds_displacement_and_stress(here: Path) -> None:
    data = validated("human:crane", "--vtu", "part.vtu")
    mesh = meshio.read(here / "part.vtu")
    (lines,) = mesh.cells
    assert lines.type == "line"
    stress = mesh.cell_data["von_mises_MPa"][0]
    assert len(lines.data) == len(stress) == 8 * human_design("crane").beam_count
    assert stress.max() == pytest.approx(data["von_mises_MPa"])
    moved = mesh.point_data["displacement_mm"]
    assert moved.shape == (len(mesh.points), 3)
    assert np.abs(moved[:, 1]).max() >= 4.33


def test_a_part_is_described_in_a_file_and_changed_on_the_command_line(here: Path) -> None:
    write(
        here / "part.toml",
        'schema = "bellcrank/part/1"\nwidth = "1.6mm"\nthickness = 4.8\nmaterial = "petg"\n',
    )
    words = ("human:crane", "--linear", "--elements", 1, "--part", "part.toml")
    part = validated(*words, "--thickness", "5.12mm")["results"][0]["part"]
    assert (part["width"], part["thickness"], part["material"]) == (1.6, 5.12, "petg")


@pytest.mark.slow
def test_a_search_for_struts_is_validated_as_what_it_searched_for(here: Path) -> None:
    words = ("--strut-width", "1.6mm", "--material", "tpu-95a", "--scale", "12mm")
    outcome = call("design", PROBLEM, "--steps", 500, "--chains", 1, *words, "--out", "run")
    assert outcome.code == 0, outcome.err
    design = read_design(here / "run" / "design.json")
    assert design.problem.section.width == pytest.approx(1.6 / 12.0)
    part = validated("run")["results"][0]["part"]
    assert (part["width"], part["scale"], part["material"]) == (1.6, 12.0, "tpu-95a")


def snapping(here: Path) -> Path:
    """A shallow arch pushed through by a force."""
    places = [[0.0, 0.0], [1.5, 0.225], [3.0, 0.45], [4.5, 0.225], [6.0, 0.0]]
    problem = {
        "schema": "bellcrank/problem/1", "name": "arch", "positions": places,
        "beams": [[0, 1], [1, 2], [2, 3], [3, 4]], "initial": "f0", "designable": [0],
        "stiffness": {"bond": 5.0, "angle": 0.1},
        "supports": {"fixed": [0, 4], "fixed_x": [], "fixed_y": []},
        "input": {"nodes": [2], "direction": [0.0, -1.0], "drive": "force", "amount": 0.02},
        "output": {"nodes": [1], "direction": [0.0, -1.0], "spring": None, "spring_kind": None},
        "aggregate": "mean",
    }  # fmt: skip
    return write(here / "arch.json", problem)


def test_a_part_that_snaps_is_told_apart_from_a_result(here: Path) -> None:
    outcome = call("validate", snapping(here), "--width", "1mm", "--json")
    assert outcome.code == 0
    data = outcome.data
    assert data["status"] == "snapped"
    assert data["efficiency"] is None
    assert data["mean_output_displacement_mm"] is None
    assert 0.0 < data["reached"] < 1.0
    words = call("validate", "arch.json", "--width", "1mm")
    assert f"snapped at {data['reached']:.1%}" in words.out
    assert "stability is lost" in words.err


def in_pieces(here: Path) -> str:
    crane = find_problem("crane")
    mask = crane.initial.copy()
    mask[crane.designable] = False
    write_design(Design(crane, mask), here / "pieces.json")
    return "pieces.json"


@pytest.mark.parametrize(
    ("words", "word"),
    [
        (("nothing",), "nothing"),
        (("human:scaling-8",), "no human design for 'scaling-8'"),
        (("crane", "--width", "12mm"), "width: struts 12 mm wide are not slender"),
        (("crane", "--width", "wide"), "width: expected a length like 2mm"),
        (("crane", "--width", "-1"), "width: expected a length above 0 mm"),
        (("crane", "--thickness", "0"), "thickness: expected a length above 0 mm"),
        (("crane", "--stroke", "0"), "stroke: expected a length above 0 mm"),
        (("pliers", "--stroke", "1mm"), "driven by a force"),
        (("crane", "--material", "jelly"), "unknown material 'jelly'; known: ninjaflex"),
        (("crane", "--young", "12"), "give --young and --poisson together"),
        (("crane", "--young", "-1", "--poisson", "0.3"), "young: expected a modulus above 0"),
        (("crane", "--young", "1", "--poisson", "0.5"), "poisson: expected a ratio"),
        (
            ("crane", "--young", "1", "--poisson", "0.3", "--material", "pla"),
            "either --material or --young",
        ),
        (("crane", "--level", "sponge"), "unknown level 'sponge'; known: frame, plane, solid"),
        (("crane", "--theory", "kirchhoff"), "unknown theory 'kirchhoff'; known: euler-bernoulli"),
        (("crane", "--elements", "0"), "elements: expected at least 1"),
        (("crane", "--part", "none.toml"), "none.toml: no such file"),
        (("crane", "--picture", "shape.jpg"), "shape.jpg: expected a picture name"),
        (("crane", "--vtu", "shape.vtk"), "shape.vtk: expected a name ending in .vtu"),
        (("crane", "--compare", "human:crane"), "--compare is for the picture"),
        (
            ("crane", "--compare", "human:pliers", "--picture", "a.png"),
            "human:pliers",
        ),
        (("crane", "--theory", "euler-bernoulli,foo"), "unknown theory 'foo'"),
        (("crane", "--level", "frame,,plane"), "--level 'frame,,plane': expected names"),
        (("crane", "--law", "foo"), "unknown law 'foo'"),
        (("crane", "--level", "plane", "--law", "linear"), "--linear"),
        (("crane", "--level", "frame,plane", "--width", "7mm"), "choose at most 5.77 mm"),
    ],
)
def test_bad_input_is_refused_in_one_line(words: tuple[str, ...], word: str) -> None:
    if {"plane", "solid"} & set(",".join(words).split(",")):
        pytest.importorskip("ngsolve", reason="NGSolve is not installed")
    assert word in refusal("validate", *words)


@pytest.mark.parametrize(
    ("words", "word"),
    [
        (("--level", "plane", "--fillet", "3mm"), "fillet: a radius of 3 mm would close"),
        (("--level", "plane", "--width", "6mm"), "width: struts 6 mm wide would close"),
        (("--level", "frame", "--fillet", "-1mm"), "fillet: expected a radius"),
        (("--level", "plane", "--size", "0"), "size: expected a length above 0 mm"),
        (("--level", "solid", "--law", "jelly"), "unknown law 'jelly'; known: linear"),
    ],
)
def test_outlines_that_cannot_be_meshed_are_refused(words: tuple[str, ...], word: str) -> None:
    pytest.importorskip("ngsolve", reason="NGSolve is not installed")
    assert word in refusal("validate", "crane", *words)


def test_without_ngsolve_the_plane_is_refused_and_frames_are_not(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "ngsolve", None)
    message = refusal("validate", "crane", "--level", "plane")
    assert "pip install 'bellcrank[fem]'" in message
    assert call("validate", "crane", "--linear").code == 0


def test_without_ngsolve_the_other_levels_are_computed_and_recorded(
    copy: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "ngsolve", None)
    words = ("--level", "solid,frame,plane", "--elements", 2, "--json")
    outcome = call("validate", copy, *words)
    assert outcome.code == 1
    [result] = outcome.data["results"]
    assert (result["level"], result["status"]) == ("frame", "converged")
    record = json.loads((copy / "validation.json").read_text())
    assert [entry["level"] for entry in record["results"]] == ["frame"]
    for level in ("plane", "solid"):
        assert f"{level}: not computed" in outcome.err
    assert "pip install 'bellcrank[fem]'" in outcome.err


@pytest.mark.slow
def test_all_levels_stand_in_one_table() -> None:
    pytest.importorskip("ngsolve", reason="NGSolve is not installed")
    words = ("human:crane", "--level", "frame,plane,solid", "--linear", "--size", "3mm")
    results = validated(*words)["results"]
    assert [entry["level"] for entry in results] == ["frame", "plane", "solid"]
    frame, plane, solid = (entry["efficiency"] for entry in results)
    assert plane == pytest.approx(frame, rel=0.2)
    assert solid == pytest.approx(plane, rel=0.1)
    assert all(entry["principal_strain"] > 0.0 for entry in results)


@pytest.mark.parametrize("option", ["--picture", "--vtu", "--record"])
def test_files_in_missing_folders_are_refused_before_anything_is_computed(option: str) -> None:
    name = {"--picture": "none/a.png", "--vtu": "none/a.vtu", "--record": "none/a.json"}[option]
    with mock.patch("bellcrank.workflows.validation.model_evaluator", side_effect=AssertionError):
        assert "(no folder none)" in refusal("validate", "crane", option, name, code=1)


def test_a_part_file_changes_only_what_it_names(here: Path) -> None:
    design = human_design("crane")
    assert design is not None
    write_design(replace(design, provenance={"part": {"width": 1.2}}), here / "thin.json")
    write(here / "m.toml", 'schema = "bellcrank/part/1"\nmaterial = "pla"\n')
    part = validated("thin.json", "--part", "m.toml", "--linear")["results"][0]["part"]
    assert (part["width"], part["material"]) == (1.2, "pla")


def test_beams_that_cross_are_doubted(here: Path) -> None:
    problem = {
        "schema": "bellcrank/problem/1", "name": "cross",
        "positions": [[0, 0], [2, 2], [0, 2], [2, 0]], "beams": [[0, 1], [2, 3], [1, 2], [3, 0]],
        "initial": "f0", "designable": [0], "stiffness": {"bond": 5.0, "angle": 0.1},
        "supports": {"fixed": [0], "fixed_x": [], "fixed_y": []},
        "input": {
            "nodes": [3], "direction": [0.0, -1.0], "drive": "displacement", "amount": 0.01
        },
        "output": {"nodes": [2], "direction": [0.0, 1.0], "spring": None, "spring_kind": None},
        "aggregate": "mean",
    }  # fmt: skip
    problem["positions"] = [[float(x), float(y)] for x, y in problem["positions"]]
    write(here / "cross.json", problem)
    data = validated("cross.json", "--linear", "--width", "1mm")
    assert "0 and 1" in next(text for text in data["doubts"] if "cross" in text)


def test_an_output_that_hangs_on_nothing_is_doubted(here: Path) -> None:
    crane = find_problem("crane")
    mask = crane.initial.copy()
    mask[crane.lattice.beams_touching(crane.output.nodes)] = False
    write_design(Design(crane, mask), here / "loose.json")
    data = validated("loose.json", "--linear", "--elements", 1)
    assert "none of the output nodes have beams" in " ".join(data["doubts"])


def test_inputs_that_push_against_each_other_have_a_push() -> None:
    data = validated("human:pliers", "--linear", "--elements", 1)
    assert data["input_push_N"] == pytest.approx(-data["input_force_N"][1])


def test_a_design_in_pieces_is_refused(here: Path) -> None:
    message = refusal("validate", in_pieces(here))
    assert "the design is in 3 pieces" in message
    assert "no support" in message


def test_a_picture_is_not_written_over(here: Path) -> None:
    write(here / "stress.png", "mine")
    message = refusal("validate", "human:crane", "--picture", "stress.png")
    assert "stress.png: exists already" in message
