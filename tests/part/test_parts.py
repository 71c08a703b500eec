"""Parts: lengths, materials, sizes, what is written of them, and springs that stand for struts."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from bellcrank.errors import InvalidFile, InvalidSettings, UnknownName
from bellcrank.model import find_problem, human_design
from bellcrank.part import (
    Material,
    Part,
    PartSpec,
    Section,
    materials,
    read_length,
    read_part,
)
from bellcrank.part.pieces import beam_pieces, check_supported

if TYPE_CHECKING:
    from pathlib import Path

RUBBER = Material(name="rubber", young=12.0, poisson=0.48)


@pytest.mark.parametrize(
    ("text", "expected"),
    [("2mm", 2.0), ("2", 2.0), (" 0.2 cm ", 2.0), ("2e-3m", 2.0), ("500um", 0.5), (1, 1.0)],
)
def test_lengths_are_read_with_their_units(text: str | float, expected: float) -> None:
    assert read_length("width", text) == pytest.approx(expected)


@pytest.mark.parametrize(
    "text", ["", "mm", "2 miles", "1.2.3mm", "nan", "inf", "1e999", True, None]
)
def test_what_is_no_length_is_refused(text: object) -> None:
    with pytest.raises(InvalidSettings, match=r"width: expected a length like 2mm"):
        read_length("width", text)  # type: ignore[arg-type]


@pytest.mark.parametrize("name", list(materials))
def test_every_material_says_where_each_figure_comes_from(name: str) -> None:
    material = materials[name]
    assert material.name == name
    for figure in ("young", "poisson", "density", "strain_limit"):
        known = not math.isnan(getattr(material, figure))
        assert known == bool(material.sources.get(figure)), figure


@pytest.mark.parametrize(
    ("changes", "word"),
    [
        ({"young": 0.0}, "young"),
        ({"young": math.inf}, "young"),
        ({"poisson": 0.5}, "poisson"),
        ({"poisson": -0.1}, "poisson"),
        ({"density": -1.0}, "density"),
        ({"strain_limit": 0.0}, "strain_limit"),
    ],
)
def test_impossible_materials_are_refused(changes: dict[str, float], word: str) -> None:
    with pytest.raises(InvalidSettings, match=f"^{word}: expected"):
        replace(RUBBER, **changes)  # type: ignore[arg-type]


def test_a_part_is_refused_that_cannot_be_built() -> None:
    crane = find_problem("crane").full_design()
    with pytest.raises(InvalidSettings, match=r"width: struts 10 mm wide are not slender"):
        Part(crane, RUBBER, Section(10.0, 5.0))
    with pytest.raises(InvalidSettings, match=r"scale: expected a length above 0"):
        Part(crane, RUBBER, Section(2.0, 5.0), scale=0.0)
    with pytest.raises(InvalidSettings, match=r"fillet: expected a radius"):
        Part(crane, RUBBER, Section(2.0, 5.0), fillet=-1.0)
    with pytest.raises(InvalidSettings, match=r"no beams"):
        Part(crane.with_mask(np.zeros_like(crane.mask)), RUBBER, Section(2.0, 5.0))
    with pytest.raises(UnknownName, match=r"unknown material 'jelly'; known: ninjaflex"):
        PartSpec(material="jelly").of(crane)


def test_a_fillet_that_leaves_no_room_is_refused_and_the_default_always_fits() -> None:
    human = human_design("crane")
    assert human is not None
    with pytest.raises(InvalidSettings, match=r"^fillet: .* at most 1\.88 mm leaves room"):
        PartSpec(fillet=3.0).of(human).outline()
    for width in (0.5, 2.0, 5.0, 5.7):
        part = PartSpec(width=width).of(human)
        assert part.outline().hole_count > 0
        assert 0.0 < part.fillet_radius <= width / 4.0


def test_a_specification_survives_being_written(tmp_path: Path) -> None:
    spec = PartSpec(width=1.6, fillet=0.3, material=RUBBER)
    assert PartSpec.from_dict(spec.to_dict()) == spec
    path = tmp_path / "part.toml"
    path.write_text(
        'schema = "bellcrank/part/1"\nwidth = "1.6mm"\nfillet = 0.3\n'
        'material = { name = "rubber", young = 12.0, poisson = 0.48 }\n'
    )
    assert read_part(path) == spec


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("width = 2.0", "schema"),
        ('schema = "bellcrank/part/1"\ngirth = 2.0', "girth"),
        ('schema = "bellcrank/part/1"\nmaterial = { young = 1.0 }', "poisson"),
        ('schema = "bellcrank/part/1"\nwidth = true', "width"),
    ],
)
def test_a_file_that_describes_no_part_is_refused(tmp_path: Path, text: str, word: str) -> None:
    path = tmp_path / "part.toml"
    path.write_text(text)
    with pytest.raises((InvalidFile, InvalidSettings), match=word):
        read_part(path)


def test_the_part_of_a_section_has_it_in_millimetres() -> None:
    assert PartSpec.of_section(Section(0.15, 0.4), 8.0) == PartSpec(
        width=1.2, thickness=3.2, scale=8.0, joint=0.0
    )


def test_loose_pieces_are_found_and_named() -> None:
    crane = find_problem("crane").full_design()
    check_supported(crane)
    mask = crane.mask.copy()
    mask[crane.problem.designable] = False
    loose = crane.with_mask(mask)  # input and output hang in the air
    assert beam_pieces(loose).max() == 2
    with pytest.raises(InvalidSettings, match=r"3 pieces: \d+ of its \d+ beams .* first beam \d+"):
        check_supported(loose)
