"""Every form of `bellcrank animate`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import av
import numpy as np
import pytest
from PIL import Image

from bellcrank.cli import live

from .helpers import PROBLEM, call, files, refusal, write

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.usefixtures("here")

QUICK = ("--seconds", "0.4", "--fps", "20", "--size", "320x180")


def filmed(here: Path, *words: object) -> Path:
    """Film, and return the only file that is new in the current folder."""
    before = files(here)
    outcome = call("animate", *words, *QUICK)
    assert outcome.code == 0, outcome.err
    assert outcome.out == ""
    (name,) = set(files(here)) - set(before)
    assert outcome.err.splitlines()[-1] == f"wrote {name}"
    return here / name


def frames_of(path: Path) -> list[np.ndarray]:
    with av.open(str(path)) as container:
        return [frame.to_ndarray(format="gray") for frame in container.decode(video=0)]


def test_a_motion_is_filmed_as_long_and_as_large_as_asked_for(here: Path, small: str) -> None:
    frames = frames_of(filmed(here, small, "motion.mp4"))
    assert [frame.shape for frame in frames] == [(180, 320)] * 8
    assert np.abs(frames[0].astype(int) - frames[-1]).mean() < 0.5
    assert np.abs(frames[0].astype(int) - frames[4]).mean() > 0.5


def test_progress_lines_of_a_slow_machine_come_before_the_name_of_the_file(
    here: Path, small: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(live, "QUIET_INTERVAL", 0.0)
    outcome = call("animate", small, "motion.gif", *QUICK)
    lines = outcome.err.splitlines()
    assert lines[-1] == "wrote motion.gif"
    assert len(lines) > 2


def test_the_suffix_chooses_the_format(here: Path, small: str) -> None:
    with Image.open(filmed(here, small, "motion.gif")) as picture:
        assert (picture.format, picture.size) == ("GIF", (320, 180))
        assert picture.info["loop"] == 0


@pytest.mark.parametrize("what", ["", "design.json"])
def test_the_design_of_a_run_is_filmed(here: Path, whole: Path, what: str) -> None:
    assert len(frames_of(filmed(here, whole / what, "motion.mp4"))) == 8


def test_two_designs_are_filmed_beside_each_other(here: Path, whole: Path) -> None:
    two = frames_of(filmed(here, PROBLEM, "two.mp4", "--compare", whole))
    one = frames_of(filmed(here, PROBLEM, "one.mp4"))
    assert np.abs(two[4].astype(int) - one[4]).mean() > 1.0


def test_a_larger_motion_is_another_movie(here: Path, small: str) -> None:
    plain = filmed(here, small, "plain.gif")
    larger = filmed(here, small, "larger.gif", "--magnify", "3")
    assert plain.read_bytes() != larger.read_bytes()


def test_a_movie_is_replaced_on_request_only(here: Path, small: str) -> None:
    write(here / "m.gif", "precious")
    line = refusal("animate", small, "m.gif", *QUICK)
    assert line.startswith("error: m.gif: exists already; ")
    assert call("animate", small, "m.gif", "--overwrite", *QUICK).code == 0
    assert (here / "m.gif").read_bytes().startswith(b"GIF89a")


@pytest.mark.parametrize("form", [(), ("--compare", PROBLEM)])
@pytest.mark.parametrize("name", ["m.avi", "m", "m.mp4.txt"])
def test_an_unknown_format_is_refused(small: str, form: tuple[str, ...], name: str) -> None:
    line = refusal("animate", small, name, *form)
    assert line == f"error: {name}: expected a movie name ending in .mp4, .gif"


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (("--seconds", "0"), "seconds: expected a number above 0, got 0.0"),
        (("--seconds", "nan"), "seconds: expected a number above 0, got nan"),
        (("--seconds", "1e9"), "expected 3 to 36000"),
        (("--fps", "0"), "fps: expected a whole number from 1 to 120, got 0"),
        (("--size", "large"), "size: expected pixels like 1920x1080, got 'large'"),
        (("--size", "-4x5"), "size: expected pixels like 1920x1080, got '-4x5'"),
        (("--size", "101x100"), "size: expected even numbers for an MP4, got 101x100"),
        (("--size", "8x8"), "size: expected 96 to 7680 pixels each way, got 8x8"),
        (("--magnify", "0", *QUICK), "magnify: expected a number above 0, got 0.0"),
        (("--objective", "best"), "unknown objective 'best'; known: displacement, "),
        (("--compare", "nowhere"), "unknown problem 'nowhere'; known: "),
    ],
)
def test_what_makes_no_sense_is_refused(small: str, words: tuple[str, ...], complaint: str) -> None:
    assert complaint in refusal("animate", small, "m.mp4", *words)


def test_a_missing_folder_for_the_movie_is_named(small: str) -> None:
    line = refusal("animate", small, "no/m.gif", *QUICK, code=1)
    assert line.startswith("error: no/m.gif: cannot be written (No such file or directory)")
