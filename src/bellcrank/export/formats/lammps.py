"""LAMMPS scripts: nodes as spheres, struts as bonds that stretch, shear, bend and twist.

A script defines the units (mm, N, s and t), atoms, bonds of the style ``bpm/rotational``, and the
groups ``support``, ``input`` and ``output``. It needs the package BPM. Loads follow it, for example
``include crane.lmp``, ``displace_atoms input move 0 0 -1`` and ``fix moves all nve/bpm/sphere``.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.export.formats.base import Export, Exporter, exporters

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from bellcrank.part import Part

UNBREAKABLE = 1e30
"""Forces and moments at which bonds break, N and N mm."""
MARGIN = 0.25
"""Distance between the nodes and the sides of the box, over the size of the part."""
DENSITY = 1.0
"""Density of materials whose density is unknown, g/cm^3."""


def to_bytes(export: Export) -> bytes:
    """Return the struts as a LAMMPS script.

    The stiffness of a bond is that of a strut for small strains, with shear, between its joints.
    An atom has the mass of half of the struts that meet in it.
    """
    part = export.part
    nodes = np.unique(part.struts)
    number = np.zeros(len(part.positions), dtype=np.int64)
    number[nodes] = np.arange(1, len(nodes) + 1)
    kinds, kind = np.unique(_stiffnesses(part), axis=0, return_inverse=True)
    points = np.zeros((len(part.positions), 3))
    points[:, : part.dimension] = part.positions
    margin = MARGIN * float(np.ptp(points, axis=0).max())
    box = np.stack([points[nodes].min(axis=0) - margin, points[nodes].max(axis=0) + margin], axis=1)
    size, density = _spheres(part)
    most = int(np.bincount(part.struts.ravel()).max())
    breaking = _text([UNBREAKABLE] * 4 + [0.0] * 4)
    lines = [
        f"# {' '.join(export.name.split())}, written by bellcrank: mm, N, s, t",
        "units lj",
        "atom_style bpm/sphere",
        "atom_modify map array",
        "special_bonds lj 0 1 1 coul 0 1 1",
        "newton on off",
        f"region box block {_text(box.ravel())}",
        (
            f"create_box 1 box bond/types {len(kinds)} extra/bond/per/atom {most} "
            f"extra/special/per/atom {most * most}"
        ),
        *(f"create_atoms 1 single {_text(points[k])} units box" for k in nodes),
        *(f"set atom {number[k]} diameter {size[k]:.9g} density {density[k]:.9g}" for k in nodes),
        "pair_style zero 0.1 nocoeff",
        "pair_coeff * *",
        f"comm_modify vel yes cutoff {2.0 * part.lengths.max():.9g}",
        "bond_style bpm/rotational break no smooth no normalize no",
        *(f"bond_coeff {k} {_text(row)} {breaking}" for k, row in enumerate(kinds, start=1)),
        *(
            f"create_bonds single/bond {k + 1} {number[first]} {number[second]} special no"
            for k, (first, second) in zip(kind.reshape(-1), part.struts, strict=True)
        ),
    ]
    problem = part.design.problem
    for name, group in (
        ("support", problem.supports.nodes), ("input", problem.input.nodes),
        ("output", problem.output.nodes),
    ):  # fmt: skip
        members = number[group][number[group] > 0]
        if len(members):
            lines.append(f"group {name} id {' '.join(map(str, members.tolist()))}")
    # The lengths of bonds at rest are stored at the start of the first run.
    lines.append("run 0 post no")
    return ("\n".join(lines) + "\n").encode()


def _text(values: Iterable[float]) -> str:
    return " ".join(f"{each:.9g}" for each in values)


def _stiffnesses(part: Part) -> NDArray[np.float64]:
    """Return (s, 4) the stiffness of struts: along, across (N/mm), twisting and bending (N mm)."""
    young, shear = part.material.young, part.material.shear
    free = part.lengths - part.joints.sum(axis=1)
    rows = []
    for length, width in zip(free.tolist(), part.widths.tolist(), strict=True):
        thickness = width if part.dimension == 3 else part.section.thickness
        section = replace(part.section, width=width, thickness=thickness, joint=0.0)
        bending = young * section.inertia
        soft = 12.0 * bending / (section.shear_coefficient * shear * section.area * length**2)
        along, twisting = young * section.area / length, shear * section.torsion_constant / length
        rows.append([along, 12.0 * bending / length**3 / (1.0 + soft), twisting, bending / length])
    # Struts of equal length are bonds of one type in spite of rounding errors.
    return np.array([[float(f"{each:.9g}") for each in row] for row in rows])


def _spheres(part: Part) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return diameter, mm, and density, t/mm^3, of the sphere of each node, (N,) each."""
    known = 1e-9 * (DENSITY if math.isnan(part.material.density) else part.material.density)
    volume = part.section.area_of(part.widths) * part.lengths
    mass, size = np.zeros(len(part.positions)), part.widest
    np.add.at(mass, part.struts, 0.5 * known * volume[:, None])
    density = np.divide(mass, math.pi / 6.0 * size**3, out=np.zeros_like(mass), where=size > 0.0)
    return size, density


exporters.register("lammps")(Exporter((".lmp",), to_bytes))
