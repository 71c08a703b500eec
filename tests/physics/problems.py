"""Small problems built by hand, and designs to try on them."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.model import Input, Lattice, Output, Problem, Supports, lattices

if TYPE_CHECKING:
    from numpy.typing import NDArray


def frame(
    positions: list[tuple[float, float]],
    beams: list[tuple[int, int]],
    *,
    fixed: list[int],
    drive: tuple[int, tuple[float, float], float],
    watch: tuple[int, tuple[float, float]],
    force: bool = False,
    spring: float | None = None,
    spring_kind: str | None = None,
    fixed_x: list[int] = (),
    fixed_y: list[int] = (),
) -> Problem:
    """A problem of a few nodes with one driven and one watched node."""
    node, towards, amount = drive
    return Problem(
        name="frame",
        lattice=Lattice(positions, beams),
        supports=Supports(fixed=fixed, fixed_x=list(fixed_x), fixed_y=list(fixed_y)),
        input=Input([node], towards, "force" if force else "displacement", amount),
        output=Output([watch[0]], watch[1], spring, spring_kind),
        designable=np.arange(len(beams)),
    )


def arm_on(**supports: list[int]) -> Problem:
    """A horizontal chain of three beams, its right end pulled upwards by a force."""
    return frame(
        [(0, 0), (1, 0), (2, 0), (3, 0)],
        [(0, 1), (1, 2), (2, 3)],
        drive=(3, (0.0, 1.0), 1e-3),
        watch=(2, (0.0, 1.0)),
        force=True,
        **{"fixed": [], **supports},
    )


def patch(*, force: bool = False, kind: str = "directional") -> Problem:
    """A triangular patch of 18 nodes on four supports, pushed on the right, watched on the left."""
    lattice = lattices["triangular-rows"](counts=[4, 5, 4, 5], first_x=[0.5, 0.0, 0.5, 0.0])
    problem = Problem(
        name="patch",
        lattice=lattice,
        supports=Supports(fixed=[0, 1, 2, 3]),
        input=Input([17], [0.0, -1.0], "displacement", 0.2),
        output=Output([13], [-1.0, 0.0]),
    )
    if not force:
        return problem
    return replace(
        problem,
        input=Input([17], [0.0, -1.0], "force", 0.05),
        output=Output([13], [-1.0, 0.0], 2.0, kind),
    )


def random_masks(
    problem: Problem, share: float, count: int, seed: int = 0
) -> list[NDArray[np.bool_]]:
    """Designs with each designable beam present with probability `share`."""
    rng = np.random.default_rng(seed)
    masks = []
    for _ in range(count):
        mask = problem.initial.copy()
        mask[problem.designable] = rng.random(len(problem.designable)) < share
        masks.append(mask)
    return masks


def with_lattice(problem: Problem, positions: NDArray[np.float64], turn: NDArray[np.float64]):
    """The same problem at other `positions`, its directions turned by the matrix `turn`."""
    return replace(
        problem,
        lattice=Lattice(positions, problem.lattice.beams),
        input=replace(problem.input, direction=problem.input.direction @ turn.T),
        output=replace(problem.output, direction=problem.output.direction @ turn.T),
    )
