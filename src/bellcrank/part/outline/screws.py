"""Screw holes in a plate, and their best positions."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.part.outline.curves import Loop, Outline
from bellcrank.part.outline.grips import read_nodes

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    Reals = NDArray[np.float64]
    Ids = NDArray[np.int64]

_ACROSS = 120
"""Number of candidate positions along the longer side of a plate."""
_INSIDE = 0.75
"""Preferred clearance of screws, as a fraction of the largest clearance in the plate."""

_NARROW = 0.5
"""Width over length of a region up to which screws are in one row."""
_SWEEPS = 50
"""Largest number of times that each screw is placed again."""


def drilled(outline: Outline, centres: ArrayLike, diameter: float, wall: float) -> Outline:
    """Return an outline with circular holes, which are the last ones of its holes.

    Parameters
    ----------
    outline
        Outline of the part.
    centres : (k, 2) array_like, mm
        Centres of the holes.
    diameter, wall : float, mm
        Diameter of the holes, and smallest thickness of the material around them.

    Raises
    ------
    InvalidSettings
        If a hole leaves too thin a wall, or a length is not valid.

    Examples
    --------
    >>> square = Outline((Loop([[0, 0], [20, 0], [20, 20], [0, 20]], [0, 0, 0, 0]),))
    >>> round(square.area - drilled(square, [[6, 10], [14, 10]], 4.0, 2.0).area, 6)
    25.132741
    >>> drilled(square, [[3, 10]], 4.0, 2.0)
    Traceback (most recent call last):
        ...
    bellcrank.errors.InvalidSettings: centres[0]: a hole of 4 mm at (3, 10) mm would leave a wall \
of 1 mm, less than 2 mm; move it, choose a larger plate or a smaller screw
    """
    radius = _read_screw(diameter, wall)
    points = np.asarray(centres, dtype=np.float64).reshape(-1, 2)
    left = clearance(outline, points) - radius
    apart = np.linalg.norm(points[:, None] - points[None], axis=2)
    np.fill_diagonal(apart, np.inf)
    left = np.minimum(left, apart.min(axis=1, initial=np.inf) - 2.0 * radius)
    thin = np.flatnonzero(left < wall * (1.0 - 1e-9))
    if len(thin):
        x, y = points[thin[0]]
        raise InvalidSettings(
            f"centres[{thin[0]}]: a hole of {diameter:g} mm at ({x:.4g}, {y:.4g}) mm would leave "
            f"{_wall_text(left[thin[0]])}, less than {wall:g} mm; move it, choose a larger plate "
            "or a smaller screw"
        )
    side = np.array([radius, 0.0])
    turn = np.array([-1.0, -1.0])
    holes = [Loop(np.stack([centre - side, centre + side]), turn) for centre in points]
    return Outline(outline.outer, (*outline.holes, *holes))


def screw_positions(
    outline: Outline,
    positions: ArrayLike,
    nodes: ArrayLike,
    count: int,
    diameter: float,
    wall: float,
) -> Reals:
    """Return the best positions of screws in a plate: far from each other and from the boundary.

    Parameters
    ----------
    outline
        Outline of the part with its plate (`filled`).
    positions : (N, 2) array_like, mm
        All nodes of the lattice.
    nodes : (k,) array_like of int
        Nodes of the plate: screws are nearer to one of them than to any other node.
    count
        Number of screws.
    diameter, wall : float, mm
        Diameter of the holes, and smallest thickness of the material around them.

    Returns
    -------
    (count, 2) float64, mm

    Raises
    ------
    InvalidSettings
        If the plate has no room for the screws.

    Examples
    --------
    >>> plate = Outline((Loop([[0, 0], [40, 0], [40, 12], [0, 12]], [0, 0, 0, 0]),))
    >>> corners = [[0, 0], [40, 0], [40, 12], [0, 12]]
    >>> points = screw_positions(plate, corners, [0, 1, 2, 3], 2, 3.0, 1.5)
    >>> drilled(plate, points, 3.0, 1.5).hole_count
    2
    """
    from scipy.spatial import cKDTree

    radius = _read_screw(diameter, wall)
    every = np.asarray(positions, dtype=np.float64)
    block = read_nodes(nodes, len(every))
    if count < 1:
        raise InvalidSettings(f"count: expected at least 1 screw, got {count}")
    low, high = every[block].min(axis=0), every[block].max(axis=0)
    step = max(float((high - low).max()), diameter) / _ACROSS
    axes = [
        np.linspace(a, b, max(1, round((b - a) / step)) + 1)
        for a, b in zip(low.tolist(), high.tolist(), strict=True)
    ]
    grid = np.vstack([np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2), every[block]])
    grid = grid[np.isin(cKDTree(every).query(grid)[1], block)]
    depth = clearance(outline, grid)
    least = radius + wall
    deepest = float(depth.max(initial=-np.inf))
    for limit in (max(least, _INSIDE * deepest), least):
        deep = grid[depth >= limit]
        for candidates in (_middle_row(deep), deep):
            points = _far_apart(candidates, count)
            if _are_apart(points, count, diameter + wall):
                return points
    raise InvalidSettings(
        f"count: no room for {count} screw holes of {diameter:g} mm with {wall:g} mm of wall; the "
        f"largest circle in the plate is {2.0 * max(deepest, 0.0):.3g} mm wide; choose a "
        "larger plate, or fewer or smaller screws"
    )


def clearance(outline: Outline, points: ArrayLike) -> Reals:
    """Return the exact distance of points from the boundary of a part.

    Parameters
    ----------
    outline
        Outline of the part.
    points : (k, 2) array_like, mm
        The points.

    Returns
    -------
    (k,) float64, mm
        Positive inside the part, negative outside.

    Examples
    --------
    >>> disc = Outline((Loop([[-2.0, 0.0], [2.0, 0.0]], [1.0, 1.0]),))
    >>> clearance(disc, [[0.5, 0.0], [0.0, -3.0]]).round(9).tolist()
    [1.5, -1.0]
    """
    import shapely

    points = np.asarray(points, dtype=np.float64).reshape(-1, 2)
    fine = 1e-4 * min(loop.length for loop in outline.loops)
    solid = outline.polygon(fine)
    shapely.prepare(solid)
    inside = shapely.contains_xy(solid, *points.T)
    distance = np.full(len(points), np.inf)
    for loop in outline.loops:
        distance = np.minimum(distance, _distance(loop, points))
    # The sign is not exact within the distance of an arc and its chord.
    signed: Reals = np.where(inside, distance, -distance)
    return signed


def _distance(loop: Loop, points: Reals) -> Reals:
    """Return the distance of points from a loop."""
    nearest = np.full(len(points), np.inf)
    for start, chord, centre, radius, turn in zip(
        loop.points, loop.chords, loop.centres, loop.radii, loop.turns, strict=True
    ):
        offset = points - start
        if turn == 0.0:
            share = np.clip(offset @ chord / (chord @ chord), 0.0, 1.0)
            away = np.linalg.norm(offset - share[:, None] * chord, axis=1)
        else:
            spoke, arm = start - centre, points - centre
            angle = np.arctan2(spoke[0] * arm[:, 1] - spoke[1] * arm[:, 0], arm @ spoke)
            ahead = np.mod(np.sign(turn) * angle, 2.0 * np.pi)
            ends = np.minimum(
                np.linalg.norm(offset, axis=1), np.linalg.norm(offset - chord, axis=1)
            )
            radial = np.abs(np.linalg.norm(arm, axis=1) - radius)
            away = np.where(ahead <= np.abs(turn), radial, ends)
        nearest = np.minimum(nearest, away)
    return nearest


def _middle_row(points: Reals) -> Reals:
    """Return the points of the row in the middle of a long region; all of another region."""
    if not len(points):
        return points
    low, high = points.min(axis=0), points.max(axis=0)
    across = int(np.argmin(high - low))
    if (high - low)[across] > _NARROW * (high - low)[1 - across]:
        return points
    away = np.abs(points[:, across] - 0.5 * (low + high)[across])
    height = points[int(np.argmin(away)), across]
    row: Reals = points[np.abs(points[:, across] - height) <= 1e-9 * (1.0 + away.max())]
    return row


def _far_apart(points: Reals, count: int) -> Reals:
    """Return points that are as far from each other as possible.

    Each is first placed as far as possible from the previous ones, then from all others in turn.
    """
    if not len(points):
        return points
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    if count == 1:
        return points[[int(np.argmin(np.linalg.norm(points - middle, axis=1)))]]
    chosen = [int(np.argmax(np.linalg.norm(points - middle, axis=1)))]
    away = np.linalg.norm(points - points[chosen[0]], axis=1)
    while len(chosen) < count:
        chosen.append(int(np.argmax(away)))
        away = np.minimum(away, np.linalg.norm(points - points[chosen[-1]], axis=1))
    for _ in range(_SWEEPS):
        before = list(chosen)
        for screw in range(count):
            others = points[chosen[:screw] + chosen[screw + 1 :]]
            away = np.linalg.norm(points[:, None] - others, axis=2).min(axis=1)
            farthest = int(np.argmax(away))
            if away[farthest] > away[chosen[screw]] * (1.0 + 1e-9):
                chosen[screw] = farthest
        if chosen == before:
            break
    return points[chosen]


def _are_apart(points: Reals, count: int, least: float) -> bool:
    """Return whether there are enough points with the least distance."""
    if len(points) < count:
        return False
    away = np.linalg.norm(points[:, None] - points[None], axis=2)
    np.fill_diagonal(away, np.inf)
    return bool(away.min() >= least)


def _read_screw(diameter: float, wall: float) -> float:
    if not 0.0 < diameter < np.inf:
        raise InvalidSettings(f"diameter: expected a length above 0 mm, got {diameter!r}")
    if not 0.0 <= wall < np.inf:
        raise InvalidSettings(f"wall: expected a length of 0 mm or more, got {wall!r}")
    return 0.5 * diameter


def _wall_text(wall: float) -> str:
    return f"a wall of {wall:.3g} mm" if wall > 0.0 else "no wall"
