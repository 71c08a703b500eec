"""Every form of `bellcrank export` and `bellcrank print`, and what they refuse."""

from __future__ import annotations

import shutil
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest
import trimesh

from bellcrank.export import Export, exporters, slicer
from bellcrank.export.gcode import read_gcode
from bellcrank.export.profiles import profiles
from bellcrank.model import Design, find_problem, human_design, write_design
from bellcrank.part import PartSpec, materials
from bellcrank.task import find_task

from .helpers import call, files, refusal, write

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.usefixtures("here")

SLICER = pytest.mark.skipif(
    shutil.which("prusa-slicer") is None, reason="PrusaSlicer is not installed"
)


@pytest.mark.parametrize("name", [name for name in exporters if name not in {"step", "3mf-beams"}])
def test_every_format_is_written_by_its_suffix(here: Path, name: str) -> None:
    file = f"part{exporters[name].suffixes[0]}"
    outcome = call("export", "human:crane", file, "--plate", "--screws", 2, "--pad", "--moved")
    assert outcome.code == 0, outcome.err
    assert outcome.err.splitlines()[0] == f"wrote {file}, 122 x 97.26 x 5.12 mm"
    printed = file.endswith((".stl", ".3mf"))
    assert ("whole number of layers" in outcome.err) == printed
    assert list(files(here)) == [file]
    assert (here / file).stat().st_size > 3000


def test_a_result_folder_is_exported_in_place_of_the_problem_of_its_name(here: Path) -> None:
    human = human_design("crane")
    assert human is not None
    (here / "crane").mkdir()
    write_design(human, here / "crane" / "design.json")
    noted = call("export", "crane", "part.svg")
    assert "note:" in noted.err
    assert "note:" not in call("export", "crane/", "same.svg").err
    call("export", "human:crane", "human.svg")
    written = [(here / name).read_bytes() for name in ("part.svg", "same.svg", "human.svg")]
    assert written[0] == written[1] == written[2]


def test_the_part_is_as_wide_and_thick_as_said(here: Path) -> None:
    trimesh = pytest.importorskip("trimesh")
    words = ("--width", "1.6mm", "--thickness", "3mm", "--scale", "20mm")
    call("export", "crane", "a.stl", *words, "--layer", "0")
    call("export", "crane", "b.stl", *words, "--layer", "0.2mm")
    whole = trimesh.load(here / "a.stl")
    assert whole.extents[2] == pytest.approx(3.0)
    assert whole.extents[0] == pytest.approx(13.0 * 20.0 + 1.6, abs=21.0)
    assert trimesh.load(here / "b.stl").extents[2] == pytest.approx(3.0)


def test_struts_are_drawn_wider_where_the_printer_makes_them_thin(here: Path) -> None:
    trimesh = pytest.importorskip("trimesh")
    call("export", "crane", "a.stl", "--width", "2mm", "--printed-width", "80%")
    call("export", "crane", "b.stl", "--width", "2.5mm")
    call("export", "crane", "c.stl", "--width", "2mm")
    thin, wide, drawn = (trimesh.load(here / f"{name}.stl").volume for name in "abc")
    assert thin == pytest.approx(wide)
    assert thin > 1.1 * drawn


@pytest.mark.parametrize(
    ("words", "word"),
    [
        (("crane", "part.stl", "--printed-width", "20%"), "printed_width: expected the printed"),
        (("crane", "part.foo"), "unknown export format '.foo'; known suffixes: .stl, .3mf"),
        (("crane", "part.stl", "--width", "6mm"), "width: struts 6 mm wide would close"),
        (("crane", "part.stl", "--fillet", "3mm"), "fillet: a radius of 3 mm would close"),
        (("crane", "part.stl", "--thickness", "0.1mm"), "less than one layer of 0.32 mm"),
        (("crane", "part.stl", "--screws", "2"), "--plate"),
        (("crane", "part.stl", "--plate", "--screws", "-1"), "screws: expected a number"),
        (("crane", "part.stl", "--layer", "thin"), "layer: expected a length"),
        (("crane", "part.stl", "--material", "jelly"), "unknown material 'jelly'"),
        (("crane", "part.stl", "--pointer", "-2mm"), "pointer: expected a length"),
    ],
)
def test_bad_input_is_refused_in_one_line(words: tuple[str, ...], word: str) -> None:
    assert word in refusal("export", *words)


def test_supports_and_inputs_in_one_row_get_a_plate_and_a_pad_outside_of_the_part(
    here: Path,
) -> None:
    task = find_task("slider")  # supports in one row, an input of two nodes
    assert task is not None
    write_design(task.problem.full_design(), here / "slider.json")
    sizes = {}
    for name, options in {
        "plain": (), "plate": ("--plate", "--screws", "2"), "pad": ("--pad",)
    }.items():  # fmt: skip
        assert call("export", "slider.json", f"{name}.stl", *options).code == 0
        sizes[name] = np.ptp(trimesh.load(here / f"{name}.stl").vertices, axis=0)
    # Room for screws of 3.4 mm with 1.5 mm around them, beyond the struts.
    assert sizes["plate"][1] - sizes["plain"][1] == pytest.approx(6.4 + 2.0, abs=0.1)
    assert sizes["pad"][1] - sizes["plain"][1] == pytest.approx(6.4 + 2.0, abs=0.1)
    assert sizes["plate"][0] == pytest.approx(sizes["plain"][0], abs=0.1)


def test_a_pad_without_a_hole_to_fill_is_refused(here: Path) -> None:
    task = find_task("slider")
    assert task is not None
    given = task.problem.input
    one = replace(given, nodes=given.nodes[:1], direction=given.direction[:1])
    problem = replace(task.problem, input=one, specification=None)
    write_design(problem.full_design(), here / "slider.json")
    assert "pad: there is nothing to fill" in refusal("export", "slider.json", "part.stl", "--pad")
    assert not (here / "part.stl").exists()


@pytest.mark.parametrize("suffix", ["stl", "3mf", "dxf", "svg"])
def test_a_design_in_pieces_is_no_part_but_still_a_lattice(here: Path, suffix: str) -> None:
    crane = find_problem("crane")
    mask = crane.initial.copy()
    mask[crane.designable] = False
    write_design(Design(crane, mask), here / "pieces.json")
    assert "the design is in 3 pieces" in refusal("export", "pieces.json", f"part.{suffix}")
    assert call("export", "pieces.json", "part.vtu").code == 0


def test_an_export_is_not_written_over(here: Path) -> None:
    write(here / "part.svg", "mine")
    assert "part.svg: exists already" in refusal("export", "crane", "part.svg")
    assert call("export", "crane", "part.svg", "--overwrite").code == 0
    assert "none/part.svg" in refusal("export", "crane", "none/part.svg", code=1)


def test_without_a_slicer_the_way_round_it_is_told() -> None:
    message = refusal("print", "crane", "--slicer", "no-such-slicer")
    assert "apt install prusa-slicer" in message
    assert "bellcrank export DESIGN part.3mf" in message


@pytest.mark.slow
@SLICER
def test_the_crane_is_sliced_into_as_much_plastic_as_it_has(here: Path) -> None:
    outcome = call("print", "crane")
    assert outcome.code == 0, outcome.err
    assert "16 of 0.32 mm" in outcome.out
    lines = (here / "crane.gcode").read_text().splitlines()
    deposit = read_gcode(lines, profiles["ninjaflex"].filament_diameter)
    assert deposit.layers == 16
    assert deposit.high[2] == pytest.approx(5.12)
    share = float(next(w for w in outcome.out.split() if w.endswith("%")).rstrip("%"))
    assert 97.0 <= share <= 103.0
    assert "whole number of layers" in outcome.err


@pytest.mark.slow
@SLICER
def test_a_part_in_space_is_sliced_with_supports(here: Path) -> None:
    outcome = call("print", "human:space-anti-parallel", "part.gcode")
    assert outcome.code == 0, outcome.err
    lines = (here / "part.gcode").read_text().splitlines()
    deposit = read_gcode(lines, profiles["ninjaflex"].filament_diameter)
    share = float(next(w for w in outcome.out.split() if w.endswith("%")).rstrip("%"))
    assert 95.0 <= share <= 105.0
    assert deposit.support > 0.0
    assert "to be removed" in outcome.out
    solid = Export(part=PartSpec().of(human_design("space-anti-parallel"))).solid()
    size, high = np.ptp(solid.vertices, axis=0), deposit.high - deposit.low
    assert np.abs(high - size)[:2].max() < 1.0
    assert deposit.layers == pytest.approx(size[2] / 0.32, abs=1.5)
    assert "flatter than 40 degrees" in outcome.err


@pytest.mark.slow
@SLICER
def test_stl_is_sliced_as_well(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(slicer, "PERIMETERS", (4,))
    part = PartSpec(width=2.0).of(human_design("crane"))
    bundle = Export(part=part)
    solid = bundle.solid()
    profile = profiles["ninjaflex"]
    size = (130.0, 100.0)
    content = exporters["stl"].to_bytes(bundle)
    sliced = slicer.slice_solid(content, ".stl", profile, size, solid.volume, slicer.find_slicer())
    assert sliced.deposit.layers == 16
    assert sliced.deposit.volume == pytest.approx(solid.volume, rel=0.03)


@SLICER
def test_what_is_to_be_sliced_is_checked_first() -> None:
    assert "expected a name ending in .gcode" in refusal("print", "crane", "part.stl")
    assert "unknown profile 'jelly'" in refusal("print", "crane", "--profile", "jelly")
    assert "layer" in refusal("print", "crane", "--layer", "1mm")


def test_every_material_has_a_profile_with_sources() -> None:
    assert set(materials) <= set(profiles)
    for profile in profiles.values():
        figures = {"nozzle", "layer", "bead_width", "temperature", "bed_temperature", "speed"}
        assert figures <= set(profile.sources)


GCODE = """; generated by hand
M82
G92 E0
G1 Z0.3 F600
G1 X10 Y0
G1 X20 Y0 E1.0
G1 E0.2
G1 X30 Y0
G1 E1.0
G1 X30 Y10 E2.0
G1 Z0.6
G92 E0
G1 X10 Y10 E0.5
; estimated printing time (normal mode) = 1h 2m 3s
"""


def test_moves_of_supports_are_counted_apart() -> None:
    supports = [";TYPE:Support material interface", "G1 Z0.2", "G1 X90 Y10 E1.0", ";TYPE:Perimeter"]
    moves = ["M83", "G1 Z0.3", "G1 X10 Y0", *supports, "G1 Z0.3", "G1 X10 Y0", "G1 X20 Y0 E1.0"]
    deposit = read_gcode(moves, 1.75)
    assert deposit.support == pytest.approx(deposit.volume)
    assert deposit.high.tolist() == [20.0, 0.0, 0.3]
    assert deposit.layers == 1


def test_gcode_with_absolute_filament_is_read_back() -> None:
    deposit = read_gcode(GCODE.splitlines(), 2.0)
    assert deposit.volume == pytest.approx(2.5 * 3.14159265)
    assert deposit.low.tolist() == [10.0, 0.0, 0.3]
    assert deposit.high.tolist() == [30.0, 10.0, 0.6]
    assert deposit.layers == 2
    assert deposit.seconds == 3723.0
