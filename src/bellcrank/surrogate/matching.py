"""Correspondence between the problem of a trained network and a differently numbered one."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidModel
from bellcrank.surrogate.trained_model import lattice_hash

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.model import Problem

TOLERANCE = 1e-4
"""Largest distance of corresponding nodes in lattice units; largest relative difference of other
numbers."""


def beams_between(known: Problem, given: Problem) -> NDArray[np.int64]:
    """Return, for each beam of a given problem, its number in the known problem.

    Parameters
    ----------
    known
        Problem that a network was trained on.
    given
        The same problem up to the numbering of nodes and beams, and a shift.

    Returns
    -------
    (M,) int64

    Raises
    ------
    InvalidModel
        If the problems differ; the message names the first difference.
    """
    node_of = _nodes_between(known, given)
    beam_of = _matching_beams(known, given, node_of)
    _require_same_task(known, given, node_of)
    return beam_of


def renumbered(masks: NDArray[np.bool_], beams: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return designs (n, M) of the given problem in the numbering of the known problem.

    Parameters
    ----------
    masks : (n, M) bool
    beams : (M,) int64
        Result of `beams_between`.

    Examples
    --------
    >>> renumbered(np.array([[True, False, False]]), np.array([2, 0, 1])).tolist()
    [[False, False, True]]
    """
    known = np.zeros(masks.shape, np.bool_)
    known[:, beams] = masks
    return known


def _nodes_between(known: Problem, given: Problem) -> NDArray[np.int64]:
    """Return the known number of each given node."""
    from scipy.spatial import cKDTree

    first, second = known.lattice, given.lattice
    there, here = (first.node_count, first.beam_count), (second.node_count, second.beam_count)
    if there != here:
        raise InvalidModel(
            f"the model was trained on {known.name!r} with {there[0]} nodes and {there[1]} beams; "
            f"{given.name!r} has {here[0]} and {here[1]}"
        )
    if lattice_hash(first) == lattice_hash(second):
        return np.arange(first.node_count)
    shift = first.positions.min(axis=0) - second.positions.min(axis=0)
    apart, nearest = cKDTree(first.positions).query(second.positions + shift)
    node_of = np.asarray(nearest, np.int64)
    far = np.flatnonzero(apart > TOLERANCE)
    if len(far) or len(np.unique(node_of)) < len(node_of):
        node = int(far[0]) if len(far) else 0
        raise InvalidModel(
            f"the model was trained on {known.name!r}, which has no node at the position of node "
            f"{node} of {given.name!r}: lattices must agree up to numbering and a shift, within "
            f"{TOLERANCE:g}"
        )
    return node_of


def _matching_beams(
    known: Problem, given: Problem, node_of: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Return the known number of each given beam."""
    ends = np.sort(known.lattice.beams, axis=1)
    number = {(a, b): beam for beam, (a, b) in enumerate(ends.tolist())}
    translated = np.sort(node_of[given.lattice.beams], axis=1).tolist()
    found = [number.get((a, b), -1) for a, b in translated]
    if -1 in found:
        raise InvalidModel(
            f"the model was trained on {known.name!r}, which has no beam {found.index(-1)} of "
            f"{given.name!r}"
        )
    return np.array(found, np.int64)


def _require_same_task(known: Problem, given: Problem, node_of: NDArray[np.int64]) -> None:
    """Raise InvalidModel if supports, drive, output or stiffness differ."""
    there = _task(known, np.arange(known.lattice.node_count))
    here = _task(given, node_of)
    for name, value in there.items():
        other = here[name]
        if not _agree(value, other):
            values = "" if isinstance(value, np.ndarray) else f": {value} in training, {other} here"
            raise InvalidModel(
                f"the model was trained on {known.name!r}, whose {name} differs from that of "
                f"{given.name!r}{values}"
            )


def _agree(first: Any, second: Any) -> bool:
    """Whether two values of a task agree: node numbers exactly, other numbers within TOLERANCE."""
    if isinstance(first, np.ndarray):
        if first.shape != second.shape:
            return False
        tolerance = TOLERANCE if first.dtype == np.float64 else 0.0
        return bool((np.abs(first - second) <= tolerance).all())
    if isinstance(first, float) and isinstance(second, float):
        return math.isclose(first, second, rel_tol=TOLERANCE)
    return bool(first == second)


def _task(problem: Problem, node_of: NDArray[np.int64]) -> dict[str, Any]:
    """Return what determines efficiencies besides the lattice, in known node numbers."""
    from bellcrank.mechanics.objectives import objective_of

    task: dict[str, Any] = {}
    for name in ("fixed", "fixed_x", "fixed_y"):
        task[f"support ({name})"] = np.sort(node_of[getattr(problem.supports, name)])
    for name, region in (("input", problem.input), ("output", problem.output)):
        nodes = node_of[region.nodes]
        order = np.argsort(nodes)
        task[f"{name} region"] = nodes[order]
        directions = np.broadcast_to(region.direction, (len(nodes), 2))
        task[f"{name} direction"] = np.asarray(directions)[order]
    task["drive"] = problem.input.drive
    task["amount"] = problem.input.amount
    task["output spring"] = problem.output.spring
    task["spring_kind"] = problem.output.spring_kind
    task["stiffness of beams"] = problem.stiffness.bond
    task["stiffness of joints"] = problem.stiffness.angle
    task["aggregate"] = problem.aggregate
    # None and the name of the default are the same objective.
    objective = objective_of(problem)
    by_force = problem.input.drive == "force" and objective.denominator is not None
    task["objective"] = "force" if by_force else "displacement"
    task["exponent of the objective"] = objective.exponent
    return task
