"""Scores of the designs in the records of a search."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bellcrank.mechanics import Status
from bellcrank.search.constraints.evaluator import BASE_PENALTY
from bellcrank.search.markov.costs import costs
from bellcrank.search.verdict import Verdict

if TYPE_CHECKING:
    from collections.abc import Mapping
    from typing import Any

    from numpy.typing import NDArray

    from bellcrank.model import Problem
    from bellcrank.search.settings import SearchSettings

SCORE_COLUMNS = ("efficiency", "cost", "accepted", "status")
"""Columns of the records from which scores follow."""
LEAST_MET = -0.5 * BASE_PENALTY
"""Score below which a design misses items or constraints."""


def recorded_scores(
    records: Mapping[str, NDArray[Any]], settings: SearchSettings, problem: Problem
) -> NDArray[np.float64]:
    """Return the scores of accepted designs.

    The score is the efficiency, of a problem with a specification its objective, less a penalty
    where items are missed.

    Parameters
    ----------
    records
        The `SCORE_COLUMNS` of a chain.

    Returns
    -------
    (n,) float64
        nan for designs that were not accepted, or violate goals.
    """
    statuses = [Status.CONVERGED, *([Verdict.UNMET] if problem.is_specified else [])]
    taken = records["accepted"] & np.isin(records["status"], statuses)
    found = np.full(len(taken), np.nan)
    found[taken] = records["efficiency"][taken]
    if problem.is_specified:
        inverse = costs[getattr(settings, "cost", "negative")].inverse
        found[taken] = [inverse(each) for each in records["cost"][taken].tolist()]
    return found
