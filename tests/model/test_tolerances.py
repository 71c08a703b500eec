"""Tolerances of a specification: range, files, tasks."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from bellcrank.errors import InvalidProblem
from bellcrank.model import Tolerances, read_problem, write_problem
from bellcrank.task import task_from_dict

if TYPE_CHECKING:
    from pathlib import Path


def task(**tolerance: object) -> dict[str, object]:
    return {
        "schema": "bellcrank/task/1",
        "name": "tolerant",
        "part": {"spacing": 20.0, "width": 4.0},
        "domain": {"problem": "crane"},
        "cases": [{"outputs": [{"gain": "maximise"}]}],
        "tolerance": tolerance,
    }


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("width", -0.1),
        ("each_width", 0.5),
        ("node", float("nan")),
        ("least_yield", 1.2),
        ("keep", 1.0),
    ],
)
def test_values_out_of_range_are_refused(name: str, value: float) -> None:
    with pytest.raises(InvalidProblem, match=rf"^tolerances: {name}: expected a number"):
        Tolerances(**{name: value})


def test_a_task_names_them_in_its_own_units() -> None:
    found = task_from_dict(task(width="20%", node="0.2 mm", angle="3 deg")).problem.specification
    assert found is not None
    assert found.tolerances == Tolerances(width=0.2, node=0.01, angle=3.0)


def test_an_empty_table_has_the_defaults() -> None:
    found = task_from_dict(task()).problem.specification
    assert found is not None
    assert found.tolerances == Tolerances(node=0.1 / 20.0)


def test_an_error_names_the_key_of_the_task() -> None:
    with pytest.raises(InvalidProblem, match=r"tolerance\.width: expected a number"):
        task_from_dict(task(width="120%"))


def test_they_are_stored_with_a_problem(tmp_path: Path) -> None:
    problem = task_from_dict(task(width="15%", least_yield="90%", keep="80%")).problem
    write_problem(problem, tmp_path / "problem.json")
    again = read_problem(tmp_path / "problem.json")
    assert again.specification is not None
    assert problem.specification is not None
    assert again.specification.tolerances == problem.specification.tolerances
