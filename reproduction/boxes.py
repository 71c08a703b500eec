"""Standard tasks of compliant-mechanism design on a box with a lattice.

The force inverter and the gripper are standard examples of topology optimisation (Bendsoe and
Sigmund, Topology Optimization, 2003, chapter 2). The input is in the middle of the left side and
moves to the right; the two left corners are fixed. The output of the inverter is in the middle of
the right side and moves to the left; the outputs of the gripper are two jaws beside a gap, which
close. The lift is not such a standard: its output is that of the inverter and moves up.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.mechanics import FrameEvaluator, Status
from bellcrank.model import Input, Output, Problem, Supports, lattices
from bellcrank.part import PartSpec, frame_problem
from bellcrank.search.symmetry import beam_images

if TYPE_CHECKING:
    from numpy.typing import NDArray

TASKS = ("inverter", "gripper", "lift")
STARTING_SHARE = 0.9
"""Probability with which `stable_start` keeps a beam."""
GAP = 2.0
"""Depth of the gap of the gripper, lattice units; it extends one row to each side."""


@dataclass(frozen=True, slots=True)
class Box:
    """A task on a box.

    Parameters
    ----------
    problem
        Problem on a lattice, as a frame of the struts.
    spec
        Size and material of all designs.
    low, high : (2,) mm
        Corners of the box, including half the strut width.
    void : (2, 2) mm or None
        Corners of the region that must remain empty.
    """

    problem: Problem
    spec: PartSpec
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    void: NDArray[np.float64] | None

    @property
    def positions(self) -> NDArray[np.float64]:
        """(N, 2) positions of the nodes, mm."""
        return self.problem.lattice.positions * self.spec.scale


def box_of(
    name: str, columns: int, rows: int, stroke: float, spring: float | None, width: float = 2.0
) -> Box:
    """Return a task.

    Parameters
    ----------
    name
        ``"inverter"``, ``"gripper"`` or ``"lift"``.
    columns, rows
        Nodes per row, and number of rows: 4 k + 3, so that the middle row reaches both sides.
    stroke
        Input displacement, lattice units.
    spring
        Stiffness of the spring at the output, units of the discrete model: a strut has 10. None
        for a free output.
    width
        Strut width, mm.
    """
    lattice = lattices["triangular-rectangle"](columns=columns, rows=rows)
    spec = PartSpec(width=width)
    positions = lattice.positions
    middle = 0.5 * float(positions[:, 1].max())
    top, right = float(positions[:, 1].max()), float(positions[:, 0].max())

    def nearest(*points: tuple[float, float]) -> NDArray[np.int64]:
        return np.array([int(np.argmin(np.hypot(*(positions - point).T))) for point in points])

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
    if name != "gripper":
        outputs = nearest((right, middle))
        direction = np.array([[-1.0, 0.0] if name == "inverter" else [0.0, 1.0]])
    else:
        outputs = nearest((right - 0.5, middle + rise), (right - 0.5, middle - rise))
        direction = np.array([[0.0, -1.0], [0.0, 1.0]])
        centre = positions[lattice.beams].mean(axis=1)
        inside = (np.abs(centre[:, 1] - middle) < rise - 1e-6) & (centre[:, 0] > right - GAP)
        initial &= ~inside
        half = rise - 0.5 * spec.width / spec.scale
        void = spec.scale * np.array([[right - GAP, middle - half], [right + 1.0, middle + half]])
    output = Output(
        nodes=outputs,
        direction=direction,
        spring=spring,
        spring_kind=None if spring is None else "directional",
    )
    problem = Problem(
        name=name,
        lattice=lattice,
        supports=Supports(fixed=fixed),
        input=drive,
        output=output,
        initial=initial,
    )
    free = np.intersect1d(problem.designable, np.flatnonzero(initial))
    problem = stable_start(frame_problem(replace(problem, designable=free), spec))
    reach = 0.5 * spec.width
    size = spec.scale * np.array([right, top])
    return Box(problem, spec, np.full(2, -reach), size + reach, void)


def stable_start(problem: Problem) -> Problem:
    """Return the problem with a stable initial design, symmetric about the horizontal middle.

    Thin struts of a full lattice buckle in front of the input. Then one designable beam in ten is
    left out at random, with its mirror image, until the design is stable.
    """
    evaluator = FrameEvaluator(problem)
    images, rng = beam_images(problem, "y"), np.random.default_rng(0)
    initial = problem.initial.copy()
    while evaluator.evaluate(initial).status is not Status.CONVERGED:
        present = rng.random(len(problem.designable)) < STARTING_SHARE
        initial[problem.designable] = present & present[images]
    return replace(problem, initial=initial)
