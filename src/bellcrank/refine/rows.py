"""Objectives and constraints of a refinement, and their gradients.

A constraint is a number that is at most 0 where it is met, normalised like the violations of a
search. Bounds that hold along the stroke are one constraint at each state.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidProblem
from bellcrank.mechanics import Channel, Status, StrokeRecord, channels_of, quantity_values
from bellcrank.mechanics.frames.geometry import BeamSlopes, beam_slopes, geometry_slopes
from bellcrank.mechanics.frames.quantities.definition import Measures, Quantity, Slopes, vector
from bellcrank.mechanics.frames.quantities.forces import LOWEST_STIFFNESS
from bellcrank.mechanics.items import reduced, scale_of
from bellcrank.refine.gaps import gaps_of
from bellcrank.refine.shape import shape_rows
from bellcrank.refine.stability import softest_states
from bellcrank.search.clearance import printed_beams
from bellcrank.search.specification import SpecificationEvaluator
from bellcrank.search.stroke_states import fractions_of

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from numpy.typing import NDArray

    from bellcrank.mechanics.frames.equilibria import Equilibrium
    from bellcrank.model import Item, Problem
    from bellcrank.refine.variables import Variables

    Values = NDArray[np.float64]
    RowsAt = Callable[[Mapping[Channel, Values]], tuple[Values, Values]]
    Gradients = dict[tuple[Channel, int], Values]

LARGEST_INCREMENT = 1.0 / 16.0
"""Largest increment of the load: larger ones may end on another branch near a bifurcation."""
STEP = 1e-6
"""Step in central differences by channels, as a part of their size."""
GAP_STATES = 8
"""States along the stroke at which gaps are computed."""
STABLE = 0.5
"""Smallest lowest stiffness along the stroke, as a part of the smaller one near its ends. Paths on
which it is below 0.2 count as unstable."""
SOFT = 1.2
"""Lowest stiffness, over its bound, below which a state is a constraint."""
GAP_REACH = 0.5
"""Gaps that are constraints, in widths of the section beyond the wanted one."""


@dataclass(frozen=True, slots=True, eq=False)
class Rows:
    """Objectives and constraints of one geometry.

    Parameters
    ----------
    objectives : (k,)
        To be maximised; the smallest counts.
    constraints : (r,)
        At most 0 where they are met.
    names : (r,)
        What each constraint belongs to.
    keys : (r,)
        What distinguishes constraints of one name, of which there may be others in other
        geometries.
    objective_slopes, constraint_slopes : (k, n) and (r, n)
        Derivatives by the variables; (0, n) if they were not asked for.
    """

    objectives: Values
    constraints: Values
    names: tuple[str, ...]
    keys: tuple[tuple[int, ...], ...]
    objective_slopes: Values
    constraint_slopes: Values

    @property
    def objective(self) -> float:
        """The smallest objective; 0 if there is none."""
        return float(self.objectives.min()) if len(self.objectives) else 0.0

    @property
    def violation(self) -> float:
        """Sum of the violations."""
        return float(np.maximum(self.constraints, 0.0).sum())


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
        Smallest lowest stiffness along a path over the smaller one near its ends.
    """

    def __init__(
        self,
        variables: Variables,
        mask: NDArray[np.bool_],
        items: Sequence[Item],
        stable: float = STABLE,
    ) -> None:
        self.variables = variables
        self.mask = mask
        self.items = tuple(items)
        self.stable = stable
        self.soft: dict[tuple[str, int], set[float]] = {}
        bounds = [item.at_most for item in self.items if item.quantity == "mass"]
        self.volume = min((bound for bound in bounds if bound is not None), default=np.inf)

    def evaluate(self, vector: Values, *, slopes: bool = False) -> Rows | None:
        """Return the rows of a geometry; None if a response is not stable, or a strut too short.

        Parameters
        ----------
        vector : (n,)
            Variables.
        slopes
            Compute the derivatives too.
        """
        try:
            problem = self.variables.problem_at(vector)
        except InvalidProblem:
            return None
        evaluator = SpecificationEvaluator(problem)
        for case in evaluator.cases.values():
            response = case.evaluator.respond(self.mask, LARGEST_INCREMENT)
            if response.status is not Status.CONVERGED:
                return None
        parts = []
        for name in evaluator.cases:
            found = self._channel_rows(evaluator, name, slopes=slopes)
            gaps = self._gap_rows(evaluator, name, slopes=slopes)
            stable = self._stability_rows(evaluator, name, slopes=slopes)
            if found is None or gaps is None or stable is None:
                return None
            parts += [found, gaps, stable]
        return self._joined([*parts, self._shape_rows(problem, slopes=slopes)])

    def _joined(self, parts: list[Rows]) -> Rows:
        return Rows(
            np.concatenate([part.objectives for part in parts]),
            np.concatenate([part.constraints for part in parts]),
            tuple(name for part in parts for name in part.names),
            tuple((k, *key) for k, part in enumerate(parts) for key in part.keys),
            np.concatenate([part.objective_slopes for part in parts]),
            np.concatenate([part.constraint_slopes for part in parts]),
        )

    def _channel_rows(
        self, evaluator: SpecificationEvaluator, name: str, *, slopes: bool
    ) -> Rows | None:
        """Return the rows of a load case that follow from its channels."""
        case = evaluator.cases[name]
        own = [item for item in self.items if item.case == name]
        items = [item for item in own if channels_of(item.quantity, item.output)]
        kinks = case.evaluator.problem.input.kinks
        fractions = fractions_of(own, kinks, verified=True)
        channels = case.evaluator.values(case.channels, fractions.tolist())
        record = StrokeRecord(fractions, channels, payloads=case.evaluator.payloads, kinks=kinks)
        wanted = [each for each in evaluator.objectives if each.case == name]

        def rows_at(channels: Mapping[Channel, Values]) -> tuple[Values, Values]:
            now = replace(record, channels=channels)
            found = [
                quantity_values(now, each.quantity, each.output)[..., -1:] / each.scale
                for each in wanted
            ]
            bounds = _stacked([_bounded(item, now) for item in items])
            # Without objectives, the smallest margin is improved.
            return (_stacked(found) if evaluator.objectives else -bounds), bounds

        objectives, constraints = rows_at(channels)
        if not (np.isfinite(objectives).all() and np.isfinite(constraints).all()):
            return None
        names = [item.name for item in items for _ in _bounded(item, record)]
        keys = tuple((k,) for k in range(len(names)))
        none = np.zeros((0, self.variables.count))
        if not slopes:
            return Rows(objectives, constraints, tuple(names), keys, none, none)
        gradients = self._channel_gradients(evaluator, name)
        if gradients is None:
            return None
        slopes_by = _jacobian(channels, rows_at, gradients)
        return Rows(objectives, constraints, tuple(names), keys, *slopes_by)

    def _channel_gradients(self, evaluator: SpecificationEvaluator, name: str) -> Gradients | None:
        """Return (c, n) the derivatives of each channel at each of its states."""
        known: dict[int, BeamSlopes] = {}
        out: Gradients = {}
        for point in evaluator.cases[name].evaluator.merged_points():
            key = id(point.evaluator)
            if key not in known:
                known[key] = beam_slopes(point.evaluator)
            found = geometry_slopes(point.equilibrium, point.measured, known[key])
            if found is None:
                return None
            for each, (quantity, measures), slope in zip(
                point.channels, point.measured, found, strict=True
            ):
                by_measure = self.variables.gradient(slope.positions, slope.widths)
                if quantity.combine is not vector:
                    by_measure = quantity.gradient(measures.value)[None] @ by_measure
                out[each] = by_measure
        return out

    def _gap_rows(
        self, evaluator: SpecificationEvaluator, name: str, *, slopes: bool
    ) -> Rows | None:
        """Return the constraints on the gaps of a load case along the stroke."""
        case = evaluator.cases[name].evaluator
        problem = case.problem
        assert problem.section is not None
        bounds = [
            item.at_least or 0.0
            for item in self.items
            if item.quantity == "clearance" and item.case == name
        ]
        bound, width = max(bounds, default=0.0), problem.section.width
        printed = printed_beams(problem, self.mask, case.frame.structure.present != 0)
        values, gradients = [np.zeros(0)], [np.zeros((0, self.variables.count))]
        keys: list[tuple[int, ...]] = []
        of_beams = beam_slopes(case.frame) if slopes else None
        for k in range(1, GAP_STATES + 1):
            state = case.state(k / GAP_STATES)
            if state is None:
                return None
            reach = bound + GAP_REACH * width
            found = gaps_of(problem, np.flatnonzero(printed), state.state.u, reach)
            values.append((bound - found.value) / width)
            keys += [(k, *pair) for pair in found.pairs.tolist()]
            if of_beams is None or not len(found.value):
                continue
            measured = [(_quantity_of(found.fields), Measures(found.value))]
            moved = geometry_slopes(state, measured, of_beams)
            if moved is None:
                return None
            positions = moved[0].positions + found.fields[..., :2]
            by_vector = self.variables.gradient(positions, moved[0].widths + found.widths)
            gradients.append(-by_vector / width)
        constraints = np.concatenate(values)
        names = ("clearance",) * len(constraints)
        return Rows(
            np.zeros(0), constraints, names, tuple(keys), gradients[0], np.concatenate(gradients)
        )

    def _stability_rows(
        self, evaluator: SpecificationEvaluator, name: str, *, slopes: bool
    ) -> Rows | None:
        """Return the constraints on the lowest stiffness of a load case along the stroke."""
        case = evaluator.cases[name].evaluator
        paths = [case.frame, *(case.other("payload", output) for output in case.payloads)]
        none = np.zeros((0, self.variables.count))
        constraints, gradients, keys = [np.zeros(0)], [none], []
        for index, frame in enumerate(paths):
            soft = self.soft.setdefault((name, index), set())
            found = softest_states(frame, soft)
            if found is None:
                return None
            values = {fraction: float(each.value[0]) for fraction, (_, each) in found.items()}
            end = min((min(values), max(values)), key=values.__getitem__)
            ratio = {fraction: value / values[end] for fraction, value in values.items()}
            # States that were soft in one geometry remain constraints in all others.
            soft |= {each for each in ratio if ratio[each] < SOFT * self.stable and each != end}
            near = sorted(soft - {end})
            constraints.append(1.0 - np.array([ratio[each] for each in near]) / self.stable)
            keys += [(index, round(1e6 * each)) for each in near]
            if not slopes or not near:
                continue
            rates, of_beams = {}, beam_slopes(frame)
            for fraction in (*near, end):
                equilibrium, measures = found[fraction]
                slope = geometry_slopes(equilibrium, [(LOWEST_STIFFNESS, measures)], of_beams)
                if slope is None:
                    return None
                rates[fraction] = self.variables.gradient(*slope[0])[0]
            gradients += [
                -(rates[each] - ratio[each] * rates[end])[None] / (values[end] * self.stable)
                for each in near
            ]
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


def _bounded(item: Item, record: StrokeRecord) -> Values:
    """Return (..., q) the constraints of an item: its bounds, at each state where they hold."""
    if item.quantity == "payload" and item.at_least and item.at_most is None:
        # The payload is infinite where a load changes nothing; its inverse is smooth.
        payload = quantity_values(record, item.quantity, item.output)
        return item.at_least / payload - 1.0
    values = quantity_values(record, item.quantity, item.output, item.path)
    if item.quantity == "off_axis":
        motion = record.of("motion", item.output)
        normal = np.linalg.norm(motion[..., 1:], axis=-1)
        values = normal / np.abs(motion[..., -1:, 0])
    elif item.of != "every":
        values = np.stack([reduced(item, record)[0]], axis=-1)
    elif values.shape[-1] == len(record.fractions):
        chosen = (record.fractions >= item.start - 1e-9) & (record.fractions <= item.stop + 1e-9)
        values = values[..., chosen]
    scale = scale_of(item)
    sides = []
    if item.at_most is not None:
        sides.append((values - item.at_most) / scale)
    if item.at_least is not None:
        sides.append((item.at_least - values) / scale)
    return np.concatenate(sides, axis=-1)


def _stacked(rows: list[Values]) -> Values:
    """Return rows (..., q) side by side."""
    return np.concatenate(rows, axis=-1) if rows else np.zeros(0)


def _jacobian(
    channels: Mapping[Channel, Values], rows_at: RowsAt, gradients: Gradients
) -> tuple[Values, Values]:
    """Return the derivatives of objectives and constraints by the variables.

    By central differences of both by the channels, whose own derivatives are given.
    """
    total = sum(value.size for value in channels.values())
    steps = np.concatenate(
        [np.full(v.size, STEP * max(float(np.abs(v).max()), 1e-9)) for v in channels.values()]
    )
    moved, begin = {}, 0
    for channel, value in channels.items():
        many = np.repeat(value[None], 2 * total, axis=0).reshape(2 * total, -1)
        own = np.arange(begin, begin + value.size)
        many[own, own - begin] += steps[own]
        many[total + own, own - begin] -= steps[own]
        moved[channel] = many.reshape(2 * total, *value.shape)
        begin += value.size
    by_channel = [
        (found[:total] - found[total:]) / (2.0 * steps[:, None]) if found.size else None
        for found in rows_at(moved)
    ]
    of_channels = np.concatenate(
        [
            gradients[channel, row]
            for channel, value in channels.items()
            for row in range(len(value))
        ]
    )
    none = np.zeros((0, of_channels.shape[1]))
    objective, constraint = (none if each is None else each.T @ of_channels for each in by_channel)
    return objective, constraint
