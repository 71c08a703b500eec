"""What is said about printing a part, and what is not."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bellcrank.errors import InvalidSettings
from bellcrank.export import Export, PrintRules, PrintWarning, check_print, checks
from bellcrank.model import (
    Design,
    Input,
    Lattice,
    Output,
    Problem,
    Supports,
    gallery_design,
    human_design,
)
from bellcrank.part import Part, PartSpec
from bellcrank.part.outline.grips import filled


def part_of(positions: list, beams: list, mask: list | None = None, **spec: object) -> Part:
    """A part held in its first node, pushed in the second and read in the third."""
    problem = Problem(
        name="test",
        lattice=Lattice(positions, beams),
        supports=Supports(fixed=[0]),
        input=Input(nodes=[1], direction=[0, -1], drive="displacement", amount=0.1),
        output=Output(nodes=[2], direction=[-1, 0]),
        designable=[len(beams) - 1],
    )
    present = np.ones(len(beams), dtype=bool) if mask is None else np.array(mask, dtype=bool)
    return PartSpec(**({"width": 1.6, "thickness": 4.8, "fillet": 0.3} | spec)).of(
        Design(problem=problem, mask=present)
    )


SQUARE = ([[0, 0], [1, 0], [1, 1], [0, 1]], [[0, 1], [1, 2], [2, 3], [3, 0]])


def found(part: Part | Export, **rules: float) -> dict[str, PrintWarning]:
    return {warning.kind: warning for warning in check_print(part, PrintRules(**rules))}


def test_nothing_is_said_of_a_part_that_prints() -> None:
    assert check_print(part_of(*SQUARE)) == []


@pytest.mark.parametrize("name", checks.names())
def test_every_check_says_what_it_finds_in_whole_sentences(name: str) -> None:
    tail = (
        [*SQUARE[0], [2, 1.0], [0.2, 0.5], [3, 3], [4, 3]],
        [*SQUARE[1], [2, 4], [5, 2], [6, 7]],
    )
    part = part_of(*tail, width=0.7, thickness=5.0, fillet=0.01)
    rules = {"bead_width": 12.0, "nozzle": 12.0} if name in {"gaps", "holes"} else {}
    warning = found(part, **rules)[name]
    assert warning.kind == name
    assert warning.sentence[0].isupper() or warning.sentence[0].isdigit()
    assert warning.sentence.endswith(".")


def test_four_beads_of_045_make_a_strut_of_16_and_of_040_do_not() -> None:
    part = part_of(*SQUARE)
    assert "struts" not in found(part, bead_width=0.45, layer=0.32)
    sentence = found(part, bead_width=0.40, layer=0.32)["struts"].sentence
    assert "1.39 or 1.73 mm" in sentence
    assert "5 beads of 0.37 mm" in sentence


@pytest.mark.parametrize("bead", [0.35, 0.45, 0.6])
@pytest.mark.parametrize("lines", [2, 3, 4, 7])
def test_struts_of_whole_lines_are_not_complained_of(bead: float, lines: int) -> None:
    rules = PrintRules(bead_width=bead, layer=0.2)
    part = part_of(*SQUARE, width=rules.width_of(lines))
    assert "struts" not in found(part, bead_width=bead, layer=0.2)
    assert rules.lines_in(rules.width_of(lines)) == lines


def test_lines_side_by_side_hold_the_plastic_of_their_beads() -> None:
    """n beads have the area of n rectangles with half circles; so has what they fill."""
    rules = PrintRules(bead_width=0.5, layer=0.2)
    one = 0.2 * (0.5 - 0.2) + 0.25 * math.pi * 0.2**2
    for lines in (1, 2, 5):
        whole = 0.2 * (rules.width_of(lines) - 0.2) + 0.25 * math.pi * 0.2**2
        assert whole == pytest.approx(lines * one)


def test_struts_of_less_than_two_lines_are_found() -> None:
    sentence = found(part_of(*SQUARE, width=0.5))["struts"].sentence
    assert "2 lines" in sentence
    assert "at least 0.83 mm" in sentence
    assert "struts" not in found(part_of(*SQUARE, width=0.45), min_lines=1)


def test_gaps_are_found_where_a_dead_end_comes_near_a_strut_it_does_not_join() -> None:
    """The tip ends 2 mm from a centre line, struts being 1.6 mm wide."""
    positions = [*SQUARE[0], [0.2, 0.5], [0.5, 0.0]]
    beams = [[0, 5], [5, 1], [1, 2], [2, 3], [3, 0], [2, 4]]
    part = part_of(positions, beams, fillet=0.1)
    gap = found(part)["gaps"]
    assert "1 gap" in gap.sentence
    assert "0.4 mm at (1, 5) mm" in gap.sentence
    assert gap.points == ((pytest.approx(1.0), pytest.approx(5.0)),)
    assert "gaps" not in found(part, bead_width=0.39, nozzle=0.38)


def test_gaps_within_plates_are_not_complained_of() -> None:
    positions = [*SQUARE[0], [0.2, 0.5], [0.5, 0.0]]
    beams = [[0, 5], [5, 1], [1, 2], [2, 3], [3, 0], [2, 4]]
    part = part_of(positions, beams, fillet=0.1)
    plate = filled(part.outline(), part.positions, part.struts, range(6))
    assert plate.hole_count == 0
    assert "gaps" not in found(Export(part=part, shape=plate))


def test_holes_smaller_than_a_bead_are_found_by_the_circle_in_them() -> None:
    positions = [[0, 0], [1, 0], [0.5, 0.75**0.5], [1.5, 0.75**0.5]]
    part = part_of(positions, [[0, 1], [1, 2], [2, 0], [1, 3], [3, 2]], width=5.4, fillet=0.0)
    across = 2.0 * (10.0 / 12.0**0.5 - 2.7)
    holes = found(part, nozzle=0.5, bead_width=0.5)["holes"]
    assert "2 holes less than 0.5 mm across" in holes.sentence
    assert f"{across:.2g} mm" in holes.sentence
    assert len(holes.points) == 2
    assert "holes" not in found(part, nozzle=0.3, bead_width=0.35, layer=0.2)


def test_fillets_smaller_than_half_a_bead_are_found() -> None:
    assert "half a bead (0.225 mm)" in found(part_of(*SQUARE, fillet=0.2))["fillets"].sentence
    assert "fillets" not in found(part_of(*SQUARE, fillet=0.23))


def test_a_thickness_between_layers_is_found() -> None:
    sentence = found(part_of(*SQUARE, thickness=5.0))["layers"].sentence
    assert "16 layers are 5.12 mm" in sentence


def test_loose_pieces_are_found_with_their_place() -> None:
    positions = [*SQUARE[0], [3, 3], [4, 3]]
    pieces = found(part_of(positions, [*SQUARE[1], [4, 5]]))["pieces"]
    assert "in 2 pieces" in pieces.sentence
    (place,) = pieces.points
    assert place[0] > 25.0


def test_dead_ends_are_found_but_not_at_supports_inputs_and_outputs() -> None:
    positions = [*SQUARE[0], [2, 1]]
    ends = found(part_of(positions, [*SQUARE[1], [2, 4]]))["dead-ends"]
    assert "1 strut ends in a free node and carries no load" in ends.sentence
    assert "node 4 at (20, 10) mm" in ends.sentence
    open_ended = part_of(*SQUARE, mask=[1, 1, 0, 0])
    assert "dead-ends" not in found(open_ended)


@pytest.mark.parametrize("kind", ["human", "machine"])
def test_designs_that_come_with_the_package_print_without_gaps(kind: str) -> None:
    design = gallery_design(kind, "crane")
    assert design is not None
    said = found(PartSpec(width=1.6, thickness=4.8, fillet=0.4).of(design))
    assert set(said) <= {"dead-ends"}


@pytest.mark.parametrize(
    ("rules", "message"),
    [
        ({"nozzle": 0.0}, "nozzle: expected a length above 0 mm, got 0.0"),
        ({"layer": 0.41}, "layer: expected at most 0.4 mm, the smaller of nozzle and bead_width"),
        ({"bead_width": math.inf}, "bead_width: expected a length above 0 mm, got inf"),
        ({"min_lines": 0}, "min_lines: expected at least 1, got 0"),
    ],
)
def test_rules_that_make_no_sense_are_refused(rules: dict, message: str) -> None:
    with pytest.raises(InvalidSettings, match=message):
        PrintRules(**rules)


def test_thinner_than_one_layer_is_refused() -> None:
    design = human_design("crane")
    assert design is not None
    with pytest.raises(InvalidSettings, match="less than one layer"):
        check_print(PartSpec(thickness=0.2).of(design))
