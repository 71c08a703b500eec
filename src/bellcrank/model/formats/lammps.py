"""LAMMPS data files: atoms are nodes, bonds are beams, atom types are roles.

Files are written in atom style *bond*, which LAMMPS reads with ``atom_style bond`` and OVITO opens
directly. The styles atomic, bond, angle, molecular and full are read. The style is the comment
after ``Atoms``, otherwise it is determined by the number of columns.

References
----------
LAMMPS documentation, ``read_data`` command.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidFile
from bellcrank.model.formats.network import LatticeFormat, Network, NodeRole, formats
from bellcrank.model.lattice import Lattice

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

# Columns before x, y, z. Three image flags may follow.
_STYLES = {
    "atomic": ("id", "type"),
    "bond": ("id", "molecule", "type"),
    "angle": ("id", "molecule", "type"),
    "molecular": ("id", "molecule", "type"),
    "full": ("id", "molecule", "type", "charge"),
}
_STYLE_BY_COLUMNS = {5: "atomic", 8: "atomic", 6: "bond", 9: "bond", 7: "full", 10: "full"}


def to_text(network: Network) -> str:
    """Return a network as a LAMMPS data file.

    Coordinates are written with all digits, so that reading returns the same numbers. A planar
    lattice has z = 0.

    Examples
    --------
    >>> from bellcrank.model import Lattice
    >>> beam = Network(Lattice([[0, 0], [1, 0]], [[0, 1]]), [2, 1])
    >>> print(to_text(beam))  # doctest: +ELLIPSIS
    bellcrank lattice, written in lattice units
    <BLANKLINE>
    2 atoms
    1 bonds
    ...
    """
    lattice = network.lattice
    positions = np.zeros((lattice.node_count, 3))
    positions[:, : lattice.dimension] = lattice.positions
    types = max(int(network.roles.max()), *NodeRole)
    margin = 0.5  # LAMMPS refuses a box of no thickness
    lower, upper = positions.min(axis=0) - margin, positions.max(axis=0) + margin
    lines = [
        "bellcrank lattice, written in lattice units",
        "",
        f"{lattice.node_count} atoms",
        f"{lattice.beam_count} bonds",
        f"{types} atom types",
        "1 bond types",
        "",
        *(
            f"{float(low)!r} {float(high)!r} {axis}lo {axis}hi"
            for axis, low, high in zip("xyz", lower, upper, strict=True)
        ),
        "",
        "Masses",
        "",
        *(f"{kind} 1.0{_comment(kind)}" for kind in range(1, types + 1)),
        "",
        "Atoms # bond",
        "",
        *(
            f"{node} 1 {role} {x!r} {y!r} {z!r}"
            for node, (role, (x, y, z)) in enumerate(
                zip(network.roles.tolist(), positions.tolist(), strict=True), start=1
            )
        ),
        "",
        "Bonds",
        "",
        *(f"{beam} 1 {a + 1} {b + 1}" for beam, (a, b) in enumerate(lattice.beams.tolist(), 1)),
        "",
    ]
    return "\n".join(lines)


def from_text(text: str, source: str) -> Network:
    """Return the network of a LAMMPS data file.

    Nodes and beams are numbered in the order of the atom and bond ids. The lattice is planar if
    all z are equal. Bonds across a periodic boundary are read unchanged.

    Raises
    ------
    InvalidFile
        If atoms or bonds are missing, or a line is invalid; names the line.
    """
    sections = _sections(text)
    if "Atoms" not in sections or "Bonds" not in sections:
        missing = "Atoms" if "Atoms" not in sections else "Bonds"
        raise InvalidFile(f"{source}: expected a LAMMPS data file with a section {missing!r}")
    style, atoms = _rows(source, sections["Atoms"])
    # A named style takes precedence: several styles have the same number of columns.
    columns = _STYLES.get(style or _STYLE_BY_COLUMNS.get(atoms.shape[1], ""))
    if columns is None or atoms.shape[1] - len(columns) not in {3, 6}:
        raise InvalidFile(
            f"{source}: Atoms: expected a style among {', '.join(_STYLES)}, "
            f"got {style or 'none'} with {atoms.shape[1]} columns"
        )
    bonds = _rows(source, sections["Bonds"])[1].astype(np.int64)
    if bonds.shape[1] != 4:
        raise InvalidFile(f"{source}: Bonds: expected 4 columns, got {bonds.shape[1]}")
    atoms = atoms[np.argsort(atoms[:, 0], kind="stable")]
    bonds = bonds[np.argsort(bonds[:, 0], kind="stable")]
    positions = atoms[:, len(columns) : len(columns) + 3]
    if np.ptp(positions[:, 2]) == 0.0:
        positions = positions[:, :2]
    ends = _node_numbers(source, atoms[:, 0].astype(np.int64), bonds)
    roles = atoms[:, columns.index("type")].astype(np.int64)
    return Network(Lattice(positions, ends), roles)


def _comment(kind: int) -> str:
    names = {role.value: role.name.lower() for role in NodeRole}
    return f" # {names[kind]}" if kind in names else ""


def _sections(text: str) -> dict[str, tuple[str, list[tuple[int, str]]]]:
    """Return the comment and the numbered lines of each section."""
    found: dict[str, tuple[str, list[tuple[int, str]]]] = {}
    lines: list[tuple[int, str]] = []
    # The first line is a title. Counts before the first section repeat the sections' lengths.
    for number, content, comment in _content(text):
        if content[0].isalpha():
            lines = []
            found[content] = (comment, lines)
        else:
            lines.append((number, content))
    return found


def _content(text: str) -> Iterator[tuple[int, str, str]]:
    for number, line in enumerate(text.splitlines(), start=1):
        content, _, comment = line.partition("#")
        if number > 1 and content.strip():
            yield number, content.strip(), comment.strip()


def _rows(
    source: str, section: tuple[str, list[tuple[int, str]]]
) -> tuple[str, NDArray[np.float64]]:
    """Return the comment and the lines of a section as a table of numbers."""
    comment, lines = section
    table: list[list[float]] = []
    for number, line in lines:
        try:
            table.append([_finite(field) for field in line.split()])
        except ValueError:
            raise InvalidFile(f"{source}: line {number}: expected numbers, got {line!r}") from None
        if len(table[-1]) != len(table[0]):
            raise InvalidFile(
                f"{source}: line {number}: expected {len(table[0])} numbers, got {len(table[-1])}"
            )
    if not table:
        raise InvalidFile(f"{source}: expected at least one atom and one bond")
    return comment, np.array(table)


def _finite(field: str) -> float:
    value = float(field)
    if not math.isfinite(value):
        raise ValueError(field)
    return value


def _node_numbers(
    source: str, atom_ids: NDArray[np.int64], bonds: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Return the positions of atom ids in the sorted list of ids."""
    if (np.diff(atom_ids) == 0).any():
        twice = atom_ids[np.flatnonzero(np.diff(atom_ids) == 0)[0]]
        raise InvalidFile(f"{source}: Atoms: atom {twice} is listed twice")
    ends = bonds[:, 2:]
    unknown = np.argwhere(~np.isin(ends, atom_ids))
    if len(unknown):
        bond, side = unknown[0]
        raise InvalidFile(
            f"{source}: Bonds: bond {bonds[bond, 0]} names atom {ends[bond, side]}, "
            "which does not exist"
        )
    numbers: NDArray[np.int64] = np.searchsorted(atom_ids, ends).astype(np.int64)
    return numbers


formats.register("lammps")(
    LatticeFormat(suffixes=(".lammps", ".data", ".lmp"), to_text=to_text, from_text=from_text)
)
