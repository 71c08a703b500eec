"""The plain lever: it obeys the law of the lever, and is the best of its family."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bellcrank.errors import InvalidSettings
from bellcrank.machines import elementary, mean_ports, two_port_at
from bellcrank.machines.elementary import DIRECTIONS
from bellcrank.machines.library.lever import (
    ARMS,
    LEVER,
    Shape,
    lever_of,
    plain_lever,
    shapes,
)
from bellcrank.mechanics import VERIFICATION_INCREMENT, SpringEvaluator, Status
from bellcrank.model import Problem, Stiffness


def rotated(vector: np.ndarray) -> np.ndarray:
    """A vector rotated by 90 degrees: its velocity in a unit rotation."""
    return np.array([-vector[1], vector[0]])


def lever_law(problem: Problem, shape: Shape) -> float:
    """Efficiency of a lever with rigid arms, a rigid link and free joints."""
    positions = problem.lattice.positions
    pivot, first, knee = positions[[shape.pivot, shape.link[0], shape.link[-1]]]
    along = knee - first
    output = positions[problem.output.nodes].mean(axis=0)
    given = along @ problem.input.direction.mean(axis=0)
    wanted = rotated(output - pivot) @ problem.output.direction.mean(axis=0)
    arm = along @ rotated(knee - pivot)
    return float(given * wanted / arm) if abs(arm) > 1e-9 else np.inf


def efficiency_with(angle: float, problem: Problem, shape: Shape) -> float:
    """Of the two-port at rest, with joints of some stiffness."""
    soft = replace(problem, stiffness=Stiffness(bond=5.0, angle=angle))
    element = mean_ports(lever_of(soft, shape))
    return two_port_at(element, element.rest()).efficiency


def rigid(problem: Problem, pivot: int, struts: int) -> Shape:
    """A lever whose arms are two rows of struts everywhere, so that only its joints bend."""
    found = [
        shape
        for shape in shapes(problem)
        if shape.arms == LEVER and (shape.pivot, len(shape.link) - 1) == (pivot, struts)
    ]
    return min(found, key=lambda shape: abs(efficiency_with(1e-6, problem, shape)
                                            / lever_law(problem, shape) - 1))  # fmt: skip


@pytest.mark.parametrize("direction", ["up", "right", "down-left", "down-right"])
@pytest.mark.parametrize(("pivot", "struts"), [(6, 6), (3, 6), (6, 3)])
def test_with_free_joints_the_two_port_obeys_the_law_of_the_lever(
    direction: str, pivot: int, struts: int
) -> None:
    """What is off goes with the stiffness of the joints against that of the struts."""
    problem = elementary(9, direction)
    shape = rigid(problem, pivot, struts)
    law = lever_law(problem, shape)
    off = [abs(efficiency_with(angle, problem, shape) / law - 1) for angle in (1e-3, 1e-4, 1e-5)]
    assert off[2] < 1e-3
    assert off[2] < 0.15 * off[1]
    assert off[1] < 0.2 * off[0]


def test_force_and_motion_change_places_in_a_lever() -> None:
    """A lever without losses: what is gained in motion is lost in force."""
    soft = replace(elementary(9, "up"), stiffness=Stiffness(bond=5.0, angle=1e-6))
    element = mean_ports(lever_of(soft, rigid(soft, 3, 6)))
    port = two_port_at(element, element.rest())
    assert port.force_efficiency * port.efficiency == pytest.approx(1.0, rel=1e-3)


def test_stiff_joints_make_a_lever_worse_than_its_law() -> None:
    problem = elementary(9, "up")
    lever = plain_lever(problem)
    shape = Shape(LEVER, lever.provenance["pivot"], tuple(lever.provenance["link"]))
    assert lever.provenance["arms"] == LEVER
    assert lever.efficiency is not None
    assert 0.5 * lever_law(problem, shape) < lever.efficiency < lever_law(problem, shape)


@pytest.mark.parametrize(
    "direction",
    [
        pytest.param(name, marks=[] if name in ("up", "down-left") else pytest.mark.slow)
        for name in DIRECTIONS
    ],
)
def test_none_of_the_family_is_better(direction: str) -> None:
    problem = elementary(7, direction, 0.02)
    best = plain_lever(problem)
    evaluator = SpringEvaluator(problem)
    found = {}
    for shape in shapes(problem):
        response = evaluator.evaluate(lever_of(problem, shape).mask, VERIFICATION_INCREMENT)
        if response.status is Status.CONVERGED:
            found[shape] = response.efficiency
    assert best.efficiency == max(found.values())
    assert {shape.arms for shape in found} <= set(ARMS)
    assert best.efficiency == evaluator.evaluate(best.mask, VERIFICATION_INCREMENT).efficiency


def test_a_bar_between_the_ports_only_follows() -> None:
    problem = elementary(9, "down")
    response = SpringEvaluator(problem).evaluate(lever_of(problem, Shape("bar")).mask)
    assert response.efficiency == pytest.approx(1.0, abs=1e-9)
    assert response.energy == pytest.approx(0.0, abs=1e-12)


def test_a_lever_stands_on_its_pivot_alone_and_has_whole_ports() -> None:
    problem = elementary(9, "up-right")
    lever = plain_lever(problem)
    lattice = problem.lattice
    used = np.unique(lattice.beams[lever.mask])
    assert np.intersect1d(used, problem.supports.fixed).tolist() == [lever.provenance["pivot"]]
    for region in (problem.input, problem.output):
        inside = np.isin(lattice.beams, region.nodes).all(axis=1)
        assert lever.mask[inside].all()


def test_a_lever_keeps_the_goals_that_it_is_given() -> None:
    problem = elementary(9, "up")
    free, light = plain_lever(problem), plain_lever(problem, ["input-stiffness <= 0.1"])
    for lever, keeps in ((free, False), (light, True)):
        response = SpringEvaluator(problem).evaluate(lever.mask)
        stiffness = 2.0 * response.energy / problem.input.amount**2
        assert (stiffness <= 0.1) == keeps
    assert free.efficiency is not None
    assert light.efficiency is not None
    assert light.efficiency < free.efficiency


def test_goals_that_no_lever_keeps_are_said() -> None:
    with pytest.raises(InvalidSettings, match=r"no plain lever .*input-stiffness >= 1000"):
        plain_lever(elementary(7, "up"), ["input-stiffness >= 1000"])
