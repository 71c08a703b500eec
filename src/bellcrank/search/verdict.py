"""Codes that a search records for its proposals."""

from __future__ import annotations

from bellcrank.mechanics import Outcome, Status


class Verdict(Outcome):
    """Result of a proposal, as written to the column ``status`` of runs and campaigns.

    The codes of `bellcrank.mechanics.Status`, and those that only searches assign.
    """

    CONVERGED = Status.CONVERGED.value, Status.CONVERGED.message
    SNAPPED = Status.SNAPPED.value, Status.SNAPPED.message
    MECHANISM = Status.MECHANISM.value, Status.MECHANISM.message
    UNCONVERGED = Status.UNCONVERGED.value, Status.UNCONVERGED.message
    FORBIDDEN = (
        4,
        (
            "the design violates the rules or goals of the search more than the current design; "
            "it is not evaluated where its beams alone decide this"
        ),
    )
    REJECTED_EARLY = 5, "the proposal was rejected without evaluation because of a prediction"
    UNVERIFIED = Status.UNVERIFIED.value, Status.UNVERIFIED.message
    UNMET = 7, "a stable equilibrium was reached from rest, but the design does not meet its goals"

    @property
    def is_admissible(self) -> bool:
        """Whether a search may accept a design with this verdict."""
        return self in {Verdict.CONVERGED, Verdict.UNMET}
