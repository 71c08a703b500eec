"""Fits that are kept are a short cut and nothing else."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from bellcrank.errors import InvalidSettings
from bellcrank.machines import Fit, Reach, fit, mean_ports, usual_reach
from bellcrank.machines.shelf import kept_fit, usual_folder
from bellcrank.model import find_problem

if TYPE_CHECKING:
    from pathlib import Path

    from bellcrank.model import Design

DEGREES = (2, 3)


@pytest.fixture(scope="module")
def design() -> Design:
    return find_problem("scaling-8").full_design()


@pytest.fixture(scope="module")
def reach(design: Design) -> Reach:
    return usual_reach(mean_ports(design))


@pytest.fixture(scope="module")
def fitted(design: Design) -> Fit:
    return fit(mean_ports(design), DEGREES)


class Maker:
    """Counts how often it is asked."""

    def __init__(self, fitted: Fit) -> None:
        self.fitted, self.calls = fitted, 0

    def __call__(self) -> Fit:
        self.calls += 1
        return self.fitted


def test_what_was_fitted_once_is_read_the_next_time(
    design: Design, reach: Reach, fitted: Fit, tmp_path: Path
) -> None:
    make = Maker(fitted)
    first = kept_fit(tmp_path / "new", design, reach, DEGREES, make)
    second = kept_fit(tmp_path / "new", design, reach, DEGREES, make)
    assert make.calls == 1
    x = np.array([0.1, 0.001])
    assert second.potential.answer(x) == pytest.approx(first.potential.answer(x), abs=0.0)
    assert second.typical_error == pytest.approx(first.typical_error, abs=0.0)


def test_another_design_range_or_degree_is_another_fit(
    design: Design, reach: Reach, fitted: Fit, tmp_path: Path
) -> None:
    make = Maker(fitted)
    kept_fit(tmp_path, design, reach, DEGREES, make)
    mask = design.mask.copy()
    mask[design.problem.designable[0]] = False
    wider = Reach(reach.prescribed, 2.0 * reach.axis, reach.spread)
    kept_fit(tmp_path, design.with_mask(mask), reach, DEGREES, make)
    kept_fit(tmp_path, design, wider, DEGREES, make)
    kept_fit(tmp_path, design, reach, (2,), make)
    assert make.calls == len(list(tmp_path.iterdir())) == 4


@pytest.mark.parametrize("text", ["", "{", "{}", "[1]", "null"])
def test_what_cannot_be_read_is_made_again(
    text: str, design: Design, reach: Reach, fitted: Fit, tmp_path: Path
) -> None:
    make = Maker(fitted)
    kept_fit(tmp_path, design, reach, DEGREES, make)
    (kept,) = tmp_path.iterdir()
    kept.write_text(text)
    kept_fit(tmp_path, design, reach, DEGREES, make)
    assert make.calls == 2
    kept_fit(tmp_path, design, reach, DEGREES, make)
    assert make.calls == 2


def test_a_folder_that_cannot_be_written_keeps_nothing(
    design: Design, reach: Reach, fitted: Fit, tmp_path: Path
) -> None:
    make = Maker(fitted)
    (tmp_path / "file").touch()
    for _ in range(2):
        assert kept_fit(tmp_path / "file" / "in", design, reach, DEGREES, make) is fitted
    assert kept_fit(None, design, reach, DEGREES, make) is fitted
    assert make.calls == 3


def test_errors_come_through_and_are_not_kept(design: Design, reach: Reach, tmp_path: Path) -> None:
    def fail() -> Fit:
        raise InvalidSettings("snaps nearly everywhere")

    with pytest.raises(InvalidSettings, match="nearly everywhere"):
        kept_fit(tmp_path, design, reach, DEGREES, fail)
    assert not list(tmp_path.iterdir())


def test_the_folder_is_where_the_user_wants_it(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("BELLCRANK_CACHE", str(tmp_path))
    assert usual_folder() == tmp_path / "potentials"
    monkeypatch.delenv("BELLCRANK_CACHE")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert usual_folder() == tmp_path / "bellcrank" / "potentials"
