"""Parts as frames in the plane: their beams and supports, and their equations of equilibrium.

The beams are those of `bellcrank.mechanics.frames`. Lengths in mm, forces in N.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.fem.frame.sparse import Assembly, SparseFactor
from bellcrank.fem.path import Linearisation, PathState
from bellcrank.mechanics.frames.beams import beam_stiffness, subdivided
from bellcrank.mechanics.frames.system import (
    applied_forces,
    held_unknowns,
    prescribed_motion,
    spring_stiffness,
)
from bellcrank.model import Elasticity
from bellcrank.model.stroke_ranges import kinks_of, rate_at, share_at

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.part.part import Part

TOLERANCE = 1e-10
"""Admissible residual as a fraction of the largest force within an element."""
ROUNDING = 100.0 * float(np.finfo(float).eps)


@dataclass(frozen=True, slots=True, eq=False)
class PartFrame:
    """A part as a frame with its supports, input and output springs.

    Parameters
    ----------
    positions : (n, 2) float64
        Nodes at rest, mm: the lattice nodes, then those within struts.
    elements : (e, 2) int64
        End nodes of the elements, strut by strut.
    struts : (s,) int64
        Lattice beams of the struts.
    rigid : (e, 2) float64
        Lengths of their ends that do not bend, mm.
    stiffness : (e, 4) float64
        Stiffness of the elements, as `bellcrank.mechanics.frames` defines it.
    held : (n, 3) bool
        Unknowns that supports and the drive prescribe, and all those of nodes without struts.
    drive : (n, 3) float64
        Prescribed displacements at the full stroke, mm.
    ramps : (n, 2) float64
        Fractions of the stroke between which nodes of the drive move.
    load : (G, n, 3) float64
        Full forces, N, those of one range together.
    load_range : (G, 2) float64
        Fractions of the stroke between which they grow.
    springs : (n, 2, 2) float64
        Stiffness of the springs from the nodes to the ground, N / mm.
    """

    positions: NDArray[np.float64]
    elements: NDArray[np.int64]
    struts: NDArray[np.int64]
    rigid: NDArray[np.float64]
    stiffness: NDArray[np.float64]
    held: NDArray[np.bool_]
    drive: NDArray[np.float64]
    ramps: NDArray[np.float64]
    load: NDArray[np.float64]
    load_range: NDArray[np.float64]
    springs: NDArray[np.float64]

    def load_at(self, fraction: float) -> NDArray[np.float64]:
        """Return (n, 3) the forces at a fraction of the stroke, N."""
        return np.tensordot(share_at(self.load_range, fraction), self.load, axes=1)

    @property
    def rest(self) -> NDArray[np.float64]:
        """Vectors from the first to the second end of each element at rest, (e, 2), mm."""
        return self.positions[self.elements[:, 1]] - self.positions[self.elements[:, 0]]

    @property
    def lines(self) -> NDArray[np.int64]:
        """Nodes along each strut, (s, k)."""
        chains = self.elements.reshape(len(self.struts), -1, 2)
        return np.concatenate([chains[:, :, 0], chains[:, -1:, 1]], axis=1)


def part_frame(part: Part, elements: int = 8, theory: str = "euler-bernoulli") -> PartFrame:
    """Divide each strut of a part into elements.

    Parameters
    ----------
    part
        Part to be analysed.
    elements
        Number of elements of each strut.
    theory
        Name in the registry of theories.

    Raises
    ------
    InvalidSettings
        If the number of elements is not positive.
    UnknownName
        If there is no such theory.
    """
    if elements < 1:
        raise InvalidSettings(f"elements: expected at least 1 in each strut, got {elements}")
    problem, material = part.design.problem, part.material
    struts = part.struts.astype(np.int64)
    positions, ends, rigid = subdivided(part.positions, struts, elements, part.joints)
    length = np.linalg.norm(positions[ends[:, 1]] - positions[ends[:, 0]], axis=1)
    ratio = np.repeat(part.width_ratios, elements)
    elasticity = Elasticity(material.young, material.poisson)
    drive, ramps = prescribed_motion(problem, len(positions), 3)
    load, load_range, _ = applied_forces(problem, len(positions), 3)
    absent = np.ones(len(positions), dtype=bool)
    absent[ends] = False
    there = ~absent[:, None]
    return PartFrame(
        positions=positions,
        elements=ends,
        struts=np.flatnonzero(part.design.mask),
        rigid=rigid,
        stiffness=beam_stiffness(part.section, elasticity, length, theory, 2, rigid, ratio),
        held=held_unknowns(problem, len(positions), 3) | ~there,
        drive=part.scale * drive * there,
        ramps=ramps,
        load=part.stiffness_unit * part.scale * load * there,
        load_range=load_range,
        springs=(part.stiffness_unit * spring_stiffness(problem, len(positions)))[:, :2, :2]
        * there[:, :, None],
    )


@dataclass(frozen=True, slots=True, eq=False)
class FrameState:
    """An equilibrium of a frame.

    Parameters
    ----------
    load
        Fraction of the full input, 0 to 1.
    displacement : (n, 3) float64
        Displacements of the nodes in x and y, mm, and their rotations, rad.
    reaction : (n, 3) float64
        Forces, N, and moments, N mm, on the held unknowns; 0 on the free ones.
    resultants : (e, 3) float64
        Axial force, N, and end moments, N mm, of each element.
    """

    load: float
    displacement: NDArray[np.float64]
    reaction: NDArray[np.float64]
    resultants: NDArray[np.float64]


class FrameEquations:
    """Equilibrium of a frame with large displacements; unknowns are the free displacements.

    Parameters
    ----------
    frame
        The frame.
    """

    def __init__(self, frame: PartFrame) -> None:
        self.frame = frame
        self.free = np.flatnonzero(~frame.held)
        self._rest = frame.rest
        self._length = np.linalg.norm(self._rest, axis=1)
        self._sprung = np.flatnonzero(frame.springs.any(axis=(1, 2)))
        unknowns = np.arange(frame.held.size).reshape(-1, 3)
        self._ends = unknowns[frame.elements].reshape(-1, 6)
        self._assembly = Assembly([self._ends, unknowns[self._sprung, :2]], self.free)

    @property
    def count(self) -> int:
        """Number of unknowns."""
        return len(self.free)

    @property
    def kinks(self) -> tuple[float, ...]:
        """Fractions within the stroke at which an input or a load starts or stops growing."""
        return kinks_of(np.concatenate([self.frame.ramps, self.frame.load_range]))

    def displacement(self, unknowns: NDArray[np.float64], load: float) -> NDArray[np.float64]:
        """Return (n, 3) the displacements of all nodes."""
        whole = share_at(self.frame.ramps, load)[:, None] * self.frame.drive
        whole.ravel()[self.free] = unknowns
        return whole

    def linearise(self, unknowns: NDArray[np.float64], load: float) -> Linearisation:
        """Linearise the equations; raises RuntimeError if the stiffness is singular."""
        displacement = self.displacement(unknowns, load)
        force, tangent = self._beams(displacement)
        residual = (self._sum(force, displacement) - self.frame.load_at(load)).ravel()[self.free]
        magnitude = float(np.abs(force[:, [0, 1, 3, 4]]).max())
        tolerance = self._residual_tolerance(displacement, magnitude)
        return Linearisation(residual, tolerance, self._factor(tangent))

    def load_derivative(
        self, unknowns: NDArray[np.float64], load: float, toward: float = 1.0
    ) -> NDArray[np.float64]:
        """Return (f,) the derivative of the residual with respect to the load."""
        _, tangent = self._beams(self.displacement(unknowns, load))
        drive = rate_at(self.frame.ramps, load, toward)[:, None] * self.frame.drive
        force = self._linear_force(tangent, drive)
        rates = rate_at(self.frame.load_range, load, toward)
        applied = np.tensordot(rates, self.frame.load, axes=1)
        return (self._sum(force, drive) - applied).ravel()[self.free]

    def distance(self, change: NDArray[np.float64]) -> float:
        """Return the largest component of a change of the displacements, mm."""
        return float(np.abs(change[self.free % 3 < 2]).max(initial=0.0))

    def complete(self, state: PathState) -> FrameState:
        """Return an equilibrium with the displacements and forces of all nodes and elements."""
        displacement = self.displacement(state.unknowns, state.load)
        force, _ = self._beams(displacement)
        moved = displacement[self.frame.elements, :2]
        return self._state(state.load, displacement, force, self._rest + moved[:, 1] - moved[:, 0])

    def solve_linear(self) -> FrameState:
        """Return the response to the full input for small displacements.

        Raises
        ------
        RuntimeError
            If the stiffness is singular.
        """
        _, tangent = self._beams(np.zeros_like(self.frame.drive))
        factor = self._factor(tangent)
        if not factor.nonsingular:
            raise RuntimeError("singular")
        displacement = self.frame.drive.copy()
        given = self._sum(self._linear_force(tangent, displacement), displacement)
        applied = self.frame.load_at(1.0)
        displacement.ravel()[self.free] = factor.solve((applied - given).ravel()[self.free])
        force = self._linear_force(tangent, displacement)
        return self._state(1.0, displacement, force, self._rest)

    def _state(
        self,
        load: float,
        displacement: NDArray[np.float64],
        force: NDArray[np.float64],
        chord: NDArray[np.float64],
    ) -> FrameState:
        """Return a state from the end forces (e, 6) of elements along their chords (e, 2)."""
        reaction = (self._sum(force, displacement) - self.frame.load_at(load)).ravel()
        reaction[self.free] = 0.0
        axial = (force[:, 3:5] * chord).sum(axis=1) / np.linalg.norm(chord, axis=1)
        resultants = np.column_stack([axial, force[:, 2], force[:, 5]])
        return FrameState(load, displacement, reaction.reshape(-1, 3), resultants)

    def _beams(
        self, displacement: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return (e, 6) the end forces and (e, 6, 6) the tangent stiffness of the elements."""
        from bellcrank.mechanics.frames.kernels.beams import plane_beams

        count = len(self._rest)
        force, tangent = np.empty((count, 6)), np.empty((count, 6, 6))
        plane_beams(
            self.frame.elements, self._rest, self.frame.stiffness, np.zeros((count, 3)),
            displacement, force, tangent,
        )  # fmt: skip
        return force, tangent

    def _linear_force(
        self, tangent: NDArray[np.float64], displacement: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return (e, 6) the changes of the end forces for small displacements (n, 3)."""
        force: NDArray[np.float64] = np.einsum(
            "eij,ej->ei", tangent, displacement.ravel()[self._ends]
        )
        return force

    def _sum(
        self, force: NDArray[np.float64], displacement: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return (n, 3) the sum of the forces of elements and springs at the nodes."""
        total: NDArray[np.float64] = np.zeros_like(displacement)
        ends, size = self._ends.ravel(), displacement.size
        total += np.bincount(ends, weights=force.ravel(), minlength=size).reshape(-1, 3)
        total[:, :2] += np.einsum("nij,nj->ni", self.frame.springs, displacement[:, :2])
        return total

    def _factor(self, tangent: NDArray[np.float64]) -> SparseFactor:
        """Return the factorised stiffness of the free unknowns."""
        return SparseFactor(self._assembly.matrix(tangent, self.frame.springs[self._sprung]))

    def _residual_tolerance(
        self, displacement: NDArray[np.float64], magnitude: float
    ) -> NDArray[np.float64]:
        """Return (f,) the admissible residual: forces in N, moments in N mm.

        It is a small fraction of the largest element force plus the error by rounding.
        Displacements have a relative rounding error, and angles of chords that error divided by
        the length and a constant one. The first matters in slender struts, the second in short
        elements and at short strokes.
        """
        stiffness, length = self.frame.stiffness, self._length
        moved = float(np.abs(displacement[:, :2]).max())
        bending = stiffness[:, 1] / length * (1.0 + moved / length)
        rounding = moved * float(stiffness[:, 0].max()) + float(bending.max())
        force = TOLERANCE * magnitude + ROUNDING * rounding
        return force * np.where(self.free % 3 == 2, float(length.max()), 1.0)
