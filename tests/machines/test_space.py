"""Machines in space: placement, columns on columns, prediction, errors."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from bellcrank.errors import InvalidFile
from bellcrank.machines import assemble, predict, simulate
from bellcrank.machines.plan import MachineTable, plan_of
from bellcrank.mechanics import VERIFICATION_INCREMENT, FrameEvaluator
from bellcrank.model import human_design
from bellcrank.task import task_from_dict

if TYPE_CHECKING:
    from bellcrank.machines import Machine
    from bellcrank.model import Design

COLUMN = {
    "name": "column",
    "domain": {
        "size": ["23 mm", "23 mm", "52 mm"],
        "cells": {"kind": "octet", "up": [1, 1, 1], "envelope": "cylinder"},
    },
    "supports": [{"at": {"face": "bottom"}}],
    "cases": [
        {
            "inputs": [
                {"at": {"point": [11.5, 11.5, 50]}, "direction": "down", "displacement": 0.4},
            ],
            "outputs": [
                {"at": {"face": "top", "without": {"cylinder": [11.5, 11.5], "radius": 5}},
                 "direction": "down", "gain": "maximise"},
            ],
        }
    ],
}  # fmt: skip
"""Seven layers of triangles, of which the first and the last lie above each other."""


@cache
def found(name: str) -> Design:
    if name == "column":
        return task_from_dict(COLUMN).problem.full_design()
    design = human_design(name)
    assert design is not None
    return design


def machine(
    parts: dict[str, Any],
    given: list[str],
    wanted: list[str],
    links: list[dict[str, str]] | None = None,
    **ends: Any,
) -> Machine:
    data = {
        "name": "trial", "parts": parts, "links": links or [],
        "input": {"ports": given, **ends}, "output": {"ports": wanted},
    }  # fmt: skip
    return assemble(plan_of(MachineTable.model_validate(data), "trial.toml"), found)


def alone(name: str, **placement: Any) -> Machine:
    return machine({"a": {"entry": name, **placement}}, ["a.input"], ["a.output"])


def motion(made: Machine, port: str = "a.output") -> np.ndarray:
    """Return (3,) the mean motion of a port of a part over the input displacement."""
    problem = made.design.problem
    response = FrameEvaluator(problem).evaluate(made.design.mask, VERIFICATION_INCREMENT)
    name = next(each for each in made.ports if str(each) == port)
    moved = response.displacement[made.port_nodes(name), :3].mean(axis=0)
    return moved / problem.input.amount


@pytest.mark.parametrize(
    ("placement", "turn"),
    [
        ({"rotate": 90}, [[0, -1, 0], [1, 0, 0], [0, 0, 1]]),
        ({"mirror": True}, np.diag([-1, 1, 1])),
        ({"upside_down": True}, np.diag([1, -1, -1])),
        ({"mirror": True, "upside_down": True, "rotate": 180}, np.diag([1, 1, -1])),
        ({"scale": 2.0, "at": [1.0, 2.0, 3.0]}, np.eye(3)),
    ],
)
def test_a_placed_part_moves_as_before_in_its_own_axes(placement: Any, turn: Any) -> None:
    before, after = motion(alone("orthogonal")), motion(alone("orthogonal", **placement))
    # A section of the same width is a fifth of a strut before, and a tenth at twice the size.
    tolerance = 0.2 if "scale" in placement else 1e-9
    assert after == pytest.approx(np.array(turn) @ before, abs=tolerance)


def test_the_input_of_a_part_is_placed_at_a_point() -> None:
    made = alone("orthogonal", at=[1.0, 2.0, 3.0], rotate=30)
    nodes = made.design.problem.input.nodes
    centre = made.design.problem.lattice.positions[nodes].mean(axis=0)
    assert centre == pytest.approx([1.0, 2.0, 3.0])


@pytest.fixture(scope="module")
def jaws() -> Machine:
    parts = {
        name: {
            "entry": "orthogonal",
            "at": [6.5 * np.cos(np.radians(angle)), 6.5 * np.sin(np.radians(angle)), 0.0],
            "rotate": angle,
        }
        for name, angle in (("a", 0), ("b", 120), ("c", 240))
    }
    return machine(parts, [f"{name}.input" for name in parts], [f"{name}.output" for name in parts])


def test_three_parts_around_an_axis_close_together(jaws: Machine) -> None:
    single = alone("orthogonal")
    efficiency = FrameEvaluator(jaws.design.problem).evaluate(jaws.design.mask).efficiency
    expected = FrameEvaluator(single.design.problem).evaluate(single.design.mask).efficiency
    assert efficiency == pytest.approx(expected, rel=1e-9)
    motions = [motion(jaws, f"{name}.output") for name in "abc"]
    assert np.sum(motions, axis=0)[:2] == pytest.approx(0.0, abs=1e-9)


def test_prediction_and_simulation_agree(jaws: Machine) -> None:
    predicted, simulated = predict(jaws, 4), simulate(jaws, 4)
    assert predicted.efficiency[1:] == pytest.approx(simulated.efficiency[1:], rel=1e-8)
    assert predicted.input_force == pytest.approx(simulated.input_force, rel=1e-7)


def test_a_column_stands_on_another_by_its_supports() -> None:
    parts = {
        "lower": {"entry": "column"},
        "upper": {"entry": "column", "join": "lower.output", "by": "supports", "supports": False},
    }
    links = [{"from": "upper.supports", "to": "lower.input"}]
    made = machine(parts, ["upper.input"], ["upper.output"], links)
    problem, one = made.design.problem, found("column").problem
    shared = len(one.supports.nodes)
    assert problem.lattice.node_count == 2 * one.lattice.node_count - shared
    assert np.ptp(problem.lattice.positions[:, 2]) == pytest.approx(
        2.0 * np.ptp(one.lattice.positions[:, 2])
    )
    assert len(problem.supports.nodes) == shared
    predicted, simulated = predict(made, 3), simulate(made, 3)
    assert predicted.output == pytest.approx(simulated.output, rel=1e-8)
    assert predicted.input_force == pytest.approx(simulated.input_force, rel=1e-7)
    # Two equal springs in series.
    single = simulate(alone("column"), 3)
    ratio = simulated.input_force[-1] / single.input_force[-1]
    assert 0.3 < ratio < 0.7


UPPER = {"entry": "column", "join": "a.output", "by": "supports"}


@pytest.mark.parametrize(
    ("parts", "links", "ends", "message"),
    [
        ({"a": {"entry": "column", "rotate": 45}}, [], {}, "expected a multiple of 60 degrees in"),
        ({"a": {"entry": "column", "at": [1, 2]}}, [], {}, "expected 3 coordinates in space"),
        ({"a": {"entry": "column"}, "b": {"entry": "crane", "at": [9, 9]}}, [], {},
         "different dimensions: in space against in the plane"),
        ({"a": {"entry": "crane", "upside_down": True}}, [], {}, "upside_down: expected a part in"),
        ({"a": {"entry": "crane", "rotate": 30}}, [], {}, "multiple of 60 degrees in the plane"),
        ({"a": {"entry": "column"}, "b": {**UPPER, "supports": True}}, [], {},
         "parts.b: its supports are linked; expected supports = false"),
        ({"a": {"entry": "column"}, "b": {**UPPER, "supports": False}}, [], {},
         "parts a and b overlap near"),
        ({"a": {"entry": "column"}, "b": {"entry": "column", "at": [0.4, 0.3, 0.45]}}, [], {},
         "parts a and b overlap"),
        ({"a": {"entry": "column"}, "b": {"entry": "column", "at": [4, 0, 0]}},
         [{"from": "a.output", "to": "b.input", "kind": "bridge"}], {},
         "bridge from a.output to b.input: expected parts in the plane"),
        ({"a": {"entry": "column"}}, [], {"direction": [1, 0]}, "input.direction: expected 3"),
        ({"a": {"entry": "column"}}, [{"from": "a.supports", "to": "a.output"}], {},
         "parts.a: its supports are linked"),
    ],
)  # fmt: skip
def test_bad_plans_in_space_get_one_clear_error(
    parts: Any, links: Any, ends: Any, message: str
) -> None:
    with pytest.raises(InvalidFile, match=message):
        machine(parts, ["a.input"], ["a.output"], links, **ends)


def test_supports_are_neither_input_nor_output() -> None:
    with pytest.raises(InvalidFile, match=r"unknown port 'a\.supports'"):
        machine({"a": {"entry": "column", "supports": False}}, ["a.supports"], ["a.output"])
