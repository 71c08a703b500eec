"""Settings of the comparison with topology optimisation."""

from __future__ import annotations

import itertools
from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """Tasks, and the effort of both methods.

    Parameters
    ----------
    boxes
        Title, task, columns and rows of the lattice.
    stroke, spring
        Stroke in lattice units, and output spring in units of the discrete model.
    width
        Strut width of bellcrank's designs, mm, close to the narrowest width of the competing
        designs.
    steps, chains
        Length and number of chains of bellcrank's default search.
    goals
        Sets of goals of bellcrank's search; the best result is reported.
    elements
        Elements of the topology optimisation along the longer side of the box.
    radii
        Filter radii, in elements. The first is that of the examples of pyMOTO.
    springs
        Springs at input and output, in units of Young's modulus times thickness. The best result
        of all springs and radii is reported.
    iterations
        Iterations of the optimiser.
    triangle, finer
        Triangle sizes of the analysis and of its convergence check, mm.
    lift
        Title, columns and rows of the straight, loaded motion; None for a comparison without it.
    lift_seeds
        Number of bellcrank's designs of it; the best is reported.
    """

    boxes: tuple[tuple[str, str, int, int], ...] = (
        ("inverter", "inverter", 10, 11),
        ("gripper", "gripper", 10, 11),
        ("small inverter", "inverter", 6, 7),
    )
    stroke: float = 0.2
    spring: float = 0.01
    width: float = 1.3
    steps: int = 8000
    chains: int = 3
    goals: tuple[tuple[str, ...], ...] = ((), ("mirror y",))
    elements: int = 100
    radii: tuple[float, ...] = (2.0, 1.5)
    springs: tuple[tuple[float, float], ...] = tuple(itertools.product((0.1, 1.0), (0.007, 0.005)))
    iterations: int = 100
    triangle: float = 1.0
    finer: float = 0.7
    lift: tuple[str, int, int] | None = ("straight lift", 10, 11)
    lift_seeds: int = 3
