"""What the lowest stiffness along a path is compared with."""

from __future__ import annotations

import numpy as np
import pytest

from bellcrank.refine import stability
from bellcrank.refine.row_evaluator import RowEvaluator
from bellcrank.refine.stability import DECLINE, references
from bellcrank.refine.variables import variables_of

from .designs import unloaded_crane


def ratios(values: list[float]) -> list[float]:
    """Return the values over their largest reference, at most 1."""
    given = dict(enumerate(values))
    return [
        min([1.0, *(given[k] / (factor * given[peak]) for peak, factor in pairs)])
        for k, pairs in references(given).items()
    ]


def test_a_valley_is_compared_with_the_lower_of_its_sides() -> None:
    assert ratios([4.0, 1.0, 2.0]) == pytest.approx([1.0, 0.5, 1.0])
    assert ratios([2.0, 1.0, 4.0]) == pytest.approx([1.0, 0.5, 1.0])


def test_a_path_that_gets_softer_is_compared_with_a_part_of_its_largest_stiffness() -> None:
    assert ratios([10.0, 8.0, 6.0]) == pytest.approx([1.0, 1.0, 1.0])
    assert ratios([10.0, 8.0, 2.0]) == pytest.approx([1.0, 1.0, 0.2 / DECLINE])
    # The larger of both references of a valley counts.
    assert ratios([10.0, 1.0, 2.0])[1] == pytest.approx(0.1 / DECLINE)


def test_a_path_that_gets_stiffer_is_free() -> None:
    assert ratios([1.0, 2.0, 9.0]) == pytest.approx([1.0, 1.0, 1.0])


def test_each_later_state_is_a_reference() -> None:
    """So that a step is refused by the model if it makes another one the largest."""
    found = references(dict(enumerate([9.0, 1.0, 4.0, 5.0])))
    assert found[1] == ((0, DECLINE), (2, 1.0), (3, 1.0))


@pytest.mark.parametrize("decline", [DECLINE, 1.2])
def test_the_constraints_follow_from_the_lowest_stiffness(
    decline: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where it falls there are constraints, by either reference; their gradients are right."""
    monkeypatch.setattr(stability, "DECLINE", decline)
    design = unloaded_crane()
    variables = variables_of(design, 0.3, (0.2, 0.4))
    strict = RowEvaluator(variables, design.mask, [], stable=2.0)
    rows = strict.evaluate(np.zeros(variables.count), slopes=True)
    assert rows is not None
    chosen = [k for k, name in enumerate(rows.names) if name == "stability"]
    assert chosen
    direction = np.random.default_rng(1).normal(size=variables.count)
    step = 1e-4 / np.linalg.norm(direction)
    by_key = []
    for sign in (-1.0, 1.0):
        moved = strict.evaluate(sign * step * direction)
        assert moved is not None
        by_key.append(dict(zip(moved.keys, moved.constraints, strict=True)))
    for k in chosen:
        key = rows.keys[k]
        found = (by_key[1][key] - by_key[0][key]) / (2.0 * step)
        assert rows.constraint_slopes[k] @ direction == pytest.approx(found, rel=1e-4, abs=1e-6)
