"""Position of a drawn part in a picture: contrast with the background, then its outline.

The camera of a part without markers follows from the part itself. A coarse similarity is where
the drawing covers most of what differs from the background; a homography then maximises the
correlation of both; finally points of the drawn outline are moved to the edges in the picture.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import UnreadableFilm
from bellcrank.measure.camera import Lens, linearised, transformed
from bellcrank.measure.corners import GAMMA, opencv

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.part import Part

    Values = NDArray[np.float64]
    Picture = NDArray[np.float32]

LEAST_CONTRAST = 0.25
"""Smallest difference between part and background, in logarithms of the light."""
COARSE = 160
"""Longer side of pictures in the coarse search, pixels."""
ANGLES = np.arange(-180.0, 180.0, 5.0)
SIZES = (0.8, 0.87, 0.94, 1.0, 1.07)
"""Sizes in the coarse search, over that of equal areas."""
LEAST_CORRELATION = 0.55
"""Smallest correlation of the drawing with the picture."""
LARGEST_EDGE_ERROR = 0.35
"""Largest median distance of edges from the drawn outline, mm."""
FINE = 3.0
"""Resolution of the drawing in the fine search, pixels per mm."""


@dataclass(frozen=True, slots=True, eq=False)
class Registration:
    """The camera of a picture, from the outline of a part.

    Parameters
    ----------
    lens
        Distortion.
    homography : (3, 3) float64
        From mm of the part at rest to points without distortion.
    error
        Median distance of edges from the drawn outline, mm.
    correlation
        Correlation of the drawing with the picture.
    pixels_per_mm
        Scale of the picture.
    """

    lens: Lens
    homography: Values
    error: float
    correlation: float
    pixels_per_mm: float

    def pixels(self, points: Values) -> Values:
        """Return pixels of points (..., 2), mm."""
        flat = transformed(self.homography, points.reshape(-1, 2))
        return self.lens.pixels(flat).reshape(points.shape)


def contrast_of(grey: NDArray[np.uint8]) -> tuple[Picture, float]:
    """Return by how much a picture differs from its background, 0 to about 1 on the part.

    The logarithm of the light of the background is a polynomial of second degree, fitted to the
    pixels that are not the part.

    Parameters
    ----------
    grey : (height, width) uint8

    Returns
    -------
    (height, width) float32
        Difference over that of the part.
    float
        That of the part, in logarithms of the light; negative for a dark part.
    """
    cv2 = opencv()
    table = (GAMMA * np.log((np.arange(256) + 2.0) / 257.0)).astype(np.float32)
    level = table[grey]
    high, wide = level.shape
    small = cv2.resize(level, (96, max(8, 96 * high // wide)), interpolation=cv2.INTER_AREA)
    base = _quadratic(small.shape)
    weight = np.ones(small.size)
    values = small.ravel().astype(np.float64)
    coefficients = np.zeros(base.shape[1])
    for _ in range(12):
        rows = base * weight[:, None]
        normal = rows.T @ base + 1e-9 * np.eye(base.shape[1])
        coefficients = np.linalg.solve(normal, rows.T @ values)
        off = values - base @ coefficients
        spread = max(1.5 * float(np.median(np.abs(off))), 0.02)
        weight = 1.0 / (1.0 + (off / spread) ** 2) ** 2
    ground = (_quadratic(level.shape) @ coefficients).reshape(level.shape).astype(np.float32)
    difference = level - ground
    part = _part_level(cv2.GaussianBlur(difference, (0, 0), 1.0))
    return (difference / np.float32(part)).astype(np.float32), part


def _quadratic(shape: tuple[int, ...]) -> Values:
    """Return the monomials up to second degree in the pixels of a picture."""
    y, x = (np.linspace(-1.0, 1.0, count) for count in shape)
    u, v = (each.ravel() for each in np.meshgrid(x, y))
    return np.stack([np.ones_like(u), u, v, u * u, u * v, v * v], axis=1)


def _part_level(difference: Picture) -> float:
    """Return the typical difference of the part from the background, by the method of Otsu."""
    cv2 = opencv()
    best, found = 0.0, 1e-6
    for sign in (-1.0, 1.0):
        values = np.clip(sign * difference, 0.0, 3.0)
        scaled = np.round(values * (255.0 / 3.0)).astype(np.uint8)
        threshold, _ = cv2.threshold(scaled, 0, 255, cv2.THRESH_BINARY + cv2.THRESH_OTSU)
        inside = scaled > threshold
        share = float(inside.mean())
        if not 0.002 < share < 0.6:
            continue
        level = float(np.median(values[inside]))
        strength = level * np.sqrt(share)
        if strength > best:
            best, found = strength, sign * level
    return found


def register(name: str, contrast: Picture, level: float, part: Part) -> Registration:
    """Return the camera of a picture of a part at rest.

    Parameters
    ----------
    name
        Name of the film, for messages.
    contrast : (height, width) float32
        Result of `contrast_of`.
    level
        Difference of the part from the background.
    part
        The part.

    Raises
    ------
    UnreadableFilm
        If part and background hardly differ, or the drawn part is not found.
    """
    if abs(level) < LEAST_CONTRAST:
        raise UnreadableFilm(
            f"{name}: part and background hardly differ; film the part before a plain "
            "background that is much lighter or darker"
        )
    guess = _coarse(contrast, part)
    guess, correlation = _correlated(contrast, part, guess)
    if correlation < LEAST_CORRELATION:
        raise UnreadableFilm(
            f"{name}: the drawn part is not found in the first picture (correlation "
            f"{correlation:.2f}, expected {LEAST_CORRELATION:g}); begin at rest, show the whole "
            "part before a plain background, and check that the design is that of the part"
        )
    lens, homography, error = _by_edges(contrast, part, guess)
    middle = part.positions[np.unique(part.struts)].mean(axis=0)
    ends = lens.pixels(transformed(homography, middle + np.array([[-0.5, 0.0], [0.5, 0.0]])))
    if error > LARGEST_EDGE_ERROR:
        raise UnreadableFilm(
            f"{name}: edges deviate from the drawn outline by {error:.2f} mm, expected at most "
            f"{LARGEST_EDGE_ERROR:g} mm; film sharper, at rest first, and check the design"
        )
    scale = float(np.linalg.norm(ends[1] - ends[0]))
    return Registration(lens, homography, error, correlation, scale)


def _drawing(part: Part, scale: float, margin: float) -> tuple[Picture, Values]:
    """Return the drawn part in pixels, and the homography from mm to these pixels."""
    cv2 = opencv()
    loops = [loop.flattened(0.05) for loop in part.outline().loops]
    points = np.concatenate(loops)
    low, high = points.min(axis=0) - margin, points.max(axis=0) + margin
    wide, tall = np.ceil((high - low) * scale).astype(int).tolist()
    matrix = np.array([[scale, 0.0, -scale * low[0]], [0.0, -scale, scale * high[1]], [0, 0, 1.0]])
    canvas = np.zeros((tall, wide), dtype=np.uint8)
    polygons = [np.round(16 * transformed(matrix, loop)).astype(np.int32) for loop in loops]
    cv2.fillPoly(canvas, polygons, 255, shift=4)
    return canvas.astype(np.float32) / 255.0, matrix


def _coarse(contrast: Picture, part: Part) -> Values:
    """Return the similarity (3, 3) from mm to pixels that covers most of the contrast."""
    cv2 = opencv()
    high, wide = contrast.shape
    shrink = COARSE / max(high, wide)
    seen = cv2.resize(np.clip(contrast, 0.0, 1.0), None, fx=shrink, fy=shrink,
                      interpolation=cv2.INTER_AREA)  # fmt: skip
    drawn, to_drawing = _drawing(part, 1.0, 1.0)
    equal = float(np.sqrt(seen.sum() / drawn.sum()))
    size = 2 * COARSE
    spectrum = np.fft.rfft2(seen - seen.mean(), (size, size))
    middle = 0.5 * np.array(drawn.shape[::-1])
    best, found = -np.inf, np.eye(3)
    for factor in SIZES:
        scale = equal * factor
        reach = int(np.ceil(scale * float(np.hypot(*drawn.shape)))) + 2
        if reach > size:
            continue
        smooth = cv2.GaussianBlur(drawn, (0, 0), max(0.5 / scale, 0.3))
        for angle in ANGLES.tolist():
            turn = cv2.getRotationMatrix2D(tuple(middle.tolist()), angle, scale)
            turn[:, 2] += 0.5 * reach - middle
            patch = cv2.warpAffine(smooth, turn, (reach, reach))
            norm = float(np.sqrt((patch**2).sum())) + 1e-9
            product = np.fft.irfft2(spectrum * np.conj(np.fft.rfft2(patch, (size, size))))
            at = int(np.argmax(product))
            value = float(product.ravel()[at]) / norm
            if value > best:
                row, column = divmod(at, size)
                shift = np.array([column - size * (column > size // 2) * 1.0,
                                  row - size * (row > size // 2) * 1.0])  # fmt: skip
                whole = np.vstack([turn, [0.0, 0.0, 1.0]])
                whole[:2, 2] += shift
                best, found = value, whole
    grow = np.diag([1.0 / shrink, 1.0 / shrink, 1.0])
    return np.asarray(grow @ found @ to_drawing)


def _correlated(contrast: Picture, part: Part, guess: Values) -> tuple[Values, float]:
    """Return the homography (3, 3) from mm to pixels of the largest correlation, and that."""
    cv2 = opencv()
    drawn, to_drawing = _drawing(part, FINE, 6.0)
    matrix = guess @ np.linalg.inv(to_drawing)
    seen = np.clip(contrast, -0.2, 1.2)
    correlation = 0.0
    stop = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 60, 1e-5)
    for blur, kind in ((4.0, cv2.MOTION_AFFINE), (3.0, cv2.MOTION_HOMOGRAPHY),
                       (1.5, cv2.MOTION_HOMOGRAPHY), (0.6, cv2.MOTION_HOMOGRAPHY)):  # fmt: skip
        # The picture is first brought to the size of the drawing, then corrected.
        near = cv2.warpPerspective(
            seen, matrix, drawn.shape[::-1], flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        )
        smooth = [cv2.GaussianBlur(each, (0, 0), blur * FINE) for each in (drawn, near)]
        rows = 3 if kind == cv2.MOTION_HOMOGRAPHY else 2
        change = np.eye(3, dtype=np.float32)[:rows]
        try:
            value, change = cv2.findTransformECC(smooth[0], smooth[1], change, kind, stop, None, 1)
        except cv2.error:
            continue
        correlation = float(value)
        matrix = matrix @ np.vstack([change, np.eye(3)[rows:]])
    whole = matrix @ to_drawing
    return np.asarray(whole / whole[2, 2]), correlation


def _by_edges(contrast: Picture, part: Part, guess: Values) -> tuple[Lens, Values, float]:
    """Return lens and homography that move the drawn outline to the edges, and their distance."""
    cv2 = opencv()
    points, normal = _outline_points(part)
    lens = Lens.of_size(contrast.shape[::-1])
    to_ideal = np.array([[1.0 / lens.length, 0.0, -lens.centre[0] / lens.length],
                         [0.0, 1.0 / lens.length, -lens.centre[1] / lens.length],
                         [0.0, 0.0, 1.0]])  # fmt: skip
    middle, size = points.mean(axis=0), float(np.abs(points - points.mean(axis=0)).mean())
    scaling = np.array([[1 / size, 0, -middle[0] / size], [0, 1 / size, -middle[1] / size],
                        [0, 0, 1.0]])  # fmt: skip
    scaled = transformed(scaling, points)
    homography = to_ideal @ guess @ np.linalg.inv(scaling)
    homography = homography / homography[2, 2]
    smooth = cv2.GaussianBlur(contrast, (0, 0), 1.0)
    error, width = np.inf, 1.2
    for step in range(14):
        seen, jacobian = (each[0] for each in linearised(homography[None], lens, scaled))
        ahead = lens.pixels(transformed(homography, transformed(scaling, points + 0.05 * normal)))
        way = (ahead - seen) / 0.05
        per_mm = np.linalg.norm(way, axis=1)
        away = _edge_distance(smooth, seen, way / per_mm[:, None], width * per_mm)
        good = np.isfinite(away)
        if good.sum() < 50:
            return lens, homography @ scaling, np.inf
        spread = 1.5 * float(np.median(np.abs(away[good]))) + 0.05
        weight = np.where(good, 1.0 / (1.0 + (np.nan_to_num(away) / (2.0 * spread)) ** 2), 0.0)
        rows = np.einsum("na,nai->ni", way / per_mm[:, None], jacobian)
        used = 8 if step < 6 else 10
        rows = rows[:, :used] * weight[:, None]
        prior = np.zeros(used)
        prior[8:] = np.array([100.0, 200.0])[: used - 8] * 3.0
        normal_matrix = rows.T @ rows + np.diag(1e-6 * (rows**2).sum(axis=0) + prior**2)
        change = np.linalg.solve(
            normal_matrix,
            rows.T @ (weight * np.nan_to_num(away))
            - prior**2 * np.concatenate([np.zeros(8), lens.radial])[:used],
        )
        homography = homography.copy()
        homography.reshape(-1)[:8] += change[:8]
        if used == 10:
            lens = Lens(lens.centre, lens.length, lens.radial + change[8:])
        error = float(np.median(np.abs(away[good]) / per_mm[good]))
        width = max(0.5, 0.8 * width)
    whole = homography @ scaling
    return lens, whole / whole[2, 2], error


def _outline_points(part: Part) -> tuple[Values, Values]:
    """Return points on the drawn outline, mm, and the normals away from the material."""
    points, normals = [], []
    for loop in part.outline().loops:
        corners = loop.flattened(0.05)
        ends = np.roll(corners, -1, axis=0)
        along = ends - corners
        length = np.linalg.norm(along, axis=1)
        for start, way, long in zip(corners, along, length.tolist(), strict=True):
            count = int(long // 1.0)
            if count:
                share = (np.arange(count) + 0.5) / count
                points.append(start + share[:, None] * way)
                normals.append(np.tile([way[1] / long, -way[0] / long], (count, 1)))
    return np.concatenate(points), np.concatenate(normals)


def _edge_distance(picture: Picture, at: Values, way: Values, reach: Values) -> Values:
    """Return the signed distance (n,), pixels, to the edge from part to background; nan if none."""
    cv2 = opencv()
    offset = np.linspace(-1.0, 1.0, 25) * reach[:, None]
    where = (at[:, None] + offset[..., None] * way[:, None]).astype(np.float32)
    values: Any = cv2.remap(picture, where[..., 0], where[..., 1], cv2.INTER_LINEAR)
    above = values > 0.5
    crosses = above[:, :-1] & ~above[:, 1:]
    nearest = np.where(crosses, np.abs(offset[:, :-1] + offset[:, 1:]), np.inf)
    index = np.argmin(nearest, axis=1)
    row = np.arange(len(at))
    first, second = values[row, index], values[row, index + 1]
    share = (first - 0.5) / np.maximum(first - second, 1e-6)
    found = offset[row, index] + share * (offset[row, index + 1] - offset[row, index])
    return np.where(crosses.any(axis=1), found, np.nan)
