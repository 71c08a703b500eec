"""States of a refined geometry by better models: frames of 8 elements, and the sheet."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from bellcrank.errors import InvalidSettings
from bellcrank.model import CARRIED
from bellcrank.part.outline import room_for_fillet
from bellcrank.refine.differences import on_same_path
from bellcrank.refine.shape import shape_rows
from bellcrank.search import HoppingSettings
from bellcrank.search.verification import Verifier

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np
    from numpy.typing import NDArray

    from bellcrank.mechanics import ItemResult
    from bellcrank.model import Problem
    from bellcrank.refine.differences import Records

PRINTABLE = 1e-2
"""Part of the smallest angle or length by which one may be smaller: rounding of the steps."""
LARGEST_MISS = 0.5
"""Largest sum of violations in the sheet at which a geometry is corrected and not taken back."""


@dataclass(frozen=True, slots=True)
class State:
    """A design before or after its refinement, by frames with eight elements in each beam.

    Parameters
    ----------
    objective
        Smallest objective; the smallest margin where there is none.
    items
        Items of the specification; empty if the response is not stable.
    met
        Whether all of them are met, and the geometry prints.
    efficiency
        Efficiency at the full stroke; nan if the response is not stable.
    records
        Channels along the stroke by load case.
    share
        Part of random prints that meet all items, up to the wanted one; 1 without tolerances.
    sheet
        Items in the sheet; empty if they were not computed, or it is not stable.
    sheet_records
        The channels in the sheet.
    sheet_violation
        Sum of the violations in the sheet with a reserve for finer meshes.
    """

    objective: float
    items: tuple[ItemResult, ...]
    met: bool
    efficiency: float = math.nan
    records: Records = field(default_factory=dict)
    share: float = 1.0
    sheet: tuple[ItemResult, ...] = ()
    sheet_records: Records = field(default_factory=dict)
    sheet_violation: float = math.inf

    @property
    def rank(self) -> tuple[bool, float, float]:
        """How good it is by frames; larger is better."""
        return self.met, self.share, self.objective

    @property
    def is_stable(self) -> bool:
        """Whether all paths are stable, under payloads too."""
        return _is_stable(self.items)

    @property
    def met_in_sheet(self) -> bool | None:
        """Whether all items are met in the sheet; None if it was not computed or is not stable."""
        return all(item.met for item in self.sheet) if self.sheet else None

    @property
    def is_on_path_of_sheet(self) -> bool:
        """Whether the sheet is stable, under payloads too, and on the same path as the frame."""
        return _is_stable(self.sheet) and on_same_path(self.records, self.sheet_records)

    @property
    def missed_in_sheet(self) -> float:
        """The `sheet_violation`; infinite where the sheet is not on the same path."""
        return self.sheet_violation if self.is_on_path_of_sheet else math.inf

    @property
    def rank_in_sheet(self) -> tuple[float, float, float]:
        """How far the sheet is from meeting all items, then the yield; smaller is better."""
        return self.missed_in_sheet, total_violation(self.sheet), -self.share

    @property
    def is_near_sheet(self) -> bool:
        """Whether the sheet is on the same path, and misses little."""
        return self.missed_in_sheet <= LARGEST_MISS


def _is_stable(items: tuple[ItemResult, ...]) -> bool:
    """Whether there are items, and all have a value, as on stable paths."""
    return bool(items) and not any(math.isnan(item.value) for item in items)


def loses_payload(items: tuple[ItemResult, ...]) -> bool:
    """Whether a path is lost under a payload."""
    return any(each.item.quantity in CARRIED and math.isnan(each.value) for each in items)


def total_violation(items: tuple[ItemResult, ...]) -> float:
    """Return the sum of the violations of items; infinite without any."""
    return sum(item.violation for item in items) if items else math.inf


def state_of(problem: Problem, mask: NDArray[np.bool_]) -> State:
    """Return the state of a design of a problem with a specification."""
    found = Verifier(problem, HoppingSettings()).verify(mask)
    assert problem.specification is not None
    if not found.items:
        return State(-math.inf, (), met=False)
    objective = found.response.efficiency - found.response.penalty
    if found.fault is not None:
        objective = -sum(item.violation for item in found.items)
    met = found.fault is None and _prints(problem, mask)
    return State(objective, found.items, met, found.response.efficiency, found.records)


def _prints(problem: Problem, mask: NDArray[np.bool_]) -> bool:
    """Whether all holes between the struts are open, and no strut or angle is too small."""
    if shape_rows(problem, mask, math.inf).values.max(initial=0.0) > PRINTABLE:
        return False
    lattice = problem.lattice
    if lattice.dimension == 3:
        return True
    try:
        room_for_fillet(lattice.positions, lattice.beams[mask], problem.beam_widths[mask])
    except InvalidSettings:
        return False
    return True


def latest_met(
    state_at: Callable[[int], State], count: int, halvings: int | None = None
) -> tuple[State, int]:
    """Return state and number of the last geometry of a path that meets all with eight elements.

    The later ones may be too close to a loss of stability. The last geometry, if none is found
    among a few.

    Parameters
    ----------
    state_at
        Function from the number of a geometry to its state.
    count
        Number of geometries.
    halvings
        Largest number of times the path is halved; as often as it is possible by default.
    """
    low, high, halved = 0, count - 1, 0
    found = state_at(high), high
    if found[0].met:
        return found
    while high - low > 1 and halved != halvings:
        halved += 1
        middle = (low + high) // 2
        state = state_at(middle)
        if state.met:
            low, found = middle, (state, middle)
        else:
            high = middle
    return found


def is_better(new: State, old: State) -> bool:
    """Whether a state meets more, or has the larger objective."""
    return bool(new.items) and new.rank > old.rank
