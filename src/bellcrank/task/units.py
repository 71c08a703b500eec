"""Conversion between the units of a part (mm, N, g) and those of its problem."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.part import frame_section
from bellcrank.part.units import GRAVITY

if TYPE_CHECKING:
    from bellcrank.model import Elasticity, Lattice, Problem, Section
    from bellcrank.model.specification import Dimension
    from bellcrank.part import PartSpec


@dataclass(frozen=True, slots=True)
class ProblemUnits:
    """Units of a frame problem.

    Parameters
    ----------
    length
        Length of a lattice unit, mm.
    force
        Force of 1 in the problem, N.
    density
        Density of the material, g/mm^3; nan if it is unknown.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> from bellcrank.part import PartSpec, frame_problem
    >>> spec = PartSpec()
    >>> units = units_of(frame_problem(find_problem("crane"), spec), spec)
    >>> units.length, round(units.force, 6)
    (10.0, 12.0)
    >>> round(units.in_part("stiffness", 1.0), 6)
    1.2
    """

    length: float
    force: float
    density: float = math.nan

    def size(self, dimension: Dimension) -> float:
        """Return the size of 1 in the problem: mm, N, N/mm, g; 1 for ratios and degrees."""
        return {
            "length": self.length,
            "force": self.force,
            "stiffness": self.force / self.length,
            "volume": self.length**3 * self.density,
        }.get(dimension, 1.0)

    def in_part(self, dimension: Dimension, value: float) -> float:
        """Convert a value of the problem to mm, N, N/mm or g."""
        return value * self.size(dimension)

    def in_problem(self, dimension: Dimension, value: float) -> float:
        """Convert a value in mm, N, N/mm or g to the units of the problem."""
        return value / self.size(dimension)

    @property
    def weight(self) -> float:
        """Weight of a unit of volume in the units of the problem."""
        return self.density * 1e-3 * GRAVITY * self.length**3 / self.force


def units_of(problem: Problem, spec: PartSpec) -> ProblemUnits:
    """Return the units of a frame problem that is made as a part."""
    assert problem.section is not None
    assert problem.material is not None
    return part_units(problem.lattice, problem.section, problem.material, spec)


def part_units(
    lattice: Lattice, section: Section, elasticity: Elasticity, spec: PartSpec
) -> ProblemUnits:
    """Return the units of a frame of a lattice that is made as a part.

    Parameters
    ----------
    lattice, section, elasticity
        Those of the problem, in lattice units.
    spec
        Size and material of the part.
    """
    material = spec.registered_material
    length = float(np.mean(lattice.rest_length))
    modelled = elasticity.young * section.area / length
    made = frame_section(spec, lattice.dimension).scaled(spec.scale)
    stiffness = material.young * made.area / (length * spec.scale) / modelled
    return ProblemUnits(spec.scale, stiffness * spec.scale, material.density * 1e-3)


NAMES: dict[Dimension, str] = {
    "ratio": "", "length": "mm", "angle": "deg", "force": "N", "stiffness": "N/mm", "volume": "g",
}  # fmt: skip
"""Name of the unit of each dimension in a part."""
