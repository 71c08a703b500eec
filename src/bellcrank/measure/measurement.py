"""Measurement of the motion of a part: figures with intervals at strokes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings, UnreadableFilm
from bellcrank.measure.curves import HOLD, Basis, basis_for, fitted_curve, phases_of

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
LEAST_PIXELS = 2.0
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
    name: str,
    frames: NDArray[np.int64],
    pixels_per_mm: float,
    nominal: float,
    motion_for: Callable[[np.random.Generator | None, slice], Motion],
    settings: MeasureSettings,
    floor: float,
) -> Measurement:
    """Return the figures of a film.

    Parameters
    ----------
    name
        Name of the film, for messages.
    frames : (F,)
        Numbers of its frames in which the part can be measured.
    pixels_per_mm
        Scale of the pictures.
    nominal
        Full motion of the input, mm.
    motion_for
        Function of a random generator and the frames at rest that returns the motion in all
        frames: with None the best estimate, else one with the systematic errors of a sample.
    settings
        Number of samples and their seed.
    floor
        Smallest noise of a position in a frame, mm.

    Raises
    ------
    UnreadableFilm
        If the input does not move, moves backwards, or its motion is too small.
    """
    whole = motion_for(None, slice(0, 1))
    _check_direction(name, whole.input, pixels_per_mm)
    phases = phases_of(whole.input)
    rest, count = slice(0, phases.rest), phases.loading
    best = motion_for(None, rest)
    pushed, values = best.input[:count], best.quantities[:count]
    top = float(np.median(pushed[pushed >= 0.98 * pushed.max()]))
    basis = basis_for(pushed, values[:, 0])
    noise = _noise(basis, pushed, values, floor)
    _check_size(name, top, float(noise[0]), pixels_per_mm)
    at = min(top, nominal) * FRACTIONS
    shown = _fitted(basis, pushed, values, at)
    rng = np.random.default_rng(settings.seed)
    groups = _groups(pushed, phases.rest)
    samples = []
    for _ in range(settings.samples):
        motion = motion_for(rng, rest)
        error = noise * rng.standard_normal((groups.max() + 1, len(noise)))
        moved = np.column_stack([motion.input, motion.quantities])[:count] + error[groups]
        moved = moved - moved[rest].mean(axis=0)
        samples.append(_fitted(basis, moved[:, 0], moved[:, 1:], at))
    spread = [np.std(each, axis=0, ddof=1) for each in zip(*samples, strict=True)]
    efficiency, off_axis, rotation, path = (
        np.stack([value, deviation], axis=-1)
        for value, deviation in zip(shown, spread, strict=True)
    )
    half = NORMAL * efficiency[-1, 1] / max(abs(float(efficiency[-1, 0])), 0.4)
    if half > WIDEST:
        raise UnreadableFilm(
            f"{name}: motion too small for the resolution: the efficiency would be known within "
            f"{half:.0%} only; film from nearer, in sharper pictures or over a longer stroke"
        )
    return Measurement(
        at,
        efficiency,
        off_axis,
        rotation,
        path,
        count,
        float(noise[0]),
        pixels_per_mm,
        frames,
        best,
    )


def _fitted(
    basis: Basis, pushed: Values, values: Values, at: Values
) -> tuple[Values, Values, Values, Values]:
    """Return efficiency, off-axis motion, rotation and path at strokes."""
    found = fitted_curve(basis, pushed, values, at)
    along = found[:, 0]
    return (
        along / at, np.linalg.norm(found[:, 1:3], axis=1) / np.maximum(np.abs(along), 1e-9),
        found[:, 3], found[:, 4:],
    )  # fmt: skip


def _noise(basis: Basis, pushed: Values, values: Values, floor: float) -> Values:
    """Return the noise (7,) of a frame: of the input, and of each quantity.

    It follows from the deviations of frames from the curve. Those of positions contain the noise
    of the input times the slope of the curve; input and output have the same noise.
    """
    found = fitted_curve(basis, pushed, values, pushed)
    free = len(pushed) - basis.count
    step = 0.01 * max(float(np.ptp(pushed)), 1e-9)
    slope = (
        fitted_curve(basis, pushed, values, pushed + step)
        - fitted_curve(basis, pushed, values, pushed - step)
    ) / (2.0 * step)
    deviation = values - found
    slope[:, 3] *= np.radians(1.0) * TURNED
    scaled = deviation / np.sqrt(1.0 + slope**2)
    if free < 3:
        size = np.zeros(values.shape[1])
    else:
        # The median, because single frames may be wrong, and steep parts of the curve not followed.
        size = np.median(np.abs(scaled), axis=0) / 0.6745 * np.sqrt(len(pushed) / free)
    position = max(float(np.nanmax(size[[0, 1, 2]])), floor)
    turn = max(float(size[3]), float(np.degrees(floor / TURNED)))
    return np.array([position, position, position, position, turn, position, position])


def _groups(pushed: Values, rest: int) -> NDArray[np.int64]:
    """Return groups (F,) of frames that show the same state: at rest, held, and each other frame.

    Films repeat errors in pictures that do not change, so that such frames are one observation.
    """
    top = float(pushed.max())
    held = pushed >= (1.0 - HOLD) * top
    groups = np.arange(2, len(pushed) + 2)
    groups[held], groups[:rest] = 1, 0
    return groups


def _check_direction(name: str, pushed: Values, pixels_per_mm: float) -> None:
    low, high = float(pushed.min()), float(pushed.max())
    if -low > high and -low * pixels_per_mm > LEAST_PIXELS:
        raise UnreadableFilm(
            f"{name}: the input moves {-low:.2f} mm against its direction; begin the film at rest "
            "and push the input as in the drawing"
        )


def _check_size(name: str, top: float, noise: float, pixels_per_mm: float) -> None:
    if top * pixels_per_mm < LEAST_PIXELS or top < LEAST_SIGNAL * noise:
        raise UnreadableFilm(
            f"{name}: motion too small for the resolution: the input moves {max(top, 0.0):.2f} mm, "
            f"{max(top * pixels_per_mm, 0.0):.1f} pixels, with a noise of {noise:.3f} mm in a "
            f"frame; expected {LEAST_PIXELS:g} pixels and {LEAST_SIGNAL:g} times the noise: film "
            "from nearer or over a longer stroke"
        )
