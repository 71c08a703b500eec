"""`bellcrank card`: one page about a design as a part."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
import pytest
from matplotlib.transforms import Bbox

from bellcrank.export import Export
from bellcrank.model import find_problem, human_design
from bellcrank.plots.card import card_figure
from bellcrank.workflows import find_design, spec_for
from bellcrank.workflows.card import card_of, design_hash

from .helpers import call, colours, files, refusal, write

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.usefixtures("here")


@pytest.mark.parametrize(
    ("design", "name"),
    [
        ("human:crane", "card.pdf"),
        pytest.param("machine:pliers", "card.png", marks=pytest.mark.slow),
    ],
)
def test_a_card_is_drawn_on_one_page(here: Path, design: str, name: str) -> None:
    outcome = call("card", design, name)
    assert outcome.code == 0, outcome.err
    assert outcome.err.splitlines()[-1] == f"wrote {name}"
    content = (here / name).read_bytes()
    if name.endswith("pdf"):
        assert content.startswith(b"%PDF")
        assert b"/Count 1" in content
    else:
        assert colours(here / name) > 100


@pytest.mark.slow
def test_a_card_takes_up_the_record_of_a_run(copy: Path, here: Path) -> None:
    call("validate", copy, "--elements", 2)
    without = call("card", copy / "design.json", "one.png")
    assert without.code == 0, without.err
    call("validate", copy, "--theory", "timoshenko", "--linear")
    assert call("card", copy, "two.png").code == 0
    assert (here / "one.png").read_bytes() != (here / "two.png").read_bytes()


def overlaps(boxes: list[tuple[str, Bbox]]) -> list[tuple[str, str]]:
    """Pairs of named boxes that overlap by more than one point each way."""
    found = []
    for (name, box), (other_name, other) in combinations(boxes, 2):
        common = Bbox.intersection(box, other)
        if common is not None and min(common.width, common.height) > 1.0:
            found.append((name, other_name))
    return found


@pytest.mark.parametrize(
    "name",
    [
        "human:crane",
        pytest.param("human:pliers", marks=pytest.mark.slow),
        pytest.param("machine:twist-column", marks=pytest.mark.slow),
    ],
)
def test_nothing_on_a_card_overlaps_and_nothing_is_cut(name: str) -> None:
    design = find_design(name)
    entry = {
        "level": "solid", "linear": True, "efficiency": -12.345,
        "status": "converged", "von_mises_MPa": 0.123, "principal_strain": 0.1,
    }  # fmt: skip
    figure = card_figure(card_of(design, spec_for(design), [entry] * 6, name))
    figure.set_dpi(72.0)
    figure.canvas.draw()
    [legend] = figure.legends
    boxes = [(text.get_text(), text.get_window_extent()) for text in figure.texts]
    boxes += [("legend", legend.get_window_extent())]
    panel, *diagrams = figure.axes
    boxes += [("drawing", panel.get_window_extent())]
    boxes += [("diagram", diagram.get_tightbbox()) for diagram in diagrams]
    assert overlaps([(label, box) for label, box in boxes if label.strip()]) == []
    page = figure.bbox
    for label, box in boxes:
        assert page.x0 <= box.x0 <= box.x1 <= page.x1, label
        assert page.y0 <= box.y0 <= box.y1 <= page.y1, label


def test_a_card_in_space_has_the_size_and_volume_of_the_solid() -> None:
    design = find_design("human:orthogonal")
    spec = spec_for(design)
    tables = dict(card_of(design, spec, []).tables)
    part = dict(tables["Part"])
    solid = Export(part=spec.of(design)).solid()
    wide, deep, high = np.ptp(solid.vertices, axis=0)
    assert part["size"] == f"{wide:.1f} x {deep:.1f} x {high:.2f} mm"
    assert part["struts"] == "diameter 2 mm"
    assert part["volume"] == f"{solid.volume / 1000.0:.2f} cm3"
    assert dict(tables["Printing"])["warnings"] == "overhangs"


def test_cards_are_refused_like_all_pictures(here: Path) -> None:
    write(here / "card.pdf", "mine")
    assert "card.pdf: exists already" in refusal("card", "crane", "card.pdf")
    assert "card.txt: expected a picture name" in refusal("card", "crane", "card.txt")
    assert "width: expected a length" in refusal("card", "crane", "a.pdf", "--width", "wide")
    assert set(files(here)) == {"card.pdf"}


def test_a_hash_names_problem_stroke_and_beams() -> None:
    crane = find_problem("crane").full_design()
    human = human_design("crane")
    assert human is not None
    hashes = {
        design_hash(crane),
        design_hash(human),
        design_hash(find_problem("discs").full_design()),
    }
    assert len(hashes) == 3
    assert design_hash(crane) == design_hash(find_problem("crane").full_design())
