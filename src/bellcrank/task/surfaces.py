"""Closed surfaces of triangles from STL files."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidFile, InvalidSettings

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

TILT = np.array([[1.0, 3.1e-5, 7.3e-5], [-3.1e-5, 1.0, 4.7e-5], [-7.3e-5, -4.7e-5, 1.0]])
"""A small turn, so that no ray meets an edge of a regular surface."""
DIGITS = 7
"""Digits, of the size of a surface, in which equal corners agree."""
TINY = 1e-300


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """A closed surface of triangles.

    Parameters
    ----------
    corners : (T, 3, 3)
        Corners of the triangles, mm.
    """

    corners: NDArray[np.float64]

    @property
    def low(self) -> NDArray[np.float64]:
        """(3,) smallest coordinates."""
        low: NDArray[np.float64] = self.corners.min(axis=(0, 1))
        return low

    @property
    def high(self) -> NDArray[np.float64]:
        """(3,) largest coordinates."""
        high: NDArray[np.float64] = self.corners.max(axis=(0, 1))
        return high

    def joined(self) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Return (p, 3) different corners and (T, 3) their numbers in each triangle."""
        corners = self.corners.reshape(-1, 3)
        size = np.ptp(corners, axis=0).max()
        _, first, number = np.unique(
            (corners / max(size, TINY)).round(DIGITS), axis=0, return_index=True,
            return_inverse=True,
        )  # fmt: skip
        return corners[first], number.reshape(-1, 3)

    @property
    def is_closed(self) -> bool:
        """Whether each edge belongs to as many triangles in one direction as in the other."""
        if len(self.corners) < 4:
            return False
        _, triangles = self.joined()
        edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
        edges = edges[edges[:, 0] != edges[:, 1]]
        forward, count = np.unique(edges, axis=0, return_counts=True)
        backward, other = np.unique(edges[:, ::-1], axis=0, return_counts=True)
        closed = np.array_equal(forward, backward) and np.array_equal(count, other)
        return bool(len(edges)) and closed

    def contains(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return (n,) which points (n, 3) the surface encloses.

        A ray upward from a point inside meets the surface an odd number of times.
        """
        turned = points @ TILT.T
        order = np.argsort(turned[:, 0])
        x, y, z = turned[order].T
        crossings = np.zeros(len(points), dtype=np.int64)
        for a, b, c in self.corners @ TILT.T:
            begin = np.searchsorted(x, min(a[0], b[0], c[0]))
            end = np.searchsorted(x, max(a[0], b[0], c[0]), side="right")
            size = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])
            if begin == end or size == 0.0:
                continue
            px, py = x[begin:end] - a[0], y[begin:end] - a[1]
            s = (px * (c[1] - a[1]) - py * (c[0] - a[0])) / size
            t = (py * (b[0] - a[0]) - px * (b[1] - a[1])) / size
            height = a[2] + s * (b[2] - a[2]) + t * (c[2] - a[2])
            hit = (s >= 0.0) & (t >= 0.0) & (s + t <= 1.0) & (height > z[begin:end])
            crossings[begin:end] += hit
        inside = np.zeros(len(points), dtype=bool)
        inside[order] = crossings % 2 == 1
        return inside


def read_surface(path: Path) -> Surface:
    """Read a closed surface from an STL file in mm.

    Raises
    ------
    InvalidFile
        If the file cannot be read, or the surface is not closed.
    InvalidSettings
        If meshio is not installed.
    """
    try:
        import meshio
    except ImportError:
        raise InvalidSettings(
            "domains from STL files need meshio; install it with: pip install bellcrank[files]"
        ) from None
    if path.suffix.lower() != ".stl":
        raise InvalidFile(f"domain.outline: expected an STL file in space, got {path}")
    if not path.is_file():
        raise InvalidFile(f"domain.outline: {path}: no such file")
    try:
        with np.errstate(over="ignore"):  # of a number that a text file does not have
            mesh = meshio.read(path, file_format="stl")
        triangles = np.concatenate([block.data for block in mesh.cells if block.type == "triangle"])
    except (meshio.ReadError, ValueError, IndexError, OSError) as error:
        raise InvalidFile(f"domain.outline: {path}: not a valid STL file ({error})") from None
    corners = np.asarray(mesh.points, dtype=np.float64)[triangles]
    surface = Surface(corners)
    if not np.isfinite(corners).all() or not surface.is_closed:
        raise InvalidFile(f"domain.outline: {path}: expected a closed surface, got one with gaps")
    return surface
