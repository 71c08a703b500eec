"""Responses of designs in one load case: several quantities of several outputs along the stroke.

A *channel* is a quantity of one output at the states of the stroke. What a specification bounds
is a function of channels (`bellcrank.mechanics.items`). The change of channels by flips follows
from one Newton step at each state.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from bellcrank.mechanics.frames.evaluator import FrameEvaluator
from bellcrank.mechanics.frames.output_loads import (
    with_dead_load,
    with_held_output,
    with_output,
    with_payload,
)
from bellcrank.mechanics.frames.quantities import quantities
from bellcrank.mechanics.frames.quantities.definition import Quantity, linear, vector
from bellcrank.mechanics.frames.quantities.forces import mean_weights
from bellcrank.mechanics.frames.quantities.motion import input_weights, output_weights
from bellcrank.mechanics.status import Status

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from numpy.typing import ArrayLike, NDArray

    from bellcrank.mechanics.evaluator import Response
    from bellcrank.mechanics.frames.equilibria import Equilibrium
    from bellcrank.mechanics.frames.quantities import Measures
    from bellcrank.mechanics.frames.quantities.definition import Load
    from bellcrank.model import Problem


class Channel(NamedTuple):
    """A quantity of an output; the output is empty where it belongs to the case."""

    name: str
    output: str = ""


CHANNELS: dict[str, Quantity] = {
    "motion": Quantity(*linear(output_weights), combine=vector),
    "displacement": Quantity(*linear(mean_weights), combine=vector),
    "input_motion": Quantity(*linear(input_weights)),
    "rotation": quantities["rotation"],
    "input_force": quantities["input_force"],
    "strain": quantities["strain"],
    "stiffness": quantities["output_stiffness"],
    "blocked_force": quantities["blocked_force"],
    "loaded_motion": Quantity(*linear(output_weights), combine=vector, load="payload"),
    "carried_motion": Quantity(*linear(output_weights), combine=vector, load="dead load"),
    "sag": quantities["sag"],
}
"""Channels by name. Motion: along the wanted direction, then the components normal to it."""

LOADED = ("loaded_motion", "carried_motion")
"""Channels under a force on the output."""
END_ONLY = frozenset({"stiffness", "blocked_force", *LOADED, "sag"})
"""Channels with a single value: at full stroke, or at rest."""


def bound_to(quantity: Quantity, problem: Problem) -> Quantity:
    """Return a quantity that is measured with the output of another problem."""
    return replace(
        quantity,
        measure=lambda equilibrium: quantity.measure(replace(equilibrium, problem=problem)),
        slopes=lambda equilibrium, found: quantity.slopes(
            replace(equilibrium, problem=problem), found
        ),
    )


class _Point(NamedTuple):
    """An equilibrium with measured channels."""

    evaluator: FrameEvaluator
    equilibrium: Equilibrium
    channels: list[tuple[Channel, int]]
    """Channels, and the rows of their values."""
    measured: list[tuple[Quantity, Measures]]


class CaseEvaluator:
    """Responses of designs in one load case, and channels along the stroke.

    Parameters
    ----------
    problem
        Problem of the case (`Problem.cases`), with a section.
    elements : int, optional
        As in `FrameEvaluator`.
    weight : (d,), optional
        Own weight that causes the sag: force on a unit of volume.
    forces : dict of Channel to float, optional
        Forces on outputs under which their loaded and carried motions are measured.

    Examples
    --------
    >>> from bellcrank.model import human_design
    >>> from bellcrank.part import PartSpec, frame_problem
    >>> design = human_design("crane")
    >>> case = CaseEvaluator(frame_problem(design.problem, PartSpec()))
    >>> case.respond(design.mask).status.label
    'converged'
    >>> case.values([Channel("motion", "output")], [0.5, 1.0])["motion", "output"].round(3)
    array([[ 0.3  ,  0.   , -0.049],
           [ 0.506,  0.   , -0.091]])
    """

    def __init__(
        self,
        problem: Problem,
        elements: int | None = None,
        weight: ArrayLike | None = None,
        forces: Mapping[Channel, float] | None = None,
    ) -> None:
        self.problem = problem
        self.frame = FrameEvaluator(problem, "displacement", elements)
        self._weight = weight
        self.forces = dict(forces or {})
        self._by_output = {name: with_output(problem, name) for name in problem.outputs}
        self._others: dict[tuple[Load, str], FrameEvaluator] = {}
        self._quantities: dict[Channel, Quantity] = {}
        self._points: list[_Point] = []
        self._states: dict[float, Equilibrium | None] = {}
        self._mask: NDArray[np.bool_] = problem.initial
        self._warm, self._increment = False, 1.0
        self._converged: list[FrameEvaluator] = []

    def respond(
        self,
        mask: NDArray[np.bool_],
        largest_increment: float = 1.0,
        *,
        warm_start: bool = False,
        lower_bound: float = -math.inf,
    ) -> Response:
        """Compute the response to the input; as `FrameEvaluator.evaluate`."""
        self._points, self._states = [], {}
        self._mask, self._warm, self._increment = mask, warm_start, largest_increment
        self._converged = []
        response = self.frame.evaluate(
            mask, largest_increment, warm_start=warm_start, lower_bound=lower_bound
        )
        if response.status is Status.CONVERGED:
            self._converged.append(self.frame)
        return response

    def set_reference(self) -> None:
        """Make the responses computed last, as far as they have converged, the reference."""
        for evaluator in self._converged:
            evaluator.set_reference()

    def values(
        self,
        channels: Iterable[Channel],
        fractions: Sequence[float],
        at_end: frozenset[str] = frozenset(),
    ) -> dict[Channel, NDArray[np.float64]]:
        """Return channels of the design evaluated last.

        Parameters
        ----------
        channels
            Channels to measure.
        fractions
            Fractions of the stroke, above 0 and at most 1. At 1, the last state of the response
            counts, even if it is not verified that the path from rest leads to it.
        at_end
            Names of further channels to measure at full stroke alone.

        Returns
        -------
        dict of (F,) or (F, c) float64
            Of a channel that is measured at full stroke or at rest alone (`END_ONLY`), (1,) or
            (1, c); nan where the path does not lead.
        """
        single = END_ONLY | at_end
        by_load: dict[tuple[Load, str], list[Channel]] = {}
        for channel in channels:
            load = CHANNELS[channel.name].load
            shared = load in {"input", "weight"}
            key: tuple[Load, str] = (load, "" if shared else channel.output)
            by_load.setdefault(key, []).append(channel)
        found: dict[Channel, NDArray[np.float64]] = {}
        for (load, output), wanted in by_load.items():
            if load == "input":
                along = [each for each in wanted if each.name not in single]
                found |= self._measured(
                    self.frame, [self.state(each) for each in fractions], along, len(fractions)
                )
                ends = [each for each in wanted if each.name in single]
                found |= self._measured(self.frame, [self.state(1.0)], ends, 1)
            else:
                evaluator = self.other(load, output)
                state = self._state_of(load, evaluator)
                found |= self._measured(evaluator, [state], wanted, 1)
        return found

    def state(self, fraction: float) -> Equilibrium | None:
        """Return the equilibrium at a fraction of the stroke; None where the path does not lead.

        At 1, the last state of the response, even if it is not verified that the path from rest
        leads to it.
        """
        if fraction not in self._states:
            found = self.frame.end if fraction == 1.0 else self.frame.equilibrium(fraction)
            self._states[fraction] = found
        return self._states[fraction]

    @property
    def loaded(self) -> list[FrameEvaluator]:
        """Evaluators of outputs under their forces."""
        return [self.other(CHANNELS[name].load, output) for name, output in self.forces]

    def other(self, load: Load, output: str) -> FrameEvaluator:
        """Return the evaluator of another load than the input."""
        if (load, output) not in self._others:
            elements = self.frame.elements
            if load == "weight":
                made = FrameEvaluator(self.problem, "displacement", elements, weight=self._weight)
            elif load == "payload":
                force = self.forces[Channel("loaded_motion", output)]
                loaded = with_payload(self._by_output[output], force)
                made = FrameEvaluator(loaded, "displacement", elements)
            elif load == "dead load":
                force = self.forces[Channel("carried_motion", output)]
                carried = with_dead_load(self._by_output[output], force)
                made = FrameEvaluator(carried, "displacement", elements)
            else:
                held = with_held_output(self._by_output[output])
                made = FrameEvaluator(held, "displacement", elements)
            self._others[load, output] = made
        return self._others[load, output]

    def _state_of(self, load: Load, evaluator: FrameEvaluator) -> Equilibrium | None:
        """Return the state of another load in which its channels are measured."""
        if load == "weight":
            return evaluator.at_rest(self._mask)
        response = evaluator.evaluate(self._mask, self._increment, warm_start=self._warm)
        if response.status is not Status.CONVERGED:
            return None
        self._converged.append(evaluator)
        return evaluator.end

    def _quantity(self, channel: Channel) -> Quantity:
        if channel not in self._quantities:
            quantity = CHANNELS[channel.name]
            shared = quantity.load in {"input", "weight"}
            if channel.output and shared and len(self._by_output) > 1:
                quantity = bound_to(quantity, self._by_output[channel.output])
            self._quantities[channel] = quantity
        return self._quantities[channel]

    def _measured(
        self,
        evaluator: FrameEvaluator,
        states: Sequence[Equilibrium | None],
        channels: list[Channel],
        rows: int,
    ) -> dict[Channel, NDArray[np.float64]]:
        """Measure channels at states; keep what predictions of flips need."""
        found: dict[Channel, NDArray[np.float64]] = {}
        if not channels:
            return found
        chosen = [self._quantity(channel) for channel in channels]
        for row, equilibrium in enumerate(states):
            if equilibrium is None:
                continue
            measured = [(each, each.measure(equilibrium)) for each in chosen]
            rows_of = [(channel, row) for channel in channels]
            self._points.append(_Point(evaluator, equilibrium, rows_of, measured))
            for channel, (quantity, measures) in zip(channels, measured, strict=True):
                value = np.asarray(quantity.combine(measures.value))
                if channel not in found:
                    found[channel] = np.full((rows, *value.shape), np.nan)
                found[channel][row] = value
        for channel in channels:
            if channel not in found:
                found[channel] = np.full((rows, *self._shape(channel)), np.nan)
        return found

    def _shape(self, channel: Channel) -> tuple[int, ...]:
        """Return the shape of the values of a channel at one state."""
        dimension = self.problem.lattice.dimension
        if channel.name in {"motion", *LOADED}:
            return (1 + dimension,)
        return (dimension,) if channel.name == "displacement" else ()

    def predict_flips(
        self, values: Mapping[Channel, NDArray[np.float64]], beams: NDArray[np.int64]
    ) -> tuple[dict[Channel, NDArray[np.float64]], NDArray[np.bool_], NDArray[np.float64]] | None:
        """Predict channels of the design evaluated last after each flip, by one Newton step.

        Parameters
        ----------
        values
            Channels that were measured last.
        beams : (n,) int64
            Beams to flip, one at a time.

        Returns
        -------
        channels : dict of (n, F, ...) float64
        changed : (n,) bool
            Whether the flip changes any measure: False for beams that carry no load.
        strain : (n,)
            As in `bellcrank.mechanics.FlipPrediction`, the largest along the stroke.
        None
            If an equilibrium is unstable.
        """
        after = {
            channel: np.repeat(value[None], len(beams), axis=0) for channel, value in values.items()
        }
        changed, strain = np.zeros(len(beams), dtype=bool), np.zeros(len(beams))
        for point in self.merged_points():
            found = point.evaluator.flip_changes(
                point.equilibrium, point.measured, beams, first_order=False
            )
            if found is None:
                return None
            np.maximum(strain, np.abs(found.strain), out=strain)
            for (channel, row), (quantity, before), change in zip(
                point.channels, point.measured, found.measures, strict=True
            ):
                changed |= change.any(axis=1)
                moved = before.value + change
                if quantity.after_flips is not None:
                    moved = quantity.after_flips(
                        point.equilibrium, before, beams, found.forces, moved
                    )
                after[channel][:, row] = quantity.combine(moved)
        return after, changed, strain

    def merged_points(self) -> list[_Point]:
        """Return the measured equilibria, each once with all its channels."""
        merged: dict[int, _Point] = {}
        for point in self._points:
            known = merged.get(id(point.equilibrium))
            if known is not None:
                known.channels.extend(point.channels)
                known.measured.extend(point.measured)
            else:
                own = point._replace(channels=[*point.channels], measured=[*point.measured])
                merged[id(point.equilibrium)] = own
        return list(merged.values())
