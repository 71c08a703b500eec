"""Rows of a refinement as drawn and in scenarios: deviations of print and drive, lost struts."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from bellcrank.model import ObjectiveTerm
from bellcrank.refine.row_evaluator import RowEvaluator
from bellcrank.refine.rows import Rows, joined

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from typing import Protocol

    from numpy.typing import NDArray

    from bellcrank.model import Problem
    from bellcrank.refine.variables import Variables
    from bellcrank.tolerance import Scenario

    Values = NDArray[np.float64]

    class Part(Protocol):
        """Some of the rows."""

        @property
        def soft_states(self) -> int:
            """As `RowEvaluator.soft_states`."""

        def evaluate(self, vector: Values, *, slopes: bool = False) -> Rows | None:
            """As `RowEvaluator.evaluate`."""


PARTS = (0.85, 0.7, 0.5, 0.3, 0.15)
"""Parts of a deviation, the largest first."""
NEAR = 0.5
"""Largest sum of violations of a scenario that is near to being met."""


class ScenarioRows:
    """Rows of a design as drawn and in scenarios, one after the other.

    Parameters
    ----------
    drawn
        Those of the design as drawn.
    others
        Those of the scenarios.
    """

    def __init__(self, drawn: RowEvaluator, others: Sequence[Part]) -> None:
        self.drawn, self.variables = drawn, drawn.variables
        self.replace_others(others)

    @property
    def soft_states(self) -> int:
        """Number of states that were soft or unstable in any geometry, and are constraints."""
        return self.drawn.soft_states + sum(each.soft_states for each in self.others)

    def evaluate(self, vector: Values, *, slopes: bool = False) -> Rows | None:
        """Return the rows of a geometry; None if a response is not stable, or a strut too short."""
        found: dict[int, Rows] = {}
        for part in self._order:
            rows = part.evaluate(vector, slopes=slopes)
            if rows is None:
                # The next geometry is likely to be unstable in the same scenario.
                self._order.remove(part)
                self._order.insert(0, part)
                return None
            found[id(part)] = rows
        return joined([found[id(part)] for part in (self.drawn, *self.others)])

    def update(self, _vector: Values) -> Update:
        """Return whether the scenarios have changed: never."""
        return Update()

    def replace_others(self, others: Sequence[Part]) -> None:
        """Take other scenarios."""
        self.others = tuple(others)
        self._order: list[Part] = [self.drawn, *others]


class Update(NamedTuple):
    """What has changed since scenarios were chosen last.

    Parameters
    ----------
    is_changed
        Whether there are other scenarios.
    back : (n,) or None
        The geometry to go back to, if the present one is far from meeting others than before.
    """

    is_changed: bool = False
    back: Values | None = None


def reduced_rows(
    rows_of: Callable[[Scenario], RowEvaluator], scenario: Scenario, vector: Values
) -> RowEvaluator | None:
    """Return the rows of the largest part of a scenario that a geometry is near meeting.

    None if it is not near meeting even a small part.

    Parameters
    ----------
    rows_of
        Function to the rows of a scenario.
    scenario
        The scenario.
    vector : (n,)
        The geometry.
    """
    for part in PARTS:
        reduced = rows_of(scenario.scaled(part))
        found = reduced.evaluate(vector)
        if found is not None and found.violation <= NEAR:
            return reduced
    return None


class LossRows:
    """The constraint that the loss of a strut costs at most a part of the efficiency.

    Parameters
    ----------
    variables
        Variables of the design.
    mask : (M,) bool
        Its beams.
    beam
        The strut.
    largest
        Largest loss.
    """

    def __init__(
        self, variables: Variables, mask: NDArray[np.bool_], beam: int, largest: float
    ) -> None:
        of_gain = replace(variables, problem=_with_gain(variables.problem))
        self.largest, self.beam, without = largest, beam, mask.copy()
        without[beam] = False
        self.parts = [
            RowEvaluator(of_gain, present, [], objectives_only=True) for present in (mask, without)
        ]

    @property
    def soft_states(self) -> int:
        """Number of states that are constraints: none."""
        return 0

    def evaluate(self, vector: Values, *, slopes: bool = False) -> Rows | None:
        """Return the constraint; None if a response is not stable."""
        found = [part.evaluate(vector, slopes=slopes) for part in self.parts]
        drawn, without = found
        if drawn is None or without is None:
            return None
        ratio = without.objectives / drawn.objectives
        by_vector = without.objective_slopes - ratio[:, None] * drawn.objective_slopes
        return Rows(
            np.zeros(0),
            (1.0 - ratio) / self.largest - 1.0,
            ("strut_loss",),
            ((self.beam,),),
            np.zeros((0, drawn.objective_slopes.shape[1])),
            -by_vector / (self.largest * drawn.objectives[:, None]),
        )


def _with_gain(problem: Problem) -> Problem:
    """Return the first load case of a problem, with the gain of its first output to maximise."""
    wanted = problem.specification
    assert wanted is not None
    gain = ObjectiveTerm(quantity="gain", case=wanted.case, output=wanted.output)
    alone = replace(
        wanted, cases=(), items=(), maximise=(gain,), symmetry=(), tolerances=None, weight=None
    )
    return replace(problem, specification=alone)
