"""Lattices read from files of other programs."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bellcrank.model.formats import read_network
from bellcrank.model.lattices.registry import lattices

if TYPE_CHECKING:
    from pathlib import Path

    from bellcrank.model.lattice import Lattice


@lattices.register("imported")
def imported(path: Path) -> Lattice:
    """Read the lattice from a file in one of the exchange formats.

    Parameters
    ----------
    path
        The file, relative to the problem file that names it. Its suffix determines the format
        (see `bellcrank.model.formats`).

    Raises
    ------
    InvalidFile, InvalidProblem, UnknownName
        If the file cannot be read or does not contain a valid lattice.
    """
    return read_network(path).lattice
