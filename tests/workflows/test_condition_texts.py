"""Inputs and loads of a task in words."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from bellcrank.task import find_task, task_from_dict
from bellcrank.workflows.condition_texts import condition_texts

if TYPE_CHECKING:
    from bellcrank.model import Problem
    from bellcrank.task import Task


def arm(case: dict[str, Any]) -> Task:
    """Return the task of a part that is held at its left edge."""
    return task_from_dict(
        {
            "name": "arm",
            "domain": {"size": ["92 mm", "72 mm"]},
            "supports": [{"at": {"edge": "left"}}],
            "cases": [case],
        }
    )


def test_every_load_of_a_task_is_listed() -> None:
    task = arm(
        {
            "inputs": [
                {"at": {"point": [60, 2]}, "direction": "up", "displacement": "3 mm"}
            ],
            "outputs": [
                {
                    "at": {"point": [88, 70], "count": 2}, "direction": "up",
                    "gain": "maximise", "spring": "0.2 N/mm",
                }
            ],
            "loads": [
                {
                    "at": {"point": [88, 70], "count": 2}, "force": "0.05 N",
                    "direction": "30deg",
                },
                {"at": {"point": [88, 2]}, "spring": "0.1 N/mm", "direction": "right"},
            ],
            "gravity": "down",
        }
    )  # fmt: skip
    assert condition_texts(task.problem, task.part) == [
        "input 3 mm up at (61, 1.4) mm",
        "load of 0.05 N in all at 30 deg at (81, 70.6) and (91, 70.6) mm, grows with the input",
        "spring of 0.1 N/mm at (91, 1.4) mm, right",
        "own weight down, grows with the input",
        "spring of 0.2 N/mm against output",
    ]


def test_a_direction_in_space_without_a_name_has_components() -> None:
    task = task_from_dict(
        {
            "name": "column",
            "domain": {"size": ["42 mm", "42 mm", "42 mm"]},
            "part": {"width": "2 mm"},
            "supports": [{"at": {"face": "bottom"}}],
            "cases": [
                {
                    "inputs": [
                        {
                            "at": {"point": [7, 7, 35]},
                            "direction": [0, 3, 4],
                            "displacement": "2 mm",
                        }
                    ],
                    "outputs": [
                        {"at": {"point": [21, 21, 21]}, "direction": "up", "gain": "maximise"}
                    ],
                }
            ],
        }
    )
    (text,) = condition_texts(task.problem, task.part)
    assert text == "input 2 mm along (0.00, 0.60, 0.80) at (6.9, 6.9, 35.1) mm"


def test_inputs_of_several_directions_and_parts_of_the_stroke_are_texts_of_their_own() -> None:
    task = arm(
        {
            "inputs": [
                {
                    "at": {"edge": "bottom", "between": [60, 92]}, "direction": "up",
                    "displacement": "3 mm", "during": ["0%", "50%"],
                },
                {
                    "at": {"point": [88, 70]}, "direction": "left",
                    "displacement": "3 mm", "during": ["50%", "100%"],
                },
            ],
            "outputs": [
                {"at": {"point": [46, 40]}, "direction": "up", "gain": "maximise"}
            ],
        }
    )  # fmt: skip
    assert condition_texts(task.problem, task.part) == [
        "input 3 mm up on 4 nodes between (61, 1.4) and (91, 1.4) mm, from 0% to 50% of the stroke",
        "input 3 mm left at (91, 70.6) mm, from 50% to 100% of the stroke",
    ]


def test_a_force_is_that_on_all_nodes_of_an_input() -> None:
    task = arm(
        {
            "inputs": [
                {"at": {"edge": "bottom", "between": [60, 92]}, "direction": "up",
                 "force": "0.5 N"}
            ],
            "outputs": [
                {"at": {"point": [46, 40]}, "direction": "up", "gain": "maximise"}
            ],
        }
    )  # fmt: skip
    (text,) = condition_texts(task.problem, task.part)
    assert text.startswith("input of 0.5 N up on 4 nodes between ")


def test_a_material_without_a_known_limit_of_the_strain_is_remarked() -> None:
    task = find_task("slider")
    stiff = replace(task.part, material="tpu-95a")
    (*same, remark) = condition_texts(without_strain(task.problem), stiff)
    assert same == condition_texts(task.problem, task.part)
    assert remark == "no limit of the strain: that of tpu-95a is not known"
    # A bound of the task's own counts.
    assert condition_texts(task.problem, stiff)[-1] != remark


def without_strain(problem: Problem) -> Problem:
    """The problem without its items on the strain."""
    wanted = problem.specification
    assert wanted is not None
    items = tuple(each for each in wanted.items if each.quantity != "strain")
    assert len(items) < len(wanted.items)
    return replace(problem, specification=replace(wanted, items=items))
