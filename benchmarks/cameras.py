"""Cameras that see a sheet, for rendered films.

They do not use the code that measures films: a pinhole with Brown's radial and tangential
distortion.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import cv2
import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    Values = NDArray[np.float64]

GRID = 8
"""Distance of the points at which rays are computed, pixels; linear between them."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Camera:
    """A camera above the sheet.

    Parameters
    ----------
    size
        Width and height, pixels.
    focal
        Focal length, pixels.
    principal : (2,)
        Principal point, pixels.
    distortion : (4,)
        Brown's k1, k2, p1, p2.
    rotation : (3, 3)
        From the coordinates of the sheet to those of the camera.
    position : (3,)
        Position of the camera, mm.
    """

    size: tuple[int, int]
    focal: float
    principal: Values
    distortion: Values
    rotation: Values
    position: Values

    def project(self, points: Values, height: float) -> Values:
        """Return pixels of points (..., 2), mm, at a height above the sheet."""
        whole = np.concatenate([points, np.full((*points.shape[:-1], 1), height)], axis=-1)
        seen = (whole - self.position) @ self.rotation.T
        return self._distorted(seen[..., :2] / seen[..., 2:]) * self.focal + self.principal

    def _distorted(self, flat: Values) -> Values:
        k1, k2, p1, p2 = self.distortion
        x, y = flat[..., 0], flat[..., 1]
        square = x * x + y * y
        factor = 1.0 + square * (k1 + k2 * square)
        return np.stack(
            [
                x * factor + 2 * p1 * x * y + p2 * (square + 2 * x * x),
                y * factor + p1 * (square + 2 * y * y) + 2 * p2 * x * y,
            ],
            axis=-1,
        )

    def on_sheet(self, pixels: Values) -> Values:
        """Return the points (..., 2), mm, of the sheet that are seen at pixels."""
        seen = (pixels - self.principal) / self.focal
        flat = seen.copy()
        for _ in range(25):
            flat = flat + (seen - self._distorted(flat))
        rays = np.concatenate([flat, np.ones((*flat.shape[:-1], 1))], axis=-1) @ self.rotation
        return self.position[:2] - rays[..., :2] * (self.position[2] / rays[..., 2:])

    def fine_map(self, samples: int) -> NDArray[np.float32]:
        """Return the point of the sheet (height, width, 2) behind each sample of each pixel."""
        wide, high = self.size
        x, y = np.arange(-GRID, wide + GRID + 1, GRID), np.arange(-GRID, high + GRID + 1, GRID)
        coarse = self.on_sheet(np.stack(np.meshgrid(x, y), axis=-1).astype(float))
        step = 1.0 / samples
        at_x = ((np.arange(wide * samples) + 0.5) * step - 0.5 + GRID) / GRID
        at_y = ((np.arange(high * samples) + 0.5) * step - 0.5 + GRID) / GRID
        return _bilinear(coarse.astype(np.float32), at_x, at_y)


def _bilinear(source: NDArray[np.float32], x: Values, y: Values) -> NDArray[np.float32]:
    """Return bilinear values of a grid; cv2.remap rounds positions to 1/32, this does not."""
    left, low = np.floor(x).astype(int), np.floor(y).astype(int)
    across = (x - left).astype(np.float32)[:, None]
    down = (y - low).astype(np.float32)[:, None, None]
    lines = source[low] + down * (source[low + 1] - source[low])
    first = lines[:, left]
    return first + across * (lines[:, left + 1] - first)


def camera_over(
    low: Values, high: Values, size: tuple[int, int], rng: np.random.Generator, *,
    tilt: float, focal: float, distortion: Values, fill: float = 0.93, principal: float = 0.008,
    roll: float = 3.0,
) -> Camera:  # fmt: skip
    """Return a camera that sees a rectangle of the sheet.

    Parameters
    ----------
    low, high : (2,), mm
        Corners of the rectangle, which fills the picture up to `fill`.
    tilt, roll
        Angle between the axis of the camera and the normal of the sheet, about a random axis;
        standard deviation of the rotation about the axis; degrees.
    focal
        Focal length over the width of the picture.
    principal
        Standard deviation of the principal point over the width.
    """
    way = rng.uniform(0.0, 2.0 * np.pi)
    axis = np.array([np.cos(way), np.sin(way), 0.0])
    lean = cv2.Rodrigues(np.radians(tilt) * axis)[0]
    spin = cv2.Rodrigues(np.radians(rng.normal(0.0, roll)) * np.array([0.0, 0.0, 1.0]))[0]
    rotation = spin @ lean @ np.diag([1.0, -1.0, -1.0])
    middle = 0.5 * np.array(size) - 0.5
    point = middle + rng.normal(0.0, principal * size[0], 2)
    edge = np.array([[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]])
    corners = np.concatenate([edge, 0.5 * (edge + np.roll(edge, 1, axis=0))])
    centre = np.append(0.5 * (low + high), 0.0)
    distance = 1.2 * float(np.hypot(*(high - low)))
    camera = None
    for _ in range(80):
        position = centre - distance * rotation[2]
        camera = Camera(
            size=size, focal=focal * size[0], principal=point, distortion=distortion,
            rotation=rotation, position=position,
        )  # fmt: skip
        seen = camera.project(corners, 0.0)
        # Aim at the middle of what is seen.
        aim = camera.on_sheet(0.5 * (seen.min(axis=0) + seen.max(axis=0))[None])[0]
        own = camera.on_sheet(middle[None])[0]
        centre[:2] += 0.7 * (aim - own)
        reach = (np.ptp(seen, axis=0) / np.array(size)).max() / fill
        distance *= float(reach**0.7)
    assert camera is not None
    return camera


def random_camera(
    low: Values, high: Values, size: tuple[int, int], rng: np.random.Generator
) -> Camera:
    """Return a random camera: up to 20 degrees of tilt, and distortion as of phones and more."""
    distortion = [rng.uniform(-0.08, 0.06), rng.uniform(-0.02, 0.02), *rng.normal(0.0, 2e-4, 2)]
    return camera_over(
        low, high, size, rng, tilt=rng.uniform(0.0, 20.0), focal=rng.uniform(0.72, 1.1),
        distortion=np.array(distortion),
    )  # fmt: skip


def moved_by_hand(camera: Camera, count: int, rng: np.random.Generator) -> Iterator[Camera]:
    """Yield cameras that move by some mm and tenths of a degree."""
    position, turn = camera.position, np.zeros(3)
    for _ in range(count):
        position = position + rng.normal(0.0, 0.6, 3)
        turn = turn + rng.normal(0.0, 6e-4, 3)
        yield replace(camera, rotation=cv2.Rodrigues(turn)[0] @ camera.rotation, position=position)
