"""Measurement of the motion of a part: figures with intervals at strokes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings, UnreadableFilm
from bellcrank.measure.curves import (
    HOLD,
    Basis,
    basis_for,
    frames_to_return,
    output_sign,
    phases_of,
    robust_weights,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from bellcrank.measure.motion import Motion

    Values = NDArray[np.float64]

FRACTIONS = np.array([0.25, 0.5, 0.75, 1.0])
"""Parts of the measured stroke at which figures are given."""
NORMAL = 1.96
"""Half width of a 95 % interval, standard deviations."""
TURNED = 6.0
"""Distance over which an error of a position becomes one of a rotation, mm."""
ROBUST_STEPS = 5
"""Number of times that the weights of frames are computed."""
LEAST_PIXELS = 4.0
"""Smallest motion of the input, pixels."""
LEAST_SIGNAL = 20.0
"""Smallest motion of the input over the noise of a single frame."""
WIDEST = 0.4
"""Widest interval of the efficiency, half width over its value or over 0.4, that is not refused."""


@dataclass(frozen=True, slots=True)
class MeasureSettings:
    """Settings of a measurement.

    Parameters
    ----------
    placement
        Standard deviation of the position of a marker on the part, each way, mm.
    sheet
        Standard deviation of the width and the height of the printed sheet over the drawn ones.
    samples
        Number of bootstrap samples.
    seed
        Seed of the samples.

    Raises
    ------
    InvalidSettings
        If a value is out of range.
    """

    placement: float = 0.3
    sheet: float = 0.0015
    samples: int = 200
    seed: int = 0

    def __post_init__(self) -> None:
        if not 0.0 <= self.placement <= 10.0:
            raise InvalidSettings(
                f"placement: expected a length of 0 to 10 mm, got {self.placement!r} mm"
            )
        if not 0.0 <= self.sheet <= 0.1:
            raise InvalidSettings(f"sheet: expected a ratio of 0 to 0.1, got {self.sheet!r}")
        if not 20 <= self.samples <= 100_000:
            raise InvalidSettings(f"samples: expected 20 to 100000, got {self.samples!r}")


@dataclass(frozen=True, slots=True, eq=False)
class Recording:
    """A film as far as the figures depend on it.

    Parameters
    ----------
    name
        Name of the film, for messages.
    frames : (F,) int64
        Numbers of its frames in which the part can be measured.
    pixels_per_mm
        Scale of the pictures.
    noise : float, mm
        Smallest noise of a position in a frame.
    """

    name: str
    frames: NDArray[np.int64]
    pixels_per_mm: float
    noise: float


@dataclass(frozen=True, slots=True, eq=False)
class Measurement:
    """Measured motion at A strokes, with standard deviations.

    Parameters
    ----------
    stroke : (A,) float64, mm
        Motion of the input along its direction.
    efficiency, off_axis : (A, 2) float64
        Motion of the output along its wanted direction over that of the input; size of its motion
        normal to it over that along it. Value and standard deviation.
    rotation : (A, 2) float64, degrees
        Rotation of the output.
    path : (A, 2, 2) float64, mm
        Mean displacement of the output nodes, x and y.
    frames
        Number of frames of the film that are used.
    noise : float, mm
        Spread of the input motion in a single frame.
    pixels_per_mm
        Scale of the pictures.
    frame_numbers : (F,) int64
        Numbers of the frames.
    motion
        Motion in these frames.
    """

    stroke: Values
    efficiency: Values
    off_axis: Values
    rotation: Values
    path: Values
    frames: int
    noise: float
    pixels_per_mm: float
    frame_numbers: NDArray[np.int64]
    motion: Motion


def interval(value: Values) -> tuple[float, float]:
    """Return the 95 % interval of a value and its standard deviation.

    Examples
    --------
    >>> interval(np.array([10.0, 0.1]))
    (9.804, 10.196)
    """
    half = NORMAL * float(value[1])
    return float(value[0]) - half, float(value[0]) + half


def measured(
    film: Recording,
    nominal: float,
    motion_for: Callable[[np.random.Generator | None, slice], Motion],
    settings: MeasureSettings,
) -> Measurement:
    """Return the figures of a film.

    Parameters
    ----------
    film
        The film.
    nominal
        Full motion of the input, mm.
    motion_for
        Function of a random generator and the frames at rest that returns the motion in all
        frames: with None the best estimate, else one with the systematic errors of a sample.
    settings
        Number of samples and their seed.

    Raises
    ------
    UnreadableFilm
        If the input does not move, moves backwards, or its motion is too small.
    """
    whole = motion_for(None, slice(0, 1))
    _check_direction(film, whole.input)
    # On the way back, a film without markers may have lost the output.
    pushed, along = (each[: frames_to_return(whole.input)] for each in (whole.input, whole.along))
    sign = output_sign(pushed, along)
    phases = phases_of(pushed, pushed + sign * along)
    rest, count = slice(0, phases.rest), phases.loading
    best = motion_for(None, rest)
    moved = best.columns[:count]
    progress = moved[:, 0] + sign * moved[:, 1]
    held = progress >= (1.0 - HOLD) * float(progress.max())
    basis = basis_for(progress, moved[:, 0])
    weight, coefficients = _curve(basis, progress, moved)
    top = float((basis.matrix(np.array([np.median(progress[held])])) @ coefficients)[0, 0])
    noise = _noise(basis, progress, moved, coefficients, film.noise)
    _check_size(film, top, float(noise[0]))
    at = min(top, nominal) * FRACTIONS
    shown = _figures(basis, coefficients, at)
    rng = np.random.default_rng(settings.seed)
    groups = _groups(held, phases.rest)
    samples = []
    for _ in range(settings.samples):
        error = noise * rng.standard_normal((groups.max() + 1, len(noise)))
        sample = motion_for(rng, rest).columns[:count] + error[groups]
        sample = sample - sample[rest].mean(axis=0)
        along = sample[:, 0] + sign * sample[:, 1]
        samples.append(_figures(basis, basis.fitted(along, sample, weight), at))
    spread = [np.std(each, axis=0, ddof=1) for each in zip(*samples, strict=True)]
    efficiency, off_axis, rotation, path = (
        np.stack([value, deviation], axis=-1)
        for value, deviation in zip(shown, spread, strict=True)
    )
    half = NORMAL * efficiency[-1, 1] / max(abs(float(efficiency[-1, 0])), 0.4)
    if half > WIDEST:
        raise UnreadableFilm(
            f"{film.name}: motion too small for the resolution: the efficiency would be known "
            f"within {half:.0%} only; film with more pixels, in sharper pictures or over a longer "
            "stroke"
        )
    return Measurement(
        at, efficiency, off_axis, rotation, path, count, float(noise[0]), film.pixels_per_mm,
        film.frames, best,
    )  # fmt: skip


def _curve(basis: Basis, progress: Values, moved: Values) -> tuple[Values, Values]:
    """Return the weights (F,) of frames and the coefficients (b, 7) of the fitted curve."""
    weight = np.ones(len(moved))
    coefficients = basis.fitted(progress, moved, weight)
    for _ in range(ROBUST_STEPS):
        weight = robust_weights((moved - basis.matrix(progress) @ coefficients)[:, :4])
        coefficients = basis.fitted(progress, moved, weight)
    return weight, coefficients


def _figures(
    basis: Basis, coefficients: Values, at: Values
) -> tuple[Values, Values, Values, Values]:
    """Return efficiency, off-axis motion, rotation and path at strokes."""
    found = basis.at_strokes(coefficients, at)
    along = found[:, 1]
    return (
        along / at, np.linalg.norm(found[:, 2:4], axis=1) / np.maximum(np.abs(along), 1e-9),
        found[:, 4], found[:, 5:],
    )  # fmt: skip


def _noise(
    basis: Basis, progress: Values, moved: Values, coefficients: Values, floor: float
) -> Values:
    """Return the noise (7,) of a frame: of the input, and of each quantity.

    It follows from the deviations of frames from the curve; input and output have the same noise.
    """
    deviation = moved - basis.matrix(progress) @ coefficients
    free = len(moved) - basis.count
    if free < 3:
        size = np.zeros(moved.shape[1])
    else:
        # The median, because single frames may be wrong.
        size = np.median(np.abs(deviation), axis=0) / 0.6745 * np.sqrt(len(moved) / free)
    # The coordinate has the errors of input and output, so that a curve that rises with both at
    # the same rate has half of their variance.
    position = max(np.sqrt(2.0) * float(np.nanmax(size[:2])), float(np.nanmax(size[2:4])), floor)
    turn = max(float(size[4]), float(np.degrees(floor / TURNED)))
    return np.array([position, position, position, position, turn, position, position])


def _groups(held: NDArray[np.bool_], rest: int) -> NDArray[np.int64]:
    """Return groups (F,) of frames that show the same state: at rest, held, and each other frame.

    Films repeat errors in pictures that do not change, so that such frames are one observation.
    """
    groups = np.arange(2, len(held) + 2)
    groups[held], groups[:rest] = 1, 0
    return groups


def _check_direction(film: Recording, pushed: Values) -> None:
    low, high = float(pushed.min()), float(pushed.max())
    if -low > high and -low * film.pixels_per_mm > LEAST_PIXELS:
        raise UnreadableFilm(
            f"{film.name}: the input moves {-low:.2f} mm against its direction; begin the film at "
            "rest and push the input as in the drawing"
        )


def _check_size(film: Recording, top: float, noise: float) -> None:
    pixels = top * film.pixels_per_mm
    if pixels < LEAST_PIXELS or top < LEAST_SIGNAL * noise:
        raise UnreadableFilm(
            f"{film.name}: motion too small for the resolution: the input moves "
            f"{max(top, 0.0):.2f} mm, {max(pixels, 0.0):.1f} pixels, with a noise of {noise:.3f} "
            f"mm in a frame; expected {LEAST_PIXELS:g} pixels and {LEAST_SIGNAL:g} times the "
            "noise: film with more pixels or over a longer stroke"
        )
