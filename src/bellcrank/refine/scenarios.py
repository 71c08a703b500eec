"""Rows of a refinement as drawn and in scenarios: deviations of print and drive, lost struts."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np

from bellcrank.model import ObjectiveTerm
from bellcrank.refine.row_evaluator import RowEvaluator
from bellcrank.refine.rows import Rows, joined

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from bellcrank.model import Problem
    from bellcrank.refine.variables import Variables
    from bellcrank.tolerance import Scenario

    Values = NDArray[np.float64]

PARTS = (0.85, 0.7, 0.5, 0.3, 0.15)
"""Parts of a deviation, the largest first."""
NEAR = 0.5
"""Largest sum of violations of a scenario that is near to being met."""


class Part(Protocol):
    """Some of the rows."""

    @property
    def soft_states(self) -> int:
        """As `RowEvaluator.soft_states`."""

    def evaluate(self, vector: Values, *, slopes: bool = False) -> Rows | None:
        """As `RowEvaluator.evaluate`."""

    def maximise_margins(self) -> None:
        """As `RowEvaluator.maximise_margins`."""


class ScenarioRows:
    """Rows of a design as drawn and in scenarios, one after the other.

    Parameters
    ----------
    drawn
        Those of the design as drawn.
    others
        Those of the scenarios.

    Attributes
    ----------
    share
        As that of `bellcrank.refine.refinement.Progress`.
    """

    share: float | None = None

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
    rows_of: Callable[[Scenario], Part], scenario: Scenario, vector: Values
) -> Part | None:
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


class KeptRows:
    """The constraint that the efficiency in a scenario is at least a part of that as drawn.

    Items are not constraints in the scenario. The stability of the path is, unless a strut is lost.

    Parameters
    ----------
    variables
        Variables of the design.
    mask : (M,) bool
        Its beams.
    least
        Smallest efficiency in the scenario over that as drawn.
    scenario
        The scenario; one of a lost strut has no other deviation.
    """

    def __init__(
        self, variables: Variables, mask: NDArray[np.bool_], least: float, scenario: Scenario
    ) -> None:
        of_gain = replace(variables, problem=_with_gain(variables.problem))
        self.least, self.beam = least, scenario.missing
        self.has_objectives = True
        if self.beam is None:
            deviating = RowEvaluator(of_gain, mask, [], scenario=scenario, kinds="stability")
        else:
            without = mask.copy()
            without[self.beam] = False
            deviating = RowEvaluator(of_gain, without, [], kinds="objectives")
        self.parts = RowEvaluator(of_gain, mask, [], kinds="objectives"), deviating

    @property
    def soft_states(self) -> int:
        """Number of states that were soft or unstable in any geometry, and are constraints.

        None without a strut.
        """
        return self.parts[1].soft_states if self.beam is None else 0

    def maximise_margins(self) -> None:
        """Make the margin of the efficiency the objective."""
        self.has_objectives = False

    def evaluate(self, vector: Values, *, slopes: bool = False) -> Rows | None:
        """Return the constraint; None if a response is not stable."""
        drawn, found = (part.evaluate(vector, slopes=slopes) for part in self.parts)
        if drawn is None or found is None:
            return None
        largest = 1.0 - self.least
        ratio = found.objectives / drawn.objectives
        loss = (1.0 - ratio) / largest - 1.0
        by_vector = ratio[:, None] * drawn.objective_slopes - found.objective_slopes
        by_vector /= largest * drawn.objectives[:, None]
        count = 0 if self.has_objectives else 1
        return Rows(
            -loss[:count],
            np.concatenate([loss, found.constraints]),
            ("kept" if self.beam is None else "strut_loss", *found.names),
            ((0 if self.beam is None else self.beam,), *found.keys),
            -by_vector[:count],
            np.concatenate([by_vector, found.constraint_slopes]),
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
