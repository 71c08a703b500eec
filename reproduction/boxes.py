"""Two classical tasks of compliant-mechanism design, on a box with a lattice in it.

The force inverter and the gripper are the examples by which topology optimisation of compliant
mechanisms is taught (Bendsoe and Sigmund, Topology Optimization, 2003, chapter 2). Input at the
middle of the left side, pushed to the right; held at the two left corners. The inverter's output
is the middle of the right side, which shall move to the left; the gripper's are two jaws beside a
gap there, which shall close.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.model import Input, Output, Problem, Supports, lattices
from bellcrank.part import PartSpec, calibrated

if TYPE_CHECKING:
    from numpy.typing import NDArray

TASKS = ("inverter", "gripper")
GAP = 2.0
"""Depth of the gripper's gap, in lattice units; it is one row high to each side."""


@dataclass(frozen=True, slots=True)
class Box:
    """A task.

    Parameters
    ----------
    problem
        On a lattice, with springs that stand for the struts.
    spec
        Size and material, for all designs.
    low, high : (2,) mm
        Corners of the box: as far as struts reach.
    void : (2, 2) mm or None
        Corners of what must stay empty.
    """

    problem: Problem
    spec: PartSpec
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    void: NDArray[np.float64] | None

    @property
    def positions(self) -> NDArray[np.float64]:
        """(N, 2) nodes, mm."""
        return self.problem.lattice.positions * self.spec.scale


def box_of(
    name: str, columns: int, rows: int, stroke: float, spring: float, width: float = 2.0
) -> Box:
    """Return a task.

    Parameters
    ----------
    name
        ``"inverter"`` or ``"gripper"``.
    columns, rows
        Nodes across, and rows up: 4 k + 3, so that the middle one reaches the sides.
    stroke
        Of the input, lattice units.
    spring
        Against the output, in units of the discrete model.
    width
        Of the struts, mm.
    """
    lattice = lattices["triangular-rectangle"](columns=columns, rows=rows)
    spec = PartSpec(width=width)
    places = lattice.positions
    middle = 0.5 * float(places[:, 1].max())
    top, right = float(places[:, 1].max()), float(places[:, 0].max())

    def nearest(*points: tuple[float, float]) -> NDArray[np.int64]:
        return np.array([int(np.argmin(np.hypot(*(places - point).T))) for point in points])

    fixed = nearest((0.5, 0.0), (1.5, 0.0), (0.5, top), (1.5, top))
    drive = Input(
        nodes=nearest((0.0, middle)),
        direction=np.array([1.0, 0.0]),
        drive="displacement",
        amount=stroke,
    )
    rise = math.sqrt(3.0) / 2.0
    initial = np.ones(lattice.beam_count, dtype=bool)
    void = None
    if name == "inverter":
        watched, direction = nearest((right, middle)), np.array([[-1.0, 0.0]])
    else:
        watched = nearest((right - 0.5, middle + rise), (right - 0.5, middle - rise))
        direction = np.array([[0.0, -1.0], [0.0, 1.0]])
        centre = places[lattice.beams].mean(axis=1)
        inside = (np.abs(centre[:, 1] - middle) < rise - 1e-6) & (centre[:, 0] > right - GAP)
        initial &= ~inside
        half = rise - 0.5 * spec.width / spec.scale
        void = spec.scale * np.array([[right - GAP, middle - half], [right + 1.0, middle + half]])
    output = Output(nodes=watched, direction=direction, spring=spring, spring_kind="directional")
    problem = Problem(
        name=name,
        lattice=lattice,
        supports=Supports(fixed=fixed),
        input=drive,
        output=output,
        initial=initial,
    )
    free = np.intersect1d(problem.designable, np.flatnonzero(initial))
    problem = calibrated(replace(problem, designable=free), spec.width, spec.scale)
    reach = 0.5 * spec.width
    size = spec.scale * np.array([right, top])
    return Box(problem, spec, np.full(2, -reach), size + reach, void)
