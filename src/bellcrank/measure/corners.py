"""Detection of markers, with corners from the edges of their squares."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.measure.layout import DICTIONARY, MODULES

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Values = NDArray[np.float64]

SAMPLES = 32
"""Number of profiles across each edge of a marker."""
ENDS = 0.14
"""Part of an edge at each end that is left out, where the other edge is near."""
GAMMA = 2.2
"""Exponent of the response of cameras: edges are where the light, not the grey level, is halved."""
REACH = 0.75
"""Largest half length of profiles, modules of the marker."""
LEAST_REACH, MOST_REACH = 3.0, 9.0
"""Smallest and largest half length of profiles, pixels."""
PROFILE = 3.5
"""Half length of profiles over the blur of the edges."""


_light = (np.arange(256, dtype=np.float32) / 255.0) ** GAMMA
"""Light for each grey level."""


def opencv() -> Any:
    """Return the module cv2 (OpenCV).

    Raises
    ------
    InvalidSettings
        If it is not installed.
    """
    try:
        import cv2
    except ImportError as missing:
        raise InvalidSettings(
            "markers and films need OpenCV; install it with: pip install 'bellcrank[measure]'"
        ) from missing
    return cv2


@dataclass(frozen=True, slots=True, eq=False)
class Detection:
    """Markers that are seen in a picture.

    Parameters
    ----------
    ids : (n,) int64
        Numbers in the dictionary.
    corners : (n, 4, 2) float64, pixels
        Corners, clockwise from the upper left of the marker.
    blur : (n,) float64, pixels
        Standard deviation of the transition from black to white at the edges.
    """

    ids: NDArray[np.int64]
    corners: Values
    blur: Values


@lru_cache(maxsize=1)
def _detector() -> Any:
    cv2 = opencv()
    settings = cv2.aruco.DetectorParameters()
    settings.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_NONE
    settings.adaptiveThreshWinSizeMax = 43
    # Blurred edges between modules are not read.
    settings.perspectiveRemovePixelPerCell = 8
    settings.perspectiveRemoveIgnoredMarginPerCell = 0.25
    settings.adaptiveThreshWinSizeStep = 20
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, DICTIONARY))
    return cv2.aruco.ArucoDetector(dictionary, settings)


def marker_modules(number: int) -> NDArray[np.bool_]:
    """Return which modules of a marker are white, (6, 6), from its upper left corner.

    Examples
    --------
    >>> marker_modules(3).astype(int).tolist()[1:3]
    [[0, 1, 0, 0, 1, 0], [0, 1, 0, 0, 1, 0]]
    """
    cv2 = opencv()
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, DICTIONARY))
    return np.asarray(cv2.aruco.generateImageMarker(dictionary, number, MODULES) > 127)


def detect_markers(grey: NDArray[np.uint8]) -> Detection:
    """Return the markers in a grey picture, each number at most once.

    Parameters
    ----------
    grey : (height, width) uint8

    Examples
    --------
    >>> picture = np.full((120, 120), 255, dtype=np.uint8)
    >>> picture[30:90, 30:90] = np.kron(marker_modules(7), np.ones((10, 10))) * 255
    >>> seen = detect_markers(picture)
    >>> seen.ids.tolist(), seen.corners[0, 0].round(1).tolist()
    ([7], [29.5, 29.5])
    """
    found, ids, _ = _detector().detectMarkers(grey)
    if ids is None or not len(found):
        return Detection(np.empty(0, dtype=np.int64), np.empty((0, 4, 2)), np.empty(0))
    numbers, quads = ids.ravel().astype(np.int64), np.concatenate(found).astype(np.float64)
    # A number that is seen twice belongs to no known marker.
    values, counts = np.unique(numbers, return_counts=True)
    single = np.isin(numbers, values[counts == 1])
    numbers, quads = numbers[single], quads[single]
    if not len(numbers):
        return Detection(numbers, np.empty((0, 4, 2)), np.empty(0))
    picture = _light[grey]
    quads, _ = refined_corners(picture, quads, None)
    quads, blur = refined_corners(picture, quads, np.full(len(quads), np.inf))
    quads, blur = refined_corners(picture, quads, blur)
    good = np.isfinite(quads).all(axis=(1, 2))
    return Detection(numbers[good], quads[good], blur[good])


def refined_corners(
    picture: NDArray[np.float32], quads: Values, blur: Values | None
) -> tuple[Values, Values]:
    """Return corners as intersections of the edges of squares, and the blur of the edges.

    The position of an edge on a profile across it is where a sharp step between the levels of
    its ends has the same integral; a symmetric point spread does not move it. Lines through
    the positions on each edge intersect in the corners.

    Far from an edge, profiles reach into white modules inside the marker. Without `blur` the
    position is therefore the outermost one at which the light is halved.

    Parameters
    ----------
    picture : (height, width) float32
        Light, from 0 to 1.
    quads : (n, 4, 2) float64, pixels
        Corners within two pixels, or half a module without `blur`, clockwise in the picture.
    blur : (n,) float64, pixels, optional
        Blur of the edges, which limits the length of profiles.

    Returns
    -------
    (n, 4, 2) float64, pixels
        Corners; nan where an edge is not visible.
    (n,) float64, pixels
        Standard deviation of the transition from black to white.
    """
    cv2 = opencv()
    start, end = quads, np.roll(quads, -1, axis=1)
    along = end - start
    length = np.linalg.norm(along, axis=-1)
    normal = np.stack([along[..., 1], -along[..., 0]], axis=-1) / length[..., None]
    side = length.mean(axis=1)
    reach = np.minimum(REACH * side / MODULES, MOST_REACH)
    if blur is not None:
        reach = np.minimum(reach, np.maximum(PROFILE * blur, LEAST_REACH))
    share = np.linspace(ENDS, 1.0 - ENDS, SAMPLES)
    count = 31
    offset = np.linspace(-1.0, 1.0, count) * reach[:, None]
    base = start[:, :, None] + share[:, None] * along[:, :, None]
    points = (
        base[:, :, :, None] + offset[:, None, None, :, None] * normal[:, :, None, None]
    ).astype(np.float32)
    grid = points.reshape(-1, count, 2)
    values = cv2.remap(
        picture, np.ascontiguousarray(grid[..., 0]), np.ascontiguousarray(grid[..., 1]),
        cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE,
    ).reshape(points.shape[:-1])  # fmt: skip
    black, white = values[..., :4].mean(axis=-1), values[..., -4:].mean(axis=-1)
    contrast = white - black
    typical = np.median(contrast, axis=2, keepdims=True)
    weak = contrast < 0.5 * np.maximum(typical, 0.02)
    level = (values - black[..., None]) / np.where(weak, 1.0, contrast)[..., None]
    step = (offset[:, 1] - offset[:, 0])[:, None, None]
    whole = level.sum(axis=-1) - 0.5 * (level[..., 0] + level[..., -1])
    position = reach[:, None, None] - step * whole
    if blur is None:
        position = _outermost(values, offset)
    position = np.where(weak, np.nan, position)
    lines = _lines(base + position[..., None] * normal[:, :, None], normal)
    corners = _intersections(np.roll(lines, 1, axis=1), lines)
    slope = np.clip(np.diff(_mean(np.where(weak[..., None], np.nan, level), 2)), 0, None)
    middle = 0.5 * (offset[:, 1:] + offset[:, :-1])[:, None, :]
    total = np.maximum(slope.sum(axis=-1), 1e-6)
    mean = (slope * middle).sum(axis=-1) / total
    variance = (slope * (middle - mean[..., None]) ** 2).sum(axis=-1) / total
    return corners, np.sqrt(np.median(variance, axis=1))


def _outermost(values: Values, offset: Values) -> Values:
    """Return the outermost positions (n, 4, k) at which the light on profiles is halved.

    Parameters
    ----------
    values : (n, 4, k, s)
        Light on profiles, from inside to outside.
    offset : (n, s), pixels
        Positions on the profiles.
    """
    black, white = np.median(values.min(axis=-1), axis=2), np.median(values[..., -1], axis=2)
    middle = 0.5 * (black + white)[..., None, None]
    dark = values[..., :-1] < middle
    last = dark.shape[-1] - 1 - np.argmax(dark[..., ::-1], axis=-1)
    inner, outer = (np.take_along_axis(values, each[..., None], axis=-1)[..., 0]
                    for each in (last, last + 1))  # fmt: skip
    share = (middle[..., 0] - inner) / np.maximum(outer - inner, 1e-6)
    step = (offset[:, 1] - offset[:, 0])[:, None, None]
    start = offset[:, 0][:, None, None] + step * last
    return np.where(dark.any(axis=-1), start + step * np.clip(share, 0.0, 1.0), np.nan)


def _mean(values: Values, axis: int) -> Values:
    """Return the mean of the known values along an axis; nan where there are none."""
    known = np.isfinite(values)
    total = np.where(known, values, 0.0).sum(axis=axis)
    count = known.sum(axis=axis)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def _lines(points: Values, normal: Values) -> Values:
    """Return lines (..., 3), n . x = c, through points (..., k, 2) near lines of given normals."""
    along = np.stack([-normal[..., 1], normal[..., 0]], axis=-1)
    middle = _mean(points, -2)
    off = points - middle[..., None, :]
    x = (off * along[..., None, :]).sum(axis=-1)
    y = (off * normal[..., None, :]).sum(axis=-1)
    weight = np.isfinite(y).astype(np.float64)
    x, y = np.where(weight > 0, x, 0.0), np.where(weight > 0, y, 0.0)
    slope, height = np.zeros(x.shape[:-1]), np.zeros(x.shape[:-1])
    for _ in range(3):
        total = np.maximum(weight.sum(axis=-1), 1e-9)
        mx, my = (weight * x).sum(axis=-1) / total, (weight * y).sum(axis=-1) / total
        dx, dy = x - mx[..., None], y - my[..., None]
        slope = (weight * dx * dy).sum(axis=-1) / np.maximum((weight * dx * dx).sum(axis=-1), 1e-9)
        height = my - slope * mx
        away = np.abs(y - height[..., None] - slope[..., None] * x)
        spread = 1.5 * np.median(away, axis=-1, keepdims=True) + 1e-3
        weight = (weight > 0) * np.minimum(1.0, 2.0 * spread / np.maximum(away, 1e-9))
    tilted = normal - slope[..., None] * along
    tilted = tilted / np.linalg.norm(tilted, axis=-1, keepdims=True)
    through = middle + height[..., None] * normal
    return np.concatenate([tilted, (tilted * through).sum(axis=-1, keepdims=True)], axis=-1)


def _intersections(first: Values, second: Values) -> Values:
    """Return the points (..., 2) in which pairs of lines (..., 3) intersect."""
    determinant = first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0]
    determinant = np.where(np.abs(determinant) < 1e-6, np.nan, determinant)
    x = first[..., 2] * second[..., 1] - first[..., 1] * second[..., 2]
    y = first[..., 0] * second[..., 2] - first[..., 2] * second[..., 0]
    return np.asarray(np.stack([x, y], axis=-1) / determinant[..., None])
