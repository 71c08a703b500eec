"""The picture of a network-driven search."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest
from matplotlib.image import imread

from bellcrank.errors import InvalidSettings, OutputExists
from bellcrank.plots.driven import DrivenSearch, draw_driven

if TYPE_CHECKING:
    from pathlib import Path


def search(count: int, *, failed: int = 0, compared: int = 30, known: bool = True) -> DrivenSearch:
    rng = np.random.default_rng(count)
    true = rng.normal(1.5, 0.4, count)
    true[:failed] = np.nan
    return DrivenSearch(
        "crane", "by a network", true, rng.normal(1.8, 0.4, count),
        rng.normal(1.6, 0.4, compared), rng.poisson(60, count) if known else None,
    )  # fmt: skip


@pytest.mark.parametrize(
    "drawn",
    [
        search(40),
        search(1),
        search(12, failed=3),
        search(5, failed=5, compared=0),
        search(20, known=False),
        search(20, compared=0, known=False),
        replace(search(30, known=False), exact=True),
    ],
)
def test_whatever_was_found_can_be_drawn(drawn: DrivenSearch, tmp_path: Path) -> None:
    draw_driven(drawn, tmp_path / "driven.png")
    picture = imread(tmp_path / "driven.png")
    assert (picture[..., :3].min(axis=2) < 0.9).mean() > 0.005
    wide = picture.shape[1] / picture.shape[0]
    assert wide > 2.0 if drawn.distance is not None else wide < 2.0


def test_a_picture_is_not_overwritten_unasked(tmp_path: Path) -> None:
    draw_driven(search(9), tmp_path / "driven.svg")
    with pytest.raises(OutputExists):
        draw_driven(search(9), tmp_path / "driven.svg")
    draw_driven(search(9), tmp_path / "driven.svg", overwrite=True)


def test_an_unknown_format_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidSettings, match="expected a picture name"):
        draw_driven(search(9), tmp_path / "driven.jpg")
