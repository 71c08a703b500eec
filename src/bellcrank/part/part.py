"""A part: a design with a scale, a strut cross-section and a material."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.model import require_plane
from bellcrank.part.outline import room_for_fillet, strut_outline

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.model import Design, Section
    from bellcrank.part.materials import Material
    from bellcrank.part.outline import Outline


FILLET = 0.25
"""Default fillet radius as a fraction of the strut width."""
ROOM = 0.9
"""Largest default fillet radius as a fraction of the radius at which holes close."""


@dataclass(frozen=True, slots=True)
class Part:
    """A design with a scale, a strut cross-section and a material.

    Parameters
    ----------
    design
        The design, whose beams become struts.
    material
        Material of the struts.
    section
        Cross-section of the struts, a rectangle, in space a disc; mm. If the struts of the design
        have different widths, their ratios to that of the section of the problem are kept.
    scale
        Length of a lattice unit, mm.
    fillet
        Radius in the corners between struts, mm; None for a quarter of the strut width, or less
        where there is no room for it.

    Raises
    ------
    InvalidSettings
        If there are no beams, the struts are round in the plane or rectangular in space, or they
        are not longer than wide.

    Examples
    --------
    >>> from bellcrank.part.materials import Material
    >>> from bellcrank.model import Section, find_problem
    >>> crane = find_problem("crane").full_design()
    >>> rubber = Material(name="rubber", young=12.0, poisson=0.48)
    >>> part = Part(crane, rubber, Section(2.0, 5.0))
    >>> round(part.stroke, 6)
    4.330127
    """

    design: Design
    material: Material
    section: Section
    scale: float = 10.0
    fillet: float | None = None

    def __post_init__(self) -> None:
        wanted, where = ("rectangle", "the plane") if self.dimension == 2 else ("round", "space")
        if self.section.shape != wanted:
            raise InvalidSettings(
                f"section: expected the shape {wanted!r} for a part in {where}, "
                f"got {self.section.shape!r}"
            )
        if self.fillet is not None and not 0.0 <= self.fillet < float("inf"):
            raise InvalidSettings(f"fillet: expected a radius of 0 mm or more, got {self.fillet!r}")
        if not 0.0 < self.scale < float("inf"):
            raise InvalidSettings(f"scale: expected a length above 0 mm, got {self.scale!r}")
        if not self.design.mask.any():
            raise InvalidSettings("the design has no beams")
        length = self.lengths
        worst = int(np.argmax(self.widths / length))
        if self.widths[worst] >= length[worst]:
            raise InvalidSettings(
                f"width: struts {self.widths[worst]:g} mm wide are not slender where the shortest "
                f"is {length[worst]:g} mm long; choose narrower struts or a larger scale"
            )

    @property
    def dimension(self) -> int:
        """2 in the plane, 3 in space."""
        return self.design.problem.lattice.dimension

    @property
    def fillet_radius(self) -> float:
        """Radius in the corners between struts, mm."""
        if self.fillet is not None:
            return self.fillet
        room = room_for_fillet(self.positions, self.struts, self.widths)
        return min(FILLET * self.section.width, ROOM * room)

    @property
    def positions(self) -> NDArray[np.float64]:
        """Nodes of the lattice at rest, (N, d), mm."""
        return self.design.problem.lattice.positions * self.scale

    @property
    def struts(self) -> NDArray[np.int64]:
        """The two nodes of each present beam, (s, 2)."""
        return self.design.problem.lattice.beams[self.design.mask]

    @property
    def width_ratios(self) -> NDArray[np.float64]:
        """Width of each strut over that of the section, (s,)."""
        problem = self.design.problem
        if problem.widths is None or problem.section is None:
            return np.ones(np.count_nonzero(self.design.mask))
        return problem.widths[self.design.mask] / problem.section.width

    @property
    def widths(self) -> NDArray[np.float64]:
        """Width of each strut, (s,), mm."""
        return self.section.width * self.width_ratios

    @property
    def lengths(self) -> NDArray[np.float64]:
        """Distance of the two nodes of each strut, (s,), mm."""
        return self.design.problem.lattice.rest_length[self.design.mask] * self.scale

    @property
    def widest(self) -> NDArray[np.float64]:
        """Width of the widest strut that meets in each node, (N,), mm; 0 where there is none."""
        found = np.zeros(len(self.positions))
        np.maximum.at(found, self.struts, self.widths[:, None])
        return found

    @property
    def joints(self) -> NDArray[np.float64]:
        """Length of the ends of each strut that do not bend, (s, 2), mm."""
        problem = self.design.problem
        if problem.joints is None or problem.section is None:
            return np.repeat((self.section.joint * self.width_ratios)[:, None], 2, axis=1)
        ratio = self.section.width / problem.section.width
        return ratio * problem.joints[self.design.mask]

    def outline(self) -> Outline:
        """Return the planar outline that is meshed, printed and cut.

        Raises
        ------
        InvalidProblem
            If the part is in space.
        InvalidSettings
            If struts or fillets close holes between struts.
        """
        require_plane(self.design.problem, "outline")
        return strut_outline(self.positions, self.struts, self.widths, self.fillet_radius)

    @property
    def stroke(self) -> float:
        """Full displacement of the input, mm; nan for an input force."""
        given = self.design.problem.input
        return given.amount * self.scale if given.drive == "displacement" else float("nan")

    @property
    def stiffness_unit(self) -> float:
        """Stiffness in N / mm that corresponds to 1 in the problem.

        A beam of the spring model has the stiffness 2 k, one of a frame E A / L, and its strut
        that of an elastic bar. Forces and springs of a problem are multiplied by this factor, so
        that they strain the struts as they strain the beams.
        """
        problem = self.design.problem
        length = float(np.mean(problem.lattice.rest_length))
        if problem.section is None or problem.material is None:
            modelled = 2.0 * problem.stiffness.bond
        else:
            modelled = problem.material.young * problem.section.area / length
        return self.material.young * self.section.area / (length * self.scale) / modelled
