"""Channels of load cases: several outputs, loads, payloads, and their prediction for flips."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bellcrank.mechanics import CaseEvaluator, Channel, FrameEvaluator
from bellcrank.mechanics.frames.case import CHANNELS, LOADED
from bellcrank.mechanics.frames.output_loads import with_payload
from bellcrank.model import (
    Loads,
    NodeSpring,
    Output,
    Problem,
    Specification,
    find_problem,
    human_design,
)
from bellcrank.part import PartSpec, frame_problem

FRACTIONS = [0.25, 0.5, 0.75, 1.0]


def crane(**changes: object) -> Problem:
    return replace(frame_problem(find_problem("crane"), PartSpec()), **changes)


@pytest.fixture(scope="module")
def mask() -> np.ndarray:
    return human_design("crane").mask


def forces_on(*outputs: str) -> dict[Channel, float]:
    """Return a small force on outputs, with the input and before it."""
    return {Channel(name, output): 2e-3 for name in LOADED for output in outputs}


def two_outputs() -> Problem:
    """Return the crane that also watches the node 80 along its diagonal, with a spring there."""
    second = Output([80], [0.6, 0.8], spring=0.3)
    return crane(specification=Specification(output="jaw", outputs={"side": second}))


def test_each_output_is_measured_as_if_it_were_the_only_one(mask: np.ndarray) -> None:
    problem = two_outputs()
    case = CaseEvaluator(problem)
    case.respond(mask)
    names = ("motion", "displacement", "rotation", "stiffness")
    found = case.values([Channel(n, o) for n in names for o in ("jaw", "side")], FRACTIONS)
    jaw, side = problem.outputs.values()
    springs = Loads(springs=(NodeSpring(side.nodes, side.direction, side.spring),))
    alone = {
        "jaw": crane(loads=springs),
        "side": crane(output=replace(side, spring=None, spring_kind=None), loads=springs),
    }
    assert jaw.spring is None
    for output, one in alone.items():
        expected = CaseEvaluator(one)
        expected.respond(mask)
        values = expected.values([Channel(name, "output") for name in names], FRACTIONS)
        for name in names:
            assert found[name, output] == pytest.approx(values[name, "output"], rel=1e-6, abs=1e-9)


def test_a_spring_load_resists_like_that_of_an_output(mask: np.ndarray) -> None:
    plain = crane()
    held = replace(plain, output=replace(plain.output, spring=0.2))
    loaded = crane(loads=Loads(springs=(NodeSpring(plain.output.nodes, [-1.0, 0.0], 0.2),)))
    moved = [FrameEvaluator(one).evaluate(mask).displacement for one in (held, loaded)]
    assert moved[0] == pytest.approx(moved[1], abs=1e-10)
    assert np.abs(moved[0] - FrameEvaluator(plain).evaluate(mask).displacement).max() > 1e-3


def test_forces_on_nodes_follow_the_linear_compliance_where_they_are_small(
    mask: np.ndarray,
) -> None:
    problem, force = crane(), 1e-6
    case = CaseEvaluator(problem)
    case.respond(mask)
    channels = [Channel("motion", "output"), Channel("stiffness", "output")]
    free = case.values(channels, [1.0])
    loaded = CaseEvaluator(with_payload(problem, force))
    loaded.respond(mask)
    travel = loaded.values(channels[:1], [1.0])[channels[0]][0, 0]
    expected = free[channels[0]][0, 0] - force / free[channels[1]][0]
    assert travel == pytest.approx(expected, abs=1e-9)


def test_own_weight_of_a_problem_is_applied_with_the_input(mask: np.ndarray) -> None:
    weight = [0.0, -1e-3]
    own = FrameEvaluator(crane(loads=Loads(weight=weight))).evaluate(mask)
    given = FrameEvaluator(crane(), weight=weight).evaluate(mask)
    assert own.displacement == pytest.approx(given.displacement, abs=1e-12)


def test_an_output_on_rollers_slides_along_them(mask: np.ndarray) -> None:
    problem = crane()
    supports = replace(problem.supports, fixed_y=problem.output.nodes)
    sliding = crane(supports=supports)
    case = CaseEvaluator(sliding)
    assert case.respond(mask).is_admissible
    motion = case.values([Channel("motion", "output")], FRACTIONS)["motion", "output"]
    assert motion[:, 1:] == pytest.approx(np.zeros((4, 2)), abs=1e-12)
    assert abs(motion[-1, 0]) > 1e-3


def test_flips_are_predicted_for_every_channel_of_every_output(mask: np.ndarray) -> None:
    problem = two_outputs()
    case = CaseEvaluator(problem, weight=[0.0, -1e-3], forces=forces_on("jaw", "side"))
    case.respond(mask)
    channels = [
        Channel(name, output)
        for name in CHANNELS
        for output in (
            [""] if name in {"input_motion", "input_force", "strain"} else ["jaw", "side"]
        )
    ]
    before = case.values(channels, FRACTIONS)
    beams = problem.designable[::9]
    after, changed, _ = case.predict_flips(before, beams)
    assert changed.any()
    errors: dict[str, list[float]] = {name: [] for name in CHANNELS}
    other = CaseEvaluator(problem, weight=[0.0, -1e-3], forces=forces_on("jaw", "side"))
    for row, beam in enumerate(beams):
        flipped = mask.copy()
        flipped[beam] ^= True
        if not other.respond(flipped).is_admissible:
            continue
        exact = other.values(channels, FRACTIONS)
        for channel in channels:
            change = np.abs(exact[channel] - before[channel]).max()
            error = np.abs(after[channel][row] - exact[channel]).max()
            # A beam that is added without its second end moves the part by its weight alone,
            # which is not predicted.
            predicted = np.abs(after[channel][row] - before[channel]).max() > 0.0
            if np.isfinite(error) and change > 1e-6 and predicted:
                errors[channel.name].append(float(error / change))
    for name, found in errors.items():
        if name != "input_motion":  # it is prescribed
            assert len(found) >= 5, name
            assert np.median(found) < 0.35, name


def test_the_reference_of_warm_starts_includes_all_loads(mask: np.ndarray) -> None:
    problem = crane()
    warm, cold = (CaseEvaluator(problem, forces=forces_on("output")) for _ in range(2))
    channels = [Channel(name, "output") for name in ("motion", *LOADED)]
    warm.respond(mask)
    warm.values(channels, [1.0])
    warm.set_reference()
    for beam in problem.designable[::25]:
        flipped = mask.copy()
        flipped[beam] ^= True
        if not cold.respond(flipped).is_admissible:
            continue
        assert warm.respond(flipped, warm_start=True).is_admissible
        found, expected = warm.values(channels, FRACTIONS), cold.values(channels, FRACTIONS)
        for channel in channels:
            assert found[channel] == pytest.approx(expected[channel], abs=1e-7, nan_ok=True)
