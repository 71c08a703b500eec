"""How `bellcrank design` ends: exit codes, refused tasks, tasks named like a bundled problem."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import TYPE_CHECKING

import pytest

from bellcrank.errors import InvalidSettings
from bellcrank.model import Supports, find_problem, problem_to_dict
from bellcrank.search import make_evaluator, read_settings, searches, start_chain

from .helpers import SMALL, call

if TYPE_CHECKING:
    from pathlib import Path

QUICK = ("--steps", "250", "--chains", "1", "--seed", "1")


def written(path: Path, **changes: object) -> Path:
    path.write_text(json.dumps({**SMALL, **changes}))
    return path


def test_a_task_named_like_a_bundled_problem_is_designed(tmp_path: Path) -> None:
    task = written(tmp_path / "task.json", name="crane")
    outcome = call("design", task, *QUICK, "--out", tmp_path / "run")
    assert outcome.code in {0, 3}, outcome.err
    summary = json.loads((tmp_path / "run" / "summary.json").read_text())
    assert summary["problem"] == "crane"
    assert "human design" not in outcome.out


def test_a_bundled_task_under_another_name_is_compared_with_the_human_design(
    tmp_path: Path,
) -> None:
    task = tmp_path / "task.json"
    task.write_text(json.dumps(problem_to_dict(replace(find_problem("crane"), name="mine"))))
    outcome = call("design", task, *QUICK, "--out", tmp_path / "run")
    assert outcome.code == 0, outcome.err
    assert "human design" in outcome.out


def test_a_task_without_supports_is_refused_before_the_search(tmp_path: Path) -> None:
    task = written(tmp_path / "task.json", supports={"fixed": [], "fixed_x": [], "fixed_y": []})
    outcome = call("design", task, *QUICK, "--out", tmp_path / "run")
    assert outcome.code == 2
    assert "supports" in outcome.err
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize("search", list(searches))
def test_no_search_starts_without_supports(search: str) -> None:
    settings = read_settings({"search": search})
    loose = replace(find_problem("scaling-8"), supports=Supports())
    with pytest.raises(InvalidSettings, match="supports: expected at least one"):
        start_chain(make_evaluator(loose, settings), settings)


def test_a_design_that_moves_the_wrong_way_ends_with_exit_code_3(tmp_path: Path) -> None:
    # A single step leaves the full lattice, whose output moves against the wanted direction.
    outcome = call("design", "crane", "--steps", "1", "--chains", "1", "--out", tmp_path / "run")
    assert outcome.code == 3
    assert "no design works" in outcome.err
    assert (tmp_path / "run" / "design.json").exists()


def test_a_part_that_does_not_work_ends_with_exit_code_3(tmp_path: Path) -> None:
    # In a stroke of 2.5 times the usual every part of a few steps is strained too far or touches.
    data = problem_to_dict(find_problem("crane"))
    data["input"]["amount"] *= 2.5
    task = tmp_path / "task.json"
    task.write_text(json.dumps(data))
    outcome = call("design", task, *QUICK, "--strut-width", "2mm", "--out", tmp_path / "run")
    assert outcome.code == 3, outcome.out
    assert "no design works" in outcome.err
