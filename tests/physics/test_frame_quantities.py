"""Quantities of frames along the stroke: values, gradients, predicted flips."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.stats import spearmanr

from bellcrank.errors import InvalidSettings, UnknownName
from bellcrank.mechanics import (
    FrameEvaluator,
    Quantities,
    Status,
    at_fraction,
    output_motion,
    quantities,
)
from bellcrank.mechanics.frames.kernels.arrays import KEPT_PATH, NEXT_PATH
from bellcrank.mechanics.frames.kernels.path import DIP
from bellcrank.model import (
    Elasticity,
    Input,
    Lattice,
    Output,
    Problem,
    Section,
    Supports,
    gallery_design,
    human_design,
)
from bellcrank.part import PartSpec, frame_problem
from tests.physics.frames import Array, chain, equilibrium, frame_of
from tests.physics.test_frame_flips import actuator, block, diluted

ALL = tuple(quantities)
WEIGHT = 1e-3


def loaded_by_forces(problem: Problem, force: float, spring: float, kind: str) -> Problem:
    """Return a problem driven by a force against output springs."""
    return replace(
        problem,
        input=replace(problem.input, drive="force", amount=force),
        output=replace(problem.output, spring=spring, spring_kind=kind),
        objective="displacement",
    )


def with_one_output(problem: Problem) -> Problem:
    """Return a problem with a single output node, whose rotation is that of the node."""
    output = problem.output
    return replace(problem, output=Output(output.nodes[:1], output.direction[:1]))


@cache
def cases() -> dict[str, tuple[Problem, Array]]:
    """Return problems with a design of each, in the plane and in space."""
    planar, solid = actuator(), at_fraction(block(), 3.0)
    lever = human_design("anti-parallel")
    # The output turns by 32 degrees.
    turned = at_fraction(frame_problem(lever.problem, PartSpec()), 5.0)
    return {
        "plane, displacement": (turned, lever.mask),
        "plane, force": (
            loaded_by_forces(planar, 2e-3, 1e-3, "directional"), diluted(planar, 20, 1),
        ),
        "plane, one output": (with_one_output(planar), diluted(planar, 20, 7)),
        "space, displacement": (solid, diluted(solid, 20, 1)),
        "space, force": (
            loaded_by_forces(solid, 1e-4, 1e-3, "isotropic"), diluted(solid, 20, 1),
        ),
        "space, one output": (with_one_output(solid), diluted(solid, 20, 1)),
    }  # fmt: skip


def down(problem: Problem) -> Array:
    """Return an own weight along the last axis."""
    return -WEIGHT * np.eye(problem.lattice.dimension)[-1]


class Refined(Quantities):
    """Quantities with tightly converged equilibria, of beams that are present in part."""

    def __init__(self, *args: object, **given: object) -> None:
        super().__init__(*args, **given)  # type: ignore[arg-type]
        for each in self._evaluators.values():
            each.frame = replace(each.frame, tolerance=1e-12)
        self._full = {
            load: (each.frame.section.copy(), each.frame.weight.copy())
            for load, each in self._evaluators.items()
        }

    def with_presence(self, mask: Array, beam: int, presence: float) -> Array:
        """Return the quantities with a part of the stiffness and of the weight of a beam."""
        for load, each in self._evaluators.items():
            section, weight = self._full[load]
            each.frame.section[beam] = presence * section[beam]
            each.frame.weight[beam] = presence * weight[beam]
            each._last = None
        return self.evaluate(mask)


@pytest.mark.parametrize("elements", [None, 1])
@pytest.mark.parametrize("name", list(cases()))
def test_gradients_are_derivatives_by_presence(name: str, elements: int | None) -> None:
    problem, mask = cases()[name]
    evaluator = FrameEvaluator(problem, elements=elements)
    found = Refined(evaluator, ALL, (0.25, 0.4, 1.0), weight=down(problem))
    values = found.evaluate(mask)
    slopes = found.sensitivity()
    assert np.isfinite(values).all()
    carrying = np.flatnonzero(evaluator.load_bearing(mask))
    rng = np.random.default_rng(2)
    for beam in rng.choice(np.intersect1d(carrying, problem.designable), 3, replace=False):
        step = 2e-3
        near = {k: found.with_presence(mask, beam, 1.0 + k * step) for k in (-2, -1, 1, 2)}
        found.with_presence(mask, beam, 1.0)
        exact = (8.0 * (near[1] - near[-1]) - (near[2] - near[-2])) / (12.0 * step)
        error = np.abs(slopes[:, :, beam] - exact)
        assert (error <= 1e-6 * (np.abs(exact) + 1e-3 * np.abs(values))).all()


@pytest.mark.parametrize("name", ["plane, displacement", "space, displacement"])
def test_gradients_of_a_frame_under_its_weight_include_that_of_the_beam(name: str) -> None:
    problem, mask = cases()[name]
    evaluator = FrameEvaluator(problem, weight=0.1 * down(problem))
    names = ("gain", "input_force", "output_stiffness", "blocked_force", "strain")
    found = Refined(evaluator, names, (0.5, 1.0))
    found.evaluate(mask)
    slopes = found.sensitivity()
    beam = int(np.intersect1d(np.flatnonzero(mask), problem.designable)[7])
    step = 2e-3
    near = {k: found.with_presence(mask, beam, 1.0 + k * step) for k in (-2, -1, 1, 2)}
    exact = (8.0 * (near[1] - near[-1]) - (near[2] - near[-2])) / (12.0 * step)
    assert np.abs(exact).min() > 0.0
    assert slopes[:, :, beam] == pytest.approx(exact, rel=1e-5)


@pytest.mark.parametrize("name", list(cases()))
def test_values_at_a_fraction_are_those_of_a_stroke_that_ends_there(name: str) -> None:
    problem, mask = cases()[name]
    fractions = (0.25, 0.3, 0.75, 0.9, 1.0)
    along = Quantities(FrameEvaluator(problem), ALL, fractions, weight=down(problem))
    values = along.evaluate(mask)
    for fraction, row in zip(fractions, values, strict=True):
        short = Quantities(
            FrameEvaluator(at_fraction(problem, fraction)), ALL, weight=down(problem)
        )
        assert row == pytest.approx(short.evaluate(mask)[0], rel=1e-5, abs=1e-9)


@pytest.mark.parametrize("name", list(cases()))
def test_motion_and_forces_are_those_of_the_response(name: str) -> None:
    problem, mask = cases()[name]
    evaluator = FrameEvaluator(problem)
    response = evaluator.evaluate(mask)
    names = ("travel", "gain", "off_axis", "rotation", "efficiency", "input_force")
    travel, gain, off_axis, rotation, efficiency, force = Quantities(evaluator, names).evaluate(
        mask
    )[0]
    moved = evaluator.output_motion()
    given = problem.input
    pushed = (response.displacement[given.nodes] * given.direction).sum(axis=1).mean()
    assert travel == pytest.approx(moved.along)
    assert gain == pytest.approx(moved.along / pushed)
    assert off_axis == pytest.approx(moved.off_axis)
    assert rotation == pytest.approx(
        float(moved.rotation) if moved.rotation.ndim == 0 else np.linalg.norm(moved.rotation)
    )
    assert efficiency == pytest.approx(response.efficiency)
    assert force == pytest.approx(evaluator.strain().input_force)
    if len(problem.output.nodes) > 1:
        best_fit = output_motion(problem, response.displacement).rotation
        assert moved.rotation == pytest.approx(best_fit)


def test_the_input_force_is_the_derivative_of_the_energy_by_the_stroke() -> None:
    problem, mask = cases()["plane, displacement"]
    force = Quantities(FrameEvaluator(problem), ["input_force"]).evaluate(mask)[0, 0]
    step = 1e-4
    energy = [
        FrameEvaluator(at_fraction(problem, 1.0 + sign * step)).evaluate(mask).energy
        for sign in (1.0, -1.0)
    ]
    rate = (energy[0] - energy[1]) / (2.0 * step * problem.input.amount)
    assert force == pytest.approx(rate, rel=1e-6)


@pytest.mark.parametrize("name", ["plane, displacement", "space, displacement"])
def test_the_output_stiffness_is_that_of_an_added_force(name: str) -> None:
    problem, mask = cases()[name]
    (found,) = Quantities(FrameEvaluator(problem, elements=1), ["output_stiffness"]).evaluate(mask)[
        0
    ]
    output, travel = problem.output, []
    force = 1e-5 * found
    for sign in (1.0, -1.0):
        load = np.zeros_like(frame_of(problem).load)
        share = sign * force * output.direction / len(output.nodes)
        load[0, output.nodes, : problem.lattice.dimension] = share
        pushed = equilibrium(frame_of(problem, load=load), mask)
        moved = pushed.u[output.nodes, : problem.lattice.dimension]
        travel.append((moved * output.direction).sum(axis=1).mean())
    assert found == pytest.approx(2.0 * force / (travel[0] - travel[1]), rel=1e-4)


@pytest.mark.parametrize("name", ["plane, displacement", "space, displacement"])
def test_the_blocked_force_is_the_reaction_of_a_held_output(name: str) -> None:
    problem, mask = cases()[name]
    (found,) = Quantities(FrameEvaluator(problem, elements=1), ["blocked_force"]).evaluate(mask)[0]
    output = problem.output
    axis = int(np.abs(output.direction[0]).argmax())
    held = frame_of(problem).held.copy()
    held[output.nodes, axis] = 1
    reached = equilibrium(frame_of(problem, held=held), mask)
    assert reached.status == "converged"
    reaction = reached.force[output.nodes, axis] * output.direction[:, axis]
    assert found == pytest.approx(-reaction.sum(), rel=1e-5)


def test_a_blocked_force_acts_on_springs_in_the_limit_of_their_stiffness() -> None:
    problem, mask = cases()["plane, force"]
    (found,) = Quantities(FrameEvaluator(problem), ["blocked_force"]).evaluate(mask)[0]
    error = []
    for spring in (1e3, 1e4):
        stiff = replace(problem, output=replace(problem.output, spring=spring))
        (travel,) = Quantities(FrameEvaluator(stiff), ["travel"]).evaluate(mask)[0]
        error.append(spring * len(problem.output.nodes) * travel - found)
    assert abs(error[1]) < 1e-3 * abs(found)
    assert error[0] / error[1] == pytest.approx(10.0, rel=0.02)


@pytest.mark.parametrize("name", list(cases()))
def test_the_sag_is_the_change_by_a_small_weight(name: str) -> None:
    problem, mask = cases()[name]
    (found,) = Quantities(FrameEvaluator(problem), ["sag"], weight=down(problem)).evaluate(mask)[0]
    slight = at_fraction(problem, 1e-6)
    part = 1e-4
    means = []
    for weight in (part * down(problem), None):
        response = FrameEvaluator(slight, weight=weight).evaluate(mask)
        means.append(response.displacement[problem.output.nodes].mean(axis=0))
    assert found == pytest.approx(np.linalg.norm(means[0] - means[1]) / part, rel=1e-4)


def test_the_strain_is_that_of_a_cantilever() -> None:
    """A tip force F bends a bar of length L by 6 F L / (w^2 t) at its root."""
    force, width = 1e-7, 0.1
    problem = replace(
        chain(np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]])),
        section=Section(width, 1.0), material=Elasticity(2.0, 0.3),
    )  # fmt: skip
    problem = at_fraction(problem, force)
    strain, stiffness, rotation = Quantities(
        FrameEvaluator(problem), ("strain", "output_stiffness", "rotation")
    ).evaluate([True, True])[0]
    rigidity = 2.0 * width**3 / 12.0
    assert strain == pytest.approx(6.0 * force * 2.0 / (2.0 * width**2), rel=1e-4)
    assert stiffness == pytest.approx(3.0 * rigidity, rel=1e-4)  # at the middle, one from the root
    assert np.radians(rotation) == pytest.approx(1.5 * force / rigidity, rel=1e-4)


def test_quantities_are_undefined_where_stability_is_lost() -> None:
    """A shallow arch is pressed through; a post on it is the output."""
    arch = Problem(
        name="arch",
        lattice=Lattice(
            [[-1.0, 0.0], [0.0, 0.1], [1.0, 0.0], [0.0, 1.1]], [[0, 1], [1, 2], [1, 3]]
        ),
        supports=Supports(fixed=[0, 2]),
        input=Input(nodes=[1], direction=[0.0, -1.0], drive="force", amount=2e-5),
        output=Output(nodes=[3], direction=[0.0, -1.0]),
        section=Section(0.02, 1.0),
        designable=[0],
    )
    evaluator = FrameEvaluator(arch)
    response = evaluator.evaluate([True, True, True])
    assert response.status is Status.SNAPPED
    fractions = (0.9 * response.reached, 1.1 * response.reached)
    along = Quantities(evaluator, ["travel", "strain"], fractions)
    values = along.evaluate([True, True, True])
    assert (values[0] > 0.0).all()
    for found in (values[1], along.sensitivity()[1], along.predict_flips()[1]):
        assert np.isnan(found).all()
    assert np.isfinite(along.sensitivity()[0]).all()


def test_warm_starts_give_the_quantities_from_rest() -> None:
    problem = frame_problem(human_design("crane").problem, PartSpec())
    mask = human_design("crane").mask.copy()
    fractions = (0.25, 0.5, 0.6, 1.0)
    warm = Quantities(FrameEvaluator(problem), ALL, fractions, weight=down(problem))
    warm.evaluate(mask)
    warm.set_reference()
    codes = set()
    for beam in np.random.default_rng(3).choice(problem.designable, 12, replace=False):
        flipped = mask.copy()
        flipped[beam] ^= True
        found = warm.evaluate(flipped, warm_start=True)
        codes.add(int(warm.evaluator.memory.path[0]))
        cold = Quantities(FrameEvaluator(problem), ALL, fractions, weight=down(problem))
        expected = cold.evaluate(flipped)
        assert found == pytest.approx(expected, rel=1e-6, abs=1e-9, nan_ok=True)
        slopes = cold.sensitivity()
        scale = np.abs(slopes).max(axis=2, keepdims=True)
        assert (np.abs(warm.sensitivity() - slopes) <= 1e-5 * scale).all()
    assert codes >= {NEXT_PATH, KEPT_PATH}


def test_flips_that_are_refused_beside_the_reference_snap_from_rest_too() -> None:
    design = gallery_design("machine", "scaling-8")
    assert design is not None
    problem = frame_problem(design.problem, PartSpec())
    warm, cold = FrameEvaluator(problem), FrameEvaluator(problem)
    assert warm.evaluate(design.mask).status is Status.CONVERGED
    warm.set_reference()
    refused = 0
    for beam in problem.designable:
        flipped = design.mask.copy()
        flipped[beam] ^= True
        found, expected = warm.evaluate(flipped, warm_start=True), cold.evaluate(flipped)
        assert (found.status is Status.CONVERGED) == (expected.status is Status.CONVERGED)
        if found.status is Status.SNAPPED:
            # Beside the reference the first state that is too soft is known, not the softest one.
            (_, first), (_, softest) = warm.memory.reached_load, cold.memory.reached_load
            refused += first > softest
            assert softest <= first <= DIP
    assert refused > 0


@pytest.mark.parametrize("problem", [actuator, block])
def test_flips_are_predicted_and_ranked(problem) -> None:
    """Of a part that deforms little; one Newton step is less accurate where it deforms much."""
    case = problem()
    mask = diluted(case, 25, 3)
    along = Quantities(FrameEvaluator(case, elements=1), ALL, (0.5, 1.0), weight=down(case))
    before = along.evaluate(mask)
    predicted = along.predict_flips()
    gained = np.full(predicted.shape, np.nan)
    for index, beam in enumerate(case.designable):
        flipped = mask.copy()
        flipped[beam] ^= True
        gained[:, :, index] = along.evaluate(flipped) - before
    for row in range(2):
        for column, name in enumerate(ALL):
            guess, truth = predicted[row, column], gained[row, column]
            compared = np.isfinite(truth) & (guess != 0.0)
            assert compared.sum() > 30
            assert spearmanr(guess[compared], truth[compared])[0] > 0.9, name


@pytest.mark.parametrize("problem", [actuator, block])
def test_the_sag_after_a_flip_is_predicted_exactly(problem) -> None:
    """It is linear in the displacements."""
    case = problem()
    along = Quantities(FrameEvaluator(case), ["sag"], weight=down(case))
    before = along.evaluate(case.initial)[0, 0]
    predicted = along.predict_flips()[0, 0]
    for beam, change in list(zip(case.designable, predicted, strict=True))[::9]:
        flipped = case.initial.copy()
        flipped[beam] = False
        gained = along.evaluate(flipped)[0, 0] - before
        assert change == pytest.approx(gained, rel=1e-4)
        back = Quantities(FrameEvaluator(case), ["sag"], weight=down(case))
        back.evaluate(flipped)
        assert back.predict_flips([beam])[0, 0, 0] == pytest.approx(-gained, rel=1e-6)


def test_flips_of_beams_without_load_change_nothing_but_the_sag() -> None:
    case = actuator()
    mask = diluted(case, 60, 4)
    evaluator = FrameEvaluator(case)
    idle = np.flatnonzero(mask & ~evaluator.load_bearing(mask))
    assert len(idle)
    along = Quantities(evaluator, ALL, weight=down(case))
    along.evaluate(mask)
    changes = along.predict_flips(idle)[0]
    assert not changes[[name != "sag" for name in ALL]].any()
    assert changes[ALL.index("sag")].any()


def test_quantities_of_several_elements_have_values_but_no_gradients() -> None:
    problem, mask = cases()["plane, displacement"]
    names = ("gain", "output_stiffness", "blocked_force", "sag")
    coarse = Quantities(FrameEvaluator(problem), names, (0.5, 1.0), weight=down(problem))
    fine = Quantities(FrameEvaluator(problem, elements=4), names, (0.5, 1.0), weight=down(problem))
    assert fine.evaluate(mask) == pytest.approx(coarse.evaluate(mask), rel=0.05)
    for compute in (fine.sensitivity, fine.predict_flips):
        with pytest.raises(InvalidSettings, match="one element in each beam"):
            compute()


def test_wrong_settings_are_refused() -> None:
    evaluator = FrameEvaluator(actuator())
    with pytest.raises(UnknownName, match="unknown quantity 'speed'; known: travel"):
        Quantities(evaluator, ["speed"])
    with pytest.raises(InvalidSettings, match="above 0 and at most 1, got 1"):
        Quantities(evaluator, ["gain"], [0.5, 1.5])
    with pytest.raises(InvalidSettings, match="the sag needs"):
        Quantities(evaluator, ["sag"])
