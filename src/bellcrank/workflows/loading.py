"""The loading path of a design in its model, from rest to the full stroke."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.mechanics import (
    VERIFICATION_INCREMENT,
    FrameEvaluator,
    Response,
    Status,
    at_fraction,
    increment_at,
    model_evaluator,
)
from bellcrank.mechanics.frames.analysis import strain_of_frame
from bellcrank.mechanics.frames.quantities import quantities

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

    from bellcrank.mechanics import Strain
    from bellcrank.model import Design, Problem

SMALL = 1e-3
"""Fraction of the stroke at which the efficiency at rest is evaluated."""


@dataclass(frozen=True, slots=True, eq=False)
class LoadingPath:
    """Equilibria of a design at K fractions of its stroke.

    Parameters
    ----------
    fraction : (K,) float64
        Fractions of the stroke, from 0 to 1.
    displacement : (K, N, d) float64
        Displacement of the nodes, lattice units.
    energy : (K, M) float64
        Strain energy of each beam (see `bellcrank.mechanics.Strain`).
    efficiency, input_force : (K,) float64
        Efficiency and total input force. The efficiency at rest is that of a small stroke.
    snapped : (K,) bool
        Whether the structure has lost stability on the way to the state.
    """

    fraction: NDArray[np.float64]
    displacement: NDArray[np.float64]
    energy: NDArray[np.float64]
    efficiency: NDArray[np.float64]
    input_force: NDArray[np.float64]
    snapped: NDArray[np.bool_]


def loading_path(
    design: Design,
    fractions: NDArray[np.float64],
    objective: str | None = None,
    report: Callable[[int], None] = lambda _done: None,
    elements: int | None = None,
) -> LoadingPath:
    """Compute the responses of a design at fractions of its stroke, each from rest.

    Where inputs move in parts of the stroke, they are equilibria of one path.

    Parameters
    ----------
    design
        The design.
    fractions : (K,) float64
        Increasing, from 0 to 1.
    objective
        Name of the objective; the problem's own by default.
    report
        Called with the number of responses computed so far.
    elements
        For frames, as in `bellcrank.mechanics.FrameEvaluator`.

    Raises
    ------
    InvalidSettings
        If the design is not supported or has no stable equilibrium at its full stroke.

    Examples
    --------
    >>> from bellcrank.model import human_design
    >>> path = loading_path(human_design("crane"), np.array([0.0, 0.5, 1.0]))
    >>> path.displacement.shape, path.snapped.any()
    ((3, 133, 2), np.False_)
    """
    problem, states = design.problem, len(fractions)
    displacement = np.zeros((states, *problem.lattice.positions.shape))
    energy = np.zeros((states, problem.lattice.beam_count))
    efficiency, force = np.zeros(states), np.zeros(states)
    snapped = np.zeros(states, dtype=bool)
    respond = _response_on_path if problem.has_ranges else _response_from_rest
    shares = np.maximum(fractions, SMALL).tolist()
    for k, (fraction, (response, strain)) in enumerate(
        zip(fractions.tolist(), respond(design, shares, objective, elements), strict=True)
    ):
        efficiency[k] = response.efficiency
        snapped[k] = response.status is Status.SNAPPED
        if fraction > 0.0:
            displacement[k] = response.displacement
            energy[k], force[k] = strain.energy, strain.input_force
        report(k + 1)
    # A single state before a snapped one may be marked by chance: only what stays is kept.
    snapped = np.logical_and.accumulate(snapped[::-1])[::-1]
    return LoadingPath(fractions, displacement, energy, efficiency, force, snapped)


def _checked(response: Response, problem: Problem) -> Response:
    """Return a response that has an equilibrium.

    Raises
    ------
    InvalidSettings
        If it has none.
    """
    if response.status not in {Status.CONVERGED, Status.SNAPPED}:
        raise InvalidSettings(f"{problem.name}: no motion to show: {response.status.message}")
    return response


def _response_from_rest(
    design: Design, shares: list[float], objective: str | None, elements: int | None
) -> Iterator[tuple[Response, Strain]]:
    """Yield responses to fractions of the input, each from rest."""
    for share in shares:
        evaluator = model_evaluator(
            at_fraction(design.problem, share), objective, elements=elements
        )
        response = _checked(evaluator.evaluate(design.mask, increment_at(share)), design.problem)
        yield response, evaluator.strain()


def _response_on_path(
    design: Design, shares: list[float], objective: str | None, elements: int | None
) -> Iterator[tuple[Response, Strain]]:
    """Yield equilibria of the path of the full input, the last stable one beyond its end."""
    problem = design.problem
    evaluator = FrameEvaluator(problem, objective, elements)
    _checked(evaluator.evaluate(design.mask, VERIFICATION_INCREMENT), problem)
    nodes, dimension = problem.lattice.positions.shape
    efficiency = quantities["efficiency"]
    for share in shares:
        found = evaluator.equilibrium(share)
        status = Status.SNAPPED if found is None else Status.CONVERGED
        here = evaluator.end if found is None else found
        value = math.nan if found is None else efficiency.value(here)
        moved = here.state.u[:nodes, :dimension].copy()
        strain = strain_of_frame(evaluator, here)
        yield Response(status, value, math.nan, moved), strain
