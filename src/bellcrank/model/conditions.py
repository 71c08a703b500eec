"""Stiffness, supports, input and output of a problem."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import reduce
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np

from bellcrank.errors import InvalidProblem
from bellcrank.model.arrays import id_list, locked, positive_number, real_array, rebuild
from bellcrank.model.stroke_ranges import WHOLE, stroke_ranges

if TYPE_CHECKING:
    from numpy.typing import NDArray

Aggregate = Literal["mean", "sum"]
Drive = Literal["displacement", "force"]
SpringKind = Literal["directional", "isotropic"]


def _no_nodes() -> NDArray[np.int64]:
    return np.empty(0, dtype=np.int64)


@dataclass(frozen=True, slots=True, eq=False)
class Stiffness:
    """Stiffness of beams against stretching and of joints against bending.

    Parameters
    ----------
    bond
        k of the energy ``k (r - r0)^2`` of a beam (no factor 1/2).
    angle
        lambda of the energy ``lambda (theta - theta0)^2`` of an angular spring.

    Raises
    ------
    InvalidProblem
        Unless both are finite and greater than zero.
    """

    bond: float = 5.0
    angle: float = 0.1

    def __post_init__(self) -> None:
        for name in ("bond", "angle"):
            value = positive_number(f"stiffness.{name}", getattr(self, name))
            object.__setattr__(self, name, value)


ROLLERS = ("fixed_x", "fixed_y", "fixed_z")
"""Names of the supports in one coordinate, in the order of the coordinates."""


@dataclass(frozen=True, slots=True, eq=False)
class Supports:
    """Supported nodes, fixed or on rollers.

    Parameters
    ----------
    fixed : int64, node ids
        Nodes fixed in all coordinates, sorted.
    fixed_x, fixed_y, fixed_z : int64, node ids
        Nodes fixed in one coordinate, sorted, without those in `fixed`. A `Problem` moves the
        nodes that are fixed in x and in y (in space, in x, in y and in z) to `fixed`, and has
        nodes in `fixed_z` only in space.

    Raises
    ------
    InvalidProblem
        If they are not flat lists of distinct integers.

    Examples
    --------
    >>> supports = Supports(fixed=[4], fixed_x=[1, 2], fixed_y=[3, 2]).merged(2)
    >>> supports.fixed, supports.fixed_x, supports.fixed_y
    (array([2, 4]), array([1]), array([3]))
    >>> Supports(fixed=[4], fixed_x=[1, 2], fixed_y=[3, 2]).merged(3).fixed
    array([4])
    """

    fixed: NDArray[np.int64] = field(default_factory=_no_nodes)
    fixed_x: NDArray[np.int64] = field(default_factory=_no_nodes)
    fixed_y: NDArray[np.int64] = field(default_factory=_no_nodes)
    fixed_z: NDArray[np.int64] = field(default_factory=_no_nodes)

    def __post_init__(self) -> None:
        fixed = np.sort(id_list("supports.fixed", self.fixed))
        object.__setattr__(self, "fixed", locked(fixed))
        for name in ROLLERS:
            nodes = id_list(f"supports.{name}", getattr(self, name))
            object.__setattr__(self, name, locked(np.setdiff1d(nodes, fixed)))

    __reduce__ = rebuild

    @property
    def nodes(self) -> NDArray[np.int64]:
        """All supported nodes, sorted."""
        return np.unique(np.concatenate([self.fixed, *self.rollers(3)]))

    def rollers(self, dimension: int) -> list[NDArray[np.int64]]:
        """Return the nodes fixed in x, in y and, in dimension 3, in z only."""
        return [getattr(self, name) for name in ROLLERS[:dimension]]

    def merged(self, dimension: int) -> Supports:
        """Return supports whose nodes fixed in all coordinates are in `fixed`.

        Parameters
        ----------
        dimension
            Spatial dimension, 2 or 3.
        """
        held = reduce(np.intersect1d, self.rollers(dimension))
        return replace(self, fixed=np.union1d(self.fixed, held)) if len(held) else self


@dataclass(frozen=True, slots=True, eq=False)
class Input:
    """Driven nodes, their direction and the amount of displacement or force.

    Parameters
    ----------
    nodes : (n,) int64, node ids
        Driven nodes.
    direction : (n, 2) float64, in space (n, 3), unit vectors
        One vector for each node; a single vector is used for all nodes.
    drive
        ``"displacement"`` prescribes amount x direction as displacement of each node,
        ``"force"`` applies it as a force to each node.
    amount
        Displacement (lattice units) or force on each node, greater than zero.
    during : (n, 2) float64, optional
        Fractions of the stroke between which the displacement of each node, or the force on it,
        grows from zero to its full size; after, it is constant. A single pair is used for all
        nodes. None if all grow during the whole stroke.

    Raises
    ------
    InvalidProblem
        If there is no node, a direction is not a unit vector, or the drive, the amount or a range
        is invalid.

    Examples
    --------
    >>> push = Input(nodes=[7, 8], direction=[0, -1], drive="displacement", amount=0.1)
    >>> push.direction
    array([[ 0., -1.],
           [ 0., -1.]])
    """

    nodes: NDArray[np.int64]
    direction: NDArray[np.float64]
    drive: Drive
    amount: float
    during: NDArray[np.float64] | None = None

    def __post_init__(self) -> None:
        nodes = node_region("input.nodes", self.nodes)
        if self.drive not in get_args(Drive):
            raise InvalidProblem(
                f"input.drive: expected 'displacement' or 'force', got {self.drive!r}"
            )
        direction = unit_vectors("input.direction", self.direction, len(nodes))
        object.__setattr__(self, "nodes", locked(nodes))
        object.__setattr__(self, "direction", locked(direction))
        object.__setattr__(self, "amount", positive_number("input.amount", self.amount))
        if self.during is not None:
            during = stroke_ranges("input.during", self.during, len(nodes))
            object.__setattr__(self, "during", during)

    @property
    def ranges(self) -> NDArray[np.float64]:
        """(n, 2) fractions of the stroke between which each displacement or force grows."""
        if self.during is None:
            return np.tile(WHOLE, (len(self.nodes), 1))
        return self.during

    __reduce__ = rebuild


@dataclass(frozen=True, slots=True, eq=False)
class Output:
    """Observed nodes, the wanted direction of their motion, and springs against it.

    Parameters
    ----------
    nodes : (n,) int64, node ids
        Observed nodes.
    direction : (n, 2) float64, in space (n, 3), unit vectors
        One vector for each node; a single vector is used for all nodes.
    spring
        Stiffness k_ext of the spring at each node, with energy ``1/2 k_ext ...``; None for no
        spring.
    spring_kind
        ``"directional"`` springs act along `direction` (the paper; default if a spring is
        given), ``"isotropic"`` springs in all directions (the published code).

    Raises
    ------
    InvalidProblem
        If there is no node, a direction is not a unit vector, or the spring is invalid.

    Examples
    --------
    >>> Output(nodes=[3], direction=[-1, 0], spring=0.5).spring_kind
    'directional'
    """

    nodes: NDArray[np.int64]
    direction: NDArray[np.float64]
    spring: float | None = None
    spring_kind: SpringKind | None = None

    def __post_init__(self) -> None:
        nodes = node_region("output.nodes", self.nodes)
        direction = unit_vectors("output.direction", self.direction, len(nodes))
        if self.spring_kind is not None and self.spring_kind not in get_args(SpringKind):
            raise InvalidProblem(
                "output.spring_kind: expected 'directional' or 'isotropic', "
                f"got {self.spring_kind!r}"
            )
        if self.spring is None and self.spring_kind is not None:
            raise InvalidProblem("output.spring_kind: given without output.spring")
        if self.spring is not None:
            object.__setattr__(self, "spring", positive_number("output.spring", self.spring))
            object.__setattr__(self, "spring_kind", self.spring_kind or "directional")
        object.__setattr__(self, "nodes", locked(nodes))
        object.__setattr__(self, "direction", locked(direction))

    __reduce__ = rebuild


def node_region(name: str, values: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return node ids, at least one.

    Raises
    ------
    InvalidProblem
    """
    nodes = id_list(name, values)
    if len(nodes) == 0:
        raise InvalidProblem(f"{name}: expected at least one node, got none")
    return nodes


def unit_vectors(name: str, values: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """Return (count, d) unit vectors; a single vector is repeated.

    Raises
    ------
    InvalidProblem
    """
    vectors = real_array(name, values)
    if vectors.shape not in {(2,), (3,), (count, 2), (count, 3)}:
        raise InvalidProblem(
            f"{name}: expected one vector, shape (2,), in space (3,), or one per node, shape "
            f"({count}, 2), in space ({count}, 3), got shape {vectors.shape}"
        )
    vectors = np.broadcast_to(vectors, (count, vectors.shape[-1]))
    lengths = np.linalg.norm(vectors, axis=1)
    bad = np.flatnonzero(np.abs(lengths - 1.0) > 1e-6)
    if len(bad):
        raise InvalidProblem(
            f"{name}: expected unit vectors, got {vectors[bad[0]].tolist()} "
            f"of length {lengths[bad[0]]:.7g} for node number {bad[0]} of the region"
        )
    # Repeated division by 1 +- 1e-16 would change the last bit, and with it the hash of a problem
    # that is read and written.
    rounded = np.abs(lengths - 1.0) <= 1e-15
    unit: NDArray[np.float64] = np.where(rounded[:, None], vectors, vectors / lengths[:, None])
    return unit
