"""Solids: closed surfaces of triangles, extruded from outlines."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.export.flattening import SAGITTA, polygons_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.part.outline import Outline


@dataclass(frozen=True, slots=True, eq=False)
class Solid:
    """A closed surface of triangles.

    Parameters
    ----------
    vertices : (V, 3) float64, mm
        Distinct vertices.
    triangles : (T, 3) int64
        Vertices of each triangle, counterclockwise as seen from outside.
    """

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int64]

    def __post_init__(self) -> None:
        for name, kind in (("vertices", np.float64), ("triangles", np.int64)):
            array = np.array(getattr(self, name), dtype=kind, order="C")
            if array.ndim != 2 or array.shape[1] != 3:
                raise InvalidSettings(f"{name}: expected shape (n, 3), got shape {array.shape}")
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.vertices, self.triangles)

    @property
    def volume(self) -> float:
        """Enclosed volume, mm^3."""
        # Relative to one vertex: coordinates far from the origin would lose digits.
        a, b, c = (self.vertices - self.vertices[0])[self.triangles].transpose(1, 0, 2)
        return float(np.sum(a * np.cross(b, c)) / 6.0)

    @property
    def euler_number(self) -> int:
        """Vertices - edges + triangles: 2 for each piece, minus 2 for each hole."""
        return len(self.vertices) - len(self.triangles) // 2

    def on_bed(self) -> Solid:
        """Return the solid translated so that its smallest coordinates are 0."""
        return Solid(self.vertices - self.vertices.min(axis=0), self.triangles)


def extruded(outline: Outline, thickness: float, sagitta: float = SAGITTA) -> Solid:
    """Return the prism over an outline, from z = 0 up.

    Its volume is the area of the outline times the thickness, up to rounding to single precision:
    the polygons have the exact area of the arcs (`bellcrank.export.flattening`).

    Parameters
    ----------
    outline
        Outline of the part.
    thickness : float, mm
        Thickness of the part.
    sagitta : float, mm
        Largest distance between an arc and the surface.

    Raises
    ------
    InvalidSettings
        If a length is not valid, or surfaces are too close to separate.

    Examples
    --------
    A ring has one hole, so that its Euler number is 0:

    >>> from bellcrank.part.outline import Loop, Outline
    >>> around = Loop([[-5.0, 0.0], [5.0, 0.0]], [1.0, 1.0])
    >>> inside = Loop([[-3.0, 0.0], [3.0, 0.0]], [-1.0, -1.0])
    >>> ring = extruded(Outline((around,), (inside,)), 2.0)
    >>> round(ring.volume / (32.0 * np.pi), 6), ring.euler_number
    (1.0, 0)
    """
    import manifold3d

    if not 0.0 < thickness < float("inf"):
        raise InvalidSettings(f"thickness: expected a length above 0 mm, got {thickness!r}")
    polygons = polygons_of(outline, sagitta)
    flat = np.concatenate(polygons)
    count = len(flat)
    # Triangulated near the origin to minimise rounding errors.
    middle = flat[0]
    top = manifold3d.triangulate([polygon - middle for polygon in polygons]).astype(np.int64)
    sizes = np.array([len(polygon) for polygon in polygons])
    first = np.repeat(np.cumsum(sizes) - sizes, sizes)
    here = np.arange(count)
    onward = first + (here - first + 1) % np.repeat(sizes, sizes)
    walls = np.concatenate(
        [
            np.column_stack([here, onward, onward + count]),
            np.column_stack([here, onward + count, here + count]),
        ]
    )
    vertices = np.zeros((2 * count, 3))
    vertices[:count, :2] = vertices[count:, :2] = flat
    vertices[count:, 2] = thickness
    return Solid(vertices, np.concatenate([top[:, ::-1], top + count, walls]))


def whole_layers(thickness: float, layer: float) -> float:
    """Return the thickness of whole layers nearest to a thickness, mm.

    Parameters
    ----------
    thickness, layer : float, mm
        Wanted thickness, and height of a layer.

    Raises
    ------
    InvalidSettings
        If the part is thinner than one layer, or a length is not valid.

    Examples
    --------
    >>> whole_layers(5.0, 0.32), whole_layers(4.9, 0.32), whole_layers(5.0, 0.2)
    (5.12, 4.8, 5.0)
    """
    for name, value in (("thickness", thickness), ("layer", layer)):
        if not 0.0 < value < float("inf"):
            raise InvalidSettings(f"{name}: expected a length above 0 mm, got {value!r}")
    if thickness < (1.0 - 1e-9) * layer:
        raise InvalidSettings(
            f"thickness: {thickness:g} mm is less than one layer of {layer:g} mm; choose a thicker "
            "part or thinner layers"
        )
    return round(round(thickness / layer) * layer, 9)
