"""Load cases: several loads, or several strokes, under which one design is evaluated."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.mechanics import at_fraction

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bellcrank.model import Problem


@dataclass(frozen=True, slots=True, eq=False)
class LoadCase:
    """A load case.

    Parameters
    ----------
    problem
        Problem that defines supports, input and output.
    weight
        Weight of the case in the mean over all cases.
    target
        Wanted efficiency; None to maximise the efficiency.

    Raises
    ------
    InvalidSettings
        If the weight is not above 0, or the target is not finite.
    """

    problem: Problem
    weight: float = 1.0
    target: float | None = None

    def __post_init__(self) -> None:
        if not 0.0 < self.weight < math.inf:
            raise InvalidSettings(f"weight of a case: expected one above 0, got {self.weight!r}")
        if self.target is not None and not math.isfinite(self.target):
            raise InvalidSettings(f"target efficiency: expected a number, got {self.target!r}")

    def value(self, efficiency: float) -> float:
        """Return the value to maximise: the efficiency, or minus its distance from the target."""
        return efficiency if self.target is None else -abs(efficiency - self.target)

    def change(self, efficiency: float, change: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the changes of the value for changes of the efficiency."""
        if self.target is None:
            return change
        values: NDArray[np.float64] = -np.abs(efficiency + change - self.target)
        # The change of a flip that affects no load-bearing beam must stay exactly zero.
        return np.where(change == 0.0, 0.0, values - self.value(efficiency))


def at_strokes(
    problem: Problem, strokes: Sequence[float], targets: Sequence[float] | None = None
) -> list[LoadCase]:
    """Return a load case for each of several fractions of the full input, the largest first.

    Parameters
    ----------
    strokes
        Fractions from 0 to 1.
    targets
        Wanted output displacement at each stroke, along the wanted direction, in lattice units;
        None to maximise it.

    Raises
    ------
    InvalidSettings
        If the numbers of targets and strokes differ, the input is a force, or a stroke is shorter
        and inputs move in parts of it.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> crane = find_problem("crane")
    >>> [round(case.problem.input.amount, 3) for case in at_strokes(crane, [0.5, 1.0])]
    [0.433, 0.217]
    """
    if targets is not None and len(targets) != len(strokes):
        raise InvalidSettings(
            f"targets: expected one for each of {len(strokes)} strokes, got {len(targets)}"
        )
    if targets is not None and problem.input.drive == "force":
        raise InvalidSettings("targets: a path needs an input that is driven by displacement")
    cases = []
    for index in sorted(range(len(strokes)), key=lambda index: -strokes[index]):
        amount = strokes[index] * problem.input.amount
        part = at_fraction(problem, strokes[index]) if strokes[index] != 1.0 else problem
        cases.append(LoadCase(part, target=None if targets is None else targets[index] / amount))
    return cases


def check_compatible(cases: Sequence[LoadCase]) -> None:
    """Raise an error unless all cases have the same lattice, designable beams and initial design.

    Raises
    ------
    InvalidSettings
    """
    if not cases:
        raise InvalidSettings("cases: expected at least one")
    first = cases[0].problem
    for number, case in enumerate(cases[1:], 1):
        other = case.problem
        for what, one, two in (
            ("positions", first.lattice.positions, other.lattice.positions),
            ("beams", first.lattice.beams, other.lattice.beams),
            ("designable beams", first.designable, other.designable),
            ("initial design", first.initial, other.initial),
        ):
            if not np.array_equal(one, two):
                raise InvalidSettings(
                    f"cases[{number}]: problem {other.name!r} has other {what} than {first.name!r}"
                )
