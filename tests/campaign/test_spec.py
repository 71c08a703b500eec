"""A spec is strict, names what is wrong, and resolves to the same runs every time."""

from __future__ import annotations

import shutil
from typing import TYPE_CHECKING

import pytest

from bellcrank.campaign import Spec, Store, read_spec
from bellcrank.campaign.spec import spec_difference
from bellcrank.errors import CorruptRun, InvalidFile, InvalidSettings, OutputExists
from bellcrank.model import find_problem, write_problem

from .helpers import SPEC, write_spec

if TYPE_CHECKING:
    from pathlib import Path

TASK = '\n[[tasks]]\nproblem = "scaling-8"\nsearch = "paper"\nseeds = 2\n'


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("name = 'a'", "key 'tasks' is missing"),
        ("name = 'a'\ntasks = []", "tasks: expected"),
        ("colour = 1\nname = 'a'" + TASK, "unknown key 'colour'; known here: schema, name"),
        ("name = 'a'\nsegment = 300" + TASK, "segment: expected a multiple of 250, got 300"),
        ("name = 'a'" + TASK + "stepz = 5", "tasks[0]: search 'paper' has no setting 'stepz'"),
        ("name = 'a'" + TASK + "steps = 0", "tasks[0]: steps: expected a whole number of at"),
        ("name = 'a'" + TASK + "seed = 0", "tasks[0]: seed: is set for each run; use seeds"),
        ("name = 'a'" + TASK + "chains = 2", "tasks[0]: chains: is set for each run"),
        ("name = 'a'" + TASK.replace("= 2", "= 0"), "tasks[0]: seeds: expected a count from 1"),
        ("name = 'a'" + TASK.replace("= 2", "= [5, 4]"), "tasks[0]: seeds: expected a count"),
        ("name = 'a'" + TASK.replace("= 2", "= [1]"), "tasks[0]: seeds: expected a count"),
        ("name = 'a'" + TASK.replace("= 2", "= true"), "tasks[0].seeds"),
        ("name = 'a'" + TASK.replace("paper", "pape"), "tasks[0]: unknown search 'pape'; known"),
        ("name = 'a'" + TASK.replace("scaling-8", "crain"), "tasks[0]: problem: unknown problem"),
        ("name = 'a'" + TASK + TASK, "tasks[1]: name 'scaling-8-paper' is also that of tasks[0]"),
        ("name = 'a'" + TASK + TASK + "name = 'b'", "are equal and share seed 0; remove one"),
        ("name = ", "not valid TOML"),
    ],
)
def test_what_is_wrong_with_a_spec_is_said_in_one_line(
    tmp_path: Path, text: str, message: str
) -> None:
    path = write_spec(tmp_path, text)
    with pytest.raises(InvalidFile) as raised:
        read_spec(path)
    line = str(raised.value)
    assert line.startswith(f"{path}: ")
    assert message in line
    assert "\n" not in line


def test_a_problem_file_is_looked_for_beside_the_spec(tmp_path: Path) -> None:
    write_problem(find_problem("scaling-8"), tmp_path / "mine.json")
    spec = read_spec(write_spec(tmp_path, "name = 'a'" + TASK.replace("scaling-8", "mine.json")))
    builtin = read_spec(write_spec(tmp_path, "name = 'a'" + TASK))
    assert spec == builtin


def test_a_bad_problem_file_is_named(tmp_path: Path) -> None:
    (tmp_path / "mine.json").write_text("{")
    path = write_spec(tmp_path, "name = 'a'" + TASK.replace("scaling-8", "mine.json"))
    with pytest.raises(InvalidFile, match=r"mine\.json: not valid JSON"):
        read_spec(path)


def test_runs_are_named_by_what_they_compute(spec: Spec, tmp_path: Path) -> None:
    runs = list(spec.runs())
    assert [run.seed for run in runs] == [0, 1, 2, 7]
    assert len({run.id for run in runs}) == 4
    more = read_spec(write_spec(tmp_path, SPEC.replace("seeds = 3", "seeds = [1, 9]")))
    assert more.run(0).id == runs[1].id
    other = read_spec(write_spec(tmp_path, SPEC.replace("steps = 600", "steps = 700")))
    assert other.run(0).id != runs[0].id


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("steps = 600", "steps = 700", "task 'scaling-8-paper': settings: steps is 600 there and"),
        ("seeds = 3", "seeds = 4", "task 'scaling-8-paper': seeds is [0, 2] there and [0, 3]"),
        ("segment = 250", "segment = 500", "segment is 250 there and 500 here"),
        ('name = "large"', 'name = "great"', "task 'great' is missing there"),
        ('"crane"', '"anti-parallel"', "task 'large': problem: name is crane there and anti-"),
    ],
)
def test_another_spec_in_the_same_folder_is_refused_and_said_where_it_differs(
    tmp_path: Path, spec: Spec, old: str, new: str, message: str
) -> None:
    Store.create(tmp_path / "store", spec)
    assert Store.create(tmp_path / "store", spec).spec == spec
    other = read_spec(write_spec(tmp_path, SPEC.replace(old, new)))
    with pytest.raises(
        InvalidSettings, match="the campaign in this folder has another spec: "
    ) as raised:
        Store.create(tmp_path / "store", other)
    assert message in str(raised.value)


def test_a_task_that_is_gone_is_named(spec: Spec) -> None:
    assert (
        spec_difference(spec, Spec(spec.name, 250, spec.tasks[:1]))
        == "task 'large' is missing here"
    )
    assert (
        spec_difference(spec, Spec(spec.name, 250, spec.tasks[::-1]))
        == "the tasks have another order"
    )


def test_a_description_changed_by_hand_is_refused(tmp_path: Path, finished: Path) -> None:
    folder = shutil.copytree(finished, tmp_path / "copy", symlinks=True)
    file = folder / "campaign.json"
    file.write_text(file.read_text().replace('"steps": 600', '"steps": 900'))
    with pytest.raises(CorruptRun, match=r"campaign\.json: was changed after"):
        Store.open(folder)


def test_a_folder_with_something_else_in_it_is_refused(tmp_path: Path, spec: Spec) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(OutputExists, match=r"it holds notes\.txt"):
        Store.create(tmp_path, spec)
    with pytest.raises(InvalidFile, match=r"it has no campaign\.json"):
        Store.open(tmp_path)
    with pytest.raises(InvalidFile, match="no such folder"):
        Store.open(tmp_path / "nowhere")
