"""Stability of a state from solutions with its stiffness."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    Solve = Callable[[NDArray[np.float64]], NDArray[np.float64]]

SOLUTIONS = 12
"""Dimension of the Krylov space."""
SPREAD = 0.3
"""Size of the random part of the start vector, relative to the expected softest mode."""
ROUNDING = 1e-8
"""Compliance, as a fraction of the largest, below which its sign is not significant."""


def extreme_compliances(
    solve: Solve, expected: NDArray[np.float64], rng: np.random.Generator
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the extreme compliances of a structure and the mode of the least stable one.

    Lanczos' method with the inverse of the stiffness. Its values lie within the spectrum, so that
    a negative compliance proves instability. An unstable direction is missed only if it is much
    stiffer than the softest stable ones and nearly orthogonal to the start vector.

    Parameters
    ----------
    solve
        Function from forces (f,) to displacements (f,).
    expected : (f,) float64
        Estimate of the softest mode; zeros if there is none.
    rng
        Random numbers for the start vector.

    Returns
    -------
    compliance : (k,) float64
        Compliances in ascending order.
    mode : (f,) float64
        Unit vector.
    """
    start = solve(rng.standard_normal(len(expected)))
    start /= np.linalg.norm(start)
    start = expected + SPREAD * start if expected.any() else start
    basis = [start / np.linalg.norm(start)]
    projected = np.zeros((SOLUTIONS, SOLUTIONS))
    for k in range(SOLUTIONS):
        ahead = solve(basis[k])
        spanned = np.array(basis)
        projected[: k + 1, k] = spanned @ ahead
        ahead -= spanned.T @ (spanned @ ahead)
        ahead -= spanned.T @ (spanned @ ahead)
        size = float(np.linalg.norm(ahead))
        if k + 1 == SOLUTIONS or size <= ROUNDING * np.abs(projected).max():
            break
        basis.append(ahead / size)
    count = len(basis)
    square = np.triu(projected[:count, :count])
    compliance, shapes = np.linalg.eigh(square + np.triu(square, 1).T)
    unstable = compliance[0] < -ROUNDING * np.abs(compliance).max()
    least = 0 if unstable else count - 1
    mode: NDArray[np.float64] = np.array(basis).T @ shapes[:, least]
    return compliance, mode


def count_negative(compliance: NDArray[np.float64]) -> int:
    """Return the number of compliances that are negative beyond rounding.

    Examples
    --------
    >>> count_negative(np.array([-2.0, -1e-12, 0.5]))
    1
    """
    return int((compliance < -ROUNDING * np.abs(compliance).max(initial=0.0)).sum())
