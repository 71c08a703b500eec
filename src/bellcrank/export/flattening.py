"""Polygons with exactly the area of outlines of lines and arcs.

Polygons with corners on an arc enclose less than its area. Here the inner corners lie on a
slightly larger circle of radius q r, and the first and the last corner on the arc of radius r. An
arc that turns by n phi is replaced by n sides. Their area equals that of the sector if

    (n - 2) q^2 + 2 q = n phi / sin(phi)

The ends of the arc do not move. Corners are outside the arc by at most r phi^2 / 6, and the kink
between an arc and a line is smaller than with chords.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bellcrank.part.outline import Loop, Outline

    Reals = NDArray[np.float64]
    Ids = NDArray[np.int64]

SAGITTA = 0.01
"""Default of the largest distance between an arc and its polygon, mm."""

_BITS = 24
"""Bits of the mantissa of numbers in STL files."""
_REFINEMENTS = 8
"""Largest number of divisions of the distance by four where polygons touch."""


def polygons_of(outline: Outline, sagitta: float = SAGITTA) -> list[Reals]:
    """Return a polygon for each loop of an outline, with the total area of the outline.

    The corners lie on a grid whose spacing is a power of two, between 1/16 and 1/8 million of the
    size of the part, so that numbers of single precision represent them exactly. Where polygons
    touch, because surfaces of the part almost touch, the distance to the arcs is reduced.

    Parameters
    ----------
    outline
        Outline of the part.
    sagitta : float, mm
        Largest distance between an arc and its polygon.

    Returns
    -------
    list of (m, 2) float64, mm
        Counterclockwise for outer loops, then clockwise for holes.

    Raises
    ------
    InvalidSettings
        If `sagitta` is not above 0, or surfaces are too close for polygons that do not touch.

    Examples
    --------
    >>> from bellcrank.part.outline import Loop, Outline
    >>> disc = Outline((Loop([[-5.0, 0.0], [5.0, 0.0]], [1.0, 1.0]),))
    >>> corners = polygons_of(disc, 0.1)[0]
    >>> x, y = corners.T
    >>> len(corners), round(0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / disc.area, 7)
    (20, 1.0)
    """
    if not 0.0 < sagitta < float("inf"):
        raise InvalidSettings(f"sagitta: expected a length above 0 mm, got {sagitta!r}")
    low_x, low_y, high_x, high_y = outline.bounds
    # Corners are outside by at most the sagitta.
    extent = max(high_x - low_x, high_y - low_y)
    extent += 2.0 * min(sagitta, extent)
    grid = 2.0 ** (np.ceil(np.log2(extent)) - _BITS)
    loops = outline.loops
    fine = np.full(len(loops), sagitta)
    for _ in range(_REFINEMENTS):
        polygons = _on_grid(_approximated(loops, fine), grid, outline.area)
        touching, point = _touching(polygons)
        if not len(touching):
            return polygons
        fine[touching] *= 0.25
    raise InvalidSettings(
        f"fillet: surfaces almost touch at ({point[0]:.4g}, {point[1]:.4g}) mm; choose narrower "
        "struts or smaller fillets"
    )


def _approximated(loops: Sequence[Loop], sagitta: Reals) -> list[Reals]:
    """Return a polygon for each loop, with the sagitta of the loop."""
    sizes = np.array([len(loop.points) for loop in loops])
    start = np.concatenate([loop.points for loop in loops])
    chord = np.concatenate([loop.chords for loop in loops])
    bulge = np.concatenate([loop.bulge for loop in loops])
    arc = np.flatnonzero(bulge)
    turn = 4.0 * np.arctan(bulge[arc])
    height = 0.25 * (1.0 / bulge[arc] - bulge[arc])
    spoke = -0.5 * chord[arc] - height[:, None] * _left(chord[arc])
    radius = np.hypot(*spoke.T)
    # Corners are outside by at most 4/3 of the sagitta of chords.
    depth = np.repeat(sagitta, sizes)[arc] / radius
    step = np.maximum(2.0 * np.arccos(np.clip(1.0 - 0.75 * depth, 0.0, 1.0)), np.sqrt(depth))
    parts = np.ones(len(bulge), dtype=np.int64)
    parts[arc] = np.ceil(np.abs(turn) / step).clip(2)
    edge = np.repeat(np.arange(len(bulge)), parts)
    number = np.arange(len(edge)) - np.repeat(np.cumsum(parts) - parts, parts)
    corners = start[edge]
    # All corners of an arc but the first are computed from its centre.
    of_arc = np.full(len(bulge), -1)
    of_arc[arc] = np.arange(len(arc))
    between = number > 0
    which = of_arc[edge[between]]
    angle = turn[which] * number[between] / parts[arc][which]
    out = _corner_ratio(parts[arc], turn)[which]
    spokes = spoke[which]
    corners[between] += (
        (out * np.cos(angle) - 1.0)[:, None] * spokes
        + (out * np.sin(angle))[:, None] * _left(spokes)
    )  # fmt: skip
    points_before = np.cumsum(np.add.reduceat(parts, np.cumsum(sizes) - sizes))
    return np.split(corners, points_before[:-1])


def _corner_ratio(parts: Ids, turn: Reals) -> Reals:
    """Return the ratio q of corner distance to radius for each arc."""
    share = turn / parts
    sector = parts / np.sinc(share / np.pi)
    inner = parts - 2
    larger: Reals = sector / (1.0 + np.sqrt(1.0 + inner * sector))
    return larger


def _left(vectors: Reals) -> Reals:
    return np.column_stack([-vectors[:, 1], vectors[:, 0]])


def _on_grid(polygons: list[Reals], grid: float, area: float) -> list[Reals]:
    """Return polygons on a grid with a given total area, without repeated corners.

    Lines parallel to the grid are rounded as a whole, which changes the area of a regular lattice.
    Some corners are therefore moved to a neighbouring grid point until the area is correct.
    """
    sizes = np.array([len(polygon) for polygon in polygons])
    exact = np.concatenate(polygons) / grid
    rounded = np.round(exact)
    first = np.repeat(np.cumsum(sizes) - sizes, sizes)
    number = np.arange(len(exact)) - first
    count = np.repeat(sizes, sizes)
    onward, before = first + (number + 1) % count, first + (number - 1) % count
    missing = area / grid**2 - _area(rounded, onward, first)
    # Neighbours depend on each other: first every second corner, then those between.
    for nearer, parity in ((True, 0), (True, 1), (False, 0), (False, 1)):
        chosen = (number % 2 == parity) & ((number < count - 1) | (parity == 1))
        missing -= _move_corners(
            rounded, exact, 0.5 * (rounded[onward] - rounded[before]), chosen, missing, nearer
        )
    repeated = np.all(rounded == rounded[before], axis=1)
    scaled = grid * rounded
    ends = np.cumsum(sizes)[:-1]
    return [
        polygon[~same]
        for polygon, same in zip(np.split(scaled, ends), np.split(repeated, ends), strict=True)
    ]


def _move_corners(
    rounded: Reals,
    exact: Reals,
    span: Reals,
    chosen: NDArray[np.bool_],
    missing: float,
    nearer: bool,
) -> float:
    """Move chosen corners by one grid point, each at most once, and return the change of the area.

    If `nearer` is set, corners move to the other side of the exact point, otherwise anywhere.
    """
    gain = np.column_stack([span[:, 1], -span[:, 0]])
    step = np.where(exact > rounded, 1.0, -1.0) if nearer else np.sign(gain) * np.sign(missing)
    gain = np.where(chosen[:, None], step * gain, 0.0) * np.sign(missing)
    axis = np.argmax(gain, axis=1)
    gains = np.take_along_axis(gain, axis[:, None], axis=1)[:, 0]
    order = np.argsort(-gains, kind="stable")
    left = abs(missing)
    for corner, adds in zip(order.tolist(), gains[order].tolist(), strict=True):
        if adds <= 0.0:
            break
        if adds <= left:
            left -= adds
            rounded[corner, axis[corner]] += step[corner, axis[corner]]
    return float(np.sign(missing) * (abs(missing) - left))


def _area(corners: Reals, onward: Ids, first: Ids) -> float:
    """Return the area of polygons minus their holes."""
    x, y = (corners - corners[first]).T
    return float(0.5 * np.sum(x * y[onward] - x[onward] * y))


def _touching(polygons: list[Reals]) -> tuple[Ids, Reals]:
    """Return the polygons that touch others or themselves or have vanished, and one point."""
    import shapely

    sizes = np.array([len(polygon) for polygon in polygons])
    vanished = np.flatnonzero(sizes < 3)
    if len(vanished):
        return vanished, polygons[vanished[0]].reshape(-1, 2).mean(axis=0)
    loop = np.repeat(np.arange(len(polygons)), sizes)
    start = np.concatenate(polygons)
    end = np.concatenate([np.roll(polygon, -1, axis=0) for polygon in polygons])
    sides = shapely.linestrings(np.stack([start, end], axis=1))
    one, two = shapely.STRtree(sides).query(sides, predicate="intersects")
    first = np.repeat(np.cumsum(sizes) - sizes, sizes)
    following = first + (np.arange(len(loop)) - first + 1) % sizes[loop]
    meet = (one != two) & (following[one] != two) & (following[two] != one)
    points: Reals = start[one[meet]]
    return np.unique(loop[one[meet]]), points[0] if len(points) else np.zeros(2)
