"""New designs from those of a population: perturbation and recombination."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.model import Problem
    from bellcrank.search.hopping.settings import HoppingSettings


def designable_midpoints(problem: Problem) -> NDArray[np.float64]:
    """Return the midpoints of the designable beams."""
    lattice = problem.lattice
    midpoints: NDArray[np.float64] = lattice.positions[lattice.beams[problem.designable]].mean(
        axis=1
    )
    return midpoints


def perturb(
    problem: Problem, mask: NDArray[np.bool_], settings: HoppingSettings, rng: np.random.Generator
) -> NDArray[np.bool_]:
    """Redraw the designable beams of a disc at random, until the design differs.

    The disc is centred at the midpoint of a random designable beam, and the midpoints of the
    beams lie in it. Its radius is between a half and one and a half times the mean radius.
    """
    middle = designable_midpoints(problem)
    length = float(np.mean(problem.lattice.rest_length))
    while True:
        centre = middle[int(rng.integers(len(middle)))]
        radius = settings.radius * length * rng.uniform(0.5, 1.5)
        inside = problem.designable[np.linalg.norm(middle - centre, axis=1) < radius]
        perturbed = mask.copy()
        perturbed[inside] = rng.random(len(inside)) < rng.uniform(settings.min_density, 1.0)
        if (perturbed != mask).any():
            return perturbed


def recombine(
    problem: Problem,
    mask: NDArray[np.bool_],
    other: NDArray[np.bool_],
    rng: np.random.Generator,
) -> NDArray[np.bool_]:
    """Copy the designable beams of a disc from another design that differs from this one.

    The disc is centred at the midpoint of a random beam in which the designs differ, and contains
    between a tenth and a half of the designable beams.
    """
    middle = designable_midpoints(problem)
    differs = np.flatnonzero(mask[problem.designable] != other[problem.designable])
    centre = middle[differs[int(rng.integers(len(differs)))]]
    order = np.argsort(np.linalg.norm(middle - centre, axis=1), kind="stable")
    inside = problem.designable[order[: max(1, round(rng.uniform(0.1, 0.5) * len(order)))]]
    child = mask.copy()
    child[inside] = other[inside]
    return child
