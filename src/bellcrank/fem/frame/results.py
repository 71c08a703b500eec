"""What a frame analysis says about a part."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.fem.frame.elements import natural
from bellcrank.mechanics.objectives import objective_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.fem.frame.mesh import FrameMesh
    from bellcrank.fem.frame.path import FrameState
    from bellcrank.fem.part import Part


def efficiency_of(part: Part, moved: NDArray[np.float64], name: str | None = None) -> float:
    """Return the efficiency of a motion of the lattice's nodes, (N, 2) in mm.

    Nodes without struts do not move.
    """
    problem = part.design.problem
    objective = objective_of(problem, name)
    motion = moved / part.scale
    wanted = problem.output.direction
    there = motion[problem.output.nodes]
    size = np.hypot(there[:, 0], there[:, 1])
    cosine = np.divide(
        (there * wanted).sum(axis=1), size, out=np.zeros_like(size), where=size > 0.0
    )
    half = np.sqrt(np.clip(0.5 * (1.0 + cosine), 0.0, 1.0))
    numerator = objective.numerator_scale * float(
        (size * (2.0 * half**objective.exponent - 1.0)).sum()
    )
    denominator = objective.denominator
    if denominator is None:
        given = problem.input
        along = (motion[given.nodes] * given.direction).sum()
        denominator = objective.denominator_scale * float(along)
    return numerator / denominator if denominator else float("nan")


def motion_of(mesh: FrameMesh, state: FrameState) -> NDArray[np.float64]:
    """Return (N, 2) the motion of the lattice's nodes, mm; 0 where no strut is."""
    moved = np.zeros((len(mesh.node), 2))
    there = mesh.node >= 0
    moved[there] = state.displacement[mesh.node[there], :2]
    return moved


@dataclass(frozen=True, slots=True, eq=False)
class Fibres:
    """The most strained fibres of the elements.

    Parameters
    ----------
    strain : (e,)
        Largest magnitude in each element: elongation and bending together.
    stress : (e,)
        The same in MPa; uniaxial, so the von Mises stress as well.
    """

    strain: NDArray[np.float64]
    stress: NDArray[np.float64]


def fibres_of(part: Part, mesh: FrameMesh, state: FrameState) -> Fibres:
    """Return strain and stress of the outermost fibres, at the worse end of each element."""
    strain, _, _ = natural(mesh, state.displacement)
    inner = np.einsum("eij,ej->ei", mesh.stiffness, strain)
    moment = np.abs(inner[:, 1:]).max(axis=1)
    section, young = part.section, part.material.young
    bent = moment * section.width / (2.0 * young * section.inertia)
    total = np.abs(strain[:, 0]) / mesh.length + bent
    return Fibres(total, young * total)
