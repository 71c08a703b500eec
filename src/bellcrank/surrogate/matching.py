"""Whether a trained network is for the problem at hand, and how its beams are numbered there."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidModel
from bellcrank.surrogate.identity import lattice_hash

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.model import Lattice, Problem

TOLERANCE = 1e-4
"""How far nodes that are the same may be apart, in lattice units; of other numbers, a fraction."""


def beams_between(known: Problem, given: Problem) -> NDArray[np.int64]:
    """Return, for each beam of the problem at hand, its number in the problem that is known.

    Parameters
    ----------
    known
        What a network has learnt.
    given
        What it is asked about: the same up to the numbering of nodes and beams, and a shift.

    Returns
    -------
    (M,) int64

    Raises
    ------
    InvalidModel
        If the problems differ; says where.
    """
    node_of = _nodes_between(known.lattice, given.lattice, known.name, given.name)
    beam_of = _beams_between(known.lattice, given.lattice, node_of, known.name, given.name)
    _require_same_task(known, given, node_of)
    return beam_of


def renumbered(masks: NDArray[np.bool_], beams: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return designs (n, M) of the problem at hand as the problem that is known numbers them.

    Parameters
    ----------
    masks : (n, M) bool
    beams : (M,) int64
        As `beams_between` gives them.

    Examples
    --------
    >>> renumbered(np.array([[True, False, False]]), np.array([2, 0, 1])).tolist()
    [[False, False, True]]
    """
    known = np.zeros(masks.shape, np.bool_)
    known[:, beams] = masks
    return known


def require_same_numbers(known: Problem, given: Problem) -> None:
    """Refuse a network that can tell about a problem, but not go on learning it.

    Parameters
    ----------
    known
        What it has learnt.
    given
        What it is to go on with: its beams must be numbered as the network knows them.

    Raises
    ------
    InvalidModel
        If they are not, or the problems differ.
    """
    beam_of = beams_between(known, given)
    wrong = np.flatnonzero(beam_of != np.arange(len(beam_of)))
    if len(wrong):
        raise InvalidModel(
            f"the model has learnt {known.name!r} with other numbers of the beams than those of "
            f"{given.name!r} (beam {wrong[0]} is {beam_of[wrong[0]]} there); to go on learning, "
            f"build the dataset for the problem as the model knows it"
        )


def _nodes_between(
    known: Lattice, given: Lattice, known_name: str, given_name: str
) -> NDArray[np.int64]:
    """Return the known number of each given node."""
    from scipy.spatial import cKDTree

    there = (known.node_count, known.beam_count)
    here = (given.node_count, given.beam_count)
    if there != here:
        raise InvalidModel(
            f"the model has learnt {known_name!r} with {there[0]} nodes and {there[1]} beams; "
            f"{given_name!r} has {here[0]} and {here[1]}"
        )
    if lattice_hash(known) == lattice_hash(given):
        return np.arange(known.node_count)
    shift = known.positions.min(axis=0) - given.positions.min(axis=0)
    apart, nearest = cKDTree(known.positions).query(given.positions + shift)
    node_of = np.asarray(nearest, np.int64)
    far = np.flatnonzero(apart > TOLERANCE)
    if len(far) or len(np.unique(node_of)) < len(node_of):
        node = int(far[0]) if len(far) else 0
        raise InvalidModel(
            f"the model has learnt {known_name!r}, a lattice with no node where {given_name!r} "
            f"has node {node}: lattices must agree up to numbering and a shift, within "
            f"{TOLERANCE:g}"
        )
    return node_of


def _beams_between(
    known: Lattice, given: Lattice, node_of: NDArray[np.int64], known_name: str, given_name: str
) -> NDArray[np.int64]:
    """Return the known number of each given beam."""
    ends = np.sort(known.beams, axis=1)
    number = {(a, b): beam for beam, (a, b) in enumerate(ends.tolist())}
    translated = np.sort(node_of[given.beams], axis=1).tolist()
    found = [number.get((a, b), -1) for a, b in translated]
    if -1 in found:
        raise InvalidModel(
            f"the model has learnt {known_name!r}, a lattice without beam {found.index(-1)} of "
            f"{given_name!r}"
        )
    return np.array(found, np.int64)


def _require_same_task(known: Problem, given: Problem, node_of: NDArray[np.int64]) -> None:
    """Refuse other supports, drives, outputs or stiffnesses: their efficiencies are others."""
    there, here = _task(known, np.arange(known.lattice.node_count)), _task(given, node_of)
    for name, value in there.items():
        other = here[name]
        if not _same(value, other):
            told = "" if isinstance(value, np.ndarray) else f" ({value} there, {other} here)"
            raise InvalidModel(
                f"the model has learnt {known.name!r}, whose {name} is another than that of "
                f"{given.name!r}{told}"
            )


def _same(there: Any, here: Any) -> bool:
    """Whether what was learnt and what is asked are one: nodes exactly, numbers nearly."""
    if isinstance(there, np.ndarray):
        if there.shape != here.shape:
            return False
        nearly = TOLERANCE if there.dtype == np.float64 else 0.0
        return bool((np.abs(there - here) <= nearly).all())
    if isinstance(there, float) and isinstance(here, float):
        return math.isclose(there, here, rel_tol=TOLERANCE)
    return bool(there == here)


def _task(problem: Problem, node_of: NDArray[np.int64]) -> dict[str, Any]:
    """Return what decides about efficiencies, besides the lattice, by known numbers of nodes."""
    from bellcrank.mechanics.objectives import objective_of

    told: dict[str, Any] = {}
    for name in ("fixed", "fixed_x", "fixed_y"):
        nodes = node_of[getattr(problem.supports, name)]
        told[f"support ({name})"] = np.sort(nodes)
    for name, region in (("input", problem.input), ("output", problem.output)):
        nodes = node_of[region.nodes]
        order = np.argsort(nodes)
        told[f"{name} region"] = nodes[order]
        directions = np.broadcast_to(region.direction, (len(nodes), 2))
        told[f"{name} direction"] = np.asarray(directions)[order]
    told["drive"] = problem.input.drive
    told["amount"] = problem.input.amount
    told["output spring"] = problem.output.spring
    told["spring_kind"] = problem.output.spring_kind
    told["stiffness of beams"] = problem.stiffness.bond
    told["stiffness of joints"] = problem.stiffness.angle
    told["aggregate"] = problem.aggregate
    # None and the name of what it stands for are the same objective.
    objective = objective_of(problem)
    by_force = problem.input.drive == "force" and objective.denominator is not None
    told["objective"] = "force" if by_force else "displacement"
    told["exponent of the objective"] = objective.exponent
    return told
