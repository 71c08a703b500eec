"""Movies of a film with the measured and the computed motion drawn on it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.measure import Tracks, opencv
from bellcrank.measure.by_markers import part_on_sheet
from bellcrank.measure.camera import transformed
from bellcrank.model.storage import write_bytes
from bellcrank.plots.movies import check_movie, movie_settings
from bellcrank.plots.movies.output import format_of

if TYPE_CHECKING:
    import os
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from bellcrank.workflows.measure import FilmResult

    Values = NDArray[np.float64]
    Picture = NDArray[np.uint8]

WIDEST = 1280
"""Largest width of the movie, pixels."""
MEASURED, COMPUTED = (178, 114, 0), (0, 94, 213)
"""Colours as blue, green, red: those of output and input in all pictures of bellcrank."""
PLAIN_RATE = 4
"""Photographs in a second."""
FINE = 16


class OverlayFrames:
    """The pictures of a film with the measured and the computed motion.

    Parameters
    ----------
    result
        The measurement.
    """

    def __init__(self, result: FilmResult) -> None:
        self._result = result
        wide, high = result.film.size
        self._scale = min(1.0, WIDEST / wide)
        self._size = tuple(2 * max(1, round(0.5 * self._scale * each)) for each in (wide, high))
        self._index = {
            frame: k for k, frame in enumerate(result.measurement.frame_numbers.tolist())
        }
        self._pictures: Iterator[Picture] = result.film.pictures()
        found = result.measurement
        inputs = np.clip(found.motion.input, 0.0, result.computed.full_stroke)
        self._nodes = result.computed.positions_at(inputs)
        output = result.computed.part.design.problem.output.nodes
        self._rest = result.computed.part.positions[output].mean(axis=0)
        self._expected = self._nodes[:, output].mean(axis=1)
        camera = result.camera
        self._onto = part_on_sheet(camera) if isinstance(camera, Tracks) else np.eye(3)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels."""
        return self._size[0], self._size[1]

    @property
    def order(self) -> NDArray[np.int64]:
        """(F,) number of each picture."""
        return np.arange(self._result.film.count)

    def draw(self, state: int) -> Picture:
        """Return the next picture (height, width, 4); pictures are drawn in their order."""
        cv2 = opencv()
        picture = next(self._pictures)
        canvas = cv2.resize(picture, self.size, interpolation=cv2.INTER_AREA)
        if state in self._index:
            self._draw_motion(canvas, self._index[state])
        return np.asarray(cv2.cvtColor(canvas, cv2.COLOR_BGR2RGBA))

    def _draw_motion(self, canvas: Picture, k: int) -> None:
        cv2, result = opencv(), self._result
        nodes = self._pixels(k, self._nodes[k])
        struts = [nodes[pair] for pair in result.computed.part.struts]
        cv2.polylines(canvas, struts, False, COMPUTED, 1, cv2.LINE_AA, 4)
        motion = result.measurement.motion
        loading = result.measurement.frames
        last = min(k + 1, len(motion.path))
        for points, colour, width in (
            (self._rest + motion.path[:last], MEASURED, 3),
            (self._expected[: min(loading, last)], COMPUTED, 1),
        ):
            where = self._pixels(k, points)
            cv2.polylines(canvas, [where], False, colour, width, cv2.LINE_AA, 4)
            cv2.circle(canvas, tuple(where[-1].tolist()), 4 * FINE, colour, -1, cv2.LINE_AA, 4)
        pushed = float(motion.input[k])
        lines = [("computed (frames)", COMPUTED), ("measured", MEASURED)]
        text = f"input {max(pushed, 0.0):.2f} mm"
        if pushed > 0.1 * result.measurement.stroke[-1]:
            expected = float(result.computed.at(np.array([pushed]))[0, 0]) / pushed
            lines[0] = (f"computed {expected:.2f}", COMPUTED)
            lines[1] = (f"measured {float(motion.along[k]) / pushed:.2f}", MEASURED)
            text += ", efficiency:"
        size = self.size[1] / 900.0
        cv2.rectangle(canvas, (0, 0), (round(360 * size), round(112 * size)), (255, 255, 255), -1)
        for row, (line, colour) in enumerate([(text, (40, 40, 40)), *lines]):
            at = (round(12 * size), round((32 + 34 * row) * size))
            cv2.putText(
                canvas, line, at, cv2.FONT_HERSHEY_SIMPLEX, 0.8 * size, colour, 2, cv2.LINE_AA
            )

    def _pixels(self, k: int, points: Values) -> Any:
        """Return pixels (n, 2) of the movie in sixteenths, for points of the part in mm."""
        camera = self._result.camera
        if isinstance(camera, Tracks):
            seen = camera.views.pixels(k, transformed(self._onto, points))
        else:
            seen = camera.pixels(points)
        return np.round(FINE * (self._scale * (seen + 0.5) - 0.5)).astype(np.int32)


def write_overlay(
    result: FilmResult, path: str | os.PathLike[str], *, overwrite: bool = False
) -> None:
    """Write a film with the measured and the computed motion drawn on it.

    Blue is the measured path of the output, orange the computed path, and the struts as
    computed at the measured motion of the input.

    Parameters
    ----------
    result
        The measurement.
    path
        Movie; the suffix mp4 or gif selects the format.
    overwrite
        Whether to replace the file.

    Raises
    ------
    InvalidSettings
        If the suffix is unknown or a package is missing.
    OutputExists, StorageError
        If the file exists or cannot be written.
    """
    target = check_movie(path, overwrite=overwrite)
    frames = OverlayFrames(result)
    rate = max(1, round(result.film.rate)) if result.film.rate else PLAIN_RATE
    seconds = result.film.count / rate
    settings = movie_settings(target, seconds, rate, frames.size)
    content = format_of(target).encode(frames, settings.fps, lambda _done: None)
    write_bytes(target, content, overwrite=overwrite)
