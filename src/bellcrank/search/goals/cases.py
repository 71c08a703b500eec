"""Load cases: what one design is to do under several loads, or at several strokes."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bellcrank.model import Problem


@dataclass(frozen=True, slots=True, eq=False)
class Case:
    """One thing asked of a design.

    Parameters
    ----------
    problem
        The load, the output and what is held.
    weight
        Of its value among those of all cases.
    wanted
        The efficiency to come near; None for as much as possible.

    Raises
    ------
    InvalidSettings
        If the weight is not above 0, or the wanted efficiency no number.
    """

    problem: Problem
    weight: float = 1.0
    wanted: float | None = None

    def __post_init__(self) -> None:
        if not 0.0 < self.weight < math.inf:
            raise InvalidSettings(f"weight of a case: expected one above 0, got {self.weight!r}")
        if self.wanted is not None and not math.isfinite(self.wanted):
            raise InvalidSettings(f"wanted efficiency: expected a number, got {self.wanted!r}")

    def value(self, efficiency: float) -> float:
        """Return what is raised: the efficiency, or minus its distance from the wanted one."""
        return efficiency if self.wanted is None else -abs(efficiency - self.wanted)

    def change(self, efficiency: float, change: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the change of the value by changes of the efficiency."""
        if self.wanted is None:
            return change
        values: NDArray[np.float64] = -np.abs(efficiency + change - self.wanted)
        # Flips that no load can feel must stay at exactly zero.
        return np.where(change == 0.0, 0.0, values - self.value(efficiency))


def at_strokes(
    problem: Problem, strokes: Sequence[float], wanted: Sequence[float] | None = None
) -> list[Case]:
    """Return a case for each of some parts of the full input, the longest first.

    Parameters
    ----------
    strokes
        From 0 to 1.
    wanted
        Output motion at each, in the length unit of the lattice: a trajectory to follow, along
        the wanted direction. None for as much as possible.

    Raises
    ------
    InvalidSettings
        If there are not as many wanted motions as strokes, or the input is a force.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> crane = find_problem("crane")
    >>> [round(case.problem.input.amount, 3) for case in at_strokes(crane, [0.5, 1.0])]
    [0.433, 0.217]
    """
    if wanted is not None and len(wanted) != len(strokes):
        raise InvalidSettings(
            f"wanted: expected one motion for each of {len(strokes)} strokes, got {len(wanted)}"
        )
    if wanted is not None and problem.input.drive == "force":
        raise InvalidSettings("wanted: a trajectory needs an input that is driven by displacement")
    cases = []
    for index in sorted(range(len(strokes)), key=lambda index: -strokes[index]):
        amount = strokes[index] * problem.input.amount
        part = problem
        if strokes[index] != 1.0:
            part = replace(problem, input=replace(problem.input, amount=amount))
        cases.append(Case(part, wanted=None if wanted is None else wanted[index] / amount))
    return cases


def check_alike(cases: Sequence[Case]) -> None:
    """Refuse cases that are not about the same designs.

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
