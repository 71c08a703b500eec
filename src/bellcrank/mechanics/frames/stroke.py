"""Quantities of a frame along its stroke, their gradients, and their prediction for flips."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.mechanics.frames.evaluator import FrameEvaluator
from bellcrank.mechanics.frames.output_loads import with_held_output
from bellcrank.mechanics.frames.quantities import quantities
from bellcrank.mechanics.status import Status

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import ArrayLike, NDArray

    from bellcrank.mechanics.frames.equilibria import Equilibrium
    from bellcrank.mechanics.frames.flips import FlipChanges
    from bellcrank.mechanics.frames.quantities import Load, Measures, Quantity


@dataclass(frozen=True, slots=True, eq=False)
class _Point:
    """An equilibrium, and the measures of the quantities that belong to its load."""

    rows: slice
    """Fractions that it belongs to."""
    evaluator: FrameEvaluator
    equilibrium: Equilibrium
    columns: list[int]
    measured: list[tuple[Quantity, Measures]]


class Quantities:
    """Quantities of designs at fractions of the stroke.

    They are computed from the response of an evaluator, which stores the states at which the path
    was followed, the quarters of the load among them. The equilibria of other fractions are found
    from the two stored states next to them. Blocked forces need a second response, with a held
    output; the sag needs none.

    Parameters
    ----------
    evaluator
        Evaluator of the responses.
    names
        Names of k quantities (`bellcrank.mechanics.quantities`).
    fractions
        Fractions of the stroke, above 0 and at most 1; multiples of 1/4 cost least.
    weight : (d,), optional
        Own weight that causes the sag: force on a unit of volume; by default that of the
        evaluator.

    Raises
    ------
    InvalidSettings
        If a fraction is not above 0 and at most 1, or the sag is wanted without a weight.
    UnknownName
        If there is no such quantity.

    Examples
    --------
    >>> from bellcrank.model import human_design
    >>> from bellcrank.part import PartSpec, frame_problem
    >>> design = human_design("crane")
    >>> evaluator = FrameEvaluator(frame_problem(design.problem, PartSpec()))
    >>> along = Quantities(evaluator, ["gain", "rotation"], fractions=[0.5, 1.0])
    >>> along.evaluate(design.mask).round(2)
    array([[1.38, 2.81],
           [1.17, 4.77]])
    """

    def __init__(
        self,
        evaluator: FrameEvaluator,
        names: Sequence[str],
        fractions: Sequence[float] = (1.0,),
        weight: ArrayLike | None = None,
    ) -> None:
        self.evaluator = evaluator
        self.names = tuple(names)
        self.fractions = tuple(fractions)
        for fraction in self.fractions:
            if not 0.0 < fraction <= 1.0:
                raise InvalidSettings(
                    f"fractions: expected numbers above 0 and at most 1, got {fraction!r}"
                )
        self._quantities = [quantities[name] for name in self.names]
        loads = {quantity.load for quantity in self._quantities}
        problem = evaluator.problem
        self._evaluators: dict[Load, FrameEvaluator] = {"input": evaluator}
        if "held output" in loads:
            self._evaluators["held output"] = evaluator.for_problem(with_held_output(problem))
        if "weight" in loads:
            given = evaluator.weight if weight is None else weight
            if given is None:
                raise InvalidSettings("weight: the sag needs the force on a unit of volume")
            self._evaluators["weight"] = FrameEvaluator(
                problem, "displacement", evaluator.elements, evaluator.theory, given
            )
        self._points: list[_Point] = []
        self._converged: dict[Load, bool] = {}

    def evaluate(self, mask: ArrayLike, *, warm_start: bool = False) -> NDArray[np.float64]:
        """Return the quantities of a design.

        The evaluator computes its response unless it is the design evaluated last.

        Parameters
        ----------
        mask : (M,) bool
            Which beams are present.
        warm_start
            Start responses that are computed from those of the reference (`set_reference`).

        Returns
        -------
        (F, k)
            nan where the stable path of the design does not lead to the fraction.

        Raises
        ------
        InvalidProblem
            If the mask has the wrong length.
        """
        values = np.full((len(self.fractions), len(self.names)), np.nan)
        self._points = []
        for load, evaluator in self._evaluators.items():
            columns = [k for k, each in enumerate(self._quantities) if each.load == load]
            if not columns:
                continue
            for rows, equilibrium in self._equilibria(load, evaluator, mask, warm_start=warm_start):
                chosen = [self._quantities[k] for k in columns]
                measured = [(each, each.measure(equilibrium)) for each in chosen]
                self._points.append(_Point(rows, evaluator, equilibrium, columns, measured))
                values[rows, columns] = [each.combine(found.value) for each, found in measured]
        return values

    def _equilibria(
        self, load: Load, evaluator: FrameEvaluator, mask: ArrayLike, *, warm_start: bool
    ) -> Iterator[tuple[slice, Equilibrium]]:
        """Yield the equilibria of a load, and the rows of the fractions that each belongs to."""
        if load == "weight":
            if (rest := evaluator.at_rest(mask)) is not None:
                yield slice(None), rest
            return
        response = evaluator.response_of(mask)
        if response is None:
            response = evaluator.evaluate(mask, warm_start=warm_start)
        self._converged[load] = response.status is Status.CONVERGED
        for row, fraction in enumerate(self.fractions):
            if (equilibrium := evaluator.equilibrium(fraction)) is not None:
                yield slice(row, row + 1), equilibrium

    def set_reference(self) -> None:
        """Make the responses computed last, as far as they have converged, the reference."""
        for load, converged in self._converged.items():
            if converged:
                self._evaluators[load].set_reference()

    def sensitivity(self) -> NDArray[np.float64]:
        """Return the derivatives of the quantities of the design evaluated last by presence.

        The presence of a beam is the factor of its stiffness and of its weight: 1 for a present
        beam, 0 for an absent one. One adjoint solution for each measure of a quantity.

        Returns
        -------
        (F, k, M)
            Zero for beams that carry no load; nan where the quantities are nan, or the equilibrium
            is unstable.

        Raises
        ------
        InvalidSettings
            If the evaluator has several elements in each beam.
        """
        beams = np.arange(self.evaluator.problem.lattice.beam_count)
        slopes = np.full((len(self.fractions), len(self.names), len(beams)), np.nan)
        for point, found in self._flip_changes(beams, first_order=True):
            for column, (quantity, before), change in zip(
                point.columns, point.measured, found.measures, strict=True
            ):
                slopes[point.rows, column] = change @ quantity.gradient(before.value)
        return slopes

    def _flip_changes(
        self, beams: NDArray[np.int64], *, first_order: bool
    ) -> Iterator[tuple[_Point, FlipChanges]]:
        """Yield the stable equilibria with the changes of their measures by flips."""
        for point in self._points:
            found = point.evaluator.flip_changes(
                point.equilibrium, point.measured, beams, first_order=first_order
            )
            if found is not None:
                yield point, found

    def predict_flips(self, beams: ArrayLike | None = None) -> NDArray[np.float64]:
        """Predict the changes of the quantities of the design evaluated last by each flip.

        As `FrameEvaluator.predict_flips`: by one Newton step from each equilibrium.

        Parameters
        ----------
        beams : (n,) int64
            Beams to flip, one at a time; the designable ones by default.

        Returns
        -------
        (F, k, n)
            Zero and nan as in `sensitivity`.

        Raises
        ------
        InvalidSettings
            If the evaluator has several elements in each beam.
        """
        designable = self.evaluator.problem.designable
        chosen = designable if beams is None else np.asarray(beams, dtype=np.int64)
        changes = np.full((len(self.fractions), len(self.names), len(chosen)), np.nan)
        for point, found in self._flip_changes(chosen, first_order=False):
            for column, (quantity, before), change in zip(
                point.columns, point.measured, found.measures, strict=True
            ):
                after = before.value + change
                if quantity.after_flips is not None:
                    after = quantity.after_flips(
                        point.equilibrium, before, chosen, found.forces, after
                    )
                changes[point.rows, column] = quantity.combine(after) - quantity.combine(
                    before.value
                )
        return changes
