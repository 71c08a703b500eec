"""Mirror symmetry: beams that are mirror images of each other are present or absent together."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bellcrank.search.goals.terms import Kind, Term
from bellcrank.search.goals.terms import terms as registry

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.model import Problem

TOLERANCE = 1e-4
"""Of a node's mirror image, in mean beam lengths."""
AXES = {"x": 0, "y": 1}


def read_axis(rest: str) -> str:
    """Read ``x`` or ``y``."""
    if rest not in AXES:
        raise ValueError(rest)
    return rest


def mirror_images(problem: Problem, axis: str) -> NDArray[np.int64]:
    """Return (D,) the index into the designable beams of each one's mirror image.

    ``x`` exchanges left and right, ``y`` up and down, about the middle of the designable beams.

    Raises
    ------
    ValueError
        If one has no designable image.
    """
    from scipy.spatial import cKDTree

    lattice, beams = problem.lattice, problem.designable
    column = AXES[axis]
    ends = lattice.positions[lattice.beams[beams]]
    nodes = ends.reshape(-1, 2)
    image = ends.copy()
    image[..., column] = nodes[:, column].min() + nodes[:, column].max() - ends[..., column]
    tolerance = TOLERANCE * float(np.mean(lattice.rest_length))
    distance, partner = cKDTree(_looks(ends)).query(_looks(image))
    lonely = np.flatnonzero(np.asarray(distance) > tolerance)
    if len(lonely):
        raise ValueError(
            f"problem {problem.name!r} is not symmetric in {axis}: {len(lonely)} of {len(beams)} "
            f"designable beams have no designable mirror image, the first is {beams[lonely[0]]}"
        )
    found: NDArray[np.int64] = np.asarray(partner, dtype=np.int64)
    return found


def _looks(ends: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n, 5) where beams lie, whichever end comes first."""
    along = ends[:, 1] - ends[:, 0]
    rise = np.sign(along[:, :1] * along[:, 1:].round(6)) * np.abs(along).min(axis=1)[:, None]
    looks: NDArray[np.float64] = np.hstack([ends.mean(axis=1), np.abs(along), rise])
    return looks


def mirror(problem: Problem, axis: str) -> Term:
    """Designable beams and their mirror images are alike."""
    images = mirror_images(problem, axis)

    def of_beams(mask: NDArray[np.bool_], _core: NDArray[np.bool_]) -> float:
        present = mask[problem.designable]
        return float(np.mean(present != present[images]))

    return Term(of_beams=of_beams)


def orbits_of(problem: Problem, axes: list[str]) -> NDArray[np.int64]:
    """Return (D,) the lowest beam among the mirror images of each designable beam.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> problem = find_problem("scaling-8")
    >>> len(problem.designable), len(set(orbits_of(problem, ["x"])))
    (172, 88)
    """
    lowest = np.arange(len(problem.designable))
    images = [mirror_images(problem, axis) for axis in axes]
    for _ in range(2):
        for image in images:
            lowest = np.minimum(lowest, lowest[image])
    orbits: NDArray[np.int64] = problem.designable[lowest]
    return orbits


registry.register("mirror")(Kind("'mirror x' or 'mirror y'", read_axis, mirror))
