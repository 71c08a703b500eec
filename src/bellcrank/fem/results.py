"""Results of an analysis by finite elements, the same at every level."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.fem.path import PathStatus
from bellcrank.mechanics import efficiency_of
from bellcrank.mechanics.output import output_motion

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from bellcrank.fem.contact import Contacts
    from bellcrank.fem.path import StabilityLoss
    from bellcrank.part.part import Part


@dataclass(frozen=True, slots=True, kw_only=True)
class StrokePoint:
    """Figures of one equilibrium along the stroke.

    Parameters
    ----------
    load
        Fraction of the full input, 0 to 1.
    efficiency
        Efficiency by the problem's objective.
    output : (d,)
        Mean displacement of the output nodes, mm.
    off_axis
        Off-axis motion of the output as a part of its motion; nan without motion.
    rotation
        Size of the rotation of the output, degrees.
    force : (d,)
        Total force on the input nodes, N.
    push
        Sum over the input nodes of the force along the node's input direction, N. It differs from
        the total force if the input nodes move in opposite directions.
    energy
        Elastic energy, N mm.
    stress
        Largest von Mises stress, MPa.
    strain
        Largest principal strain.
    """

    load: float
    efficiency: float
    output: tuple[float, ...]
    off_axis: float
    rotation: float
    force: tuple[float, ...]
    push: float
    energy: float
    stress: float
    strain: float

    def to_dict(self) -> dict[str, Any]:
        """Return plain data with units in the keys."""
        return {
            "load": self.load,
            "efficiency": finite(self.efficiency),
            "mean_output_displacement_mm": [finite(value) for value in self.output],
            "off_axis": finite(self.off_axis),
            "output_rotation_deg": finite(self.rotation),
            "input_force_N": [finite(value) for value in self.force],
            "input_push_N": finite(self.push),
            "energy_N_mm": finite(self.energy),
            "von_mises_MPa": finite(self.stress),
            "principal_strain": finite(self.strain),
        }


def stroke_point(
    part: Part,
    load: float,
    motion: NDArray[np.float64],
    forces: NDArray[np.float64],
    rotation: ArrayLike,
    **figures: float,
) -> StrokePoint:
    """Return the figures of an equilibrium.

    Parameters
    ----------
    part
        Part that is analysed.
    load
        Fraction of the full input, 0 to 1.
    motion : (N, d) float64
        Displacements of the lattice nodes, mm; 0 for nodes without struts.
    forces : (i, d) float64
        Forces on the input nodes, N.
    rotation : () or (3,)
        Rotation of the output: angle in the plane, rotation vector in space, degrees.
    **figures
        Energy, stress and strain.
    """
    problem = part.design.problem
    output, force = motion[problem.output.nodes].mean(axis=0), forces.sum(axis=0)
    return StrokePoint(
        load=load,
        efficiency=efficiency_of(problem, motion / part.scale, load=load),
        output=tuple(output.tolist()),
        off_axis=output_motion(problem, motion).off_axis,
        rotation=float(np.linalg.norm(rotation)),
        force=tuple(force.tolist()),
        push=float((forces * problem.input.direction).sum()),
        **figures,
    )


@dataclass(frozen=True, slots=True, eq=False)
class Field:
    """A state of a part for pictures and files.

    Parameters
    ----------
    rest : (n, 2) or (n, 3) float64
        Positions of the vertices at rest, mm.
    displacement : (n, 2) or (n, 3) float64
        Displacements of the vertices, mm.
    cells : (c, k) int64
        Vertices of the cells: two for beam elements, three for triangles, four for tetrahedra.
    stress : (n,) or (c,) float64
        Von Mises stress of each vertex, or of each beam element, MPa.
    """

    rest: NDArray[np.float64]
    displacement: NDArray[np.float64]
    cells: NDArray[np.int64]
    stress: NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Analysis:
    """Result of one analysis of a part.

    Parameters
    ----------
    part
        Part that was analysed.
    level
        Name in the registry of levels.
    theory
        Beam theory, or material law.
    linear
        Whether displacements were assumed to be small.
    status
        How the equilibrium path ends; `converged` if it is stable along the whole stroke.
    loss
        Kind of the loss of stability, if stability is lost.
    points
        Stable equilibria from rest to the full stroke or to the loss of stability.
    contacts
        Struts that touch in any of the points.
    field
        State at the last point.
    cost
        Seconds, unknowns, factorisations.
    """

    part: Part
    level: str
    theory: str
    linear: bool
    status: PathStatus
    loss: StabilityLoss | None
    points: list[StrokePoint]
    contacts: Contacts
    field: Field
    cost: dict[str, float] = dataclasses.field(default_factory=dict)

    @property
    def efficiency(self) -> float:
        """Efficiency at the full stroke; nan if no stable path leads there."""
        return self.last.efficiency if self.status is PathStatus.CONVERGED else math.nan

    @property
    def last(self) -> StrokePoint:
        """The last stable equilibrium."""
        return self.points[-1]

    @property
    def warnings(self) -> list[str]:
        """Defects of the part that a builder should know of, as sentences."""
        found = []
        if self.loss is not None:
            found.append(
                f"stability is lost at {self.last.load:.1%} of the stroke ({self.loss.value})"
            )
        elif self.status is not PathStatus.CONVERGED:
            found.append(f"{self.status.message} ({self.last.load:.1%} of the stroke reached)")
        if len(self.contacts.pairs):
            found.append(self.contacts.message)
        limit = self.part.material.strain_limit
        if self.last.strain > limit:
            found.append(
                f"the largest strain, {self.last.strain:.0%}, exceeds the limit of "
                f"{self.part.material.name}, {limit:.0%}"
            )
        return found

    def to_dict(self) -> dict[str, Any]:
        """Return the analysis as plain data; figures without a value are None."""
        converged = self.status is PathStatus.CONVERGED
        last = self.last.to_dict()
        reached = last.pop("load")
        return {
            "level": self.level,
            "theory": self.theory,
            "linear": self.linear,
            "status": self.status.value,
            "stable": converged,
            "reached": reached,
            "loss_of_stability": self.loss.value if self.loss else None,
            **(last if converged else dict.fromkeys(last)),
            "contacts": self.contacts.to_list(),
            "stroke": [point.to_dict() for point in self.points],
            "warnings": self.warnings,
            "cost": self.cost,
        }


def finite(value: float) -> float | None:
    """Return a finite number unchanged, and None instead of infinity or nan."""
    return float(value) if math.isfinite(value) else None
