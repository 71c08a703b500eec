"""Regions: sets of nodes selected by position or number.

In a problem file a region is an inline table whose key is the kind of region::

    nodes = [{ row = -1, rightmost = 3 }, { box = [0, 8, 2, 10] }, { ids = [4, 5] }]

Rows exist only in the plane, layers only in space.

To add a kind, register a function ``(lattice, value, ...) -> node ids`` with
``@regions.register("key")``. Further parameters are further keys.

Examples
--------
>>> from bellcrank.model import lattices
>>> lattice = lattices["triangular-rectangle"](columns=3, rows=4)
>>> row(lattice, -1, rightmost=2)
array([12, 13])
>>> box(lattice, [0.0, 0.0, 1.0, 1.0])
array([0, 3, 4])
>>> nearest(lattice, [0.4, 0.1])
array([0])
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidProblem
from bellcrank.model.arrays import check_ids, id_list
from bellcrank.registry import Registry

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from bellcrank.model.lattice import Lattice

regions: Registry[Callable[..., NDArray[np.int64]]] = Registry("region")

MAX_NEAREST = 1.5
"""Largest distance of the region ``nearest`` from its point, in median beam lengths."""


def find_rows(lattice: Lattice) -> list[NDArray[np.int64]]:
    """Return the nodes of each row of equal y, rows from the bottom, nodes from the left.

    Raises
    ------
    InvalidProblem
        If the lattice is in space.

    Examples
    --------
    >>> from bellcrank.model import lattices
    >>> find_rows(lattices["triangular-rows"]([2, 1], [0.0, 0.5]))
    [array([0, 1]), array([2])]
    """
    if lattice.dimension != 2:
        raise InvalidProblem(
            "row: expected a lattice in the plane; in space use layer, box, sphere or nearest"
        )
    return [
        nodes[np.argsort(lattice.positions[nodes, 0], kind="stable")]
        for nodes in _levels(lattice, 1)
    ]


def _numbered(
    found: list[NDArray[np.int64]], number: int, key: str, many: str
) -> NDArray[np.int64]:
    """Return one of several rows or layers; negative numbers count from the end."""
    count = len(found)
    if not -count <= number < count:
        raise InvalidProblem(
            f"{key}: expected {-count} to {count - 1}, as the lattice has {count} {many}, got "
            f"{number}"
        )
    return found[number]


def _levels(lattice: Lattice, axis: int) -> list[NDArray[np.int64]]:
    """Return the nodes with equal coordinates along an axis, in its order."""
    along = lattice.positions[:, axis]
    order = np.argsort(along, kind="stable")
    same = 1e-3 * float(np.median(lattice.rest_length))
    breaks = np.flatnonzero(np.diff(along[order]) > same) + 1
    return [np.sort(nodes) for nodes in np.split(order, breaks)]


@regions.register("row")
def row(
    lattice: Lattice,
    row: int,
    *,
    leftmost: int | None = None,
    rightmost: int | None = None,
) -> NDArray[np.int64]:
    """Return the nodes of one row, or the leftmost or rightmost ones of it.

    Parameters
    ----------
    lattice
        The lattice.
    row
        Number of the row from the bottom, starting at 0; negative numbers count from the top.
    leftmost, rightmost
        Number of nodes from the left or right; all if neither is given.

    Raises
    ------
    InvalidProblem
        If there is no such row, it has fewer nodes, or both sides are given.
    """
    nodes = _numbered(find_rows(lattice), row, "row", "rows")
    if leftmost is not None and rightmost is not None:
        raise InvalidProblem("row: expected leftmost or rightmost, got both; give two regions")
    for name, count in (("leftmost", leftmost), ("rightmost", rightmost)):
        if count is not None and not 1 <= count <= len(nodes):
            raise InvalidProblem(
                f"{name}: expected 1 to {len(nodes)} nodes of row {row}, got {count}"
            )
    if leftmost is not None:
        nodes = nodes[:leftmost]
    if rightmost is not None:
        nodes = nodes[-rightmost:]
    return np.sort(nodes)


@regions.register("rows")
def rows(
    lattice: Lattice,
    rows: Sequence[int],
    *,
    leftmost: int | None = None,
    rightmost: int | None = None,
) -> NDArray[np.int64]:
    """Return the nodes of several rows, or the leftmost or rightmost ones of each.

    Raises
    ------
    InvalidProblem
        If one of the rows does not exist or has fewer nodes.
    """
    picked = [row(lattice, k, leftmost=leftmost, rightmost=rightmost) for k in rows]
    return np.unique(np.concatenate([np.empty(0, dtype=np.int64), *picked]))


@regions.register("box")
def box(lattice: Lattice, box: Sequence[float]) -> NDArray[np.int64]:
    """Return the nodes within ``[x_min, y_min, x_max, y_max]``, edges included.

    In space the box is ``[x_min, y_min, z_min, x_max, y_max, z_max]``.

    Raises
    ------
    InvalidProblem
        If `box` has another number of values, or a minimum exceeds its maximum.
    """
    dimension = lattice.dimension
    low, high = np.array(box[:dimension]), np.array(box[dimension:])
    if len(box) != 2 * dimension or not (low <= high).all():
        axes = "xyz"[:dimension]
        form = ", ".join(f"{axis}_{end}" for end in ("min", "max") for axis in axes)
        raise InvalidProblem(f"box: expected [{form}], got {list(box)}")
    # Nodes on an edge are included despite rounding errors.
    slack = 1e-6 * float(np.median(lattice.rest_length))
    inside = (lattice.positions >= low - slack) & (lattice.positions <= high + slack)
    return np.flatnonzero(inside.all(axis=1))


def find_layers(lattice: Lattice, axis: str = "z") -> list[NDArray[np.int64]]:
    """Return the nodes of each layer of a lattice in space, in the order of a coordinate.

    Raises
    ------
    InvalidProblem
        If the lattice is in the plane, or there is no such axis.

    Examples
    --------
    >>> from bellcrank.model import lattices
    >>> [len(layer) for layer in find_layers(lattices["octet"]([3, 3, 3]))]
    [13, 12, 13, 12, 13]
    """
    if lattice.dimension != 3:
        raise InvalidProblem("layer: expected a lattice in space; in the plane use row")
    if axis not in {"x", "y", "z"}:
        raise InvalidProblem(f"axis: expected 'x', 'y' or 'z', got {axis!r}")
    return _levels(lattice, "xyz".index(axis))


@regions.register("layer")
def layer(
    lattice: Lattice,
    layer: int,
    *,
    axis: str = "z",
    around: Sequence[float] | None = None,
    radius: Sequence[float] | None = None,
) -> NDArray[np.int64]:
    """Return the nodes of one layer of a lattice in space, or a ring of it.

    Parameters
    ----------
    lattice
        The lattice.
    layer
        Number of the layer along the axis, starting at 0; negative numbers count from the end.
    axis
        ``"x"``, ``"y"`` or ``"z"``, normal to the layer.
    around
        Middle of a ring, two coordinates in the order x, y, z; the middle of the lattice by
        default.
    radius
        Smallest and largest distance from it.

    Raises
    ------
    InvalidProblem
        If there is no such layer, or no node in the ring.
    """
    nodes = _numbered(find_layers(lattice, axis), layer, "layer", f"layers along {axis}")
    if radius is None:
        if around is not None:
            raise InvalidProblem("around: expected with radius")
        return nodes
    if len(radius) != 2 or not 0.0 <= radius[0] <= radius[1]:
        raise InvalidProblem(f"radius: expected [smallest, largest], got {list(radius)}")
    across = np.delete(lattice.positions, "xyz".index(axis), axis=1)
    middle = 0.5 * (across.min(axis=0) + across.max(axis=0)) if around is None else around
    if len(middle) != 2:
        raise InvalidProblem(f"around: expected two coordinates, got {list(middle)}")
    distance = np.linalg.norm(across[nodes] - np.array(middle), axis=1)
    slack = 1e-6 * float(np.median(lattice.rest_length))
    ring: NDArray[np.int64] = nodes[
        (distance >= radius[0] - slack) & (distance <= radius[1] + slack)
    ]
    if not len(ring):
        raise InvalidProblem(
            f"radius: no node of layer {layer} lies between {radius[0]:g} and {radius[1]:g}; its "
            f"nodes have distances of {distance.min():.4g} to {distance.max():.4g}"
        )
    return ring


@regions.register("sphere")
def sphere(lattice: Lattice, sphere: Sequence[float], *, radius: float) -> NDArray[np.int64]:
    """Return the nodes in a sphere around ``[x, y, z]``, in the plane in a circle, edge included.

    Raises
    ------
    InvalidProblem
        If `sphere` is not a point, the radius is negative, or no node lies in the sphere.
    """
    axes = "xyz"[: lattice.dimension]
    if len(sphere) != len(axes):
        raise InvalidProblem(f"sphere: expected a point [{', '.join(axes)}], got {list(sphere)}")
    if radius < 0.0:
        raise InvalidProblem(f"radius: expected 0 or more, got {radius:g}")
    distance = np.linalg.norm(lattice.positions - np.array(sphere), axis=1)
    slack = 1e-6 * float(np.median(lattice.rest_length))
    inside = np.flatnonzero(distance <= radius + slack)
    if not len(inside):
        raise InvalidProblem(
            f"sphere: no node lies within {radius:g} of {list(sphere)}; the nearest one is "
            f"{distance.min():.4g} away"
        )
    return inside


@regions.register("nearest")
def nearest(lattice: Lattice, nearest: Sequence[float], *, count: int = 1) -> NDArray[np.int64]:
    """Return the `count` nodes nearest to a point ``[x, y]``, in space ``[x, y, z]``.

    Raises
    ------
    InvalidProblem
        If `nearest` is not a point, no node is within `MAX_NEAREST` beam lengths of the point,
        or the lattice has fewer than `count` nodes.
    """
    axes = "xyz"[: lattice.dimension]
    if len(nearest) != len(axes):
        raise InvalidProblem(f"nearest: expected a point [{', '.join(axes)}], got {list(nearest)}")
    if not 1 <= count <= lattice.node_count:
        raise InvalidProblem(f"count: expected 1 to {lattice.node_count} nodes, got {count}")
    distance = np.linalg.norm(lattice.positions - np.array(nearest), axis=1)
    length = float(np.median(lattice.rest_length))
    if distance.min() > MAX_NEAREST * length:
        low, high = lattice.positions.min(axis=0), lattice.positions.max(axis=0)
        extent = " and ".join(
            f"{axis} = {a:.4g} to {b:.4g}" for axis, a, b in zip(axes, low, high, strict=True)
        )
        raise InvalidProblem(
            f"nearest: the node nearest to {list(nearest)} is {distance.min():.4g} lattice units "
            f"({distance.min() / length:.3g} beam lengths) away; expected a point within "
            f"{MAX_NEAREST:g} beam lengths of the lattice, which extends from {extent}"
        )
    return np.sort(np.argsort(distance, kind="stable")[:count])


@regions.register("ids")
def ids(lattice: Lattice, ids: Sequence[int]) -> NDArray[np.int64]:
    """Return nodes given by number, in the order given.

    Raises
    ------
    InvalidProblem
        If a node does not exist or is repeated.
    """
    nodes = id_list("ids", np.array(ids, dtype=np.int64))
    check_ids("ids", nodes, lattice.node_count, "node")
    return nodes


def leftmost(lattice: Lattice, in_row: int, count: int) -> NDArray[np.int64]:
    """Return the `count` leftmost nodes of a row."""
    return row(lattice, in_row, leftmost=count)


def rightmost(lattice: Lattice, in_row: int, count: int) -> NDArray[np.int64]:
    """Return the `count` rightmost nodes of a row."""
    return row(lattice, in_row, rightmost=count)
