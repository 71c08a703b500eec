"""Pictures in files: what they show, what they are called, and what is never written over."""

from __future__ import annotations

import csv
import io
from typing import TYPE_CHECKING

import numpy as np
import pytest
from PIL import Image

from bellcrank.errors import InvalidSettings, OutputExists, UnknownName
from bellcrank.learning import exporting
from bellcrank.learning.exporting import LABELS, UNDER_WAY, export_pictures, styles
from bellcrank.surrogate.pictures import Canvas, Renderer

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from bellcrank.model import Problem
    from bellcrank.surrogate.dataset import Dataset

FIRST = "00000-000000.png"


@pytest.fixture(scope="module")
def few(data: Dataset) -> Dataset:
    return data.take(np.arange(0, 320, 27))


def by_savefig(problem: Problem, mask: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """A picture as matplotlib saves a figure without frame."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    canvas = Canvas()
    figure = Figure(figsize=(canvas.width / 72, canvas.height / 72), dpi=72, frameon=False)
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    axes.set_xlim(0, canvas.width)
    axes.set_ylim(0, canvas.height)
    for ends in canvas.place(problem.lattice.positions)[problem.lattice.beams][mask]:
        axes.plot(*ends.T, color="black", linewidth=canvas.line, solid_capstyle="round")
    buffer = io.BytesIO()
    figure.savefig(buffer, dpi=72)
    return np.array(Image.open(buffer))


@pytest.mark.parametrize("style", list(styles))
def test_every_style_writes_a_picture_of_each_design_and_a_table(
    few: Dataset, tmp_path: Path, style: str
) -> None:
    told: list[tuple[int, int]] = []
    written = export_pictures(few, tmp_path / "p", style=style, tell=lambda *at: told.append(at))
    assert written == len(few) == 12
    assert told[0] == (0, 12)
    assert told[-1] == (12, 12)
    rows = list(csv.DictReader((tmp_path / "p" / LABELS).read_text().splitlines()))
    names = [row["name"] for row in rows]
    assert sorted([*names, LABELS]) == sorted(path.name for path in (tmp_path / "p").iterdir())
    assert names[0] == FIRST
    assert [float(row["efficiency"]) for row in rows] == few.efficiency.tolist()
    assert [int(row["run"]) for row in rows] == few.run.tolist()
    assert [int(row["step"]) for row in rows] == few.step.tolist()
    assert [bool(int(row["accepted"])) for row in rows] == few.accepted.tolist()
    for name in names:
        with Image.open(tmp_path / "p" / name) as picture:
            assert picture.size == (192, 128)


def test_the_fine_style_is_what_networks_look_at(few: Dataset, tmp_path: Path) -> None:
    export_pictures(few, tmp_path / "p")
    ink = Renderer(few.problem.lattice).render(few.packed)
    with Image.open(tmp_path / "p" / FIRST) as picture:
        assert np.array_equal(255 - np.array(picture), ink[0])


def test_the_paper_s_style_is_what_savefig_saves_to_the_last_bit(
    few: Dataset, tmp_path: Path
) -> None:
    export_pictures(few, tmp_path / "p", style="paper", count=1)
    name = next(iter((tmp_path / "p").glob("*.png")))
    run, step = map(int, name.stem.split("-"))
    row = np.flatnonzero((few.run == run) & (few.step == step))[0]
    mask = np.unpackbits(few.packed[row], count=few.problem.lattice.beam_count).astype(bool)
    with Image.open(name) as picture:
        found = np.array(picture)
    assert np.array_equal(found, by_savefig(few.problem, mask))
    assert set(np.unique(found[..., 0])) == {0, 255}  # no grey but in alpha
    assert len(np.unique(found[..., 3])) > 20


def test_some_are_spread_over_the_dataset(data: Dataset, tmp_path: Path) -> None:
    assert export_pictures(data, tmp_path / "p", count=16) == 16
    names = sorted(path.stem for path in (tmp_path / "p").glob("*.png"))
    assert sorted({int(name[:5]) for name in names}) == list(range(8))
    assert len({name[-6:] for name in names}) > 8
    assert export_pictures(data.take(np.arange(3)), tmp_path / "q", count=16) == 3


def test_an_export_that_was_stopped_goes_on(
    few: Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(exporting, "BATCH", 5)

    class Stopped(BaseException):
        pass

    def stop(done: int, _total: int) -> None:
        if done == 5:
            raise Stopped

    folder = tmp_path / "p"
    with pytest.raises(Stopped):
        export_pictures(few, folder, tell=stop)
    assert len(list(folder.glob("*.png"))) == 5
    assert not (folder / LABELS).exists()
    (folder / f".{FIRST}.0123abcd").write_bytes(b"half a picture")
    with pytest.raises(OutputExists, match="not empty"):
        export_pictures(few, folder, style="paper")
    before = (folder / FIRST).stat().st_mtime_ns
    assert export_pictures(few, folder) == 12
    assert (folder / FIRST).stat().st_mtime_ns == before
    assert len(list(folder.iterdir())) == 13
    assert not (folder / UNDER_WAY).exists()


def test_a_folder_that_is_in_use_is_left_alone(few: Dataset, tmp_path: Path) -> None:
    export_pictures(few, tmp_path / "p")
    with pytest.raises(OutputExists, match=r"p: exists already and is not empty"):
        export_pictures(few, tmp_path / "p")
    (tmp_path / "notes").mkdir()
    (tmp_path / "notes" / "mine.txt").write_text("mine")
    with pytest.raises(OutputExists, match=r"it holds mine\.txt"):
        export_pictures(few, tmp_path / "notes")
    with pytest.raises(OutputExists, match="is a file"):
        export_pictures(few, tmp_path / "notes" / "mine.txt")
    assert [path.name for path in (tmp_path / "notes").iterdir()] == ["mine.txt"]


def test_what_makes_no_sense_is_refused_before_anything_is_written(
    few: Dataset, tmp_path: Path
) -> None:
    with pytest.raises(UnknownName, match="unknown style 'coarse'; known: fine, paper"):
        export_pictures(few, tmp_path / "p", style="coarse")
    with pytest.raises(InvalidSettings, match="count: expected at least 1, got 0"):
        export_pictures(few, tmp_path / "p", count=0)
    twice = few.take(np.array([0, 0]))
    with pytest.raises(InvalidSettings, match="the same run and step"):
        export_pictures(twice, tmp_path / "p")
    assert not (tmp_path / "p").exists()
