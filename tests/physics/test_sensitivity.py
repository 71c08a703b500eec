"""The sensitivity is the slope at t = 0 of the efficiency under (1 - t) E + t E_flipped."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from bellcrank.errors import InvalidSettings
from bellcrank.mechanics import SpringEvaluator, Status

from .problems import arm_on, frame, patch, random_masks
from .twin import Blend, Twin, efficiency, solve

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.model import Problem

STEP = 1e-3


def reached(problem: Problem, mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(N,) nodes that present beams join to the input."""
    nodes = np.zeros(problem.lattice.node_count, dtype=bool)
    nodes[problem.input.nodes] = True
    for _ in range(len(nodes)):
        for a, b in problem.lattice.beams[mask]:
            nodes[a] = nodes[b] = nodes[a] or nodes[b]
    return nodes


def flipped(mask: NDArray[np.bool_], beam: int) -> NDArray[np.bool_]:
    other = mask.copy()
    other[beam] ^= True
    return other


def blended_efficiency(
    problem: Problem, mask: NDArray[np.bool_], beam: int, t: float, start: NDArray[np.float64]
) -> float:
    """Efficiency at blend `t`; what moves in either design moves."""
    other = flipped(mask, beam)
    moving = reached(problem, mask | other)
    blend = Blend(Twin(problem, mask), Twin(problem, other), t)
    return efficiency(problem, solve(blend, moving, start))


def slope(problem: Problem, mask: NDArray[np.bool_], beam: int) -> float:
    """One-sided derivative of third order: an absent beam cannot be less than absent."""
    rest = SpringEvaluator(problem).evaluate(mask)
    values = [
        blended_efficiency(problem, mask, beam, share * STEP, rest.displacement)
        for share in (1, 2, 3)
    ]
    eta = [rest.efficiency, *values]
    return (-11 * eta[0] + 18 * eta[1] - 9 * eta[2] + 2 * eta[3]) / (6 * STEP)


def kind_of_flip(problem: Problem, mask: NDArray[np.bool_], beam: int) -> str:
    """Whether a flip removes a beam, adds one between moved nodes, or changes a dead end."""
    ends = problem.lattice.beams[beam]
    others = flipped(mask, beam) if mask[beam] else mask
    dead_end = not reached(problem, others)[ends].all()
    return ("present" if mask[beam] else "absent") + (" dead end" if dead_end else "")


def compare(problem: Problem, mask: NDArray[np.bool_]) -> dict[str, int]:
    """Compare all flips with the twin; count them by kind."""
    counts: dict[str, int] = {}
    found = SpringEvaluator(problem).sensitivity(mask)
    moved = reached(problem, mask)
    for beam, ends in enumerate(problem.lattice.beams):
        if not moved[ends].any():
            assert found[beam] == 0.0
            continue
        kind = kind_of_flip(problem, mask, beam)
        expected = slope(problem, mask, beam)
        assert found[beam] == pytest.approx(expected, abs=2e-4, rel=2e-4), (beam, kind)
        counts[kind] = counts.get(kind, 0) + 1
    return counts


def sparse_patch() -> tuple[Problem, NDArray[np.bool_]]:
    """A patch with a dead end and a free node beside the load-bearing part."""
    problem = patch()
    mask = problem.initial.copy()
    ends = problem.lattice.beams
    loose = (ends == 6).any(axis=1)  # a node inside
    hanging = np.flatnonzero((ends == 10).any(axis=1))  # another keeps one beam
    mask[loose] = False
    mask[hanging[1:]] = False
    return problem, mask


def test_every_flip_of_the_full_patch() -> None:
    problem = patch()
    assert compare(problem, problem.initial)["present"] > 20


def test_every_flip_of_a_patch_with_dead_ends() -> None:
    problem, mask = sparse_patch()
    kinds = compare(problem, mask)
    assert {"present", "absent", "present dead end", "absent dead end"} == set(kinds)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["directional", "isotropic"])
def test_every_flip_under_a_force_against_springs(kind: str) -> None:
    problem = patch(force=True, kind=kind)
    mask = random_masks(problem, 0.9, 1)[0]
    evaluator = SpringEvaluator(problem, "displacement")
    found = evaluator.sensitivity(mask)
    displacement = evaluator.evaluate(mask).displacement
    at_rest = efficiency(problem, displacement)
    for beam in np.flatnonzero(reached(problem, mask)[problem.lattice.beams].all(axis=1)):
        eta = [
            blended_efficiency(problem, mask, int(beam), share * STEP, displacement)
            for share in (1, 2, 3)
        ]
        expected = (-11 * at_rest + 18 * eta[0] - 9 * eta[1] + 2 * eta[2]) / (6 * STEP)
        assert found[beam] == pytest.approx(expected, abs=2e-4, rel=2e-4)


def prop() -> Problem:
    """A lever whose free arm a prop, absent at first, would rest on a support of its own."""
    return frame(
        [(0, 0), (1, 0), (2, 0.1), (3, 0), (2, -1)],
        [(0, 1), (1, 2), (2, 3), (2, 4)],
        fixed=[0, 1, 4],
        drive=(3, (0.0, -1.0), 0.1),
        watch=(2, (0.0, -1.0)),
    )


def test_a_beam_to_a_support_that_nothing_reached_yet_is_no_dead_end() -> None:
    problem = prop()
    mask = np.array([True, True, True, False])
    found = SpringEvaluator(problem).sensitivity(mask)[3]
    assert found == pytest.approx(slope(problem, mask, 3), abs=2e-4, rel=2e-4)


def test_sensitivity_of_other_objectives_is_that_of_their_formula() -> None:
    problem = patch()
    mask = random_masks(problem, 0.9, 1)[0]
    beams = np.flatnonzero(mask)[10:20]
    for objective in ("directional:3", "directional:6"):
        evaluator = SpringEvaluator(problem, objective)
        found = evaluator.sensitivity(mask)
        rest = evaluator.evaluate(mask)
        for beam in beams:
            blend = Blend(Twin(problem, mask), Twin(problem, flipped(mask, beam)), STEP)
            ahead = solve(blend, reached(problem, mask), rest.displacement)
            blend.t = -STEP
            behind = solve(blend, reached(problem, mask), rest.displacement)
            values = [directional_efficiency(problem, u, objective) for u in (behind, ahead)]
            expected = (values[1] - values[0]) / (2 * STEP)
            assert found[beam] == pytest.approx(expected, abs=1e-4, rel=1e-4)


def directional_efficiency(problem: Problem, u: NDArray[np.float64], objective: str) -> float:
    exponent = float(objective.split(":")[1])
    out, wanted = u[problem.output.nodes], problem.output.direction
    size = np.linalg.norm(out, axis=1)
    half = np.arccos((out * wanted).sum(axis=1) / size) / 2
    motion = (size * (2 * np.cos(half) ** exponent - 1)).mean()
    return float(motion / problem.input.amount)


def test_a_mechanism_has_no_sensitivity() -> None:
    problem = arm_on(fixed=[0])
    assert SpringEvaluator(problem).evaluate(problem.initial).status is Status.MECHANISM
    with pytest.raises(InvalidSettings, match="rigid-body motion"):
        SpringEvaluator(problem).sensitivity(problem.initial)
