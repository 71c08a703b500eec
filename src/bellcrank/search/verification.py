"""Verification of finished frames, with several elements in each beam.

A search has one element in each beam. A beam may buckle between its ends, and beams may touch
along the stroke, so the candidates of a search are verified in order of their efficiency with
more elements, and the first without a fault is selected.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.fem.contact import Contacts, find_contacts
from bellcrank.mechanics import (
    VERIFICATION_INCREMENT,
    FrameEvaluator,
    Status,
    output_motion,
)
from bellcrank.mechanics.frames.analysis import centre_lines
from bellcrank.mechanics.frames.joints import with_joints
from bellcrank.mechanics.stroke import STATES
from bellcrank.search.constraints.evaluator import ConstrainedEvaluator
from bellcrank.search.evaluator import verification_evaluator
from bellcrank.search.relaxation import relaxed
from bellcrank.search.specification import SpecificationEvaluator
from bellcrank.search.verdict import Verdict

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from bellcrank.mechanics import ItemResult, Response, StrokeRecord
    from bellcrank.model import Problem
    from bellcrank.search.settings import SearchSettings

ELEMENTS = 8
"""Number of elements of each beam; with it efficiencies are within 1e-4 of the limit of many."""
NO_CONTACT = Contacts(np.empty((0, 2), np.int64), np.empty(0), np.empty(0), np.empty(0, bool))


@dataclass(frozen=True, slots=True, eq=False)
class Verification:
    """A finished design as a frame with several elements in each beam.

    Parameters
    ----------
    elements
        Number of elements of each beam.
    response
        Response from rest in small increments, by the objective and strokes of the search.
    strain
        Largest principal strain at full load.
    contacts
        Beams that touch along the stroke; lengths in lattice units.
    fault
        Reason why the design cannot be built, in a few words, or None.
    items
        Items of the specification of the problem, with the values that the design reaches.
    records
        Channels along the stroke by load case, for a problem with a specification.
    """

    elements: int
    response: Response
    strain: float
    contacts: Contacts
    fault: str | None
    items: tuple[ItemResult, ...] = ()
    records: Mapping[str, StrokeRecord] = field(default_factory=dict)

    @property
    def is_stable(self) -> bool:
        """Whether a stable path leads to the full load."""
        return self.response.status in {Status.CONVERGED, Verdict.UNMET}


class Verifier:
    """Verification of designs of one problem.

    Parameters
    ----------
    problem
        A problem with a section, in the plane or in space.
    settings
        Settings of the search, whose goals must hold too.
    strain_limit
        Largest admissible principal strain; nan if it is unknown.
    elements
        Number of elements of each beam.

    Examples
    --------
    >>> from bellcrank.model import human_design
    >>> from bellcrank.part import PartSpec, frame_problem
    >>> from bellcrank.search import HoppingSettings
    >>> design = human_design("crane")
    >>> verifier = Verifier(frame_problem(design.problem, PartSpec()), HoppingSettings())
    >>> verification = verifier.verify(design.mask)
    >>> verification.fault, round(verification.response.efficiency, 3)
    (None, 1.176)
    """

    def __init__(
        self,
        problem: Problem,
        settings: SearchSettings,
        strain_limit: float = math.nan,
        elements: int = ELEMENTS,
    ) -> None:
        self.problem = relaxed(problem) if settings.before_refinement else problem
        self.strain_limit = strain_limit
        self.elements = elements
        self._evaluator = verification_evaluator(problem, settings, elements)
        self._frame = FrameEvaluator(problem, settings.objective, elements)

    def verify(self, mask: NDArray[np.bool_]) -> Verification:
        """Verify a design."""
        if self.problem.is_specified:
            problem = self.problem
            if problem.joints is None:
                problem = with_joints(problem, mask)
            specified = SpecificationEvaluator(problem, self.elements)
            response = specified.evaluate(mask, VERIFICATION_INCREMENT)
            return self._by_items(mask, response, specified)
        response = self._evaluator.evaluate(mask, VERIFICATION_INCREMENT)
        moved = self._frame.evaluate(mask, VERIFICATION_INCREMENT).displacement
        found = Verification(
            elements=self.elements,
            response=response,
            strain=self._frame.largest_strain(),
            contacts=NO_CONTACT,
            fault=None,
        )
        if (fault := self._fault(mask, found, moved)) is not None:
            return replace(found, fault=fault)
        contacts = self._contacts()
        fault = "beams touch along the stroke" if len(contacts.pairs) else None
        return replace(found, contacts=contacts, fault=fault)

    def _by_items(
        self, mask: NDArray[np.bool_], response: Response, evaluator: SpecificationEvaluator
    ) -> Verification:
        """Verify a design by the items of its specification."""
        items = evaluator.results() if response.is_admissible else []
        strain = max(
            (item.value for item in items if item.item.quantity == "strain"), default=math.nan
        )
        records = evaluator.records if items else {}
        found = Verification(
            self.elements, response, strain, NO_CONTACT, None, tuple(items), records
        )
        fault = None
        if not np.isin(self.problem.lattice.beams[mask], self.problem.supports.nodes).any():
            fault = "held by no support"
        elif not response.is_admissible:
            fault = f"{response.status.label} with {self.elements} elements in each beam"
        elif missed := [item.item.name for item in items if not item.met]:
            fault = f"misses {', '.join(missed)} with {self.elements} elements in each beam"
        return replace(found, fault=fault)

    def _fault(
        self, mask: NDArray[np.bool_], found: Verification, moved: NDArray[np.float64]
    ) -> str | None:
        """Return a fault that shows at full load."""
        suffix = f"with {self.elements} elements in each beam"
        if not np.isin(self.problem.lattice.beams[mask], self.problem.supports.nodes).any():
            return "held by no support"
        if not found.is_stable:
            return f"{found.response.status.label} {suffix}"
        if found.response.status is Verdict.UNMET:
            assert isinstance(self._evaluator, ConstrainedEvaluator)
            return f"violates {', '.join(self._evaluator.violated(mask))} {suffix}"
        if not output_motion(self.problem, moved).along > 0.0:
            return f"moves the wrong way {suffix}"
        if found.strain > self.strain_limit:
            return "strain above the limit of the material"
        return None

    def _contacts(self) -> Contacts:
        """Return the beams that touch in states along the stroke."""
        rest, _ = centre_lines(self._frame, self._frame.state)
        stroke = [
            (fraction, centre_lines(self._frame, found.state)[1])
            for fraction in (np.arange(1, STATES + 1) / STATES).tolist()
            if (found := self._frame.equilibrium(fraction)) is not None
        ]
        return find_contacts(
            self._frame.beams, rest, stroke, self.problem.beam_widths[self._frame.beams]
        )
