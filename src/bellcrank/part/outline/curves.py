"""Closed curves of lines and circular arcs, and outlines that consist of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidSettings

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray
    from shapely import MultiPolygon, Polygon


@dataclass(frozen=True, slots=True, eq=False)
class Loop:
    """A closed curve of lines and circular arcs, with material to its left.

    An outer boundary is counterclockwise, a hole clockwise.

    Parameters
    ----------
    points : (n, 2) float64, mm
        Corners in order; the last is connected to the first.
    bulge : (n,) float64
        Bulge of the edge from each point to the next, as in DXF: 0 for a line, otherwise the
        tangent of a quarter of the angle of the arc, positive for a counterclockwise arc. No edge
        turns by more than half a circle.

    Raises
    ------
    InvalidSettings
        If a shape is wrong, a number is not finite, or an edge turns by more than half a circle.

    Examples
    --------
    >>> disc = Loop([[-1.0, 0.0], [1.0, 0.0]], [1.0, 1.0])
    >>> round(disc.area, 12), round(disc.length, 12)
    (3.14159265359, 6.28318530718)
    >>> disc.radii
    array([1., 1.])
    >>> disc.bounds
    (-1.0, -1.0, 1.0, 1.0)
    """

    points: NDArray[np.float64]
    bulge: NDArray[np.float64]

    def __post_init__(self) -> None:
        points, bulge = _locked("points", self.points), _locked("bulge", self.bulge)
        if points.ndim != 2 or points.shape[1] != 2 or len(points) < 2:
            raise InvalidSettings(
                f"points: expected shape (n, 2) with n >= 2, got shape {points.shape}"
            )
        if bulge.shape != (len(points),):
            raise InvalidSettings(
                f"bulge: expected shape ({len(points)},), one for each of the points, "
                f"got shape {bulge.shape}"
            )
        wide = np.flatnonzero(np.abs(bulge) > 1.0 + 1e-9)
        if len(wide):
            raise InvalidSettings(
                f"bulge[{wide[0]}]: expected at most 1 (half a circle), got "
                f"{bulge[wide[0]]:g}; split the arc in two"
            )
        object.__setattr__(self, "points", points)
        object.__setattr__(self, "bulge", bulge)

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.points, self.bulge)

    @property
    def turns(self) -> NDArray[np.float64]:
        """Angle by which each edge turns, (n,), positive counterclockwise; 0 for lines."""
        return 4.0 * np.arctan(self.bulge)

    @property
    def chords(self) -> NDArray[np.float64]:
        """Vector from the start of each edge to its end, (n, 2), mm."""
        vectors: NDArray[np.float64] = np.roll(self.points, -1, axis=0) - self.points
        return vectors

    @property
    def radii(self) -> NDArray[np.float64]:
        """Radius of each arc, (n,), mm; inf for lines."""
        return _divided(
            np.linalg.norm(self.chords, axis=1) * (1.0 + self.bulge**2), 4.0 * np.abs(self.bulge)
        )

    @property
    def centres(self) -> NDArray[np.float64]:
        """Centre of each arc, (n, 2), mm; nan for lines."""
        chords = self.chords
        left = np.column_stack([-chords[:, 1], chords[:, 0]])
        height = _divided(1.0 - self.bulge**2, 4.0 * self.bulge)
        height[self.bulge == 0.0] = np.nan
        centres: NDArray[np.float64] = self.points + 0.5 * chords + height[:, None] * left
        return centres

    @property
    def edge_lengths(self) -> NDArray[np.float64]:
        """Length of each edge along the curve, (n,), mm."""
        chord = np.linalg.norm(self.chords, axis=1)
        half = 0.5 * np.abs(self.turns)
        lengths: NDArray[np.float64] = chord / np.sinc(half / np.pi)
        return lengths

    @property
    def length(self) -> float:
        """Length of the loop, mm."""
        return float(self.edge_lengths.sum())

    @property
    def area(self) -> float:
        """Exact enclosed area, mm^2; negative for a clockwise loop."""
        # Relative to one of the points: coordinates far from the origin would lose digits.
        x, y = (self.points - self.points[0]).T
        arc = self.bulge != 0.0
        turn = self.turns[arc]
        segments = 0.5 * self.radii[arc] ** 2 * (turn - np.sin(turn))
        corners = 0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)
        return float(corners + segments.sum())

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """Minimum x and y, maximum x and y, mm, including arcs."""
        arc = self.bulge != 0.0
        centres, radii, turns = self.centres[arc], self.radii[arc], self.turns[arc]
        start = np.arctan2(*(self.points[arc] - centres).T[::-1])
        extremes = [self.points]
        for x, y in ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)):
            ahead = np.mod(np.sign(turns) * (np.arctan2(y, x) - start), 2.0 * np.pi)
            passed = ahead < np.abs(turns)
            extremes.append(centres[passed] + radii[passed, None] * np.array([x, y]))
        corners = np.vstack(extremes)
        low, high = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
        return low[0], low[1], high[0], high[1]

    def flattened(self, sagitta: float) -> NDArray[np.float64]:
        """Return points along the loop whose chords deviate from arcs by at most `sagitta` mm.

        Parameters
        ----------
        sagitta
            Largest distance between an arc and its chord, mm.

        Returns
        -------
        (m, 2) float64, mm
            All corners and the points between; the last is connected to the first.

        Raises
        ------
        InvalidSettings
            If `sagitta` is not above 0.

        Examples
        --------
        >>> len(Loop([[-1.0, 0.0], [1.0, 0.0]], [1.0, 1.0]).flattened(0.01))
        24
        """
        if not 0.0 < sagitta < float("inf"):
            raise InvalidSettings(f"sagitta: expected a length above 0 mm, got {sagitta!r}")
        arc = np.flatnonzero(self.bulge)
        radii, turns = self.radii[arc], self.turns[arc]
        step = 2.0 * np.arccos(np.clip(1.0 - sagitta / radii, 0.0, 1.0))
        # For an arc much flatter than the sagitta the step is rounded to 0.
        step = np.maximum(step, np.sqrt(2.0 * sagitta / radii))
        parts = np.ones(len(self.points), dtype=np.int64)
        parts[arc] = np.ceil(np.abs(turns) / step).clip(1)
        edge = np.repeat(np.arange(len(self.points)), parts)
        share = (np.arange(len(edge)) - np.repeat(np.cumsum(parts) - parts, parts)) / parts[edge]
        flat = self.points[edge] + share[:, None] * self.chords[edge]
        curved = (self.bulge[edge] != 0.0) & (share > 0.0)
        edge, angle = edge[curved], share[curved] * self.turns[edge[curved]]
        spoke = self.points[edge] - self.centres[edge]
        normal = np.column_stack([-spoke[:, 1], spoke[:, 0]])
        flat[curved] = (
            self.centres[edge] + np.cos(angle)[:, None] * spoke + np.sin(angle)[:, None] * normal
        )
        return flat


@dataclass(frozen=True, slots=True, eq=False)
class Outline:
    """The boundary of a planar part.

    Parameters
    ----------
    outer
        Outer loops, counterclockwise, one for each separate piece.
    holes
        Loops around holes, clockwise.

    Raises
    ------
    InvalidSettings
        If there is no outer loop, or a loop has the wrong orientation.

    Examples
    --------
    >>> square = Loop([[0, 0], [4, 0], [4, 4], [0, 4]], [0, 0, 0, 0])
    >>> hole = Loop([[1.0, 2.0], [3.0, 2.0]], [-1.0, -1.0])
    >>> washer = Outline((square,), (hole,))
    >>> round(washer.area, 9), washer.hole_count, washer.bounds
    (12.858407346, 1, (0.0, 0.0, 4.0, 4.0))
    >>> round(washer.scaled(2.0).area, 9)
    51.433629386
    """

    outer: tuple[Loop, ...]
    holes: tuple[Loop, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "outer", tuple(self.outer))
        object.__setattr__(self, "holes", tuple(self.holes))
        if not self.outer:
            raise InvalidSettings("outer: expected one loop or more, got none")
        for name, loops, sign in (("outer", self.outer, 1.0), ("holes", self.holes, -1.0)):
            for k, loop in enumerate(loops):
                if not sign * loop.area > 0.0:
                    turn = "counterclockwise" if sign > 0.0 else "clockwise"
                    raise InvalidSettings(
                        f"{name}[{k}]: expected a {turn} loop, got area {loop.area:g}"
                    )

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.outer, self.holes)

    @property
    def loops(self) -> tuple[Loop, ...]:
        """Outer loops, then holes."""
        return self.outer + self.holes

    @property
    def piece_count(self) -> int:
        """Number of separate pieces."""
        return len(self.outer)

    @property
    def hole_count(self) -> int:
        """Number of holes."""
        return len(self.holes)

    @property
    def edge_count(self) -> int:
        """Number of lines and arcs."""
        return sum(len(loop.points) for loop in self.loops)

    @property
    def area(self) -> float:
        """Exact area, mm^2."""
        return float(np.sum([loop.area for loop in self.loops]))

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """Minimum x and y, maximum x and y, mm, including arcs."""
        every = np.array([loop.bounds for loop in self.outer])
        low, high = every[:, :2].min(axis=0).tolist(), every[:, 2:].max(axis=0).tolist()
        return low[0], low[1], high[0], high[1]

    def scaled(self, factor: float) -> Outline:
        """Return the outline scaled by `factor` about the origin.

        Raises
        ------
        InvalidSettings
            If `factor` is not above 0.
        """
        if not 0.0 < factor < float("inf"):
            raise InvalidSettings(f"factor: expected a number above 0, got {factor!r}")
        return self._moved(factor, np.zeros(2))

    def translated(self, offset: ArrayLike) -> Outline:
        """Return the outline moved by `offset` (x, y), mm."""
        return self._moved(1.0, np.asarray(offset, dtype=np.float64))

    def _moved(self, factor: float, offset: NDArray[np.float64]) -> Outline:
        outer, holes = (
            tuple(Loop(factor * loop.points + offset, loop.bulge) for loop in loops)
            for loops in (self.outer, self.holes)
        )
        return Outline(outer, holes)

    def polygon(self, sagitta: float = 0.01) -> Polygon | MultiPolygon:
        """Return polygons whose sides deviate from the arcs by at most `sagitta` mm.

        Returns
        -------
        shapely Polygon, or MultiPolygon if the part has more than one piece
        """
        from shapely import MultiPolygon, Polygon, STRtree

        shells = [Polygon(loop.flattened(sagitta)) for loop in self.outer]
        holes = [loop.flattened(sagitta) for loop in self.holes]
        inside: list[list[NDArray[np.float64]]] = [[] for _ in shells]
        if len(shells) == 1:
            return Polygon(shells[0].exterior, holes)
        if holes:
            hole, around = STRtree(shells).query([Polygon(corners) for corners in holes], "within")
            # Pieces may be inside holes of others: a hole belongs to the smallest shell around it.
            sizes = np.array([shell.area for shell in shells])
            order = np.lexsort((sizes[around], hole))
            _, first = np.unique(hole[order], return_index=True)
            for k in order[first].tolist():
                inside[around[k]].append(holes[hole[k]])
        return MultiPolygon(
            [Polygon(shell.exterior, inner) for shell, inner in zip(shells, inside, strict=True)]
        )


def _locked(name: str, values: ArrayLike) -> NDArray[np.float64]:
    array = np.array(values, dtype=np.float64, order="C", copy=True)
    if not np.isfinite(array).all():
        where = "".join(f"[{k}]" for k in np.argwhere(~np.isfinite(array))[0])
        raise InvalidSettings(f"{name}{where}: expected a finite number")
    array.flags.writeable = False
    return array


def _divided(above: NDArray[np.float64], below: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the quotient; inf where `below` is 0."""
    flat = below == 0.0
    quotient: NDArray[np.float64] = np.where(flat, np.inf, above / np.where(flat, 1.0, below))
    return quotient
