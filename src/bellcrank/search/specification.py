"""Evaluator of searches for designs that meet a specification."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.mechanics import (
    VERIFICATION_INCREMENT,
    CaseEvaluator,
    FlipPrediction,
    ItemResult,
    Status,
    StrokeRecord,
    channels_of,
    has_channels,
    item_results,
    objective_value,
    tightened,
    violation,
)
from bellcrank.mechanics.items import TOLERANCE, Bounds, reduced, relative_distance
from bellcrank.mechanics.stroke_record import forces_of
from bellcrank.search.clearance import gap_less_overlaps
from bellcrank.search.constraints.evaluator import BASE_PENALTY
from bellcrank.search.given import GivenQuantities
from bellcrank.search.stroke_states import fractions_of
from bellcrank.search.symmetry import SymmetryGroups
from bellcrank.search.verdict import Verdict

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

    from bellcrank.mechanics import Channel, Outcome, Response
    from bellcrank.model import Item, Problem

    Values = NDArray[np.float64]

RESERVE = 0.05
"""Part of their size by which a search tightens all bounds, so that its designs meet them with more
elements and in the sheet too."""
VIOLATION_POWER = 3.0
"""Weight of violations against the objective while a specification is not met."""
CHEAP = frozenset({"motion", "displacement", "input_motion", "rotation"})
"""Channels that cost little at a known state; the others are measured last."""


class _Known(NamedTuple):
    """What is known of a design, or of many."""

    extremes: dict[int, tuple[Values, Values]]
    """Smallest and largest values of items, by their number."""
    objectives: dict[int, Values]
    """Objectives over their scale, by their number."""


class _Case(NamedTuple):
    """A load case and the items that belong to it."""

    evaluator: CaseEvaluator
    items: list[int]
    channels: list[Channel]
    cheap: list[Channel]
    fractions: NDArray[np.float64]


class SpecificationEvaluator:
    """Score of designs by the specification of their problem.

    Parameters
    ----------
    problem
        Problem with a specification.
    elements : int, optional
        As in `bellcrank.mechanics.FrameEvaluator`.
    reserve
        Part of their size by which all bounds are tightened, so that designs still meet them in a
        better model.
    gap
        Function to the clearance of designs that are not verified.

    Raises
    ------
    InvalidSettings
        If the problem has no specification, or its lattice is not symmetric as demanded.
    """

    def __init__(
        self,
        problem: Problem,
        elements: int | None = None,
        reserve: float = 0.0,
        gap: Callable[[CaseEvaluator, NDArray[np.bool_], float], float] = gap_less_overlaps,
    ) -> None:
        wanted = problem.specification
        if wanted is None:
            raise InvalidSettings(f"problem {problem.name!r} has no specification")
        try:
            self.groups = SymmetryGroups(problem, wanted.symmetry)
        except ValueError as error:
            raise InvalidSettings(f"limits.symmetry: {error}") from None
        self.problem = self.groups.problem
        self.items = tuple(tightened(item, reserve) for item in wanted.items)
        self.objectives = wanted.maximise
        self.elements = elements
        section = problem.section
        assert section is not None
        self._volume = section.area_of(problem.beam_widths) * problem.lattice.rest_length
        self.cases: dict[str, _Case] = {}
        for name, case in problem.cases.items():
            forces = forces_of(item for item in self.items if item.case == name)
            evaluator = CaseEvaluator(case, elements, wanted.weight, forces)
            chosen = [k for k, item in enumerate(self.items) if item.case == name]
            needed = [(self.items[k].quantity, self.items[k].output) for k in chosen]
            needed += [
                (objective.quantity, objective.output)
                for objective in self.objectives
                if objective.case == name
            ]
            channels = list(dict.fromkeys(c for pair in needed for c in channels_of(*pair)))
            used = [self.items[k] for k in chosen]
            cheap = [channel for channel in channels if channel.name in CHEAP]
            fractions = fractions_of(used, case.kinks, verified=False)
            self.cases[name] = _Case(evaluator, chosen, channels, cheap, fractions)
        self.records: dict[str, StrokeRecord] = {}
        self.violations = np.ones(len(self.items))
        self._bounds = Bounds.of_all(self.items)
        # Items whose margins count where there is no objective.
        self._in_margin = [
            bool(each.case and channels_of(each.quantity, each.output)) for each in self.items
        ]
        evaluators = {name: case.evaluator for name, case in self.cases.items()}
        self._given = GivenQuantities(self.problem, self.items, evaluators, elements, gap)

    def evaluate(
        self,
        mask: NDArray[np.bool_],
        largest_increment: float = 1.0,
        *,
        warm_start: bool = False,
        lower_bound: float = -math.inf,
    ) -> Response:
        """Return the response of a design; its status is UNMET if it violates items.

        The efficiency is that of the first load case and its first output.

        Parameters
        ----------
        mask : (M,) bool
        largest_increment
            Upper bound on the load increments, as a fraction of the full load. Up to
            `VERIFICATION_INCREMENT` the design is verified: contact and stability are checked
            along the whole stroke.
        warm_start
            Start from the reference (`set_reference`).
        lower_bound
            With a warm start, a design of no higher score has the status UNVERIFIED.
        """
        design = self.groups.expand(mask)
        verified = largest_increment <= VERIFICATION_INCREMENT
        structural = {"mass": float(self._volume @ design)}
        bounded = warm_start and lower_bound > -math.inf
        if bounded and (early := self._bound(design, structural, lower_bound)) is not None:
            return early
        responses = []
        for case in self.cases.values():
            response = case.evaluator.respond(
                design, largest_increment, warm_start=warm_start,
                lower_bound=-1e300 if warm_start else -math.inf,
            )  # fmt: skip
            responses.append(response)
            if response.status is not Status.CONVERGED:
                self.violations = np.ones(len(self.items))
                return replace(response, penalty=math.inf)
        response = responses[0]
        known = _Known({}, {})
        score = -math.inf
        for records in self._stages(design, structural, verified=verified):
            self._update(records, known)
            score = float(self._scores(known))
            if bounded and score <= lower_bound:
                status: Outcome = Status.UNVERIFIED
                return replace(response, status=status, penalty=response.efficiency - score)
        self.records = records
        self.violations = self._violations(known)
        met = bool((self.violations <= TOLERANCE).all())
        status = Status.CONVERGED if met else Verdict.UNMET
        return replace(response, status=status, penalty=response.efficiency - score)

    def _stages(
        self, design: NDArray[np.bool_], structural: dict[str, float], *, verified: bool
    ) -> Iterator[dict[str, StrokeRecord]]:
        """Yield records with ever more quantities, the cheap ones first; the last is complete."""
        at_end = frozenset() if verified else frozenset({"strain"})
        records = {}
        for name, case in self.cases.items():
            fractions = case.fractions
            if verified:
                items = [self.items[k] for k in case.items]
                fractions = fractions_of(items, case.evaluator.problem.kinks, verified=True)
            channels = case.evaluator.values(case.cheap, fractions.tolist(), at_end)
            records[name] = StrokeRecord(
                fractions, channels, structural, case.evaluator.forces,
                case.evaluator.problem.kinks,
            )  # fmt: skip
        yield records
        for name, case in self.cases.items():
            now = records[name]
            others = [channel for channel in case.channels if channel not in now.channels]
            found = case.evaluator.values(others, now.fractions.tolist(), at_end)
            records[name] = replace(now, channels={**now.channels, **found})
        yield records
        for name in self.cases:
            given = self._given.of_case(name, design, verified=verified)
            records[name] = replace(records[name], given={**structural, **given})
        yield records
        if given := self._given.of_design(design, verified=verified):
            for name, record in records.items():
                records[name] = replace(record, given={**record.given, **given})
            yield records

    def _bound(
        self, design: NDArray[np.bool_], structural: dict[str, float], lower_bound: float
    ) -> Response | None:
        """Return a response if the state at full load alone shows that the score is too low."""
        records = {}
        first = None
        for name, case in self.cases.items():
            response = case.evaluator.respond(design, warm_start=True, lower_bound=math.inf)
            first = first or response
            if response.status is not Status.UNVERIFIED:
                if response.status is Status.CONVERGED:  # the reference itself
                    return None
                return replace(response, penalty=math.inf)
            channels = case.evaluator.values(case.cheap, [1.0])
            records[name] = StrokeRecord(np.ones(1), channels, structural)
        score = float(self._scores(self._known(records)))
        if score > lower_bound:
            return None
        assert first is not None
        return replace(first, status=Status.UNVERIFIED, penalty=first.efficiency - score)

    def _known(self, records: dict[str, StrokeRecord]) -> _Known:
        """Return what records of the load cases show."""
        known = _Known({}, {})
        self._update(records, known)
        return known

    def _update(self, records: dict[str, StrokeRecord], known: _Known) -> None:
        """Add what records of the load cases show, and fewer channels did not."""
        first = next(iter(records.values()))
        for index, item in enumerate(self.items):
            record = records[item.case] if item.case else first
            if index not in known.extremes and self._is_known(item, record):
                known.extremes[index] = reduced(item, record)
        for index, objective in enumerate(self.objectives):
            record = records[objective.case] if objective.case else first
            is_known = has_channels(objective.quantity, objective.output, record)
            if index not in known.objectives and is_known:
                known.objectives[index] = objective_value(record, objective)

    def _violations(self, known: _Known) -> Values:
        """Return (..., I) the violations of all items that are known, in their order."""
        return violation(*self._bounded(known, sorted(known.extremes)))

    def _bounded(self, known: _Known, chosen: list[int]) -> tuple[Bounds, Values, Values]:
        """Return bounds and smallest and largest values (..., I) of some items."""
        bounds = self._bounds
        if len(chosen) < len(self.items):
            bounds = Bounds(*(np.asarray(each)[chosen] for each in bounds))
        low, high = (np.array([known.extremes[k][end] for k in chosen]).T for end in (0, 1))
        return bounds, low, high

    @staticmethod
    def _is_known(item: Item, record: StrokeRecord) -> bool:
        """Whether a record shows the violation of an item, or a lower bound of it."""
        if not has_channels(item.quantity, item.output, record):
            return False
        if len(record.fractions) > 1 or item.quantity == "mass":
            return True
        # Only the state at full stroke is known.
        return item.quantity != "path_error" and item.stop == 1.0 and item.of == "every"

    def _objective(self, known: _Known) -> Values:
        """Return (...) the smallest objective; without objectives, the smallest margin.

        An upper bound where not all channels are known.
        """
        if not self.objectives:
            return self._smallest_margin(known)
        values = list(known.objectives.values())
        return np.asarray(np.minimum.reduce(values)) if values else np.asarray(np.inf)

    def _smallest_margin(self, known: _Known) -> Values:
        """Return (...) the smallest margin of an item that follows from channels, at least 0."""
        chosen = [index for index in sorted(known.extremes) if self._in_margin[index]]
        if not chosen:
            return np.zeros(())
        margins = -relative_distance(*self._bounded(known, chosen))
        # Where items are not met, their violations count.
        return np.asarray(np.maximum(0.0, margins.min(axis=-1)))

    @staticmethod
    def score(total: Values, objective: Values) -> Values:
        """Return (...) the score for total violations and values of the objective.

        It is the objective where the specification is met. Elsewhere an objective above 0 is
        divided by the third power of the product of all 1 + e / s
        (`bellcrank.mechanics.violation`), so that neither the objective nor the violations alone
        are improved.
        """
        reduced_objective = np.where(
            objective > 0.0,
            objective * np.exp(-VIOLATION_POWER * total),
            objective - VIOLATION_POWER * total,
        )
        unmet = reduced_objective - BASE_PENALTY
        return np.asarray(np.where(total > TOLERANCE, unmet, objective))

    def _scores(self, known: _Known) -> Values:
        """Return (...) the scores; upper bounds where not all channels are known."""
        total = self._violations(known).sum(axis=-1)
        return self.score(total, self._objective(known))

    def set_reference(self) -> None:
        """Make the design evaluated last the reference of warm starts."""
        for case in self.cases.values():
            case.evaluator.set_reference()

    def predict_flips(self, mask: NDArray[np.bool_]) -> FlipPrediction | None:
        """Predict the change of the score by each flip of the design evaluated last.

        The changes by mirror images, which are flipped together, are added.
        """
        design = self.groups.expand(mask)
        members, count = self.groups.members, len(self.groups.beams)
        strain, changed = np.zeros(len(members)), np.zeros(len(members), dtype=bool)
        records = {}
        volume = float(self._volume @ design)
        sign = np.where(design[members], -1.0, 1.0)
        for name, case in self.cases.items():
            now = self.records[name]
            found = case.evaluator.predict_flips(now.channels, members)
            if found is None:
                return None
            after, differs, largest = found
            changed |= differs
            np.maximum(strain, largest, out=strain)
            channels = {
                channel: value + self.groups.total(after[channel] - value)
                for channel, value in now.channels.items()
            }
            mass = volume + self.groups.total(sign * self._volume[members])
            given = {key: np.full(count, value) for key, value in now.given.items()}
            records[name] = replace(now, channels=channels, given={**given, "mass": mass})
        before = self._scores(self._known(self.records))
        with np.errstate(invalid="ignore"):
            score = self._scores(self._known(records))
        change = np.where(self.groups.largest(changed.astype(float)) > 0.0, score - before, 0.0)
        return FlipPrediction(
            self.groups.beams, np.nan_to_num(change, nan=-1e3, neginf=-1e3, posinf=1e3),
            self.groups.largest(strain),
        )  # fmt: skip

    def objective_values(self) -> list[float]:
        """Return the values of the objectives of the design evaluated last."""
        found = []
        for objective in self.objectives:
            record = self.records[objective.case or next(iter(self.records))]
            found.append(float(objective_value(record, objective)) * objective.scale)
        return found

    def results(self) -> list[ItemResult]:
        """Return the items with the values of the design evaluated last."""
        return item_results(self.items, self.records)

    def objective_results(self) -> list[ItemResult]:
        """Return the objectives with the values of the design evaluated last."""
        return item_results([each.item for each in self.objectives], self.records)
