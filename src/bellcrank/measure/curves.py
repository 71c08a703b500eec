"""Curves of measured quantities along the stroke.

Where the output moves many times as fast as the input, a curve over the motion of the input is
nearly vertical, and small errors of the input become large ones of the curve. All quantities, the
motion of the input included, are therefore splines over a coordinate that increases with both.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Values = NDArray[np.float64]

HOLD = 0.02
"""Part of the largest input motion within which frames count as held at the full stroke."""
REST = 0.01
"""Part of the largest input motion within which the first frames count as at rest."""
RETURNED = 0.05
"""Part of the largest input motion by which it falls when the input is on its way back."""
TURNS_BACK = 0.2
"""Part of the motion of the output by which it moves backwards if it turns back."""
MOST_KNOTS = 8
GRID = 1000
"""Number of points at which curves are evaluated to find strokes."""


@dataclass(frozen=True, slots=True)
class Phases:
    """Frames of a film in which the input rests, and in which it is pushed.

    Parameters
    ----------
    rest : int
        Number of frames at rest, from the first.
    loading : int
        Number of frames until the end of the hold at the full stroke, those at rest included.
    """

    rest: int
    loading: int


def phases_of(pushed: Values, progress: Values) -> Phases:
    """Return the phases of a film.

    Parameters
    ----------
    pushed : (F,), mm
        Input motion from the first frame.
    progress : (F,), mm
        Coordinate along the stroke (`output_sign`).

    Examples
    --------
    >>> pushed = np.array([0.0, 0.0, 1.0, 2.0, 3.0, 3.0, 2.0, 1.0, 0.0])
    >>> phases_of(pushed, 4.0 * pushed)
    Phases(rest=2, loading=6)
    """
    noise = frame_noise(pushed)
    level = float(np.median(pushed[:2])) if len(pushed) > 2 else float(pushed[0])
    moves = np.abs(pushed - level) > max(REST * (float(pushed.max()) - level), 4.0 * noise)
    rest = int(np.argmax(moves)) if moves.any() else len(pushed)
    top = float(progress.max())
    held = progress >= top - max(HOLD * top, 4.0 * frame_noise(progress))
    first = int(np.argmax(held))
    after = np.flatnonzero(~held[first:])
    loading = first + (int(after[0]) if len(after) else len(pushed) - first)
    return Phases(max(rest, 1), loading)


def frames_to_return(pushed: Values) -> int:
    """Return the number of frames before the input is on its way back.

    Examples
    --------
    >>> frames_to_return(np.array([0.0, 1.0, 2.0, 1.99, 1.8, 1.0]))
    4
    """
    top = int(np.argmax(pushed))
    back = np.flatnonzero(pushed[top:] < (1.0 - RETURNED) * pushed[top])
    return top + int(back[0]) if len(back) else len(pushed)


def output_sign(pushed: Values, along: Values) -> float:
    """Return the sign of the motion of the output, or 0 if the output turns back.

    The coordinate along the stroke is the motion of the input plus this sign times that of the
    output.

    Parameters
    ----------
    pushed, along : (F,), mm
        Motion of the input, and of the output along its wanted direction.

    Examples
    --------
    >>> pushed = np.array([0.0, 1.0, 2.0, 3.0])
    >>> output_sign(pushed, np.array([0.0, -2.0, -4.0, -6.0]))
    -1.0
    >>> output_sign(pushed, np.array([0.0, 2.0, 4.0, 1.0]))
    0.0
    """
    sign = float(np.sign(along[np.argmax(np.abs(along))]))
    travel = sign * along
    back = -np.minimum(np.diff(travel[np.argsort(pushed + travel)]), 0.0).sum()
    return 0.0 if back > TURNS_BACK * float(np.ptp(travel)) else sign


def frame_noise(values: Values) -> float:
    """Return the spread of values about a smooth curve, from their second differences.

    Examples
    --------
    >>> frame_noise(np.linspace(0.0, 1.0, 12) ** 2) < 0.01
    True
    """
    if len(values) < 4:
        return 0.0
    second = np.diff(values, 2)
    spread = np.median(np.abs(second - np.median(second))) / 0.6745
    return float(spread / np.sqrt(6.0))


@dataclass(frozen=True, slots=True, eq=False)
class Basis:
    """B-splines over the coordinate along the stroke.

    Parameters
    ----------
    knots : (m,) float64, mm
        Knots.
    degree
        Their degree.
    """

    knots: Values
    degree: int

    @property
    def count(self) -> int:
        """Number of functions."""
        return len(self.knots) - self.degree - 1

    def matrix(self, progress: Values) -> Values:
        """Return the values (F, b) of the functions; constant beyond the ends."""
        from scipy.interpolate import BSpline

        inside = np.clip(progress, self.knots[0], self.knots[-1])
        rows = BSpline.design_matrix(inside, self.knots, self.degree).toarray()
        return np.asarray(rows)

    def fitted(self, progress: Values, values: Values, weight: Values) -> Values:
        """Return the coefficients (b, q) of splines fitted to values (F, q) in frames.

        A slight penalty of the second differences of the coefficients determines splines where
        there are no frames.

        Parameters
        ----------
        progress : (F,), mm
            Coordinates of the frames.
        values : (F, q)
            Measured quantities.
        weight : (F,)
            Weights of the frames.
        """
        rows = self.matrix(progress)
        normal = rows.T @ (weight[:, None] * rows)
        bends = np.diff(np.eye(self.count), 2, axis=0)
        size = float(np.trace(normal)) / self.count
        normal = normal + 1e-9 * size * np.eye(self.count) + 1e-6 * size * bends.T @ bends
        return np.asarray(np.linalg.solve(normal, rows.T @ (weight[:, None] * values)))

    def at_strokes(self, coefficients: Values, strokes: Values) -> Values:
        """Return the values (A, q) where the first of them, the motion of the input, has a value.

        Curves are straight beyond the largest motion.

        Parameters
        ----------
        coefficients : (b, q)
            Coefficients of the splines.
        strokes : (A,), mm
            Motions of the input.
        """
        grid = np.linspace(self.knots[0], self.knots[-1], GRID)
        values = self.matrix(grid) @ coefficients
        # Noise may make the fitted motion of the input turn back a little.
        pushed = 0.5 * np.maximum.accumulate(values[:, 0])
        pushed += 0.5 * np.minimum.accumulate(values[::-1, 0])[::-1]
        found = np.stack([np.interp(strokes, pushed, each) for each in values.T], axis=1)
        near = min(int(np.searchsorted(pushed, 0.9 * pushed[-1])), GRID - 2)
        slope = (values[-1] - values[near]) / max(pushed[-1] - pushed[near], 1e-9)
        return np.asarray(found + np.maximum(strokes - pushed[-1], 0.0)[:, None] * slope)


def basis_for(progress: Values, pushed: Values) -> Basis:
    """Return splines for the coordinates of frames.

    The number of knots follows from the number of distinct states. They are closer where the
    input moves fast over the coordinate.

    Parameters
    ----------
    progress, pushed : (F,), mm
        Coordinate along the stroke, and motion of the input, in the frames.

    Examples
    --------
    >>> pushed = np.linspace(0.0, 4.0, 30)
    >>> travel = pushed + 0.1 * pushed**2
    >>> progress = pushed + output_sign(pushed, travel) * travel
    >>> basis = basis_for(progress, pushed)
    >>> fitted = basis.fitted(progress, np.stack([pushed, travel], axis=1), np.ones(30))
    >>> basis.at_strokes(fitted, np.array([2.0, 4.0])).round(3).tolist()
    [[2.0, 2.4], [4.0, 5.6]]
    """
    low, high = min(float(progress.min()), 0.0), float(progress.max())
    order = np.argsort(progress)
    steps = np.diff(progress[order]) / max(high - low, 1e-12)
    steps += np.abs(np.diff(pushed[order])) / max(float(np.ptp(pushed)), 1e-12)
    length = np.concatenate([[0.0], np.cumsum(steps)])
    distinct = 1 + int(np.count_nonzero(np.diff(np.floor(length / (0.015 * length[-1])))))
    degree = int(np.clip(distinct - 2, 1, 3))
    count = int(np.clip(distinct // 3 - 1, 0, MOST_KNOTS))
    inner = np.interp(np.linspace(0.0, length[-1], count + 2)[1:-1], length, progress[order])
    ends = np.array([low] * (degree + 1)), np.array([high] * (degree + 1))
    return Basis(np.concatenate([ends[0], np.sort(inner), ends[1]]), degree)


def robust_weights(deviation: Values) -> Values:
    """Return weights (F,) of frames from their deviations (F, q), small for single wrong frames.

    Compressed films repeat parts of a picture that changed little, so that a marker may be seen
    where it was some frames ago.

    Examples
    --------
    >>> robust_weights(np.array([[0.01], [-0.01], [0.01], [1.0]])).round(2).tolist()
    [0.92, 0.92, 0.92, 0.0]
    """
    size = np.linalg.norm(deviation, axis=1)
    spread = 1.5 * float(np.median(size)) + 1e-3
    return np.asarray(1.0 / (1.0 + (size / (3.0 * spread)) ** 2) ** 2)
