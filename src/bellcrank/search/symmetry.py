"""Symmetric designs: beams that are flipped together."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.model.specification import FOLDS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bellcrank.model import Problem
    from bellcrank.storage import Proposals

SAME_POSITION = 1e-4
"""Tolerance on the position of an image, in mean beam lengths."""
AXES = {"x": 0, "y": 1, "z": 2}


class SymmetryGroups:
    """Groups of images of designable beams, each represented by its lowest beam.

    Parameters
    ----------
    original
        The problem with all beams.
    symmetry
        As in `bellcrank.model.Specification`; none for groups of one beam.

    Raises
    ------
    ValueError
        If a beam has no designable image.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> groups = SymmetryGroups(find_problem("scaling-8"), ["x"])
    >>> len(groups.members), len(groups.beams)
    (172, 88)
    """

    def __init__(self, original: Problem, symmetry: Sequence[str]) -> None:
        self.members = original.designable
        self._lowest = beam_orbits(original, symmetry)
        self.beams, self.group = np.unique(self._lowest, return_inverse=True)
        self.problem = original
        if symmetry:
            initial = self.with_images(original.initial)
            self.problem = replace(original, initial=initial, designable=self.beams)

    def expand(self, mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return the design that a mask represents: each beam as the lowest of its images."""
        design = np.asarray(mask, dtype=bool).copy()
        design[..., self.members] = design[..., self._lowest]
        return design

    def with_images(self, mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return a design with all images of its beams."""
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


def operation(problem: Problem, name: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the matrix (d, d) and the fixed point (d,) of a symmetry.

    The fixed point of a rotation is the mean position of the nodes of designable beams, that of a
    mirror symmetry is halfway between the outermost ones.

    Parameters
    ----------
    problem
        Problem whose designs are symmetric.
    name
        One of the names of `bellcrank.model.Specification.symmetry`.

    Raises
    ------
    ValueError
        If the lattice is in the plane, and the symmetry in space.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> matrix, _ = operation(find_problem("scaling-8"), "x")
    >>> matrix.tolist()
    [[-1.0, 0.0], [0.0, 1.0]]
    """
    lattice = problem.lattice
    matrix = np.eye(lattice.dimension)
    if lattice.dimension == 2 and name not in {"x", "y"}:
        raise ValueError(
            f"problem {problem.name!r} is in the plane; expected symmetry 'x' or 'y', got {name!r}"
        )
    if name in AXES:
        matrix[AXES[name], AXES[name]] = -1.0
    else:
        angle = 2.0 * math.pi / FOLDS[name]
        cosine, sine = math.cos(angle), math.sin(angle)
        matrix[:2, :2] = [[cosine, -sine], [sine, cosine]]
    nodes = lattice.positions[np.unique(lattice.beams[problem.designable])]
    centre = 0.5 * (nodes.min(axis=0) + nodes.max(axis=0)) if name in AXES else nodes.mean(axis=0)
    return matrix, np.asarray(centre)


def node_images(problem: Problem, name: str) -> NDArray[np.int64]:
    """Return (N,) the image of each node by a symmetry, -1 for nodes without one.

    Parameters, errors and the fixed point are those of `operation`.
    """
    from scipy.spatial import cKDTree

    matrix, centre = operation(problem, name)
    positions = problem.lattice.positions
    moved = (positions - centre) @ matrix.T + centre
    distance, partner = cKDTree(positions).query(moved)
    tolerance = SAME_POSITION * float(np.mean(problem.lattice.rest_length))
    images: NDArray[np.int64] = np.where(np.asarray(distance) < tolerance, partner, -1)
    return images


def beam_images(problem: Problem, name: str) -> NDArray[np.int64]:
    """Return (D,) the index into the designable beams of the image of each.

    Parameters and the fixed point are those of `operation`.

    Raises
    ------
    ValueError
        If the lattice does not have this symmetry: a beam has no designable image, or the lattice
        is in the plane, and the symmetry in space.
    """
    beams = problem.designable
    images = node_images(problem, name)
    ends = problem.lattice.beams[beams]
    numbers = {tuple(sorted(pair)): k for k, pair in enumerate(ends.tolist())}
    found = [numbers.get(tuple(sorted(pair)), -1) for pair in images[ends].tolist()]
    partner: NDArray[np.int64] = np.array(found, dtype=np.int64)
    unmatched = np.flatnonzero(partner < 0)
    if len(unmatched):
        raise ValueError(
            f"problem {problem.name!r} is not symmetric in {name}: {len(unmatched)} of "
            f"{len(beams)} designable beams have no designable image, the first is "
            f"{beams[unmatched[0]]}"
        )
    return partner


def beam_orbits(problem: Problem, symmetry: Sequence[str]) -> NDArray[np.int64]:
    """Return (D,) the lowest beam among the images of each designable beam.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> problem = find_problem("scaling-8")
    >>> len(problem.designable), len(set(beam_orbits(problem, ["x"])))
    (172, 88)
    """
    images = [beam_images(problem, name) for name in symmetry]
    lowest = np.arange(len(problem.designable))
    while True:
        before = lowest
        for image in images:
            lowest = np.minimum(lowest, lowest[image])
        if np.array_equal(lowest, before):
            return np.asarray(problem.designable[lowest])
