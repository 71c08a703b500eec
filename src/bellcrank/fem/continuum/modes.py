"""Whether a state is stable, from solutions with its stiffness alone."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    Solve = Callable[[NDArray[np.float64]], NDArray[np.float64]]

SOLUTIONS = 12
"""Dimension of Lanczos' space."""
SPREAD = 0.3
"""Of the start, as a part of what is expected to be the softest mode."""
ROUNDING = 1e-8
"""Compliance, as a part of the largest, below which signs mean nothing."""


def softest(
    solve: Solve, expected: NDArray[np.float64], rng: np.random.Generator
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the extreme compliances of a structure and the mode of the least stable one.

    Lanczos' method on the inverse of the stiffness. What it finds lies within the spectrum: a
    compliance below 0 proves that the structure is unstable. An unstable direction is missed
    only if it is far stiffer than the softest stable ones and unlike the start.

    Parameters
    ----------
    solve
        Displacements (f,) by forces (f,).
    expected : (f,)
        A guess of the softest mode; zeros if there is none.
    rng
        For the rest of the start.

    Returns
    -------
    compliance : (k,)
        Ascending.
    mode : (f,)
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


def negative(compliance: NDArray[np.float64]) -> int:
    """Return how many of some compliances are below 0, beyond rounding.

    Examples
    --------
    >>> negative(np.array([-2.0, -1e-12, 0.5]))
    1
    """
    return int((compliance < -ROUNDING * np.abs(compliance).max(initial=0.0)).sum())
