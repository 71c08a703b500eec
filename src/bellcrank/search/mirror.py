"""Designs that equal their mirror images: beams that are flipped together."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bellcrank.model import Problem
    from bellcrank.storage import Proposals

POSITION_TOLERANCE = 1e-4
"""Tolerance on the position of a mirror image, in mean beam lengths."""
AXES = {"x": 0, "y": 1}


class MirrorGroups:
    """Groups of mirror images of designable beams, each represented by its lowest beam.

    Parameters
    ----------
    original
        The problem with all beams.
    axes
        ``"x"`` exchanges left and right, ``"y"`` top and bottom; none for groups of one beam.

    Raises
    ------
    ValueError
        If a beam has no designable image.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> groups = MirrorGroups(find_problem("scaling-8"), ["x"])
    >>> len(groups.members), len(groups.beams)
    (172, 88)
    """

    def __init__(self, original: Problem, axes: Sequence[str]) -> None:
        self.members = original.designable
        self._lowest = mirror_orbits(original, list(axes)) if axes else original.designable
        self.beams, self.group = np.unique(self._lowest, return_inverse=True)
        self.problem = original
        if axes:
            initial = self.with_images(original.initial)
            self.problem = replace(original, initial=initial, designable=self.beams)

    def expand(self, mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return the design that a mask represents: each beam as the lowest of its images."""
        design = np.asarray(mask, dtype=bool).copy()
        design[..., self.members] = design[..., self._lowest]
        return design

    def with_images(self, mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return a design with all mirror images of its beams."""
        design = mask.copy()
        chosen = np.unique(self._lowest[mask[self.members]])
        design[self.members] = np.isin(self._lowest, chosen)
        return design

    def expand_proposals(self, proposals: Proposals) -> Proposals:
        """Return recorded proposals with the designs that their masks represent."""
        if np.array_equal(self.members, self._lowest):
            return proposals
        count = self.problem.lattice.beam_count
        bits = np.unpackbits(proposals.mask, axis=1)[:, :count].astype(bool)
        return proposals._replace(mask=np.packbits(self.expand(bits), axis=1))

    def total(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (g, ...) the sums over each group of values (D, ...) of the members."""
        out = np.zeros((len(self.beams), *values.shape[1:]))
        np.add.at(out, self.group, values)
        return out

    def largest(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (g,) the largest of values (D,) of the members, at least 0."""
        out = np.zeros(len(self.beams))
        np.maximum.at(out, self.group, values)
        return out


def mirror_images(problem: Problem, axis: str) -> NDArray[np.int64]:
    """Return (D,) the index into the designable beams of the mirror image of each.

    ``x`` exchanges left and right, ``y`` up and down, about the centre of the designable beams.

    Raises
    ------
    ValueError
        If the lattice is in space, or a beam has no designable image.
    """
    from scipy.spatial import cKDTree

    lattice, beams = problem.lattice, problem.designable
    if lattice.dimension != 2:
        raise ValueError(f"problem {problem.name!r} is in space; expected one in the plane")
    column = AXES[axis]
    ends = lattice.positions[lattice.beams[beams]]
    nodes = ends.reshape(-1, 2)
    image = ends.copy()
    image[..., column] = nodes[:, column].min() + nodes[:, column].max() - ends[..., column]
    tolerance = POSITION_TOLERANCE * float(np.mean(lattice.rest_length))
    distance, partner = cKDTree(_coordinates(ends)).query(_coordinates(image))
    unmatched = np.flatnonzero(np.asarray(distance) > tolerance)
    if len(unmatched):
        raise ValueError(
            f"problem {problem.name!r} is not symmetric in {axis}: {len(unmatched)} of "
            f"{len(beams)} designable beams have no designable mirror image, the first is "
            f"{beams[unmatched[0]]}"
        )
    found: NDArray[np.int64] = np.asarray(partner, dtype=np.int64)
    return found


def _coordinates(ends: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (n, 5) coordinates of beams that do not depend on the order of their ends."""
    along = ends[:, 1] - ends[:, 0]
    rise = np.sign(along[:, :1] * along[:, 1:].round(6)) * np.abs(along).min(axis=1)[:, None]
    coordinates: NDArray[np.float64] = np.hstack([ends.mean(axis=1), np.abs(along), rise])
    return coordinates


def mirror_orbits(problem: Problem, axes: list[str]) -> NDArray[np.int64]:
    """Return (D,) the lowest beam among the mirror images of each designable beam.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> problem = find_problem("scaling-8")
    >>> len(problem.designable), len(set(mirror_orbits(problem, ["x"])))
    (172, 88)
    """
    lowest = np.arange(len(problem.designable))
    images = [mirror_images(problem, axis) for axis in axes]
    for _ in range(2):
        for image in images:
            lowest = np.minimum(lowest, lowest[image])
    orbits: NDArray[np.int64] = problem.designable[lowest]
    return orbits
