"""What an analysis by finite elements says about a part, at whatever level."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from bellcrank.fem.path import PathStatus
from bellcrank.mechanics import efficiency_of

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from bellcrank.fem.contact import Contacts
    from bellcrank.fem.path import Loss
    from bellcrank.part.part import Part


@dataclass(frozen=True, slots=True, kw_only=True)
class StrokePoint:
    """An equilibrium along the stroke, in a few numbers.

    Parameters
    ----------
    load
        Part of the full input, 0 to 1.
    efficiency
        As the problem's objective defines it.
    output : (2,)
        Mean motion of the output nodes in x and y, mm.
    force : (2,)
        On all input nodes together, N.
    push
        On each input node along its direction, together, N: what is left where inputs push
        against each other.
    energy
        Elastic, N mm.
    stress
        The largest von Mises stress, MPa.
    strain
        The largest principal strain, 0.1 for 10 %.
    """

    load: float
    efficiency: float
    output: tuple[float, float]
    force: tuple[float, float]
    push: float
    energy: float
    stress: float
    strain: float

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain data, with units in the names."""
        return {
            "load": self.load,
            "efficiency": finite(self.efficiency),
            "mean_output_displacement_mm": [finite(value) for value in self.output],
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
    **inner: float,
) -> StrokePoint:
    """Return the figures of an equilibrium.

    Parameters
    ----------
    load
        Part of the full input, 0 to 1.
    motion : (N, 2)
        Of the lattice's nodes, mm; 0 where no strut is.
    forces : (i, 2)
        On each input node, N.
    **inner
        Energy, stress and strain.
    """
    problem = part.design.problem
    output, force = motion[problem.output.nodes].mean(axis=0), forces.sum(axis=0)
    return StrokePoint(
        load=load,
        efficiency=efficiency_of(problem, motion / part.scale, load=load),
        output=(float(output[0]), float(output[1])),
        force=(float(force[0]), float(force[1])),
        push=float((forces * problem.input.direction).sum()),
        **inner,
    )


@dataclass(frozen=True, slots=True, eq=False)
class Field:
    """A state of a part for pictures and files.

    Parameters
    ----------
    rest : (n, 2) or (n, 3)
        Positions of vertices at rest, mm.
    displacement : (n, 2) or (n, 3)
        mm.
    cells : (c, k) int64
        Two vertices each for the elements of a frame, three for triangles, four for tetrahedra.
    stress : (n,) or (c,)
        Von Mises, MPa: of each vertex, or of each element of a frame.
    """

    rest: NDArray[np.float64]
    displacement: NDArray[np.float64]
    cells: NDArray[np.int64]
    stress: NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Analysis:
    """What became of a part.

    Parameters
    ----------
    part
        The part.
    level
        Name in the registry of levels.
    theory
        Of its beams, or law of its material.
    linear
        Whether it was taken to move little.
    status
        `converged` if it is stable all along the stroke.
    loss
        How stability is lost, if it is.
    points
        Stable equilibria from rest to the full stroke, or to where they end.
    after
        Where it comes to rest at the full stroke after it has snapped, if that was found.
    contacts
        Struts that touch at the last of the points.
    field
        The last of the points.
    cost
        Seconds, unknowns, factorisations.
    """

    part: Part
    level: str
    theory: str
    linear: bool
    status: PathStatus
    loss: Loss | None
    points: list[StrokePoint]
    after: StrokePoint | None
    contacts: Contacts
    field: Field
    cost: dict[str, float] = dataclasses.field(default_factory=dict)

    @property
    def efficiency(self) -> float:
        """At the full stroke; nan if no stable path leads there."""
        return self.last.efficiency if self.status is PathStatus.CONVERGED else math.nan

    @property
    def last(self) -> StrokePoint:
        """The last stable equilibrium."""
        return self.points[-1]

    @property
    def warnings(self) -> list[str]:
        """What a builder should know, as sentences."""
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
                f"strains up to {self.last.strain:.0%} are beyond the {limit:.0%} that "
                f"{self.part.material.name} stands"
            )
        return found

    def to_dict(self) -> dict[str, Any]:
        """Return the analysis as plain data; what is not a result is null."""
        done = self.status is PathStatus.CONVERGED
        last = self.last.to_dict()
        reached = last.pop("load")
        return {
            "level": self.level,
            "theory": self.theory,
            "linear": self.linear,
            "status": self.status.value,
            "stable": done,
            "reached": reached,
            "loss_of_stability": self.loss.value if self.loss else None,
            **(last if done else dict.fromkeys(last)),
            "contacts": self.contacts.to_list(),
            "stroke": [point.to_dict() for point in self.points],
            "after_snap": self.after.to_dict() if self.after else None,
            "warnings": self.warnings,
            "cost": self.cost,
        }


def finite(value: float) -> float | None:
    """Return a number that JSON knows, or None."""
    return value if math.isfinite(value) else None
