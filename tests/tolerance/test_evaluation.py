"""Results of scenarios against an independent program and against responses from rest."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bellcrank.mechanics import FrameEvaluator, Status
from bellcrank.model import Design, human_design
from bellcrank.part import PartSpec, Section, frame_problem
from bellcrank.part.part import Part
from bellcrank.search.strut_loss import PATH_LOST, StrutLosses
from bellcrank.tolerance import Deviations, Scenario, ScenarioEvaluator, scenarios_of
from bellcrank.workflows import find_design
from tests.fem import opensees
from tests.fem.test_frames import RUBBER


@pytest.fixture(scope="module")
def crane() -> Design:
    design = human_design("crane")
    assert design is not None
    return replace(design, problem=frame_problem(design.problem, PartSpec(joint=0.0)))


def test_prints_agree_with_opensees(crane: Design) -> None:
    """The gain of 20 random prints, with four elements in each strut."""
    pytest.importorskip("openseespy.opensees")
    deviations = Deviations(prints=20, struts=False, seed=7)
    prints = [
        each
        for each in scenarios_of(crane.problem, crane.mask, deviations, 10.0)
        if each.kind == "print"
    ]
    evaluator = ScenarioEvaluator(crane, elements=4)
    for scenario in prints:
        problem = scenario.of(crane.problem)
        part = Part(replace(crane, problem=problem), RUBBER, Section(2.0, 5.0))
        moved, _ = opensees.respond(part, 4, "euler-bernoulli", nonlinear=True)
        output, given = problem.output, problem.input
        along = np.mean((moved[output.nodes] * output.direction).sum(axis=1))
        wanted = along / (given.amount * part.scale)
        assert evaluator.evaluate(scenario).objectives[0] == pytest.approx(wanted, abs=1e-6)


@pytest.mark.parametrize("name", ["human:crane", "machine:crane"])
def test_lost_struts_are_as_from_rest(name: str) -> None:
    """Also where Newton's method does not lead from the design to that without a strut."""
    design = find_design(name)
    design = replace(design, problem=frame_problem(design.problem, PartSpec(joint=0.0)))
    evaluator, losses = ScenarioEvaluator(design), StrutLosses(design.problem)
    alone = FrameEvaluator(design.problem, "displacement")
    nominal = alone.evaluate(design.mask).efficiency
    by_strut = losses.by_strut(design.mask)
    lost = 0
    for beam in np.flatnonzero(design.mask)[::3].tolist():
        mask = design.mask.copy()
        mask[beam] = False
        wanted = alone.evaluate(mask)
        found = evaluator.evaluate(Scenario(name="", kind="strut", missing=beam))
        if wanted.status is Status.CONVERGED:
            assert found.efficiency == pytest.approx(wanted.efficiency, abs=1e-6)
            if beam in by_strut:
                loss = min(max(1.0 - wanted.efficiency / nominal, 0.0), PATH_LOST)
                assert by_strut[beam] == pytest.approx(loss, abs=1e-6)
        else:
            assert not found.is_stable
            lost += 1
    assert lost < 10


def test_results_do_not_depend_on_the_scenarios_before(crane: Design) -> None:
    scenarios = scenarios_of(crane.problem, crane.mask, Deviations(prints=5), 10.0)
    chosen = [scenarios[k] for k in (0, 3, 8, 12, 30, 60)]
    evaluator = ScenarioEvaluator(crane)
    together = [evaluator.evaluate(each) for each in chosen]
    for scenario, found in zip(chosen, together, strict=True):
        alone = ScenarioEvaluator(crane).evaluate(scenario)
        assert found.efficiency == pytest.approx(alone.efficiency, abs=1e-9, nan_ok=True)
