"""Evaluation of the objectives and constraints of a refinement, and of their gradients."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from bellcrank.errors import InvalidProblem
from bellcrank.mechanics import Channel, Status, StrokeRecord, channels_of, objective_value
from bellcrank.mechanics.frames.geometry import BeamSlopes, beam_slopes, geometry_slopes
from bellcrank.mechanics.frames.joints import joint_slopes
from bellcrank.mechanics.frames.quantities.definition import Measures, Quantity, Slopes, vector
from bellcrank.mechanics.frames.quantities.forces import LOWEST_STIFFNESS
from bellcrank.mechanics.stroke import STATES
from bellcrank.refine.channels import bounded, jacobian, stacked
from bellcrank.refine.differences import NO_DIFFERENCE
from bellcrank.refine.gaps import gaps_of
from bellcrank.refine.rows import Rows, joined
from bellcrank.refine.shape import shape_rows
from bellcrank.refine.stability import references, softest_states
from bellcrank.search.clearance import printed_beams
from bellcrank.search.specification import SpecificationEvaluator
from bellcrank.search.stroke_states import fractions_of

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from bellcrank.mechanics.frames.equilibria import Equilibrium
    from bellcrank.model import Item, Problem
    from bellcrank.refine.differences import Difference
    from bellcrank.refine.gaps import Gaps
    from bellcrank.refine.variables import Variables
    from bellcrank.tolerance import Scenario

    Values = NDArray[np.float64]
    Gradients = dict[tuple[Channel, int], Values]
    States = dict[float, tuple[Equilibrium, Measures]]

LARGEST_INCREMENT = 1.0 / 16.0
"""Largest increment of the load: larger ones may end on another branch near a bifurcation."""
STABLE = 0.5
"""Smallest lowest stiffness along the stroke, as a part of its reference (`references`): near a
bifurcation it falls and rises again, and a small change of the geometry leads to another path."""
SOFT = 1.2
"""Lowest stiffness, over its bound, below which a state is a constraint."""
FRACTIONS = 128
"""Parts of the stroke to whose ends the fraction at which a path loses stability is rounded."""
GAP_REACH = 0.5
"""Gaps that are constraints, in widths of the section beyond the wanted one."""


@dataclass(slots=True, eq=False)
class _Geometry:
    """Responses of one geometry, and what was computed from them by load case."""

    vector: Values
    drawn: Problem
    problem: Problem
    evaluator: SpecificationEvaluator
    channels: dict[str, dict[Channel, Values]] = field(default_factory=dict)
    softest: dict[tuple[str, int], States] = field(default_factory=dict)
    gaps: dict[tuple[str, int], Gaps] = field(default_factory=dict)
    beams: BeamSlopes | None = None


class RowEvaluator:
    """Objectives and constraints of the geometries of one design.

    Parameters
    ----------
    variables
        Variables of the design.
    mask : (M,) bool
        Its beams.
    items
        What a geometry must meet. Items on the stability of the path are not constraints: every
        path must be stable.
    stable
        Smallest lowest stiffness along a path, over its reference (`references`).
    models
        Models in which the items must be met, as differences from one element in each strut. The
        last one counts for the objectives.
    scenario
        Deviation with which the responses are computed; None for none. The shape at rest is no
        constraint then.
    kinds
        Constraints besides those of `items`: all, those on the stability of the path, or none.
    """

    def __init__(
        self,
        variables: Variables,
        mask: NDArray[np.bool_],
        items: Sequence[Item],
        stable: float = STABLE,
        models: Sequence[Difference] = (NO_DIFFERENCE,),
        scenario: Scenario | None = None,
        *,
        kinds: Literal["all", "stability", "objectives"] = "all",
    ) -> None:
        self.variables = variables
        self.mask = mask
        self.scenario = scenario
        self.kinds = kinds
        self.has_objectives = True
        self.models = tuple(models)
        self.items = tuple(items)
        self.stable = stable
        self.soft: dict[tuple[str, int], set[float]] = {}
        self._last: _Geometry | None = None
        bounds = [item.at_most for item in self.items if item.quantity == "mass"]
        self.volume = min((bound for bound in bounds if bound is not None), default=np.inf)

    @property
    def soft_states(self) -> int:
        """Number of states that were soft or unstable in any geometry, and are constraints."""
        return sum(map(len, self.soft.values()))

    def maximise_margins(self) -> None:
        """Make the smallest margin the objective, as without objectives."""
        self.has_objectives, self._last = False, None

    def evaluate(self, vector: Values, *, slopes: bool = False) -> Rows | None:
        """Return the rows of a geometry; None if a response is not stable, or a strut too short.

        Responses of the geometry that was evaluated last are not computed again.

        Parameters
        ----------
        vector : (n,)
            Variables.
        slopes
            Compute the derivatives too.
        """
        if self._last is None or not np.array_equal(vector, self._last.vector):
            self._last = self._responses(vector)
        here = self._last
        if here is None:
            return None
        parts = []
        for name in here.evaluator.cases:
            functions = [self._channel_rows]
            if self.kinds == "all":
                functions.append(self._gap_rows)
            if self.kinds != "objectives":
                functions.append(self._stability_rows)
            for rows_of in functions:
                rows = rows_of(here, name, slopes=slopes)
                if rows is None:
                    return None
                parts.append(rows)
        if self.scenario is None and self.kinds == "all":
            parts.append(self._shape_rows(here.problem, slopes=slopes))
        return joined(parts)

    def _responses(self, vector: Values) -> _Geometry | None:
        """Compute the responses of a geometry; None if one is not stable, or a strut too short."""
        try:
            drawn = problem = self.variables.problem_at(vector)
            if self.scenario is not None:
                problem = self.scenario.of(drawn)
        except InvalidProblem:
            return None
        wanted = problem.specification
        assert wanted is not None
        # Payloads are those of the items of this refinement. Deviations are not symmetric.
        asked = replace(
            problem,
            specification=replace(
                wanted,
                items=self.items,
                symmetry=() if self.scenario else wanted.symmetry,
                maximise=wanted.maximise if self.has_objectives else (),
            ),
        )
        evaluator = SpecificationEvaluator(asked)
        for name, case in evaluator.cases.items():
            response = case.evaluator.respond(self.mask, LARGEST_INCREMENT)
            if response.status is not Status.CONVERGED:
                if response.status is Status.SNAPPED:
                    lost = math.ceil(response.reached * FRACTIONS) / FRACTIONS
                    self.soft.setdefault((name, 0), set()).add(min(lost, 1.0))
                return None
        return _Geometry(vector.copy(), drawn, problem, evaluator)

    def _beam_slopes(self, here: _Geometry) -> BeamSlopes:
        """Return the derivatives of the properties of beams, which are those of all load cases."""
        if here.beams is None:
            case = next(iter(here.evaluator.cases.values()))
            joints = None
            if here.drawn.joints is not None:
                # Those of the whole drawn part, without deviations and with lost struts.
                joints = joint_slopes(here.drawn, self.variables.mask)
                if self.scenario is not None:
                    joints = self.scenario.joint_slopes(joints)
            here.beams = beam_slopes(case.evaluator.frame, self.mask, joints)
        return here.beams

    def _gradient(self, positions: Values, widths: Values) -> Values:
        """Return (k, n) derivatives by the variables from those by positions and widths."""
        if self.scenario is not None and self.scenario.widths is not None:
            widths = widths * self.scenario.widths
        return self.variables.gradient(positions, widths)

    def _channel_rows(self, here: _Geometry, name: str, *, slopes: bool) -> Rows | None:
        """Return the rows of a load case that follow from its channels."""
        evaluator, case = here.evaluator, here.evaluator.cases[name]
        own = [item for item in self.items if item.case == name]
        items = [item for item in own if channels_of(item.quantity, item.output)]
        kinks = case.evaluator.problem.kinks
        fractions = fractions_of(own, kinks, verified=True)
        if name not in here.channels:
            here.channels[name] = case.evaluator.values(case.channels, fractions.tolist())
        channels = here.channels[name]
        record = StrokeRecord(fractions, channels, forces=case.evaluator.forces, kinks=kinks)
        wanted = [each for each in evaluator.objectives if each.case == name]

        def rows_at(channels: Mapping[Channel, Values]) -> tuple[Values, Values]:
            found: list[Values] = []
            by_model = []
            for model in self.models:
                now = replace(record, channels=model.added_to(name, channels))
                by_model += [bounded(item, now) for item in items]
                found = [objective_value(now, each)[..., None] for each in wanted]
            bounds = stacked(by_model)
            # Without objectives, the smallest margin is improved.
            return (stacked(found) if evaluator.objectives else -bounds), bounds

        objectives, constraints = rows_at(channels)
        if not (np.isfinite(objectives).all() and np.isfinite(constraints).all()):
            return None
        names = [item.name for item in items for _ in bounded(item, record)] * len(self.models)
        keys = tuple((k,) for k in range(len(names)))
        none = np.zeros((0, self.variables.count))
        if not slopes:
            return Rows(objectives, constraints, tuple(names), keys, none, none)
        gradients = self._channel_gradients(here, name)
        if gradients is None:
            return None
        slopes_by = jacobian(channels, rows_at, gradients)
        return Rows(objectives, constraints, tuple(names), keys, *slopes_by)

    def _channel_gradients(self, here: _Geometry, name: str) -> Gradients | None:
        """Return (c, n) the derivatives of each channel at each of its states."""
        out: Gradients = {}
        of_beams = self._beam_slopes(here)
        for point in here.evaluator.cases[name].evaluator.merged_points():
            found = geometry_slopes(point.equilibrium, point.measured, of_beams)
            if found is None:
                return None
            for each, (quantity, measures), slope in zip(
                point.channels, point.measured, found, strict=True
            ):
                by_measure = self._gradient(slope.positions, slope.widths)
                if quantity.combine is not vector:
                    by_measure = quantity.gradient(measures.value)[None] @ by_measure
                out[each] = by_measure
        return out

    def _gap_rows(self, here: _Geometry, name: str, *, slopes: bool) -> Rows | None:
        """Return the constraints on the gaps of a load case along the stroke."""
        case = here.evaluator.cases[name].evaluator
        problem = case.problem
        assert problem.section is not None
        bounds = [
            item.at_least or 0.0
            for item in self.items
            if item.quantity == "clearance" and item.case == name
        ]
        overlap = max(model.overlaps.get(name, 0.0) for model in self.models)
        bound, width = max(bounds, default=0.0) + overlap, problem.section.width
        printed = printed_beams(problem, self.mask, case.frame.structure.present != 0)
        values, gradients = [np.zeros(0)], [np.zeros((0, self.variables.count))]
        keys: list[tuple[int, ...]] = []
        of_beams = self._beam_slopes(here) if slopes else None
        for k in range(1, STATES + 1):
            state = case.state(k / STATES)
            if state is None:
                return None
            reach = bound + GAP_REACH * width
            if (name, k) not in here.gaps:
                beams = np.flatnonzero(printed)
                here.gaps[name, k] = gaps_of(problem, beams, state.state.u, reach)
            found = here.gaps[name, k]
            values.append((bound - found.value) / width)
            keys += [(k, *pair) for pair in found.keys.tolist()]
            if of_beams is None or not len(found.value):
                continue
            measured = [(_quantity_of(found.fields), Measures(found.value))]
            moved = geometry_slopes(state, measured, of_beams)
            if moved is None:
                return None
            positions = moved[0].positions + found.fields[..., : problem.lattice.dimension]
            by_vector = self._gradient(positions, moved[0].widths + found.widths)
            gradients.append(-by_vector / width)
        constraints = np.concatenate(values)
        names = ("clearance",) * len(constraints)
        return Rows(
            np.zeros(0), constraints, names, tuple(keys), gradients[0], np.concatenate(gradients)
        )

    def _stability_rows(self, here: _Geometry, name: str, *, slopes: bool) -> Rows | None:
        """Return the constraints on the lowest stiffness of a load case along the stroke."""
        case = here.evaluator.cases[name].evaluator
        paths = [case.frame, *case.loaded]
        none = np.zeros((0, self.variables.count))
        constraints, gradients, keys = [np.zeros(0)], [none], []
        for index, frame in enumerate(paths):
            soft = self.soft.setdefault((name, index), set())
            state = frame.equilibrium if index else case.state
            if (name, index) not in here.softest:
                states, lost = softest_states(state, soft)
                if lost is not None:
                    soft.add(lost)
                    return None
                here.softest[name, index] = states
            found = here.softest[name, index]
            values = {fraction: float(each.value[0]) for fraction, (_, each) in found.items()}
            known = references(values)
            # States that were soft in one geometry remain constraints in all others.
            soft |= {
                each
                for each, pairs in known.items()
                for peak, factor in pairs
                if values[each] < SOFT * self.stable * factor * values[peak]
            }
            # All references of a state are constraints: the largest one may be another one in the
            # next geometry.
            near = [
                (each, peak, factor)
                for each in sorted(soft)
                for peak, factor in known[each]
                if peak != each
            ]
            least = np.array([factor * values[peak] for _, peak, factor in near])
            ratios = np.array([values[each] for each, *_ in near]) / least
            constraints.append(1.0 - ratios / self.stable)
            keys += [(index, *(round(1e6 * each) for each in row)) for row in near]
            if not slopes or not near:
                continue
            rates, of_beams = {}, self._beam_slopes(here)
            for fraction in {state for each, peak, _ in near for state in (each, peak)}:
                equilibrium, measures = found[fraction]
                slope = geometry_slopes(equilibrium, [(LOWEST_STIFFNESS, measures)], of_beams)
                if slope is None:
                    return None
                rates[fraction] = self._gradient(*slope[0])[0]
            for (each, peak, factor), ratio, size in zip(
                near, ratios.tolist(), least.tolist(), strict=True
            ):
                rate = rates[each] - ratio * factor * rates[peak]
                gradients.append(-rate[None] / (size * self.stable))
        rows = np.concatenate(constraints)
        names = ("stability",) * len(rows)
        return Rows(np.zeros(0), rows, names, tuple(keys), none, np.concatenate(gradients))

    def _shape_rows(self, problem: Problem, *, slopes: bool) -> Rows:
        """Return the constraints on the geometry at rest."""
        found = shape_rows(problem, self.mask, self.volume)
        none = np.zeros((0, self.variables.count))
        by_vector = self.variables.gradient(found.positions, found.widths) if slopes else none
        return Rows(np.zeros(0), found.values, found.names, found.keys, none, by_vector)


def _quantity_of(fields: Values) -> Quantity:
    """Return a quantity with given derivatives (k, N, b) by the unknowns."""

    def measure(_equilibrium: Equilibrium) -> Measures:
        return Measures(np.zeros(len(fields)))

    def slopes(_equilibrium: Equilibrium, _measures: Measures) -> Slopes:
        return Slopes(fields)

    return Quantity(measure, slopes, combine=vector)
