"""Content of the exchange formats: a lattice with the role of each node."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidProblem
from bellcrank.model.arrays import index_array, locked, rebuild
from bellcrank.model.lattice import Lattice
from bellcrank.model.storage import read_text, write_text
from bellcrank.registry import FormatRegistry

if TYPE_CHECKING:
    import os
    from collections.abc import Callable

    from numpy.typing import NDArray

    from bellcrank.model.problem import Design


class NodeRole(IntEnum):
    """Role of a node; its value is the atom type in LAMMPS files."""

    FREE = 1
    SUPPORT = 2
    INPUT = 3
    OUTPUT = 4


@dataclass(frozen=True, slots=True, eq=False)
class Network:
    """A lattice with a role for each node.

    Parameters
    ----------
    lattice
        Nodes, in the plane or in space, and beams.
    roles : (N,) int64
        A `NodeRole` for each node. Other positive numbers from files are kept.

    Raises
    ------
    InvalidProblem
        If there is not one positive number for each node.
    """

    lattice: Lattice
    roles: NDArray[np.int64]

    def __post_init__(self) -> None:
        roles = index_array("roles", self.roles)
        if roles.shape != (self.lattice.node_count,) or roles.min() < 1:
            raise InvalidProblem(
                f"roles: expected one number from 1 up for each of {self.lattice.node_count} "
                f"nodes, got shape {roles.shape} with smallest {roles.min(initial=1)}"
            )
        object.__setattr__(self, "roles", locked(roles))

    __reduce__ = rebuild


@dataclass(frozen=True, slots=True)
class LatticeFormat:
    """Functions that write and read a format.

    Parameters
    ----------
    suffixes
        Suffixes of its files, the usual one first.
    to_text, from_text
        Conversion of a network to text, and of text and the name of the file (for errors) to a
        network.
    """

    suffixes: tuple[str, ...]
    to_text: Callable[[Network], str]
    from_text: Callable[[str, str], Network]


formats: FormatRegistry[LatticeFormat] = FormatRegistry("lattice format")


def network_of(design: Design) -> Network:
    """Return the beams present in a design, with the roles of the nodes.

    All nodes are kept, so that their numbers do not change.
    """
    problem = design.problem
    roles = np.full(problem.lattice.node_count, NodeRole.FREE, dtype=np.int64)
    roles[problem.supports.nodes] = NodeRole.SUPPORT
    roles[problem.input.nodes] = NodeRole.INPUT
    roles[problem.output.nodes] = NodeRole.OUTPUT
    present = problem.lattice.beams[design.mask]
    return Network(Lattice(problem.lattice.positions, present), roles)


def read_network(path: str | os.PathLike[str]) -> Network:
    """Read a network from a file in the format of its suffix.

    Raises
    ------
    UnknownName
        If no format has that suffix.
    InvalidFile
        If the file does not follow the format.
    InvalidProblem
        If its lattice is not valid.
    """
    chosen = formats.for_path(path)
    try:
        return chosen.from_text(read_text(path), str(path))
    except InvalidProblem as error:
        raise InvalidProblem(f"{path}: {error}") from None


def write_network(
    network: Network, path: str | os.PathLike[str], *, overwrite: bool = False
) -> None:
    """Write a network to a file in the format of its suffix.

    Raises
    ------
    UnknownName
        If no format has that suffix.
    OutputExists
        If the file exists and `overwrite` is not set.
    StorageError
        If it cannot be written.
    """
    write_text(path, formats.for_path(path).to_text(network), overwrite=overwrite)
