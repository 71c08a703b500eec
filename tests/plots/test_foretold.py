from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from matplotlib.image import imread

from bellcrank.errors import InvalidSettings, OutputExists
from bellcrank.plots import StrokeOfMachine, draw_foretold

if TYPE_CHECKING:
    from pathlib import Path

MOTION = np.linspace(0.0, 0.4, 9)


def stroke(bend: float, *, complete: bool = True) -> StrokeOfMachine:
    return StrokeOfMachine(MOTION, -2.0 * MOTION + bend * MOTION**2, 0.3 * MOTION, complete)


def ink(path: Path) -> int:
    """How many points are not white."""
    return int((imread(path)[..., :3] < 0.99).any(axis=2).sum())


def test_what_is_simulated_is_drawn_beside_what_is_foretold(tmp_path: Path) -> None:
    draw_foretold(stroke(1.0), (-2.0, 0.3), tmp_path / "alone.png", title="t", note="n")
    draw_foretold(
        stroke(1.0), (-2.0, 0.3), tmp_path / "both.png",
        simulated=stroke(1.1, complete=False), title="t", note="n",
    )  # fmt: skip
    assert ink(tmp_path / "both.png") > ink(tmp_path / "alone.png") > 1000


def test_the_same_picture_is_the_same_file(tmp_path: Path) -> None:
    for name in ("one.png", "two.png"):
        draw_foretold(stroke(1.0), (-2.0, 0.3), tmp_path / name)
    assert (tmp_path / "one.png").read_bytes() == (tmp_path / "two.png").read_bytes()


def test_nothing_is_overwritten_and_formats_are_known(tmp_path: Path) -> None:
    path = tmp_path / "stroke.svg"
    draw_foretold(stroke(1.0), (-2.0, 0.3), path)
    with pytest.raises(OutputExists):
        draw_foretold(stroke(1.0), (-2.0, 0.3), path)
    with pytest.raises(InvalidSettings, match="expected a picture name"):
        draw_foretold(stroke(1.0), (-2.0, 0.3), tmp_path / "stroke.gif")
