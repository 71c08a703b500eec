"""Definition of a benchmark, and the search for limit and buckling loads."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.mechanics import Status
from bellcrank.registry import Registry

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from reproduction.frame_benchmarks.frames import BenchmarkFrame

Values = list[float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Published:
    """Figures of a source.

    Parameters
    ----------
    values
        One for each quantity of the benchmark; None where the source gives none.
    digits
        Number of decimals that the source gives.
    source
        Authors, year and how they were obtained.
    elements
        Number of elements of the source; None for a converged figure.
    """

    values: tuple[float | None, ...]
    digits: int
    source: str
    elements: int | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Benchmark:
    """A frame with large displacements, and what is known about it.

    Parameters
    ----------
    title
        Title on one line.
    dimension
        2 or 3.
    source
        Reference with its DOI.
    data
        Dimensions, stiffness, supports and loads as a sentence.
    quantities
        Names of the compared quantities, with units.
    compute
        Function that returns the quantities, of the number of elements and of whether they become
        shorter when they bend.
    exact
        Function that returns the quantities without frames; None where there is no exact solution.
    method
        How the exact solution is computed.
    published
        Figures of sources.
    full, quick
        Numbers of elements, each twice the one before.
    """

    title: str
    dimension: int
    source: str
    data: str
    quantities: tuple[str, ...]
    compute: Callable[[int, bool], Values]
    exact: Callable[[], Values] | None = None
    method: str = ""
    published: tuple[Published, ...] = ()
    full: tuple[int, ...]
    quick: tuple[int, ...]


benchmarks: Registry[Benchmark] = Registry("benchmark")
"""All benchmarks."""


def line(start: NDArray[np.float64], end: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """Return (count + 1, d) nodes at equal distances from one point to another."""
    share = np.linspace(0.0, 1.0, count + 1)[:, None]
    nodes: NDArray[np.float64] = (1.0 - share) * start + share * end
    return nodes


def converged(frame: BenchmarkFrame) -> NDArray[np.float64]:
    """Return (N, d) the displacement at the full load.

    Raises
    ------
    ArithmeticError
        If the stable path does not lead there.
    """
    response = frame.respond()
    if response.status is not Status.CONVERGED:
        raise ArithmeticError(
            f"the path of stable equilibria ends at {response.reached:.4f} of the load"
        )
    return response.displacement


def pushing_force(frame: BenchmarkFrame) -> float:
    """Return the force down that holds the prescribed deflection of one node."""
    assert frame.drive is not None
    (node,) = frame.drive
    return -float(frame.respond().force[node, 1])


def limit_load(
    frame: Callable[[float], BenchmarkFrame], low: float, high: float, tolerance: float = 1e-6
) -> float:
    """Return the largest force between two deflections.

    The deflection is prescribed, so that the frame is stable beyond its limit load.

    Parameters
    ----------
    frame
        Function of the deflection.
    low, high
        Deflections before and beyond the limit load.
    tolerance
        Tolerance of the deflection over `high`.
    """
    from scipy.optimize import minimize_scalar

    peak = minimize_scalar(
        lambda deflection: -pushing_force(frame(deflection)), bounds=(low, high), method="bounded",
        options={"xatol": tolerance * high},
    )  # fmt: skip
    return float(-peak.fun)


def buckling_load(
    frame: Callable[[float], BenchmarkFrame], low: float, high: float, tolerance: float = 1e-5
) -> float:
    """Return the largest load with a path of stable equilibria from rest, by bisection.

    Parameters
    ----------
    frame
        Function of the load.
    low, high
        A stable and an unstable load.
    tolerance
        Relative tolerance.
    """
    while high - low > tolerance * high:
        middle = 0.5 * (low + high)
        if frame(middle).respond().status is Status.CONVERGED:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)
