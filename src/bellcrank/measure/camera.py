r"""The camera: a homography in each frame and one radial distortion for all frames.

A point X of the plane is seen at ``c + f d(H X)``, with the middle c of the picture, half its
diagonal f, the homography H of the frame and the radial distortion
``d(x) = x (1 + k1 |x|^2 + k2 |x|^4)``. The coefficients and the homographies follow together from
the corners of the reference markers in all frames, by Gauss-Newton steps with Huber weights. The
homographies are eliminated from each step, because only the two coefficients are shared.

References
----------
D. C. Brown, Photogrammetric Engineering 37, 855 (1971), radial distortion.
Z. Zhang, IEEE Trans. Pattern Anal. Mach. Intell. 22, 1330 (2000), planar patterns.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Values = NDArray[np.float64]

STEPS = 12
"""Largest number of Gauss-Newton steps."""
HUBER = 2.0
"""Residuals beyond this multiple of their spread have less weight."""
OUTLIER = 8.0
"""Residuals beyond half a pixel and this multiple of their spread have no weight."""
NOISE = 0.05
"""Spread of corners that weighs the prior, pixels."""
PRIOR = np.array([0.2, 0.1])
"""Spread of k1 and k2 before any film is seen."""


@dataclass(frozen=True, slots=True, eq=False)
class Lens:
    """Position and radial distortion of pictures.

    Parameters
    ----------
    centre : (2,) float64, pixels
        Middle of the picture.
    length
        Half of its diagonal, pixels.
    radial : (2,) float64
        Coefficients k1 and k2.

    Examples
    --------
    >>> lens = Lens(np.array([639.5, 359.5]), 734.0, np.array([-0.06, 0.01]))
    >>> ideal = np.array([[0.5, -0.4], [0.0, 0.1]])
    >>> bool(np.allclose(lens.ideal(lens.pixels(ideal)), ideal))
    True
    """

    centre: Values
    length: float
    radial: Values

    @staticmethod
    def of_size(size: tuple[int, int], radial: Values | None = None) -> Lens:
        """Return the lens of pictures of a width and height, without distortion by default."""
        wide, high = size
        middle = np.array([0.5 * (wide - 1), 0.5 * (high - 1)])
        return Lens(
            middle, 0.5 * float(np.hypot(wide, high)), np.zeros(2) if radial is None else radial
        )

    def pixels(self, ideal: Values) -> Values:
        """Return pixels of points (..., 2) of the picture without distortion."""
        square = (ideal**2).sum(axis=-1, keepdims=True)
        factor = 1.0 + square * (self.radial[0] + square * self.radial[1])
        return np.asarray(self.centre + self.length * factor * ideal)

    def ideal(self, pixels: Values) -> Values:
        """Return points (..., 2) without distortion for pixels, by Newton steps for the radius."""
        seen = (pixels - self.centre) / self.length
        radius = np.linalg.norm(seen, axis=-1, keepdims=True)
        true = radius.copy()
        for _ in range(8):
            square = true**2
            value = true * (1.0 + square * (self.radial[0] + square * self.radial[1])) - radius
            slope = 1.0 + square * (3.0 * self.radial[0] + 5.0 * square * self.radial[1])
            true = true - value / np.maximum(slope, 0.2)
        return np.asarray(seen * np.divide(true, radius, out=np.ones_like(true), where=radius > 0))


def transformed(matrix: Values, points: Values) -> Values:
    """Return points (..., n, 2) transformed by homographies (..., 3, 3).

    Examples
    --------
    >>> transformed(np.diag([2.0, 2.0, 1.0]), np.array([[1.0, 3.0]])).tolist()
    [[2.0, 6.0]]
    """
    image = points @ np.swapaxes(matrix[..., :2], -1, -2) + matrix[..., None, :, 2]
    return np.asarray(image[..., :2] / image[..., 2:])


def fitted_homography(points: Values, image: Values) -> Values:
    """Return the homography (3, 3) between n >= 4 points by the direct linear transformation.

    Parameters
    ----------
    points, image : (n, 2)
        Corresponding points.

    Examples
    --------
    >>> square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    >>> view = np.array([[2.0, 0.1, 3.0], [0.0, 1.8, 1.0], [0.1, 0.05, 1.0]])
    >>> bool(np.allclose(fitted_homography(square, transformed(view, square)), view))
    True
    """
    before, after = (_normalising(each) for each in (points, image))
    first, second = transformed(before, points), transformed(after, image)
    x, y = first.T
    zero, one = np.zeros_like(x), np.ones_like(x)
    u, v = second.T
    rows = np.concatenate(
        [
            np.stack([x, y, one, zero, zero, zero, -u * x, -u * y, -u], axis=1),
            np.stack([zero, zero, zero, x, y, one, -v * x, -v * y, -v], axis=1),
        ]
    )
    matrix = np.linalg.svd(rows)[2][-1].reshape(3, 3)
    whole = np.linalg.inv(after) @ matrix @ before
    return np.asarray(whole / whole[2, 2])


def _normalising(points: Values) -> Values:
    """Return the similarity that moves points to mean 0 and mean distance of about 1."""
    middle = points.mean(axis=0)
    scale = 1.0 / max(float(np.abs(points - middle).mean()), 1e-12)
    return np.array([[scale, 0.0, -scale * middle[0]], [0.0, scale, -scale * middle[1]],
                     [0.0, 0.0, 1.0]])  # fmt: skip


@dataclass(frozen=True, slots=True, eq=False)
class Views:
    """The camera in F frames, from M reference markers.

    Parameters
    ----------
    lens
        Distortion, equal in all frames.
    homographies : (F, 3, 3) float64
        From mm in the plane of the sheet to points without distortion.
    residual : (F, M, 4, 2) float64, pixels
        Seen less fitted corners; nan where a marker is not seen.
    blocks : (F, M, 10, 10) and (F, M, 10) float64
        Weighted normal equations of each marker at the solution, for `resampled`.
    scaling : (3, 3) float64
        Similarity that scales mm to coordinates of about 1.
    """

    lens: Lens
    homographies: Values
    residual: Values
    blocks: tuple[Values, Values]
    scaling: Values

    def plane(self, pixels: Values) -> Values:
        """Return mm in the plane of the sheet for pixels (F, ..., 2) of each frame."""
        flat = self.lens.ideal(pixels).reshape(len(pixels), -1, 2)
        inverse = np.asarray(np.linalg.inv(self.homographies), dtype=np.float64)
        return transformed(inverse, flat).reshape(pixels.shape)

    def pixels(self, frame: int, points: Values) -> Values:
        """Return pixels of points (..., 2), mm, of the plane in one frame."""
        flat = transformed(self.homographies[frame], points.reshape(-1, 2))
        return self.lens.pixels(flat).reshape(points.shape)

    def resampled(self, counts: Values) -> Views:
        """Return the views when each marker counts so many times, by one Gauss-Newton step.

        Parameters
        ----------
        counts : (M,)
            Weight of each marker.
        """
        matrices, sides = self.blocks
        step, change = _solved(
            np.einsum("m,fmij->fij", counts, matrices), np.einsum("m,fmi->fi", counts, sides),
            self.lens.radial,
        )  # fmt: skip
        lens = Lens(self.lens.centre, self.lens.length, self.lens.radial + change)
        scaled = _normalised(self.homographies @ np.linalg.inv(self.scaling))
        homographies = _normalised(_changed(scaled, step) @ self.scaling)
        return replace(self, lens=lens, homographies=homographies)


def fitted_views(seen: Values, points: Values, size: tuple[int, int]) -> Views:
    """Return the camera for the corners of reference markers.

    Parameters
    ----------
    seen : (F, M, 4, 2), pixels
        Corners in each frame; nan where a marker is not seen. Each frame has two or more markers.
    points : (M, 4, 2), mm
        Corners on the sheet.
    size
        Width and height of the pictures, pixels.

    Examples
    --------
    >>> corners = np.array([[-5.0, 5.0], [5.0, 5.0], [5.0, -5.0], [-5.0, -5.0]])
    >>> places = np.stack(np.meshgrid([0.0, 90.0, 180.0], [0.0, 60.0, 120.0]), axis=-1)
    >>> points = places.reshape(-1, 1, 2) + corners
    >>> view = np.array([[9e-3, 1e-3, -0.8], [-1e-3, -9e-3, 0.5], [2e-4, 4e-4, 1.0]])
    >>> lens = Lens.of_size((1280, 720), np.array([-0.08, 0.02]))
    >>> seen = lens.pixels(transformed(view, points))
    >>> fitted_views(seen[None], points, (1280, 720)).lens.radial.round(3).tolist()
    [-0.08, 0.02]
    """
    scaling = _normalising(points.reshape(-1, 2))
    scaled = transformed(scaling, points.reshape(-1, 2))
    flat = seen.reshape(len(seen), -1, 2)
    known: NDArray[np.bool_] = np.asarray(np.isfinite(flat).all(axis=-1))
    lens = Lens.of_size(size)
    ideal = lens.ideal(flat)
    homographies = np.stack(
        [fitted_homography(scaled[good], one[good]) for good, one in zip(known, ideal, strict=True)]
    )
    weight: Values = known.astype(np.float64)
    for _ in range(STEPS):
        predicted, jacobian = linearised(homographies, lens, scaled)
        residual = np.where(known[..., None], flat - predicted, 0.0)
        size_of = np.linalg.norm(residual, axis=-1)
        spread = 1.2 * float(np.median(size_of[known])) + 1e-9
        weight = known * np.minimum(1.0, HUBER * spread / np.maximum(size_of, 1e-12))
        weight *= size_of < OUTLIER * spread + 0.5
        normal, side = _blocks(jacobian, residual, weight)
        step, change = _solved(normal.sum(axis=1), side.sum(axis=1), lens.radial)
        homographies = _changed(homographies, step)
        lens = Lens(lens.centre, lens.length, lens.radial + change)
        if np.abs(change).max() < 1e-7 and np.abs(step).max() < 1e-8:
            break
    predicted, jacobian = linearised(homographies, lens, scaled)
    residual = flat - predicted
    blocks = _blocks(jacobian, np.where(known[..., None], residual, 0.0), weight)
    whole = _normalised(homographies @ scaling)
    return Views(lens, whole, residual.reshape(seen.shape), blocks, scaling)


def linearised(homographies: Values, lens: Lens, points: Values) -> tuple[Values, Values]:
    """Return pixels (F, n, 2) and their derivatives (F, n, 2, 10) by homography and radial."""
    source = np.concatenate([points, np.ones((len(points), 1))], axis=1)
    image = source @ np.swapaxes(homographies, -1, -2)
    depth = image[..., 2:]
    ideal = image[..., :2] / depth
    square = (ideal**2).sum(axis=-1)
    k1, k2 = lens.radial
    factor = 1.0 + square * (k1 + k2 * square)
    inner = 2.0 * k1 + 4.0 * k2 * square
    by_ideal = factor[..., None, None] * np.eye(2) + inner[..., None, None] * (
        ideal[..., :, None] * ideal[..., None, :]
    )
    by_entries = np.zeros((*ideal.shape, 8))
    rows = source[None] / depth
    by_entries[..., 0, :3], by_entries[..., 1, 3:6] = rows, rows
    by_entries[..., 6:] = -ideal[..., :, None] * rows[..., None, :2]
    jacobian = np.empty((*ideal.shape, 10))
    jacobian[..., :8] = by_ideal @ by_entries
    jacobian[..., 8] = ideal * square[..., None]
    jacobian[..., 9] = ideal * square[..., None] ** 2
    return lens.centre + lens.length * factor[..., None] * ideal, lens.length * jacobian


def _blocks(jacobian: Values, residual: Values, weight: Values) -> tuple[Values, Values]:
    """Return the normal equations of each marker, (F, M, 10, 10) and (F, M, 10)."""
    frames = len(jacobian)
    rows = jacobian.reshape(frames, -1, 8, 10)
    weights = np.repeat(weight, 2, axis=-1).reshape(frames, -1, 8)
    weighted = rows * weights[..., None]
    return (
        np.swapaxes(weighted, -1, -2) @ rows,
        np.einsum("fmri,fmr->fmi", weighted, residual.reshape(frames, -1, 8)),
    )


def _solved(normal: Values, side: Values, radial: Values) -> tuple[Values, Values]:
    """Return the steps of homographies (F, 8) and of the radial coefficients (2,)."""
    own, mixed, shared = normal[:, :8, :8], normal[:, :8, 8:], normal[:, 8:, 8:]
    own = own + 1e-12 * np.trace(own, axis1=1, axis2=2)[:, None, None] * np.eye(8)
    solution = np.linalg.solve(own, np.concatenate([mixed, side[:, :8, None]], axis=2))
    prior = (NOISE / PRIOR) ** 2
    matrix = (shared - np.swapaxes(mixed, 1, 2) @ solution[..., :2]).sum(axis=0) + np.diag(prior)
    right = side[:, 8:].sum(axis=0) - np.einsum("fij,fi->j", mixed, solution[..., 2])
    change = np.linalg.solve(matrix, right - prior * radial)
    return solution[..., 2] - solution[..., :2] @ change, change


def _changed(homographies: Values, step: Values) -> Values:
    """Return homographies after a step of their first eight entries."""
    changed = homographies.copy()
    changed.reshape(len(changed), 9)[:, :8] += step
    return changed


def _normalised(homographies: Values) -> Values:
    """Return homographies with a last entry of 1."""
    return np.asarray(homographies / homographies[:, 2:, 2:])
