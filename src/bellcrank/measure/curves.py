"""Curves of measured quantities over the motion of the input."""

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
MOST_KNOTS = 8


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


def phases_of(pushed: Values) -> Phases:
    """Return the phases of a film for the input motion in its frames.

    Parameters
    ----------
    pushed : (F,), mm
        Input motion from the first frame.

    Examples
    --------
    >>> phases_of(np.array([0.0, 0.0, 1.0, 2.0, 3.0, 3.0, 2.0, 1.0, 0.0]))
    Phases(rest=2, loading=6)
    """
    noise = frame_noise(pushed)
    level = float(np.median(pushed[:2])) if len(pushed) > 2 else float(pushed[0])
    top = float(pushed.max())
    moves = np.abs(pushed - level) > max(REST * (top - level), 4.0 * noise)
    rest = int(np.argmax(moves)) if moves.any() else len(pushed)
    held = pushed >= top - max(HOLD * (top - level), 4.0 * noise)
    first = int(np.argmax(held))
    after = np.flatnonzero(~held[first:])
    loading = first + (int(after[0]) if len(after) else len(pushed) - first)
    return Phases(max(rest, 1), loading)


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
    """Splines that are zero at rest.

    Parameters
    ----------
    knots : (m,) float64
        Knots of the B-splines over the input motion, mm.
    degree
        Their degree.
    """

    knots: Values
    degree: int

    @property
    def count(self) -> int:
        """Number of functions."""
        return len(self.knots) - self.degree - 1

    def matrix(self, pushed: Values) -> Values:
        """Return the values (F, b) of the functions."""
        from scipy.interpolate import BSpline

        inside = np.clip(pushed, self.knots[0], self.knots[-1])
        rows = BSpline.design_matrix(inside, self.knots, self.degree).toarray()
        return np.asarray(rows)


def basis_for(pushed: Values, values: Values) -> Basis:
    """Return splines for the input motion in frames.

    The number of knots follows from the number of distinct states. Knots are at equal lengths of
    the curve, so that there are more of them where it is steep.

    Parameters
    ----------
    pushed : (F,), mm
        Input motion in the frames.
    values : (F,)
        The quantity of interest.
    """
    low, high = min(float(pushed.min()), 0.0), float(pushed.max())
    order = np.argsort(pushed)
    steps = np.abs(np.diff(pushed[order])) / max(high - low, 1e-12)
    steps += np.abs(np.diff(values[order])) / max(float(np.ptp(values)), 1e-12)
    length = np.concatenate([[0.0], np.cumsum(steps)])
    distinct = 1 + int(np.count_nonzero(np.diff(np.floor(length / (0.015 * length[-1])))))
    degree = int(np.clip(distinct - 2, 1, 3))
    count = int(np.clip(distinct // 3 - 1, 0, MOST_KNOTS))
    inner = np.interp(np.linspace(0.0, length[-1], count + 2)[1:-1], length, pushed[order])
    ends = np.array([low] * (degree + 1)), np.array([high] * (degree + 1))
    return Basis(np.concatenate([ends[0], np.sort(inner), ends[1]]), degree)


def fitted_curve(basis: Basis, pushed: Values, values: Values, at: Values) -> Values:
    """Return values (A, q) at strokes of splines fitted to values (F, q) in frames.

    A slight penalty of the second differences of the coefficients determines splines where
    there are no frames.

    Parameters
    ----------
    basis
        The splines.
    pushed, values : (F,) and (F, q)
        Input motion and measured quantities.
    at : (A,)
        Input motions.

    Examples
    --------
    >>> pushed = np.linspace(0.0, 4.0, 30)
    >>> curve = (pushed + 0.1 * pushed**2)[:, None]
    >>> found = fitted_curve(
    ...     basis_for(pushed, curve[:, 0]), pushed, curve, np.array([2.0, 4.0])
    ... )
    >>> found.round(3).tolist()
    [[2.4], [5.6]]
    """
    rows = basis.matrix(pushed)
    normal = rows.T @ rows
    bends = np.diff(np.eye(rows.shape[1]), 2, axis=0)
    size = float(np.trace(normal)) / rows.shape[1]
    normal = normal + 1e-9 * size * np.eye(len(normal)) + 1e-6 * size * bends.T @ bends
    coefficients = np.linalg.solve(normal, rows.T @ values)
    return np.asarray(basis.matrix(at) @ coefficients)
