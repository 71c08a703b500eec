"""Tracks of markers through a film, and films that cannot be measured."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import UnreadableFilm
from bellcrank.measure.camera import Views, fitted_views
from bellcrank.measure.corners import detect_markers
from bellcrank.measure.films import LARGEST_BLUR, LEAST_FRAMES, edge_width, grey_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from bellcrank.measure.films import Film
    from bellcrank.measure.layout import Marker, MarkerLayout

    Values = NDArray[np.float64]

LEAST_REFERENCES = 4
"""Smallest number of reference markers in a frame."""
LEAST_SPREAD = 0.15
"""Smallest ratio of the spreads of reference markers in two directions."""
LARGEST_RESIDUAL = 2.0
"""Median distance of corners of reference markers from the sheet that is refused, pixels."""
LATEST_START = 1
"""Latest number of the first frame that shows all markers: motions are those from rest."""
PARTLY_COVERED = 0.35
"""Deviation of the area of a marker from its median above which it is covered in part."""
BLURRED = 0.45
"""Blur of the edges of markers that is refused, in modules of the marker."""


@dataclass(frozen=True, slots=True, eq=False)
class Tracks:
    """Corners of markers in the frames of a film in which the part can be measured.

    Parameters
    ----------
    frames : (F,) int64
        Numbers of the frames.
    views
        The camera in these frames.
    reference : tuple of Marker
        Reference markers that are seen, M of them.
    moving : tuple of Marker
        Markers on input and output, K of them.
    supports : tuple of Marker
        Markers on supports that are seen in all frames, S of them.
    corners : (F, K, 4, 2) float64, pixels
        Corners of `moving`.
    support_corners : (F, S, 4, 2) float64, pixels
        Corners of `supports`.
    """

    frames: NDArray[np.int64]
    views: Views
    reference: tuple[Marker, ...]
    moving: tuple[Marker, ...]
    supports: tuple[Marker, ...]
    corners: Values
    support_corners: Values

    @property
    def on_part(self) -> tuple[Marker, ...]:
        """The K + S markers on the part."""
        return (*self.moving, *self.supports)

    @property
    def drawn(self) -> Values:
        """Drawn centres (K + S, 2) of the markers on the part, mm."""
        return np.stack([marker.centre for marker in self.on_part])


def no_report(_done: int, _total: int) -> None:
    """Ignore progress reports."""


def track_markers(
    film: Film,
    layout: MarkerLayout,
    printed: Values | None = None,
    report: Callable[[int, int], None] = no_report,
) -> Tracks:
    """Return the tracks of the markers of a part in a film.

    Parameters
    ----------
    film
        The film.
    layout
        Its markers.
    printed : (2,), optional
        Width and height of the printed sheet over the drawn ones.
    report
        Called with the numbers of frames read and of all frames.

    Raises
    ------
    UnreadableFilm
        If markers are missing, the pictures are blurred, or the reference markers are not those
        of a flat sheet.
    """
    seen, blur, widths = _detected(film, layout, report)
    found = np.isfinite(seen[..., 0, 0])
    _check_found(film, layout, found, blur, widths)
    roles = np.array([marker.role for marker in layout.markers])
    reference = np.flatnonzero((roles == "reference") & found.any(axis=0))
    moving = np.flatnonzero((roles == "input") | (roles == "output"))
    scale = np.ones(2) if printed is None else printed
    points = np.stack([layout.markers[k].corners for k in reference]) * scale
    usable = _spread_out(found[:, reference], points.mean(axis=1))
    if usable.sum() < LEAST_FRAMES:
        raise UnreadableFilm(
            f"{film.name}: reference markers not visible: {int(usable.sum())} of {film.count} "
            f"frames show {LEAST_REFERENCES} or more that are not in one line; film the whole "
            "sheet, and keep hands off its markers"
        )
    complete = usable & found[:, moving].all(axis=1)
    if complete.sum() < max(LEAST_FRAMES, 0.5 * usable.sum()):
        worst = moving[int(np.argmin(found[usable][:, moving].sum(axis=0)))]
        marker = layout.markers[worst]
        raise UnreadableFilm(
            f"{film.name}: the {marker.role} marker {marker.id} is seen in only "
            f"{int(found[usable, worst].sum())} of {film.count} frames; keep it free of hands and "
            "reflections, move the input more slowly or film with more light"
        )
    complete &= _whole(seen[:, moving]).all(axis=1)
    frames = np.flatnonzero(complete)
    if len(frames) < LEAST_FRAMES:
        raise UnreadableFilm(
            f"{film.name}: the markers of input and output are covered in part in all but "
            f"{len(frames)} frames; keep hands and tools off them"
        )
    if frames[0] > LATEST_START:
        raise UnreadableFilm(
            f"{film.name}: the first pictures, at rest, do not show all markers of input and "
            f"output; picture {frames[0] + 1} is the first that does: film from nearer or sharper"
        )
    views = fitted_views(seen[frames][:, reference], points, film.size)
    spread = _spread(views)
    if spread > LARGEST_RESIDUAL:
        raise UnreadableFilm(
            f"{film.name}: the reference markers deviate from the sheet by {spread:.1f} pixels; "
            "the sheet must be flat and printed at true size, and must belong to this design"
        )
    held = [k for k in np.flatnonzero(roles == "support") if found[frames, k].all()]
    return Tracks(
        frames, views, tuple(layout.markers[k] for k in reference),
        tuple(layout.markers[k] for k in moving), tuple(layout.markers[k] for k in held),
        seen[frames][:, moving], seen[frames][:, held],
    )  # fmt: skip


def _detected(
    film: Film, layout: MarkerLayout, report: Callable[[int, int], None]
) -> tuple[Values, Values, list[float]]:
    """Return corners (F, n, 4, 2), blur (F, n) in modules, and widths of edges of bare frames."""
    index = {marker.id: k for k, marker in enumerate(layout.markers)}
    rows, blurs, widths = [], [], []
    for number, picture in enumerate(film.pictures()):
        grey = grey_of(picture)
        seen = detect_markers(grey)
        row = np.full((len(index), 4, 2), np.nan)
        blur = np.full(len(index), np.nan)
        for each, corners, width in zip(seen.ids.tolist(), seen.corners, seen.blur, strict=True):
            if each in index:
                row[index[each]] = corners
                side = float(np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1).mean())
                blur[index[each]] = 6.0 * width / side
        if not np.isfinite(row).any():
            widths.append(edge_width(grey))
        rows.append(row)
        blurs.append(blur)
        report(number + 1, film.count)
    if len(rows) < LEAST_FRAMES:
        raise UnreadableFilm(
            f"{film.name}: {len(rows)} pictures can be read; expected at least {LEAST_FRAMES}"
        )
    return np.stack(rows), np.stack(blurs), widths


def _check_found(
    film: Film, layout: MarkerLayout, found: NDArray[np.bool_], blur: Values, widths: list[float]
) -> None:
    """Refuse films without markers, or with blurred ones."""
    if not found.any():
        width = float(np.median(widths))
        if width > LARGEST_BLUR:
            raise UnreadableFilm(
                f"{film.name}: too blurred: the sharpest edges are {width:.0f} pixels wide; focus "
                "on the sheet, hold the camera still and use more light"
            )
        raise UnreadableFilm(
            f"{film.name}: no markers found in {len(found)} frames; film the printed sheet of "
            "markers from nearer, or use --outline for a part without markers"
        )
    typical = float(np.nanmedian(blur))
    if typical > BLURRED:
        raise UnreadableFilm(
            f"{film.name}: too blurred: edges of markers are {typical:.2f} modules wide, expected "
            f"at most {BLURRED:g}; focus on the sheet, hold the camera still and use more light"
        )
    for k, marker in enumerate(layout.markers):
        if marker.role in {"input", "output"} and not found[:, k].any():
            raise UnreadableFilm(
                f"{film.name}: the {marker.role} marker {marker.id} is seen in no frame; glue it "
                "to the part as drawn on the page of markers"
            )


def _spread_out(found: NDArray[np.bool_], centres: Values) -> NDArray[np.bool_]:
    """Return whether the reference markers of each frame determine a homography."""
    good = np.zeros(len(found), dtype=np.bool_)
    for k, row in enumerate(found):
        if row.sum() >= LEAST_REFERENCES:
            wide = np.linalg.svd(centres[row] - centres[row].mean(axis=0), compute_uv=False)
            good[k] = wide[1] > LEAST_SPREAD * wide[0]
    return good


def _whole(corners: Values) -> NDArray[np.bool_]:
    """Return whether each marker (F, K) has about its usual area: it is not covered in part."""
    x, y = np.moveaxis(corners, -1, 0)
    area = 0.5 * np.abs((x * np.roll(y, -1, axis=-1) - np.roll(x, -1, axis=-1) * y).sum(axis=-1))
    with np.errstate(invalid="ignore"):
        whole = np.abs(area / np.nanmedian(area, axis=0) - 1.0) < PARTLY_COVERED
    return np.asarray(whole)


def _spread(views: Views) -> float:
    """Return the median distance of the corners of reference markers from the sheet, pixels."""
    return float(np.nanmedian(np.linalg.norm(views.residual, axis=-1)))
