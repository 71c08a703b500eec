"""What comes out of a design job."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

    from bellcrank.mechanics import Response
    from bellcrank.model import Design
    from bellcrank.part import PartSpec
    from bellcrank.search import SearchSettings, Selection
    from bellcrank.workflows.validate import Validation

AGREEMENT = 1e-6
"""Largest difference between the efficiencies of two loading paths that verify each other, relative
to the efficiency, or to 1 where that is less."""


@dataclass(frozen=True, slots=True, eq=False)
class DesignReport:
    """What came out of a design job.

    Parameters
    ----------
    folder
        Where everything was written.
    settings
        Of the search.
    selection
        The design, and where it comes from.
    checks
        Efficiency of the design from rest, by the load increments that it was computed in.
    initial_efficiency
        Where the search began, under the same objective; nan if that has none.
    human
        The human-designed counterpart, if there is one.
    human_response
        Its response, under the same objective.
    proposals, best_by_chain
        How many designs were looked at; the best each chain accepted.
    part
        What the design is for, if for a part.
    validation
        Its frame, if it is for a part and hangs on supports.
    """

    folder: Path
    settings: SearchSettings
    selection: Selection
    checks: dict[str, float]
    initial_efficiency: float
    human: Design | None
    human_response: Response | None
    proposals: int
    best_by_chain: list[float]
    part: PartSpec | None = None
    validation: Validation | None = None

    @property
    def failures(self) -> list[str]:
        """Reasons why the design does not work; empty if it does."""
        found = []
        if self.selection.efficiency_after <= 0.0:
            found.append("the output does not move in the wanted direction")
        if self.part is not None:
            if self.validation is None:
                found.append("the part is not held by any support")
            else:
                found += self.validation.analyses[0].warnings
        return found

    @property
    def agreement(self) -> float:
        """Largest difference between the checks."""
        return max(self.checks.values()) - min(self.checks.values())

    @property
    def verified(self) -> bool:
        """Whether the checks agree."""
        return self.agreement <= AGREEMENT * max(1.0, *map(abs, self.checks.values()))
