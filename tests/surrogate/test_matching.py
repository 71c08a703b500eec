"""A trained network knows its problem under any numbering, and no other."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from bellcrank.campaign.dataset import reverse
from bellcrank.errors import InvalidModel, InvalidProblem
from bellcrank.model import Lattice, Stiffness, Supports, find_problem, unpack_mask
from bellcrank.surrogate.matching import beams_between
from bellcrank.surrogate.predictor import Predictor, load_predictor

from .helpers import moved, random_masks, untrained

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from bellcrank.model import Problem


@pytest.mark.parametrize("name", ["scaling-8", "crane", "pliers", "discs"])
def test_beams_are_found_under_another_numbering(name: str) -> None:
    known = find_problem(name)
    given, old_beam = moved(known)
    assert np.array_equal(beams_between(known, given), old_beam)
    assert np.array_equal(beams_between(known, known), np.arange(known.lattice.beam_count))


@pytest.mark.parametrize("name", ["mlp", "grid", "resnet18-w16"])
def test_predictions_do_not_depend_on_numbering_and_place(problem: Problem, name: str) -> None:
    model = untrained(problem, name)
    given, old_beam = moved(problem)
    masks = random_masks(problem, 5)
    here = Predictor(problem, [model], device="cpu").predict(masks)
    there = Predictor(given, [model], device="cpu").predict(masks[:, old_beam])
    assert np.array_equal(here.efficiency, there.efficiency)
    assert here.efficiency.std() > 0.0


def test_the_independently_numbered_crane_is_the_crane(crane: Problem, reference: Path) -> None:
    other = find_problem(str(reference / "crane.problem.json"))
    told = json.loads((reference / "crane.results.json").read_text())["results"]
    masks = np.array([unpack_mask(each["mask"], other.lattice.beam_count) for each in told])
    ours = beams_between(crane, other)
    translated = np.zeros_like(masks)
    translated[:, ours] = masks
    model = untrained(crane)
    assert np.array_equal(
        Predictor(other, [model], device="cpu").predict(masks).efficiency,
        Predictor(crane, [model], device="cpu").predict(translated).efficiency,
    )
    assert not np.array_equal(ours, np.arange(len(ours)))


def nudged(problem: Problem) -> Problem:
    positions = problem.lattice.positions.copy()
    positions[40, 0] += 2e-4
    return replace(problem, lattice=Lattice(positions, problem.lattice.beams))


def rewired(problem: Problem) -> Problem:
    beams = problem.lattice.beams.copy()
    ends = {tuple(sorted(pair)) for pair in beams.tolist()}
    far = next(n for n in range(problem.lattice.node_count) if (0, n) not in ends and n > 20)
    beams[100] = [0, far]
    return replace(problem, lattice=Lattice(problem.lattice.positions, beams))


def stiffer(problem: Problem) -> Problem:
    return replace(problem, stiffness=Stiffness(problem.stiffness.bond, 0.1001))


def rolling(problem: Problem) -> Problem:
    fixed = problem.supports.fixed
    return replace(problem, supports=Supports(fixed=fixed[1:], fixed_x=fixed[:1]))


def fewer_outputs(problem: Problem) -> Problem:
    output = problem.output
    return replace(
        problem, output=replace(output, nodes=output.nodes[1:], direction=output.direction[1:])
    )


def loaded(problem: Problem) -> Problem:
    return replace(problem, output=replace(problem.output, spring=0.1))


def turned(problem: Problem) -> Problem:
    output = replace(problem.output, direction=problem.output.direction[:, ::-1])
    return replace(problem, output=output)


def further(problem: Problem) -> Problem:
    return replace(problem, input=replace(problem.input, amount=1.001 * problem.input.amount))


def forced(problem: Problem) -> Problem:
    return replace(problem, input=replace(problem.input, drive="force"))


CHANGES: list[tuple[Callable[[Any], Any], str]] = [
    (nudged, "with no node where 'scaling-8' has node 40"),
    (rewired, "a lattice without beam 100 of 'scaling-8'"),
    (stiffer, r"stiffness of joints is another .* \(0\.1 there, 0\.1001 here\)"),
    (rolling, r"support \(fixed\) is another"),
    (fewer_outputs, "output region is another"),
    (loaded, r"output spring is another .* \(None there, 0\.1 here\)"),
    (turned, "output direction is another"),
    (reverse, "output direction is another"),
    (further, "amount is another"),
    (forced, "drive is another"),
    (lambda problem: replace(problem, aggregate="sum"), "aggregate is another"),
    (
        lambda problem: replace(problem, objective="directional:4"),
        r"exponent of the objective is another .* \(2\.0 there, 4\.0 here\)",
    ),
    (lambda _: find_problem("crane"), r"with 125 nodes and 219 beams|nodes and .* has 133 and 352"),
]


@pytest.mark.parametrize(("change", "message"), CHANGES)
def test_another_problem_is_refused_and_the_reason_given(
    problem: Problem, change: Callable[[Problem], Problem], message: str
) -> None:
    with pytest.raises(InvalidModel, match=message):
        beams_between(problem, change(problem))


def test_soft_joints_are_told_apart_however_soft(problem: Problem) -> None:
    soft, softer = (replace(problem, stiffness=Stiffness(5.0, angle)) for angle in (2e-5, 1e-5))
    with pytest.raises(InvalidModel, match="stiffness of joints"):
        beams_between(soft, softer)


def test_naming_the_usual_objective_changes_nothing(problem: Problem) -> None:
    named = replace(problem, objective="displacement")
    assert len(beams_between(problem, named)) == problem.lattice.beam_count
    pliers = find_problem("pliers")
    assert len(beams_between(pliers, replace(pliers, objective="force"))) > 0
    with pytest.raises(InvalidModel, match="objective is another"):
        beams_between(pliers, replace(pliers, objective="displacement"))


def test_several_networks_give_their_mean_and_how_much_they_dispute(problem: Problem) -> None:
    members = [untrained(problem, "mlp", seed) for seed in range(3)]
    masks = random_masks(problem, 6)
    packed = np.packbits(masks, axis=1)
    each = np.array([member.predict(packed, device="cpu") for member in members])
    found = Predictor(problem, members, device="cpu").predict(masks)
    assert np.allclose(found.efficiency, each.sum(axis=0) / 3)
    assert found.spread is not None
    variance = ((each - each.sum(axis=0) / 3) ** 2).sum(axis=0) / 2
    assert np.allclose(found.spread, np.sqrt(variance))
    assert Predictor(problem, members[:1], device="cpu").predict(masks).spread is None
    assert found.efficiency.shape == (6,)
    assert Predictor(problem, members, device="cpu").predict(masks[:0]).efficiency.shape == (0,)


def test_predictions_need_networks_and_masks_of_the_problem(
    problem: Problem, crane: Problem, tmp_path: Path
) -> None:
    with pytest.raises(InvalidModel, match="at least one trained model"):
        Predictor(problem, [])
    predictor = Predictor(problem, [untrained(problem)], device="cpu")
    for wrong in (np.ones((2, 352), bool), np.ones(219, bool), np.ones((2, 219))):
        with pytest.raises(InvalidProblem, match=r"masks: expected booleans of shape \(n, 219\)"):
            predictor.predict(wrong)  # type: ignore[arg-type]
    path = tmp_path / "model.safetensors"
    untrained(problem).write(path)
    assert load_predictor(problem, [path], device="cpu").predict(random_masks(problem, 2))
    with pytest.raises(InvalidModel, match="has learnt 'scaling-8'"):
        load_predictor(crane, [path])
