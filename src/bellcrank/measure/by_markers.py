"""Measurement by markers on the part and on a sheet behind it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import UnreadableFilm
from bellcrank.measure.camera import transformed
from bellcrank.measure.measurement import Measurement, MeasureSettings, Recording, measured
from bellcrank.measure.motion import part_motion

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.measure.camera import Views
    from bellcrank.measure.motion import Motion
    from bellcrank.measure.tracks import Tracks
    from bellcrank.part import Part

    Values = NDArray[np.float64]

MOVED_SUPPORT = 0.25
"""Motion of a support that is refused, mm, if it is also a tenth of that of the input."""
MISPLACED = 8.0
"""Distance of a marker on the part from its drawn position that is refused, mm."""


@dataclass(frozen=True, slots=True, eq=False)
class PlaneTracks:
    """Corners of markers in mm of the plane of the part.

    Parameters
    ----------
    corners : (F, K, 4, 2) float64, mm
        Corners of the markers on input and output.
    supports : (F, S, 4, 2) float64, mm
        Corners of those on supports.
    offsets : (K + S, 2) float64, mm
        Positions of the markers on the part less the drawn ones.
    """

    corners: Values
    supports: Values
    offsets: Values


def plane_tracks(tracks: Tracks, views: Views, rest: slice, errors: Values) -> PlaneTracks:
    """Return the tracks in mm.

    A point above the sheet is seen at the point of the sheet behind it. For a plane parallel to
    the sheet this is a scaling about the foot of the camera. The similarity that fits the drawn
    markers best to those on the part at rest has this factor; what remains is their offsets, of
    which it hides a part.

    Parameters
    ----------
    tracks
        Tracks in pixels.
    views
        The camera.
    rest
        Frames at rest.
    errors : (K + S, 2), mm
        Assumed positions of the markers on the part less the drawn ones: zero for the best
        estimate of the offsets, of the errors of placement for a sample of them.
    """
    moving, held = views.plane(tracks.corners), views.plane(tracks.support_corners)
    seen = np.concatenate([moving[rest], held[rest]], axis=1).mean(axis=(0, 2))
    onto = similarity(tracks.drawn + errors, seen)
    scale = float(np.hypot(*onto[:2, 0]))
    back = np.asarray(np.linalg.inv(onto), dtype=np.float64)
    offsets = transformed(back, seen) - tracks.drawn
    return PlaneTracks(moving / scale, held / scale, offsets)


def similarity(points: Values, image: Values) -> Values:
    """Return the similarity (3, 3) that fits an image (n, 2) of points (n, 2) best.

    Examples
    --------
    >>> square = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]])
    >>> found = similarity(square, 1.5 * square[:, ::-1] * [1.0, -1.0] + 5.0)
    >>> found.round(9).tolist()
    [[0.0, 1.5, 5.0], [-1.5, 0.0, 5.0], [0.0, 0.0, 1.0]]
    """
    middle, seen = points.mean(axis=0), image.mean(axis=0)
    first, second = points - middle, image - seen
    size = max(float((first**2).sum()), 1e-12)
    cosine = float((first * second).sum()) / size
    sine = float((first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]).sum()) / size
    turn = np.array([[cosine, -sine], [sine, cosine]])
    return np.vstack([np.column_stack([turn, seen - turn @ middle]), [0.0, 0.0, 1.0]])


def part_on_sheet(tracks: Tracks) -> Values:
    """Return the similarity (3, 3) from mm of the part at rest to where it is seen on the sheet."""
    seen = np.concatenate(
        [tracks.views.plane(tracks.corners)[0], tracks.views.plane(tracks.support_corners)[0]]
    )
    return similarity(tracks.drawn, seen.mean(axis=1))


def _sides(corners: Values) -> Values:
    """Return the mean side (F, K) of squares (F, K, 4, 2)."""
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=2), axis=-1)
    return np.asarray(edges.mean(axis=-1))


def measure_by_markers(
    name: str, part: Part, tracks: Tracks, nominal: float, settings: MeasureSettings
) -> Measurement:
    """Return the motion of a part from the tracks of its markers.

    Parameters
    ----------
    name
        Name of the film, for messages.
    part
        The part.
    tracks
        Tracks of its markers.
    nominal
        Full motion of the input, mm.
    settings
        Systematic errors and bootstrap.

    Raises
    ------
    UnreadableFilm
        If a support or a marker is not where it should be, or the motion is too small.

    Notes
    -----
    A sample of the interval gives the reference markers random weights (the Bayesian bootstrap)
    and draws from normal distributions errors of the placement of the markers on the part, the size
    of the sheet, and an error in each frame, equal in frames that show the same state. That error
    has the spread of the frames about the fitted curve, and at least that of the centres of
    reference markers about the sheet.

    References
    ----------
    D. B. Rubin, Ann. Stat. 9, 130 (1981), the Bayesian bootstrap.
    """
    exact = np.zeros_like(tracks.drawn)
    first = plane_tracks(tracks, tracks.views, slice(0, 1), exact)
    _check_places(name, tracks, first)
    count = len(tracks.reference)

    def motion_for(rng: np.random.Generator | None, rest: slice) -> Motion:
        if rng is None:
            plane = plane_tracks(tracks, tracks.views, rest, exact)
            return _motion(part, tracks, plane, rest)
        counts = count * rng.dirichlet(np.ones(count))
        errors = settings.placement * rng.standard_normal(exact.shape)
        plane = plane_tracks(tracks, tracks.views.resampled(counts), rest, errors)
        stretch = 1.0 + settings.sheet * rng.standard_normal(2)
        plane = replace(plane, corners=plane.corners * stretch, supports=plane.supports * stretch)
        return _motion(part, tracks, plane, rest)

    scale = _pixels_per_mm(tracks)
    film = Recording(name, tracks.frames, scale, _reference_error(tracks.views) / scale)
    found = measured(film, nominal, motion_for, settings)
    _check_supports(name, first, found)
    return found


def _motion(part: Part, tracks: Tracks, plane: PlaneTracks, rest: slice) -> Motion:
    corners = plane.corners
    if plane.supports.shape[1]:
        middle = plane.supports.mean(axis=(1, 2))
        corners = corners - (middle - middle[rest].mean(axis=0))[:, None, None]
    return part_motion(part, tracks.moving, corners, rest, plane.offsets)


def _reference_error(views: Views) -> float:
    """Return the spread of the centres of reference markers about the sheet, pixels."""
    centres = views.residual.mean(axis=2)
    return float(np.nanmedian(np.abs(centres))) / 0.6745


def _pixels_per_mm(tracks: Tracks) -> float:
    """Return the length in pixels of a mm on the part, from the sides of its markers."""
    sizes = np.array([marker.size for marker in tracks.moving])
    return float(np.median(_sides(tracks.corners) / sizes))


def _check_places(name: str, tracks: Tracks, plane: PlaneTracks) -> None:
    """Check that the markers on the part are near their drawn positions, up to a common shift."""
    seen = np.concatenate([plane.corners[0], plane.supports[0]]).mean(axis=1)
    away = seen - tracks.drawn
    away = np.linalg.norm(away - np.median(away, axis=0), axis=1)
    worst = int(np.argmax(away))
    if away[worst] > MISPLACED:
        marker = tracks.on_part[worst]
        raise UnreadableFilm(
            f"{name}: the {marker.role} marker {marker.id} is {away[worst]:.0f} mm from its drawn "
            "position; check that each marker is on the block of its role, that the film begins "
            "at rest, and that the design is that of the part"
        )


def _check_supports(name: str, plane: PlaneTracks, found: Measurement) -> None:
    if not plane.supports.shape[1]:
        return
    middle = plane.supports[: found.frames].mean(axis=2)
    smooth = middle
    if len(middle) >= 5:
        window = np.lib.stride_tricks.sliding_window_view(middle, 5, axis=0)
        smooth = np.median(window, axis=-1)
    moved = np.linalg.norm(smooth - smooth[0], axis=-1)
    most = float(moved.max())
    if most > max(MOVED_SUPPORT, 0.1 * float(found.stroke[-1])):
        raise UnreadableFilm(
            f"{name}: supports moved: a marker on a support moves {most:.2f} mm while the input "
            f"moves {found.stroke[-1]:.2f} mm; clamp the supports, and keep the sheet and the "
            "camera still"
        )
