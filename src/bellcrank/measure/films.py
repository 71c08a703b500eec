"""Films and photographs: their pictures one after the other."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidFile, UnreadableFilm
from bellcrank.measure.corners import opencv

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    Picture = NDArray[np.uint8]

PHOTOGRAPHS = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".webp")
MOST_FRAMES = 300
"""Of longer films every second, third ... frame is read."""
LEAST_FRAMES = 6
"""Smallest number of pictures."""
LARGEST_BLUR = 7.0
"""Width of the sharpest edges of a picture above which it is too blurred, pixels."""

PICTURES = ((1280, 720), (1920, 1080), (3840, 2160))
"""Usual widths and heights of films, pixels."""
LEAST_SCALE = 3.0
"""Smallest number of pixels in a mm of the sheet that the protocol asks for."""
STROKE_PIXELS = 5.0
"""Smallest motion of the input that the protocol asks for, pixels."""
FILLED = 0.9
"""Part of a picture that the sheet fills."""


def picture_scale(size: tuple[int, int], extent: tuple[float, float]) -> float:
    """Return the pixels in a mm if a sheet (width and height, mm) fills a picture (pixels)."""
    return FILLED * min(size[0] / extent[0], size[1] / extent[1])


def needed_picture(extent: tuple[float, float], stroke: float) -> tuple[int, int]:
    """Return the smallest usual picture that shows a sheet and a stroke, pixels.

    Parameters
    ----------
    extent
        Width and height of the sheet over its markers, mm.
    stroke
        Full motion of the input, mm.

    Examples
    --------
    >>> needed_picture((150.0, 140.0), 4.0), needed_picture((150.0, 140.0), 0.9)
    ((1280, 720), (1920, 1080))
    """
    wanted = max(LEAST_SCALE, STROKE_PIXELS / stroke)
    large = [size for size in PICTURES if picture_scale(size, extent) >= wanted]
    return large[0] if large else PICTURES[-1]


@dataclass(frozen=True, slots=True)
class Film:
    """A film, or photographs in the order of their names.

    Parameters
    ----------
    paths
        One film, or photographs.
    count
        Number of pictures that are read.
    every
        Of so many frames one is read.
    rate
        Pictures per second that are read; 0 for photographs.
    size
        Width and height, pixels.
    """

    paths: tuple[Path, ...]
    count: int
    every: int
    rate: float
    size: tuple[int, int]

    @property
    def name(self) -> str:
        """Name for messages."""
        return str(self.paths[0] if len(self.paths) == 1 else self.paths[0].parent)

    def pictures(self) -> Iterator[Picture]:
        """Yield the pictures (height, width, 3), uint8, blue, green, red.

        Raises
        ------
        InvalidFile
            If a picture cannot be read or has another size than the first.
        """
        if self.rate:
            yield from self._frames()
            return
        for path in self.paths:
            picture = _photograph(path)
            if picture.shape[1::-1] != self.size:
                raise InvalidFile(
                    f"{path}: expected {self.size[0]} x {self.size[1]} pixels like the first "
                    f"photograph, got {picture.shape[1]} x {picture.shape[0]}"
                )
            yield picture

    def _frames(self) -> Iterator[Picture]:
        capture = opencv().VideoCapture(str(self.paths[0]))
        try:
            number = 0
            while capture.grab():
                if number % self.every == 0:
                    good, picture = capture.retrieve()
                    if good:
                        yield picture
                number += 1
        finally:
            capture.release()


def open_film(paths: Sequence[Path]) -> Film:
    """Open a film, a folder of photographs, or photographs.

    Raises
    ------
    InvalidFile
        If a file cannot be read.
    UnreadableFilm
        If there are too few pictures.
    InvalidSettings
        If OpenCV is not installed.
    """
    opencv()
    files = _files(paths)
    if len(files) == 1 and files[0].suffix.lower() not in PHOTOGRAPHS:
        film = _film(files[0])
    else:
        wrong = [path for path in files if path.suffix.lower() not in PHOTOGRAPHS]
        if wrong:
            raise InvalidFile(
                f"{wrong[0]}: expected one film, or photographs ({', '.join(PHOTOGRAPHS)})"
            )
        high, wide = _photograph(files[0]).shape[:2]
        film = Film(tuple(files), len(files), 1, 0.0, (wide, high))
    if film.count < LEAST_FRAMES:
        raise UnreadableFilm(
            f"{film.name}: {film.count} picture{'s' * (film.count != 1)}; expected at least "
            f"{LEAST_FRAMES}, from rest to the full stroke"
        )
    return film


def _files(paths: Sequence[Path]) -> list[Path]:
    for path in paths:
        if not path.exists():
            raise InvalidFile(f"{path}: no such file or folder")
    if len(paths) == 1 and paths[0].is_dir():
        found = sorted(path for path in paths[0].iterdir() if path.suffix.lower() in PHOTOGRAPHS)
        if not found:
            raise InvalidFile(f"{paths[0]}: no photographs ({', '.join(PHOTOGRAPHS)})")
        return found
    return list(paths)


def _film(path: Path) -> Film:
    cv2 = opencv()
    capture = cv2.VideoCapture(str(path))
    try:
        frames, size = 0, (0, 0)
        while capture.isOpened() and capture.grab():
            if not frames:
                good, picture = capture.retrieve()
                size = picture.shape[1::-1] if good else (0, 0)
            frames += 1
        rate = float(capture.get(cv2.CAP_PROP_FPS)) or 30.0
    finally:
        capture.release()
    if not frames or not size[0]:
        raise InvalidFile(f"{path}: cannot be read as a film")
    every = -(-frames // MOST_FRAMES)
    return Film((path,), -(-frames // every), every, rate / every, (size[0], size[1]))


def _photograph(path: Path) -> Picture:
    cv2 = opencv()
    # Read as bytes, because OpenCV prints a warning of its own for a file that it cannot open.
    try:
        content = np.frombuffer(path.read_bytes(), dtype=np.uint8)
        picture = cv2.imdecode(content, cv2.IMREAD_COLOR) if len(content) else None
    except (OSError, cv2.error) as error:
        raise InvalidFile(f"{path}: cannot be read ({error})") from error
    if picture is None:
        raise InvalidFile(f"{path}: cannot be read as a photograph")
    return np.asarray(picture)


def grey_of(picture: Picture) -> Picture:
    """Return a picture in grey, (height, width)."""
    cv2 = opencv()
    return np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY))


def edge_width(grey: Picture) -> float:
    """Return the width of the sharpest edges of a picture, pixels.

    It is the difference of its bright and its dark level over its steepest slopes.

    Examples
    --------
    >>> step = np.zeros((64, 64), dtype=np.uint8)
    >>> step[:, 32:] = 200
    >>> edge_width(step) < 4.0
    True
    """
    cv2 = opencv()
    smooth = cv2.GaussianBlur(grey.astype(np.float32), (0, 0), 1.0)
    across, down = np.gradient(smooth)
    slope = float(np.quantile(np.hypot(across, down), 0.998))
    dark, bright = np.quantile(smooth, [0.02, 0.98]).tolist()
    return float((bright - dark) / max(slope, 1e-6))
