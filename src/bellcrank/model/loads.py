"""Loads of a problem besides its input: forces, springs, own weight."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidProblem
from bellcrank.model.arrays import locked, positive_number, real_array, rebuild
from bellcrank.model.conditions import node_region, unit_vectors
from bellcrank.model.stroke_ranges import WHOLE, stroke_range

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, eq=False)
class NodeForce:
    """Forces on nodes with fixed directions.

    Parameters
    ----------
    nodes : (n,) int64, node ids
    force : (n, d) float64
        Full force on each node; a single vector is used for all nodes.
    during
        Fractions of the stroke between which the forces grow from zero to their full size; after,
        they are constant. None if they grow during the whole stroke.

    Raises
    ------
    InvalidProblem
        If there is no node, the forces have another shape or are not finite, or the range is
        invalid.

    Examples
    --------
    >>> NodeForce([3, 4], [0.0, -0.1]).force
    array([[ 0. , -0.1],
           [ 0. , -0.1]])
    """

    nodes: NDArray[np.int64]
    force: NDArray[np.float64]
    during: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        nodes = node_region("force.nodes", self.nodes)
        force = real_array("force", self.force)
        if force.shape not in {(2,), (3,), (len(nodes), 2), (len(nodes), 3)}:
            raise InvalidProblem(
                "force: expected one vector of 2 or 3 coordinates, or one for each of "
                f"{len(nodes)} nodes, got shape {force.shape}"
            )
        spread = np.broadcast_to(force, (len(nodes), force.shape[-1]))
        object.__setattr__(self, "nodes", locked(nodes))
        object.__setattr__(self, "force", locked(spread.copy()))
        if self.during is not None:
            during = stroke_range("force.during", self.during)
            object.__setattr__(self, "during", None if during == WHOLE else during)

    __reduce__ = rebuild

    @property
    def range(self) -> tuple[float, float]:
        """Fractions of the stroke between which the forces grow."""
        return self.during or WHOLE

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, as in a problem file."""
        data = {"nodes": self.nodes.tolist(), "force": self.force.tolist()}
        return data if self.during is None else {**data, "during": list(self.during)}


@dataclass(frozen=True, slots=True, eq=False)
class NodeSpring:
    """Springs from nodes to the ground, without force at rest.

    Parameters
    ----------
    nodes : (n,) int64, node ids
    direction : (n, d) float64, unit vectors
        Direction in which each spring acts; a single vector is used for all nodes.
    stiffness
        Stiffness of the spring at each node.

    Raises
    ------
    InvalidProblem
        If there is no node, a direction is not a unit vector, or the stiffness is not above 0.
    """

    nodes: NDArray[np.int64]
    direction: NDArray[np.float64]
    stiffness: float

    def __post_init__(self) -> None:
        nodes = node_region("spring.nodes", self.nodes)
        direction = unit_vectors("spring.direction", self.direction, len(nodes))
        object.__setattr__(self, "nodes", locked(nodes))
        object.__setattr__(self, "direction", locked(direction))
        stiffness = positive_number("spring.stiffness", self.stiffness)
        object.__setattr__(self, "stiffness", stiffness)

    __reduce__ = rebuild


@dataclass(frozen=True, slots=True, eq=False)
class Loads:
    """Forces, springs and own weight.

    Parameters
    ----------
    forces, springs
        Forces on nodes and springs at them.
    weight : (d,) float64
        Own weight: force on a unit of volume; None for none.
    weight_during
        Fractions of the stroke between which the own weight grows, as `NodeForce.during`.

    Raises
    ------
    InvalidProblem
        If the weight is not a finite vector, or there is a range of it that is invalid or without
        a weight.

    Examples
    --------
    >>> bool(Loads()), bool(Loads(forces=(NodeForce([0], [0.0, 1.0]),)))
    (False, True)
    """

    forces: tuple[NodeForce, ...] = ()
    springs: tuple[NodeSpring, ...] = ()
    weight: NDArray[np.float64] | None = None
    weight_during: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "forces", tuple(self.forces))
        object.__setattr__(self, "springs", tuple(self.springs))
        if self.weight is not None:
            weight = real_array("weight", self.weight)
            if weight.shape not in {(2,), (3,)}:
                raise InvalidProblem(
                    f"weight: expected a vector of 2 or 3 coordinates, got shape {weight.shape}"
                )
            object.__setattr__(self, "weight", locked(weight.copy()))
        if self.weight_during is not None:
            if self.weight is None:
                raise InvalidProblem("weight_during: expected a weight, too")
            during = stroke_range("weight_during", self.weight_during)
            object.__setattr__(self, "weight_during", None if during == WHOLE else during)

    __reduce__ = rebuild

    def __bool__(self) -> bool:
        return bool(self.forces or self.springs or self.weight is not None)

    @property
    def weight_range(self) -> tuple[float, float]:
        """Fractions of the stroke between which the own weight grows."""
        return self.weight_during or WHOLE

    @property
    def ranges(self) -> NDArray[np.float64]:
        """(r, 2) fractions of the stroke between which forces and own weight grow."""
        found = [each.range for each in self.forces]
        if self.weight is not None:
            found.append(self.weight_range)
        return np.array(found).reshape(-1, 2)

    @property
    def nodes(self) -> NDArray[np.int64]:
        """Nodes with forces or springs, sorted."""
        listed = [each.nodes for each in self.forces] + [each.nodes for each in self.springs]
        return np.unique(np.concatenate([np.empty(0, np.int64), *listed]))

    def vectors(self) -> list[tuple[str, NDArray[np.float64]]]:
        """Return the names and values of all vectors, (n, d)."""
        found = [("loads.forces.force", each.force) for each in self.forces]
        found += [("loads.springs.direction", each.direction) for each in self.springs]
        if self.weight is not None:
            found.append(("loads.weight", self.weight[None]))
        return found

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, as in a problem file; `loads_from_dict` reads them.

        Examples
        --------
        >>> Loads(springs=(NodeSpring([2], [0.0, 1.0], 0.5),)).to_dict()
        {'springs': [{'nodes': [2], 'direction': [[0.0, 1.0]], 'stiffness': 0.5}]}
        """
        data: dict[str, Any] = {}
        if self.forces:
            data["forces"] = [each.to_dict() for each in self.forces]
        if self.springs:
            data["springs"] = [
                {
                    "nodes": each.nodes.tolist(),
                    "direction": each.direction.tolist(),
                    "stiffness": each.stiffness,
                }
                for each in self.springs
            ]
        if self.weight is not None:
            data["weight"] = self.weight.tolist()
        if self.weight_during is not None:
            data["weight_during"] = list(self.weight_during)
        return data
