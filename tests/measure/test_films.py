"""Rendered films: figures against what was rendered, refusals, the command line."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING
from unittest import mock

import numpy as np
import pytest

from tests.cli.helpers import call, refusal

cv2 = pytest.importorskip("cv2")
pytest.importorskip("av")

from bellcrank.workflows.measure import layout_for  # noqa: E402
from benchmarks import measure as benchmark  # noqa: E402
from benchmarks.cameras import camera_over  # noqa: E402
from benchmarks.films import Look, Renderer, Scene, write_film  # noqa: E402
from benchmarks.measure import measured_film, measured_outline  # noqa: E402
from benchmarks.random_films import REFUSED, computed  # noqa: E402

if TYPE_CHECKING:
    from pathlib import Path

DESIGN = "human:crane"
WORDS = {
    "no markers": "no markers found",
    "too few frames": "4 pictures; expected at least 6",
    "too blurred": "too blurred",
    "motion too small": "motion too small for the resolution",
    "supports moved": "supports moved",
    "reference markers hidden": "reference markers not visible",
    "input marker hidden": "the input marker 30 is seen in only 3 of 12 frames",
    "pushed at the start": "against its direction",
    "another design": "the output marker 39 is seen in no frame",
    "no contrast": "part and background hardly differ",
    "blurred outline": "too blurred",
}


@pytest.fixture(autouse=True)
def here(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> None:
    """An empty current folder."""
    monkeypatch.chdir(tmp_path_factory.mktemp("here"))


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A film with markers: tilted, distorted, blurred, noisy, in uneven light."""
    return rendered(tmp_path_factory.mktemp("film") / "film.mp4", with_markers=True)


@pytest.fixture(scope="module")
def bare(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A film without markers."""
    return rendered(tmp_path_factory.mktemp("bare") / "film.mp4", with_markers=False)


def rendered(path: Path, with_markers: bool) -> Path:
    own, rng = computed(DESIGN), np.random.default_rng(5)
    layout = layout_for(own)
    corners = np.concatenate([marker.corners for marker in layout.reference])
    points = corners if with_markers else own.part.positions[np.unique(own.part.struts)]
    camera = camera_over(
        points.min(axis=0) - 5.0, points.max(axis=0) + 5.0, (1280, 720), rng, tilt=12.0, focal=0.8,
        distortion=np.array([-0.05, 0.01, 0.0, 0.0]),
    )  # fmt: skip
    scene = Scene(part=own.part, layout=layout if with_markers else None)
    look = Look(blur=1.0, noise=0.008, part=0.12, table=0.6)
    renderer = Renderer(scene, look, rng, samples=2)
    fractions = np.concatenate([[0.0, 0.0], np.linspace(0.0, 1.0, 12)[1:], [1.0]])
    places = own.positions_at(fractions * own.full_stroke)
    write_film((renderer.draw(at, camera) for at in places), path)
    return path


def test_a_film_is_measured_within_2_percent(film: Path) -> None:
    outcome = call("measure", film, "--design", DESIGN, "--json")
    assert outcome.code == 0, outcome.err
    data = outcome.data
    figure = data["efficiency"]
    exact = computed(DESIGN)
    assert figure["computed"] == pytest.approx(
        float(exact.at(np.array([data["reached_mm"]]))[0, 0]) / data["reached_mm"]
    )
    assert figure["measured"] == pytest.approx(figure["computed"], rel=0.02)
    assert figure["low"] <= figure["computed"] <= figure["high"]
    last = data["strokes"][-1]
    for key in ("off_axis", "rotation_deg"):
        assert last[key]["low"] <= last[key]["computed"] <= last[key]["high"]
    assert data["reached_mm"] == pytest.approx(exact.full_stroke, rel=0.02)
    assert data["schema"] == "bellcrank/measurement/1"
    assert len(data["measured_motion"]["input_mm"]) == data["frames"]["read"] == 14


def test_a_part_without_markers_is_measured_within_5_percent(bare: Path) -> None:
    outcome = call("measure", bare, "--design", DESIGN, "--outline", "--json")
    assert outcome.code == 0, outcome.err
    figure = outcome.data["efficiency"]
    assert figure["measured"] == pytest.approx(figure["computed"], rel=0.05)
    assert figure["low"] <= figure["computed"] <= figure["high"]


def test_photographs_are_measured_like_a_film(film: Path, tmp_path: Path) -> None:
    capture, number = cv2.VideoCapture(str(film)), 0
    while True:
        good, picture = capture.read()
        if not good:
            break
        cv2.imwrite(str(tmp_path / f"{number:03}.png"), picture)
        number += 1
    folder = call("measure", tmp_path, "--design", DESIGN, "--json").data
    paths = call("measure", *sorted(tmp_path.glob("*.png")), "--design", DESIGN, "--json").data
    assert folder["efficiency"] == paths["efficiency"]
    assert folder["efficiency"]["measured"] == pytest.approx(
        call("measure", film, "--design", DESIGN, "--json").data["efficiency"]["measured"],
        rel=0.005,
    )


def test_the_table_and_the_overlay_are_written(film: Path, tmp_path: Path) -> None:
    movie = tmp_path / "overlay.mp4"
    outcome = call("measure", film, "--design", DESIGN, "--overlay", movie)
    assert outcome.code == 0, outcome.err
    for word in ("efficiency", "off-axis", "rotation", "path x", "95 % interval", "computed"):
        assert word in outcome.out
    capture = cv2.VideoCapture(str(movie))
    assert int(capture.get(cv2.CAP_PROP_FRAME_COUNT)) == 14
    good, picture = capture.read()
    assert good
    # Struts as computed are drawn in orange on the grey film.
    assert (picture[..., 2].astype(int) - picture[..., 0] > 60).sum() > 500
    assert "exists already" in refusal(
        "measure", film, "--design", DESIGN, "--overlay", movie, folder=tmp_path
    )


@pytest.mark.parametrize("kind", REFUSED)
def test_films_that_cannot_be_measured_are_refused_with_the_reason(kind: str) -> None:
    assert WORDS[kind] in benchmark.refusal(kind)


def test_wrong_arguments_are_refused_in_one_line(film: Path, tmp_path: Path) -> None:
    text = tmp_path / "film.txt"
    text.write_text("no film")
    for words, reason in (
        ((tmp_path / "none.mp4", "--design", DESIGN), "no such file or folder"),
        ((text, "--design", DESIGN), "cannot be read as a film"),
        ((film, "--design", "nosuch"), "nosuch"),
        ((film, "--design", "machine:pliers"), "the input is a force"),
        ((film, "--design", DESIGN, "--sheet", "wide"), "sheet: expected width and height"),
        ((film, "--design", DESIGN, "--sheet", "100x100"), "sheet: 100 x 100 mm"),
        ((film, "--design", DESIGN, "--outline", "--sheet", "100x90"), "outline"),
        ((film, "--design", DESIGN, "--markers", text), "cannot be read"),
    ):
        assert reason in refusal("measure", *words, folder=tmp_path)


def test_a_missing_opencv_names_the_extra(film: Path) -> None:
    with mock.patch.dict("sys.modules", {"cv2": None}):
        message = refusal("measure", film, "--design", DESIGN)
    assert "pip install 'bellcrank[measure]'" in message


def test_export_writes_markers_that_measure_reads(film: Path, tmp_path: Path) -> None:
    outcome = call("export", DESIGN, tmp_path / "part.svg", "--markers")
    assert outcome.code == 0, outcome.err
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {
        "part.svg", "part.markers.pdf", "part.markers.svg", "part.cards.svg", "part.markers.json"
    }  # fmt: skip
    positions = tmp_path / "part.markers.json"
    assert json.loads(positions.read_text())["page"] == "A4"
    with_file = call("measure", film, "--design", DESIGN, "--markers", positions, "--json")
    assert with_file.data["efficiency"] == call(
        "measure", film, "--design", DESIGN, "--json"
    ).data["efficiency"]  # fmt: skip
    assert "exists already" in refusal(
        "export", DESIGN, tmp_path / "part.svg", "--markers", folder=tmp_path
    )
    for words, reason in (
        (("other.svg", "--markers", "--marker-size", "200mm"), "marker size"),
        (("other.svg", "--marker-size", "10mm"), "expected --markers"),
        (("other.vtu", "--markers"), "expected a file for making the part"),
    ):
        assert reason in refusal("export", DESIGN, *words)
    assert "the input is a force" in refusal("export", "machine:pliers", "p.svg", "--markers")


def test_the_printed_sheet_has_its_true_size(tmp_path: Path) -> None:
    """The page is drawn with 10 pixels in a mm, and its markers are detected."""
    from bellcrank.measure.corners import detect_markers
    from bellcrank.plots.marker_sheet import sheet_figure

    own = computed(DESIGN)
    layout = layout_for(own)
    figure = sheet_figure(layout, own.part, own.positions)
    figure.savefig(tmp_path / "sheet.png", dpi=254)
    found = detect_markers(cv2.imread(str(tmp_path / "sheet.png"), cv2.IMREAD_GRAYSCALE))
    assert set(found.ids.tolist()) == {marker.id for marker in layout.reference}
    centres = {k: each.mean(axis=0) for k, each in zip(found.ids, found.corners, strict=True)}
    first, last = layout.reference[0], layout.reference[-1]
    seen = np.linalg.norm(centres[first.id] - centres[last.id]) / 10.0
    assert seen == pytest.approx(np.linalg.norm(first.centre - last.centre), abs=0.1)


def test_the_protocol_is_one_page(tmp_path: Path) -> None:
    outcome = call("card", DESIGN, tmp_path / "film.pdf", "--protocol")
    assert outcome.code == 0, outcome.err
    content = (tmp_path / "film.pdf").read_bytes()
    assert content.startswith(b"%PDF")
    assert b"/Count 1" in content


def recorded(kind: str, number: int) -> float:
    """Return the measured efficiency of a film in the record."""
    record = json.loads(benchmark.RECORD.read_text(encoding="utf-8"))
    return float(record[kind][str(number)]["efficiency"][1])


@pytest.mark.slow
@pytest.mark.parametrize("number", range(4))
def test_films_of_the_benchmark_are_measured_as_recorded(number: int) -> None:
    _, found, *_ = measured_film(number)["efficiency"]
    assert found == pytest.approx(recorded("markers", number), rel=0.005)


@pytest.mark.slow
@pytest.mark.parametrize("number", range(2))
def test_films_without_markers_are_measured_as_recorded(number: int) -> None:
    _, found, *_ = measured_outline(number)["efficiency"]
    assert found == pytest.approx(recorded("outline", number), rel=0.005)
