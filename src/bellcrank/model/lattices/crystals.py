"""Lattices in space: the nodes of a crystal inside a box or a cylinder, joined to neighbours.

Where diagonals of a cube meet there is a node, so that no two beams cross.

References
----------
Deshpande, Fleck, Ashby, "Effective properties of the octet-truss lattice material", J. Mech. Phys.
Solids 49, 1747 (2001).
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidProblem
from bellcrank.model.lattice import Lattice, check_node_count
from bellcrank.model.lattices.registry import lattices

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    Points = NDArray[np.float64]
    Kinds = NDArray[np.int64]

SLACK = 1e-6
"""Distance, in cube edges, by which nodes may lie outside the envelope."""
MOST_AROUND = 16
"""Largest number of nodes around an envelope, over the largest number of a lattice."""
UPRIGHT = (0, 0, 1)
FACES = ((0, 2, 2), (2, 0, 2), (2, 2, 0))
"""Centres of the faces of a cube, in quarters of its edge."""
CENTRE = (2, 2, 2)
KELVIN = tuple(
    site
    for site in itertools.product(range(4), repeat=3)
    if {0, 2} <= set(site) and sum(k % 2 for k in site) == 1
)
"""Corners of truncated octahedra that fill the space: one coordinate of 0, one of a half and one of
a quarter or three quarters of the edge."""


@dataclass(frozen=True, slots=True)
class Crystal:
    """Nodes that repeat in each cube, and which of them are joined.

    Parameters
    ----------
    nodes
        Site of each node in quarters of the edge of the cube, and its kind.
    joined
        Pairs of kinds, with the length of the beams between them in edges of the cube.
    """

    nodes: tuple[tuple[tuple[int, ...], int], ...]
    joined: tuple[tuple[int, int, float], ...]


CORNER = ((0, 0, 0), 0)
OCTET = Crystal((CORNER, *((face, 0) for face in FACES)), ((0, 0, math.sqrt(0.5)),))
EDGES = (0, 0, 1.0)
CUBIC = {
    "none": Crystal((CORNER,), (EDGES,)),
    "faces": Crystal((CORNER, *((face, 1) for face in FACES)), (EDGES, (0, 1, math.sqrt(0.5)))),
    "bodies": Crystal((CORNER, (CENTRE, 1)), (EDGES, (0, 1, math.sqrt(0.75)))),
}
BODY_CENTRED = Crystal((CORNER, (CENTRE, 1)), ((0, 1, math.sqrt(0.75)),))
FOAM = Crystal(tuple((site, 0) for site in KELVIN), ((0, 0, math.sqrt(0.125)),))


@lattices.register("octet")
def octet(
    size: Sequence[float],
    *,
    envelope: str = "box",
    up: Sequence[int] = UPRIGHT,
    spacing: float = 1.0,
) -> Lattice:
    """Return an octet lattice: face-centred cubic nodes, each joined to its 12 neighbours.

    Its layers normal to a diagonal of the cube, ``up=[1, 1, 1]``, are triangular lattices.

    Parameters
    ----------
    size
        Lengths ``[x, y, z]`` of the envelope, lattice units. As many beams as fit lie in it,
        symmetrically about its middle. One corner of the envelope is the origin.
    envelope
        ``"box"``, or ``"cylinder"`` for the upright cylinder, in general elliptic, in that box.
    up
        Direction in the cubes that points up, along z.
    spacing
        Length of the beams.

    Raises
    ------
    InvalidProblem
        If a value is outside its bounds, or no beam fits.

    Examples
    --------
    >>> lattice = octet([3, 3, 3])
    >>> lattice.node_count, lattice.beam_count, lattice.rest_length.max().round(9)
    (63, 240, np.float64(1.0))
    """
    return crystal(OCTET, size, envelope, up, spacing / math.sqrt(0.5))


@lattices.register("cubic")
def cubic(
    size: Sequence[float],
    *,
    diagonals: str = "bodies",
    envelope: str = "box",
    up: Sequence[int] = UPRIGHT,
    spacing: float = 1.0,
) -> Lattice:
    """Return a simple cubic lattice with diagonals of the faces or of the cubes.

    Parameters
    ----------
    size, envelope, up
        As in `octet`.
    diagonals
        ``"faces"``, ``"bodies"`` or ``"none"``. They meet in a node.
    spacing
        Length of the edges of the cubes.

    Raises
    ------
    InvalidProblem
        As `octet`.

    Examples
    --------
    >>> cubic([2, 2, 2]).node_count, cubic([2, 2, 2], diagonals="none").beam_count
    (35, 54)
    """
    if diagonals not in CUBIC:
        raise InvalidProblem(
            f"lattice.diagonals: expected {', '.join(map(repr, CUBIC))}, got {diagonals!r}"
        )
    return crystal(CUBIC[diagonals], size, envelope, up, spacing)


@lattices.register("body-centred")
def body_centred(
    size: Sequence[float],
    *,
    envelope: str = "box",
    up: Sequence[int] = UPRIGHT,
    spacing: float = 1.0,
) -> Lattice:
    """Return a body-centred cubic lattice: each node is joined to its 8 neighbours.

    Parameters and errors are those of `octet`.

    Examples
    --------
    >>> body_centred([3, 3, 3]).rest_length.std().round(9)
    np.float64(0.0)
    """
    return crystal(BODY_CENTRED, size, envelope, up, spacing / math.sqrt(0.75))


@lattices.register("kelvin")
def kelvin(
    size: Sequence[float],
    *,
    envelope: str = "box",
    up: Sequence[int] = UPRIGHT,
    spacing: float = 1.0,
) -> Lattice:
    """Return a Kelvin foam: the edges of truncated octahedra, of which four meet in each node.

    Parameters and errors are those of `octet`.

    Examples
    --------
    >>> np.bincount(kelvin([6, 6, 6]).beams.ravel()).max()
    np.int64(4)
    """
    return crystal(FOAM, size, envelope, up, spacing / math.sqrt(0.125))


def crystal(
    form: Crystal, size: Sequence[float], envelope: str, up: Sequence[int], edge: float
) -> Lattice:
    """Return the beams of a crystal inside an envelope.

    Nodes are numbered from the bottom; beams are sorted. Dead ends, and pieces that are not
    connected with the largest one, are left out.

    Parameters
    ----------
    form
        Nodes and beams of one cube.
    size, envelope, up
        As in `octet`.
    edge
        Edge of the cubes, lattice units.

    Raises
    ------
    InvalidProblem
        As `octet`.
    """
    found = []
    for positions, kinds in placements(form, size, envelope, up, edge):
        nodes, beams = without_dead_ends(len(positions), _joined(form, positions, kinds, edge))
        found.append((positions[nodes], beams))
    positions, beams = max(found, key=lambda each: len(each[1]))
    if not len(beams):
        raise InvalidProblem(
            f"lattice.size: no beam of the lattice fits into {list(size)}; the cubes have edges of "
            f"{edge:.4g} lattice units"
        )
    return Lattice(positions, beams)


def placements(
    form: Crystal, size: Sequence[float], envelope: str, up: Sequence[int], edge: float
) -> list[tuple[Points, Kinds]]:
    """Return the nodes (n, 3) of a crystal inside an envelope and their kinds (n,), both sorted.

    One after the other for each symmetric position of the crystal in the envelope.
    """
    box = _checked_size(size, edge)
    if envelope not in {"box", "cylinder"}:
        raise InvalidProblem(f"lattice.envelope: expected 'box' or 'cylinder', got {envelope!r}")
    check_node_count("lattice.size", math.ceil(len(form.nodes) * np.prod(box / edge)))
    turn, shifts = _orientation(up)
    # The cubes around the envelope, whose corners are turned back.
    corners = np.array(list(itertools.product((-0.5, 0.5), repeat=3))) * box @ turn / edge
    ranges = [np.arange(-(reach := math.ceil(each) + 1), reach + 1) for each in corners.max(axis=0)]
    around = math.prod(len(each) for each in ranges) * len(form.nodes)
    check_node_count("lattice.size", around // MOST_AROUND)
    cells = np.stack(np.meshgrid(*ranges, indexing="ij"), axis=-1)
    sites = np.array([site for site, _ in form.nodes]) / 4.0
    points = (cells.reshape(-1, 1, 3) + sites).reshape(-1, 3)
    kinds = np.tile([kind for _, kind in form.nodes], cells.size // 3)
    found = []
    for shift in shifts:
        moved = (points + shift) @ turn.T * edge
        inside = _is_inside(moved, box, envelope, SLACK * edge)
        positions = moved[inside] + 0.5 * box
        order = np.lexsort((positions / edge).round(6).T)
        found.append((positions[order], kinds[inside][order]))
    return found


def _checked_size(size: Sequence[float], edge: float) -> Points:
    """Return the lengths of the envelope."""
    if not (math.isfinite(edge) and edge > 0.0):
        raise InvalidProblem("lattice.spacing: expected a number greater than 0")
    if len(size) != 3 or not all(math.isfinite(each) and each > 0.0 for each in size):
        raise InvalidProblem(
            f"lattice.size: expected three lengths [x, y, z] greater than 0, got {list(size)}"
        )
    return np.array(size, dtype=np.float64)


def _orientation(up: Sequence[int]) -> tuple[Points, list[Points]]:
    """Return the rotation of the cubes, and the shifts, in edges, that are tried in the envelope.

    Cubes in their own orientation are shifted by half an edge along each axis; others only along
    the direction that points up, so that the axis of the envelope is one of their symmetry.
    """
    if len(up) != 3 or not any(up) or any(each != int(each) for each in up):
        raise InvalidProblem(
            f"lattice.up: expected three integers such as [0, 0, 1] or [1, 1, 1], got {list(up)}"
        )
    direction = np.array(up, dtype=np.float64)
    axis = direction / np.linalg.norm(direction)
    if np.array_equal(axis, UPRIGHT):
        halves = itertools.product((0.0, 0.5), repeat=3)
        return np.eye(3), [np.array(each) for each in halves]
    across = np.cross(UPRIGHT, axis) if abs(axis[2]) < 1.0 else np.array([1.0, 0.0, 0.0])
    across = across / np.linalg.norm(across)
    turn = np.stack([across, np.cross(axis, across), axis])
    # The distance of layers is a part of 1 / |up|; halves of all such parts are tried.
    return turn, [k / 12.0 / np.linalg.norm(direction) * axis for k in range(12)]


def _is_inside(points: Points, box: Points, envelope: str, slack: float) -> NDArray[np.bool_]:
    """Return (n,) which points are in the envelope around the origin."""
    relative = np.abs(points) / (0.5 * box + slack)
    if envelope == "cylinder":
        relative = np.stack([np.hypot(*relative.T[:2]), relative[:, 2]], axis=1)
    inside: NDArray[np.bool_] = relative.max(axis=1) <= 1.0
    return inside


def _joined(form: Crystal, positions: Points, kinds: Kinds, edge: float) -> NDArray[np.int64]:
    """Return the beams (m, 2) between the nodes."""
    from scipy.spatial import cKDTree

    longest = max(length for _, _, length in form.joined) * edge
    pairs = cKDTree(positions).query_pairs(longest + SLACK * edge, output_type="ndarray")
    pairs = np.sort(pairs.astype(np.int64).reshape(-1, 2), axis=1)
    length = np.linalg.norm(positions[pairs[:, 1]] - positions[pairs[:, 0]], axis=1)
    given = np.sort(kinds[pairs], axis=1)
    wanted = np.zeros(len(pairs), dtype=bool)
    for first, second, span in form.joined:
        wanted |= (given == (first, second)).all(axis=1) & (
            np.abs(length - span * edge) < SLACK * edge
        )
    beams = pairs[wanted]
    ordered: NDArray[np.int64] = beams[np.lexsort(beams.T[::-1])]
    return ordered


def without_dead_ends(
    nodes: int, beams: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the largest piece of a lattice without its dead ends.

    Parameters
    ----------
    nodes
        Number of nodes.
    beams : (m, 2)
        Their beams.

    Returns
    -------
    nodes : (n,)
        Those that are left.
    beams : (k, 2)
        Beams between them, in their numbers.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    while len(beams):
        degree = np.bincount(beams.ravel(), minlength=nodes)
        inner = (degree[beams] > 1).all(axis=1)
        graph = coo_matrix((np.ones(len(beams)), beams.T), shape=(nodes, nodes))
        _, piece = connected_components(graph, directed=False)
        inner &= piece[beams[:, 0]] == np.bincount(piece[beams[:, 0]]).argmax()
        if inner.all():
            break
        beams = beams[inner]
    present = np.unique(beams)
    number = np.full(nodes, -1)
    number[present] = np.arange(len(present))
    return present, number[beams]
