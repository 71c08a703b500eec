"""Every format, by what all have in common and by what each promises."""

from __future__ import annotations

import importlib.util
import os
import re
import xml.etree.ElementTree as ET
from typing import TYPE_CHECKING

import numpy as np
import pytest

from bellcrank.errors import (
    BellcrankError,
    InvalidSettings,
    OutputExists,
    StorageError,
    UnknownName,
)
from bellcrank.export import Export, export, exporters
from bellcrank.export.formats.step import solid_to_bytes as step_bytes
from bellcrank.model import find_problem, gallery_design, human_design
from bellcrank.part import PartSpec
from bellcrank.part.outline import strut_outline
from bellcrank.part.outline.grips import filled
from bellcrank.part.outline.screws import drilled
from tests.export.reading import area_in_dxf, area_in_svg, read_step, require_kernel

if TYPE_CHECKING:
    from pathlib import Path

    from bellcrank.part import Part

NAMES = [name for name in exporters.names() if name != "3mf-beams"]
"""Formats of parts in the plane."""
EXACT = [("human", "crane"), ("machine", "pliers"), ("machine", "discs"), ("machine", "scaling-8")]
SUFFIXES = [suffix for entry in exporters.values() for suffix in entry.suffixes]


@pytest.fixture(scope="module")
def part() -> Part:
    return part_of("human", "pliers")


def part_of(kind: str, name: str) -> Part:
    design = gallery_design(kind, name)
    assert design is not None
    shortest = float(design.problem.lattice.rest_length[design.mask].min())
    return PartSpec(width=min(2.0, 2.0 * shortest)).of(design)


def require(name: str) -> None:
    if name == "step":
        require_kernel()


@pytest.mark.parametrize("name", NAMES)
def test_every_format_writes_the_same_file_twice(name: str, part: Part, tmp_path: Path) -> None:
    require(name)
    suffix = exporters[name].suffixes[0]
    for file in ("one", "two"):
        export(part, tmp_path / f"{file}{suffix}")
    one, two = ((tmp_path / f"{file}{suffix}").read_bytes() for file in ("one", "two"))
    assert len(one) > 1000
    assert one == two


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_suffixes_name_formats_in_capitals_too(suffix: str) -> None:
    assert exporters.for_path(f"part{suffix.upper()}") is exporters.for_path(f"part{suffix}")


@pytest.mark.parametrize("name", NAMES)
def test_no_format_replaces_a_file_unasked(name: str, part: Part, tmp_path: Path) -> None:
    require(name)
    target = tmp_path / f"part{exporters[name].suffixes[0]}"
    target.write_text("precious")
    with pytest.raises(OutputExists, match="exists already"):
        export(part, target)
    assert target.read_text() == "precious"
    export(part, target, overwrite=True)
    assert len(target.read_bytes()) > 1000


@pytest.mark.parametrize("name", NAMES)
def test_every_format_takes_any_title(name: str, part: Part) -> None:
    require(name)
    content = exporters[name].to_bytes(Export(part=part, title="<a> & \"b\" 'c'\n\x07 ü 梃"))
    assert len(content) > 1000
    if name == "svg":
        ET.fromstring(content)


@pytest.mark.parametrize("name", NAMES)
def test_a_full_disk_leaves_no_file(
    name: str, part: Part, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    require(name)

    def fail(handle: int) -> None:
        raise OSError(28, "No space left on device")

    # Some formats are made in a file of their own first, which nobody forces to disk.
    monkeypatch.setattr(os, "fsync", fail)
    with pytest.raises(StorageError, match="No space left on device"):
        export(part, tmp_path / f"part{exporters[name].suffixes[0]}")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["stl", "3mf", "dxf", "svg", "step"])
@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"width": 8.0}, "width: struts 8 mm wide would close [0-9]+ of [0-9]+ holes; choose"),
        ({"fillet": 5.0}, "fillet: a radius of 5 mm would close .* at most .* mm leaves room"),
    ],
)
def test_parts_without_holes_are_refused_and_leave_no_file(
    name: str, change: dict, message: str, tmp_path: Path
) -> None:
    require(name)
    wide = PartSpec(**change).of(find_problem("crane").full_design())
    with pytest.raises(InvalidSettings, match=message):
        export(wide, tmp_path / f"part{exporters[name].suffixes[0]}")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["stl", "3mf", "step"])
def test_parts_thinner_than_a_layer_are_refused(name: str, tmp_path: Path) -> None:
    require(name)
    thin = PartSpec(thickness=0.2).of(find_problem("crane").full_design())
    with pytest.raises(InvalidSettings, match=r"thickness: 0.2 mm is less than one layer of 0.32"):
        export(thin, tmp_path / f"part{exporters[name].suffixes[0]}")
    assert list(tmp_path.iterdir()) == []


def test_unknown_suffixes_are_refused_with_those_there_are(part: Part, tmp_path: Path) -> None:
    for name in ("part.obj", "part", ".stl"):
        with pytest.raises(UnknownName, match=r"known suffixes: \.stl, \.3mf, .*\.step, .*\.vtu"):
            export(part, tmp_path / name)
    assert list(tmp_path.iterdir()) == []


def test_a_missing_folder_is_said(part: Part, tmp_path: Path) -> None:
    with pytest.raises(BellcrankError, match="cannot be written"):
        export(part, tmp_path / "nowhere" / "part.svg")


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"moved": np.zeros((3, 2))}, r"moved: expected shape \(\d+, 2\), got \(3, 2\)"),
    ],
)
def test_arrays_that_fit_no_part_are_refused(given: dict, message: str, part: Part) -> None:
    with pytest.raises(InvalidSettings, match=message):
        Export(part=part, **given)


def test_places_that_are_no_numbers_are_refused(part: Part) -> None:
    broken = part.design.problem.lattice.positions.copy()
    broken[0, 1] = np.nan
    with pytest.raises(InvalidSettings, match=r"moved\[0, 1\]: expected a finite number"):
        Export(part=part, moved=broken)


@pytest.mark.parametrize(("kind", "name"), EXACT)
def test_dxf_and_svg_have_the_exact_area(kind: str, name: str, tmp_path: Path) -> None:
    made = part_of(kind, name)
    outline = made.outline()
    export(made, tmp_path / "part.dxf")
    export(made, tmp_path / "part.svg")
    assert area_in_dxf(tmp_path / "part.dxf") == pytest.approx(outline.area, rel=1e-12)
    # Of a half circle, radius and chord give the angle to the root of the precision only.
    text = (tmp_path / "part.svg").read_text(encoding="utf-8")
    assert area_in_svg(text) == pytest.approx(outline.area, rel=1e-8)


def test_dxf_is_in_mm_with_holes_on_a_layer_of_their_own(part: Part, tmp_path: Path) -> None:
    import ezdxf

    export(part, tmp_path / "part.dxf")
    drawing = ezdxf.readfile(tmp_path / "part.dxf")
    outline = part.outline()
    assert drawing.dxfversion == "AC1024"
    assert drawing.header["$INSUNITS"] == ezdxf.units.MM
    layers = [line.dxf.layer for line in drawing.modelspace()]
    assert layers.count("outline") == outline.piece_count
    assert layers.count("holes") == outline.hole_count
    assert drawing.header["$EXTMIN"][:2] == pytest.approx(outline.bounds[:2])
    assert drawing.header["$EXTMAX"][:2] == pytest.approx(outline.bounds[2:])


def test_dates_are_left_out_of_dxf_only_while_it_is_written(part: Part) -> None:
    import ezdxf

    before = ezdxf.options.write_fixed_meta_data_for_testing
    exporters["dxf"].to_bytes(Export(part=part))
    assert ezdxf.options.write_fixed_meta_data_for_testing == before


def test_svg_is_as_large_as_the_part_and_the_right_way_up() -> None:
    # A foot to the right, a tip to the upper left.
    positions, beams = [[0.0, 0.0], [10.0, 0.0], [0.0, 30.0]], [[0, 1], [0, 2]]
    outline = strut_outline(positions, beams, 2.0, 1.0)
    made = part_of("human", "crane")
    text = exporters["svg"].to_bytes(Export(part=made, shape=outline)).decode()
    root = ET.fromstring(text)
    sizes = [float(root.get(name, "").removesuffix("mm")) for name in ("width", "height")]
    assert sizes == pytest.approx([12.0, 32.0])
    assert [float(word) for word in root.get("viewBox", "").split()] == [0.0, 0.0, *sizes]
    path = next(root.iter("{http://www.w3.org/2000/svg}path")).get("d", "")
    words = re.findall(r"([-0-9.e]+) ([-0-9.e]+)(?: [LAZ])", path)
    ends = np.array([[float(x), float(y)] for x, y in words])
    foot, tip = ends[ends[:, 0] > 8.0], ends[ends[:, 1] < 8.0]
    assert foot[:, 1].min() == pytest.approx(30.0)
    assert tip[:, 0].max() == pytest.approx(2.0)
    assert area_in_svg(text) == pytest.approx(outline.area, rel=1e-7)


def test_changed_outlines_are_what_is_written(tmp_path: Path) -> None:
    made = part_of("human", "crane")
    supports = made.design.problem.supports.nodes
    plate = filled(made.outline(), made.positions, made.struts, supports)
    shape = drilled(plate, [made.positions[supports].mean(axis=0)], 3.0, 1.5)
    bundle = Export(part=made, shape=shape)
    export(bundle, tmp_path / "part.dxf")
    assert area_in_dxf(tmp_path / "part.dxf") == pytest.approx(shape.area, rel=1e-12)
    solid = bundle.solid()
    assert solid.euler_number == 2 - 2 * shape.hole_count
    assert solid.volume == pytest.approx(shape.area * 5.12, rel=1e-8)


@pytest.mark.parametrize(("kind", "name"), [("human", "crane"), ("machine", "discs")])
def test_step_is_one_sound_solid_with_the_exact_volume(
    kind: str, name: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    require_kernel()
    made = part_of(kind, name)
    export(made, tmp_path / "part.step")
    printed = capfd.readouterr()
    assert printed.out == printed.err == ""
    volume, solids, sound = read_step(tmp_path / "part.step")
    assert volume == pytest.approx(made.outline().area * 5.12, rel=1e-6)
    assert (solids, sound) == (1, True)


def test_step_has_pieces_within_holes_as_solids_of_their_own(tmp_path: Path) -> None:
    require_kernel()
    corners = np.array([[0.0, 0.0], [12.0, 0.0], [6.0, 108.0**0.5]])
    inner = 0.3 * (corners - corners.mean(axis=0)) + corners.mean(axis=0)
    beams = np.array([[0, 1], [1, 2], [2, 0]])
    outline = strut_outline(np.vstack([corners, inner]), np.vstack([beams, beams + 3]), 0.3, 0.1)
    (tmp_path / "two.step").write_bytes(step_bytes(outline, 2.0, "two"))
    volume, solids, sound = read_step(tmp_path / "two.step")
    assert volume == pytest.approx(2.0 * outline.area, rel=1e-6)
    assert (solids, sound) == (2, True)


def test_vtu_has_the_struts_where_they_have_moved(part: Part, tmp_path: Path) -> None:
    import meshio

    rest = part.design.problem.lattice.positions
    moved = rest + 0.01 * np.random.default_rng(0).normal(size=rest.shape)
    export(Export(part=part, moved=moved), tmp_path / "moved.vtu")
    export(part, tmp_path / "rest.vtu")
    found, still = (meshio.read(tmp_path / f"{name}.vtu") for name in ("moved", "rest"))
    assert found.points[:, :2] == pytest.approx(moved * part.scale)
    assert still.points[:, :2] == pytest.approx(part.positions)
    assert found.points - found.point_data["displacement_mm"] == pytest.approx(still.points)
    assert (found.cells_dict["line"] == part.struts).all()
    beam = found.cell_data["beam"][0]
    assert (part.design.problem.lattice.beams[beam] == part.struts).all()
    assert set(still.point_data["role"]) <= {1, 2, 3, 4}


def test_the_thickness_is_in_whole_layers_unless_none_are_wanted() -> None:
    design = human_design("crane")
    assert design is not None
    made = PartSpec(thickness=5.0).of(design)
    assert Export(part=made).thickness == 5.12
    assert Export(part=made, layer=0.2).thickness == 5.0
    assert Export(part=made, layer=None).thickness == 5.0


@pytest.mark.parametrize("name", [name for name, format_ in exporters.items() if format_.module])
def test_a_format_without_its_module_names_the_extra(
    tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda _module: None)
    format_ = exporters[name]
    part = PartSpec().of(find_problem("crane").full_design())
    with pytest.raises(InvalidSettings, match=rf"{format_.module}.*bellcrank\[{format_.extra}\]"):
        export(part, tmp_path / f"part{format_.suffixes[0]}")
    assert not list(tmp_path.iterdir())
