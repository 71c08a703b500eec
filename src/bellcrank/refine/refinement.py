"""Refinement of a design: positions of nodes and widths of struts by gradients."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.refine.steps import corrected, linear_step, merit_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from bellcrank.model import Design
    from bellcrank.refine.rows import Rows
    from bellcrank.refine.scenarios import ScenarioRows

    Values = NDArray[np.float64]

ACCEPTED = 0.05
"""Part of the predicted improvement from which a step is accepted."""
SHARE = 0.5
"""Part of the variables that change in a step after one that lost stability."""
SMALLEST_GAIN = 1e-9
"""Predicted improvement below which a step is not tried."""
CHECKED = 5
"""Number of steps after which all scenarios are computed."""
GOOD = 0.5
"""Part of the predicted improvement from which the trust region grows."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RefinementSettings:
    """Settings of a refinement.

    Parameters
    ----------
    steps
        Largest number of accepted steps.
    evaluations
        Largest number of evaluated geometries.
    largest_move
        Largest change of a coordinate of a node, in mean beam lengths.
    narrowest, widest
        Bounds of the widths, as factors of that of the section.
    first_region, smallest_region, largest_region
        Sizes of the trust region, in beam lengths.
    patience
        Number of steps in which the merit must grow by `least_gain`.
    least_gain
        Growth below which a refinement ends.
    same_mass
        Whether the mass may not grow.
    prints
        Number of random prints with which the robustness of a geometry is computed, if the
        specification has tolerances.
    """

    steps: int = 400
    evaluations: int = 400
    largest_move: float = 0.9
    narrowest: float = 1.0
    widest: float = 1.8
    first_region: float = 0.02
    smallest_region: float = 1e-5
    largest_region: float = 0.1
    patience: int = 25
    least_gain: float = 2e-3
    same_mass: bool = False
    prints: int = 100


UNSTABLE = "no step improves the design, and some lose the stability of a path"
"""Reason for which a refinement ends at the edge of a stable region."""


@dataclass(frozen=True, slots=True, eq=False)
class Progress:
    """A state of a refinement.

    Parameters
    ----------
    step
        Number of accepted steps.
    evaluations
        Number of geometries that were evaluated.
    vector : (n,)
        Variables.
    rows
        Objectives and constraints.
    region
        Size of the trust region, beam lengths.
    reason
        Why the refinement ended; empty while it goes on.
    sheets
        Number of times the sheet has been or is being computed.
    design
        The design with this geometry, where it is known.
    share
        Part of the random prints that met all items when all were computed last, at most the
        wanted yield, with deviations `bellcrank.refine.choice.LARGER` times those that are
        tolerated; None without prints.
    has_objective
        Whether the objective of the rows is that of the specification, and not the smallest margin.
    """

    step: int
    evaluations: int
    vector: Values
    rows: Rows
    region: float
    reason: str = ""
    sheets: int = 0
    design: Design | None = None
    share: float | None = None
    has_objective: bool = True


def refine_rows(
    evaluator: ScenarioRows,
    settings: RefinementSettings,
    start: Values | None = None,
) -> Iterator[Progress]:
    """Improve a geometry step by step; yield the initial state and each accepted one.

    A step is refused if a load case loses its stability, a strut gets too short, or the merit
    grows by less than a part of what the linear model predicts; then the trust region shrinks.

    Parameters
    ----------
    evaluator
        Objectives and constraints of a design.
    start : (n,), optional
        Initial variables; zeros by default.

    Yields
    ------
    Progress
        The last one says why the refinement ended.
    """
    search = _Search(evaluator, settings, start)
    if search.rows is None:
        return
    yield search.progress()
    while not (reason := search.reason()):
        if search.advance():
            yield search.progress()
    yield search.progress(reason)


class _Search:
    """The state of a refinement."""

    def __init__(
        self,
        evaluator: ScenarioRows,
        settings: RefinementSettings,
        start: Values | None,
    ) -> None:
        self.evaluator, self.settings = evaluator, settings
        self.variables = evaluator.variables
        self.vector = np.zeros(self.variables.count) if start is None else start
        self.rows = evaluator.evaluate(self.vector, slopes=True)
        self.step, self.evaluations, self.region = 0, 1, settings.first_region
        self.merits = [] if self.rows is None else [merit_of(self.rows, _size(self.rows))]
        self.rng, self.refused = np.random.default_rng(0), 0
        self.known_merits = len(self.merits)

    def progress(self, reason: str = "") -> Progress:
        """Return the present state."""
        assert self.rows is not None
        return Progress(
            self.step, self.evaluations, self.vector, self.rows, self.region, reason,
            share=self.evaluator.share, has_objective=self.evaluator.drawn.has_objectives,
        )  # fmt: skip

    def reason(self) -> str:
        """Return why the refinement ends; empty if it goes on."""
        settings, past = self.settings, self.settings.patience
        stalled = len(self.merits) > past and (
            self.merits[-1] - self.merits[-1 - past] < settings.least_gain
        )
        ends = {
            "no node may move and no width may change": not self.variables.count,
            f"{settings.steps} steps": self.step >= settings.steps,
            f"{settings.evaluations} geometries": self.evaluations >= settings.evaluations,
            UNSTABLE: self.region < settings.smallest_region and self.refused > 0,
            "no step improves the design": self.region < settings.smallest_region,
            f"less than {settings.least_gain:g} gained in {past} steps": stalled,
        }
        return next((text for text, holds in ends.items() if holds), "")

    def advance(self) -> bool:
        """Try a step; whether it was accepted."""
        rows, variables = self.rows, self.variables
        assert rows is not None
        assert variables.problem.section is not None
        size = _size(rows)
        now = merit_of(rows, size)
        width = 2.0 * variables.problem.section.width
        reach = self.region * np.where(variables.moves, 1.0, width)
        if self.refused:
            # A path becomes unstable; other steps may not pass there.
            reach *= self.rng.random(variables.count) < SHARE
        low = np.minimum(np.maximum(-reach, variables.low - self.vector), 0.0)
        high = np.maximum(np.minimum(reach, variables.high - self.vector), 0.0)
        found = linear_step(rows, low, high, size)
        if found is None or found.merit - now < SMALLEST_GAIN:
            self.region *= 0.25
            return False
        predicted = found.merit - now
        known = self.evaluator.soft_states
        change, after = found.change, self._evaluate(found.change)
        stable = after is not None
        gained = -np.inf if after is None else merit_of(after, size) - now
        if after is not None and gained < GOOD * predicted:
            again = linear_step(corrected(rows, after, change), low, high, size)
            other = None if again is None else self._evaluate(again.change)
            if again is not None and other is not None:
                better = merit_of(other, size) - now
                if better > gained:
                    change, gained = again.change, better
        if gained < ACCEPTED * predicted:
            if self.evaluator.soft_states > known:
                # States that are soft or unstable there are constraints here from now on.
                self.rows = self._evaluate(np.zeros_like(change), slopes=True) or rows
            return self._refuse(unstable=not stable)
        after = self._evaluate(change, slopes=True)
        if after is None:
            return self._refuse(unstable=True)
        if gained > GOOD * predicted:
            self.region = min(1.5 * self.region, self.settings.largest_region)
        elif gained < 0.25 * predicted:
            self.region *= 0.6
        self.vector, self.rows = self.vector + change, after
        self.step, self.refused = self.step + 1, 0
        self.merits.append(self.merits[-1] + gained)
        if self.step % CHECKED == 0:
            self._choose_scenarios()
        return True

    def _choose_scenarios(self) -> None:
        """Choose the scenarios again; go back where others than before are far from being met."""
        found = self.evaluator.update(self.vector)
        if found.back is not None:
            self.vector = found.back
            del self.merits[self.known_merits :]
            self._refuse(unstable=True)
        else:
            self.known_merits = len(self.merits)
        if found.is_changed and found.back is None:
            self.region = max(self.region, 0.5 * self.settings.first_region)
        if found.is_changed or found.back is not None:
            self.rows = self._evaluate(np.zeros_like(self.vector), slopes=True) or self.rows

    def _evaluate(self, change: Values, *, slopes: bool = False) -> Rows | None:
        self.evaluations += 1
        return self.evaluator.evaluate(self.vector + change, slopes=slopes)

    def _refuse(self, *, unstable: bool) -> bool:
        """Shrink the trust region; after losses of stability other variables are tried too."""
        self.refused += unstable
        self.region *= 0.7 if unstable else 0.4
        return False


def _size(rows: Rows) -> float:
    """Return the size of the objective, by which it is normalised."""
    return max(abs(rows.objective), 0.1)
