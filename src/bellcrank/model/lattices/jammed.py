"""Disordered lattices: contact networks of jammed soft discs.

Discs of two sizes are placed at random in a periodic box and relaxed until all forces balance. A
beam connects the centres of two discs in contact. Two sizes are used because discs of one size
crystallise.

A seed gives the same packing on every machine: the relaxation uses only operations that IEEE
arithmetic defines to the last bit (sums over all discs by `math.fsum`). Other rounding errors
would lead the many-body dynamics to another packing.

References
----------
O'Hern, Silbert, Liu, Nagel, "Jamming at zero temperature and zero applied
stress", Phys. Rev. E 68, 011306 (2003): harmonic repulsion, two sizes 1 : 1.4.
Bitzek, Koskinen, Gaehler, Moseler, Gumbsch, "Structural relaxation made
simple", Phys. Rev. Lett. 97, 170201 (2006): the FIRE minimiser.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidProblem
from bellcrank.model.lattice import Lattice, check_node_count
from bellcrank.model.lattices.registry import lattices

if TYPE_CHECKING:
    from numpy.typing import NDArray

SIZE_RATIO = 1.4
FORCE_TOLERANCE = 1e-9  # relative to the force between two completely overlapping discs
MAX_STEPS = 20_000
SKIN = 0.3  # distance beyond contact, in mean diameters, up to which pairs are listed


@lattices.register("jammed-discs")
def jammed_discs(
    discs: int, *, rng: np.random.Generator, packing_fraction: float = 0.88
) -> Lattice:
    """Return the contact network of jammed soft discs of two sizes.

    Contacts across the edges of the periodic box are left out, and discs with fewer than two
    contacts are removed. Nodes are numbered from the bottom. The mean beam length is 1 and the
    lower left corner is (0, 0).

    Parameters
    ----------
    discs
        Number of discs, at least 20. A few of them are removed from the network.
    rng
        Source of the initial positions.
    packing_fraction
        Area of the discs divided by the area of the box, from 0.85 (jamming begins at about
        0.842) to 1.0.

    Raises
    ------
    InvalidProblem
        If the number of discs or the fraction is outside its bounds, or the relaxation does not
        converge.

    Examples
    --------
    >>> lattice = jammed_discs(40, rng=np.random.default_rng(1))
    >>> float(lattice.rest_length.mean().round(6))
    1.0
    """
    if discs < 20:
        raise InvalidProblem(f"lattice.discs: expected at least 20, got {discs}")
    check_node_count("lattice.discs", discs)
    if not 0.85 <= packing_fraction <= 1.0:
        raise InvalidProblem(
            "lattice.packing_fraction: expected 0.85 to 1.0, where discs are jammed, "
            f"got {packing_fraction}"
        )
    radii = np.where(np.arange(discs) % 2 == 0, 1.0, SIZE_RATIO) / (1.0 + SIZE_RATIO)
    box = math.sqrt(math.pi * math.fsum(radii * radii) / packing_fraction)
    positions = _relax(box * rng.random((discs, 2)), radii, box)
    return _network(positions, radii, box)


def _relax(
    start: NDArray[np.float64], radii: NDArray[np.float64], box: float
) -> NDArray[np.float64]:
    """Move overlapping discs apart by FIRE until all forces balance."""
    positions, velocity = start, np.zeros_like(start)
    step, mixing, downhill = 0.05, 0.1, 0
    pairs, listed_at = _close_pairs(positions, radii, box), positions
    for _ in range(MAX_STEPS):
        if np.max(np.abs(positions - listed_at)) > 0.25 * SKIN:
            pairs, listed_at = _close_pairs(positions, radii, box), positions
        force = _repulsion(positions, radii, box, pairs)
        if np.max(np.abs(force)) < FORCE_TOLERANCE:
            return positions % box
        if math.fsum((force * velocity).ravel()) > 0.0:
            speed = math.sqrt(math.fsum((velocity * velocity).ravel()))
            strength = math.sqrt(math.fsum((force * force).ravel()))
            velocity = (1.0 - mixing) * velocity + (mixing * speed / strength) * force
            downhill += 1
            if downhill > 5:
                step, mixing = min(1.1 * step, 0.5), 0.99 * mixing
        else:
            velocity = np.zeros_like(velocity)
            step, mixing, downhill = 0.5 * step, 0.1, 0
        velocity = velocity + step * force
        positions = positions + step * velocity
    raise InvalidProblem(
        f"lattice: the relaxation of {len(start)} discs did not converge within {MAX_STEPS} steps; "
        "choose another seed or a higher packing_fraction"
    )


def _close_pairs(
    positions: NDArray[np.float64], radii: NDArray[np.float64], box: float
) -> NDArray[np.int64]:
    """Return all pairs close to contact, in a fixed order."""
    from scipy.spatial import cKDTree

    reach = 2.0 * float(radii.max()) + SKIN
    tree = cKDTree(positions % box, boxsize=np.full(2, box))
    pairs = np.sort(tree.query_pairs(reach, output_type="ndarray"), axis=1)
    listed: NDArray[np.int64] = pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))].astype(np.int64)
    return listed


def _repulsion(
    positions: NDArray[np.float64],
    radii: NDArray[np.float64],
    box: float,
    pairs: NDArray[np.int64],
) -> NDArray[np.float64]:
    """Return the force on each disc, from the energy ``1/2 (1 - r/d)^2`` of each overlap."""
    first, second = pairs.T
    apart = positions[second] - positions[first]
    apart -= box * np.round(apart / box)
    distance = np.sqrt(apart[:, 0] ** 2 + apart[:, 1] ** 2)
    contact = radii[first] + radii[second]
    size = np.maximum(1.0 - distance / contact, 0.0) / contact
    # Two discs at one point have no direction of repulsion. Their force is set to 0: forces of
    # other discs separate them.
    push = (size / np.where(distance > 0.0, distance, np.inf))[:, None] * apart
    count = len(positions)
    return np.column_stack(
        [
            np.bincount(second, push[:, axis], count) - np.bincount(first, push[:, axis], count)
            for axis in (0, 1)
        ]
    )


def _network(positions: NDArray[np.float64], radii: NDArray[np.float64], box: float) -> Lattice:
    """Return the network of discs in contact inside the box, with its nodes renumbered."""
    pairs = _close_pairs(positions, radii, box)
    apart = positions[pairs[:, 1]] - positions[pairs[:, 0]]
    touching = np.sqrt((apart**2).sum(axis=1)) < radii[pairs].sum(axis=1)
    beams = pairs[touching]
    while True:
        degree = np.bincount(beams.ravel(), minlength=len(positions))
        connected = (degree[beams] >= 2).all(axis=1)
        if connected.all():
            break
        beams = beams[connected]
    whole = Lattice(positions, beams)
    nodes = _largest_piece(whole)
    nodes = nodes[np.lexsort((positions[nodes, 0], positions[nodes, 1]))]
    number = np.full(len(positions), -1)
    number[nodes] = np.arange(len(nodes))
    beams = np.sort(number[beams[number[beams[:, 0]] >= 0]], axis=1)
    beams = beams[np.lexsort((beams[:, 1], beams[:, 0]))]
    mean = math.fsum(Lattice(positions[nodes], beams).rest_length) / len(beams)
    return Lattice((positions[nodes] - positions[nodes].min(axis=0)) / mean, beams)


def _largest_piece(lattice: Lattice) -> NDArray[np.int64]:
    """Return the nodes of the largest connected piece."""
    left = np.ones(lattice.node_count, dtype=np.bool_)
    largest = np.empty(0, dtype=np.int64)
    while left.any():
        piece = lattice.reachable(np.flatnonzero(left)[:1])
        left &= ~piece
        if np.count_nonzero(piece) > len(largest):
            largest = np.flatnonzero(piece)
    return largest
