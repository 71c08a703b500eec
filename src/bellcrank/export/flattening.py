"""Polygons that enclose exactly the area of lines and arcs.

Chords of an arc cut off a little of it, and all the more of a part that consists of fillets.
Here the corners between chords lie on a slightly larger circle instead, the first and the last
on the arc itself. An arc of radius r that turns by n phi then becomes n chords which enclose
n - 2 triangles between corners at q r, and one at either end of which one corner is at r:

    (n - 2) q^2 + 2 q = n phi / sin(phi)

makes their area that of the sector. Neither the ends nor their neighbours move, so that nothing
is seen of it: corners lie outside by a sixth of r phi^2 at most, and where arcs meet lines the
kink is smaller than with chords in the circle.
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
"""Greatest distance between an arc and its polygon, mm, where nothing calls for a smaller one."""

_BITS = 24
"""Of a number in an STL file."""
_REFINEMENTS = 8
"""How often the distance is quartered where polygons would touch."""


def polygons_of(outline: Outline, sagitta: float = SAGITTA) -> list[Reals]:
    """Return a polygon for each loop of an outline, with the area of the outline.

    Their corners lie on a grid of a power of two, so fine that it divides the size of the part
    by 8 to 16 million, and so coarse that numbers of single precision hold it exactly. Where
    polygons would touch each other or themselves, since the surfaces of the part almost do,
    they follow arcs more closely.

    Parameters
    ----------
    outline
        Of the part.
    sagitta : float, mm
        Greatest distance between an arc and its polygon.

    Returns
    -------
    list of (m, 2) float64, mm
        For outer loops, counterclockwise, and then holes, clockwise.

    Raises
    ------
    InvalidSettings
        If `sagitta` is not above 0, or surfaces are so close that no polygon tells them apart.

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
    # Corners lie outside by the sagitta at most.
    extent = max(high_x - low_x, high_y - low_y)
    extent += 2.0 * min(sagitta, extent)
    grid = 2.0 ** (np.ceil(np.log2(extent)) - _BITS)
    loops = outline.loops
    fine = np.full(len(loops), sagitta)
    for _ in range(_REFINEMENTS):
        rings = _on_grid(_followed(loops, fine), grid, outline.area)
        touching, place = _touching(rings)
        if not len(touching):
            return rings
        fine[touching] *= 0.25
    raise InvalidSettings(
        f"fillet: surfaces all but touch at ({place[0]:.4g}, {place[1]:.4g}) mm; choose narrower "
        "struts or smaller fillets"
    )


def _followed(loops: Sequence[Loop], sagitta: Reals) -> list[Reals]:
    """Return a polygon for each loop that departs from its arcs by its own `sagitta`."""
    sizes = np.array([len(loop.points) for loop in loops])
    start = np.concatenate([loop.points for loop in loops])
    chord = np.concatenate([loop.chords for loop in loops])
    bulge = np.concatenate([loop.bulge for loop in loops])
    arc = np.flatnonzero(bulge)
    turn = 4.0 * np.arctan(bulge[arc])
    height = 0.25 * (1.0 / bulge[arc] - bulge[arc])
    spoke = -0.5 * chord[arc] - height[:, None] * _left(chord[arc])
    radius = np.hypot(*spoke.T)
    # Corners are outside by no more than 4/3 of what chords would be inside.
    depth = np.repeat(sagitta, sizes)[arc] / radius
    step = np.maximum(2.0 * np.arccos(np.clip(1.0 - 0.75 * depth, 0.0, 1.0)), np.sqrt(depth))
    parts = np.ones(len(bulge), dtype=np.int64)
    parts[arc] = np.ceil(np.abs(turn) / step).clip(2)
    edge = np.repeat(np.arange(len(bulge)), parts)
    number = np.arange(len(edge)) - np.repeat(np.cumsum(parts) - parts, parts)
    corners = start[edge]
    # All corners but the first of each arc are found from its centre.
    of_arc = np.full(len(bulge), -1)
    of_arc[arc] = np.arange(len(arc))
    between = number > 0
    which = of_arc[edge[between]]
    angle = turn[which] * number[between] / parts[arc][which]
    out = _swelling(parts[arc], turn)[which]
    spokes = spoke[which]
    corners[between] += (
        (out * np.cos(angle) - 1.0)[:, None] * spokes
        + (out * np.sin(angle))[:, None] * _left(spokes)
    )  # fmt: skip
    points_before = np.cumsum(np.add.reduceat(parts, np.cumsum(sizes) - sizes))
    return np.split(corners, points_before[:-1])


def _swelling(parts: Ids, turn: Reals) -> Reals:
    """Return how much farther than its radius from its centre the corners of an arc lie."""
    share = turn / parts
    sector = parts / np.sinc(share / np.pi)
    inner = parts - 2
    larger: Reals = sector / (1.0 + np.sqrt(1.0 + inner * sector))
    return larger


def _left(vectors: Reals) -> Reals:
    return np.column_stack([-vectors[:, 1], vectors[:, 0]])


def _on_grid(rings: list[Reals], grid: float, area: float) -> list[Reals]:
    """Return polygons on a grid, without corners that come twice, that enclose an area.

    Lines that run along the grid are rounded as a whole, which tells in a regular lattice. So
    some corners go to the next best place, until the area is right.
    """
    sizes = np.array([len(ring) for ring in rings])
    exact = np.concatenate(rings) / grid
    placed = np.round(exact)
    first = np.repeat(np.cumsum(sizes) - sizes, sizes)
    number = np.arange(len(exact)) - first
    count = np.repeat(sizes, sizes)
    onward, before = first + (number + 1) % count, first + (number - 1) % count
    missing = area / grid**2 - _area(placed, onward, first)
    # Neighbours would disturb each other: first each second corner, then those between.
    for nearer, parity in ((True, 0), (True, 1), (False, 0), (False, 1)):
        chosen = (number % 2 == parity) & ((number < count - 1) | (parity == 1))
        missing -= _step(
            placed, exact, 0.5 * (placed[onward] - placed[before]), chosen, missing, nearer
        )
    twice = np.all(placed == placed[before], axis=1)
    kept = grid * placed
    ends = np.cumsum(sizes)[:-1]
    return [
        ring[~same] for ring, same in zip(np.split(kept, ends), np.split(twice, ends), strict=True)
    ]


def _step(
    placed: Reals,
    exact: Reals,
    span: Reals,
    chosen: NDArray[np.bool_],
    missing: float,
    nearer: bool,
) -> float:
    """Move chosen corners by one place, each at most once, and return what that adds to the area.

    Steps go to the other side of the exact place, or else anywhere.
    """
    gain = np.column_stack([span[:, 1], -span[:, 0]])
    step = np.where(exact > placed, 1.0, -1.0) if nearer else np.sign(gain) * np.sign(missing)
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
            placed[corner, axis[corner]] += step[corner, axis[corner]]
    return float(np.sign(missing) * (abs(missing) - left))


def _area(corners: Reals, onward: Ids, first: Ids) -> float:
    """Return the area inside polygons, holes taken off."""
    x, y = (corners - corners[first]).T
    return float(0.5 * np.sum(x * y[onward] - x[onward] * y))


def _touching(rings: list[Reals]) -> tuple[Ids, Reals]:
    """Return which polygons touch others or themselves, or have vanished, and one place."""
    import shapely

    sizes = np.array([len(ring) for ring in rings])
    vanished = np.flatnonzero(sizes < 3)
    if len(vanished):
        return vanished, rings[vanished[0]].reshape(-1, 2).mean(axis=0)
    loop = np.repeat(np.arange(len(rings)), sizes)
    start = np.concatenate(rings)
    end = np.concatenate([np.roll(ring, -1, axis=0) for ring in rings])
    sides = shapely.linestrings(np.stack([start, end], axis=1))
    one, two = shapely.STRtree(sides).query(sides, predicate="intersects")
    first = np.repeat(np.cumsum(sizes) - sizes, sizes)
    following = first + (np.arange(len(loop)) - first + 1) % sizes[loop]
    meet = (one != two) & (following[one] != two) & (following[two] != one)
    places: Reals = start[one[meet]]
    return np.unique(loop[one[meet]]), places[0] if len(places) else np.zeros(2)
