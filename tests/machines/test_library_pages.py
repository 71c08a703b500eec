"""The index pages: every entry once, drawn as it moves, in files that need nothing else."""

from __future__ import annotations

import re
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from bellcrank.errors import OutputExists
from bellcrank.machines import elementary
from bellcrank.machines.library import Library, bundled_folder
from bellcrank.machines.library.pages import PAGE, draw, page, write_page
from bellcrank.machines.library.thumbnails import UNITS, thumbnail

DOCS = Path(__file__).parents[2] / "docs" / "library"
NUMBER = re.compile(r"-?\d+")


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Library:
    """Two entries of another folder."""
    folder = tmp_path_factory.mktemp("entries")
    known = Library((bundled_folder(),))
    for name in ("left-7-straight-10g", "down-7-straight-50g"):
        path = known.path(name)
        (folder / path.name).write_bytes(path.read_bytes())
    return Library((folder,))


def test_a_drawing_moves_as_the_design_does() -> None:
    entry = Library((bundled_folder(),)).find("down-9-straight-50g")
    drawn = draw(entry)
    assert drawn.rest.keys() == drawn.moved.keys() == {"m", "i", "o"}
    for name, path in drawn.rest.items():
        assert len(NUMBER.findall(path)) == len(NUMBER.findall(drawn.moved[name]))
    rest, moved = (
        np.array(NUMBER.findall(path["o"]), dtype=float).reshape(-1, 2)
        for path in (drawn.rest, drawn.moved)
    )
    amount = entry.design.problem.input.amount
    down = (moved - rest).mean(axis=0)[1] / UNITS / amount
    assert down == pytest.approx(entry.efficiency, rel=0.05), "as far as whole numbers can tell"


def test_what_does_not_move_is_drawn_at_rest() -> None:
    design = elementary(7, "up").full_design()
    drawn = thumbnail(design, np.full((design.problem.lattice.node_count, 2), np.nan))
    assert drawn.rest == drawn.moved


def test_the_page_shows_each_entry_once(small: Library, tmp_path: Path) -> None:
    path = write_page(small, tmp_path)
    assert path.name == PAGE
    text = path.read_text()
    for name in small.names():
        assert text.count(f"`{name}`") == 1
        ET.parse(tmp_path / f"{name}.svg")
    assert "nan" not in text
    with pytest.raises(OutputExists):
        write_page(small, tmp_path)


def test_pictures_of_removed_entries_are_removed(small: Library, tmp_path: Path) -> None:
    for name in ("up-own-00000000.svg", "a-picture-of-mine.svg"):
        (tmp_path / name).write_text("<svg/>")
    write_page(small, tmp_path)
    found = {path.stem for path in tmp_path.glob("*.svg")}
    assert found == {*small.names(), "a-picture-of-mine"}


def test_the_page_in_the_documentation_is_that_of_the_bundled_entries() -> None:
    if not DOCS.is_dir():
        pytest.skip("no documentation beside the tests")
    known = Library((bundled_folder(),))
    assert sorted(path.stem for path in DOCS.glob("*.svg")) == known.names()
    text = (DOCS / PAGE).read_text()
    entry = known.find(known.names()[-1])
    assert page([entry]).splitlines()[-1] in text
    assert all(f"`{name}`" in text for name in known.names())
    assert (DOCS / f"{entry.name}.svg").read_text() == draw(entry).svg(entry.name)
