"""Ways to find an equilibrium: a registry.

All agree on the response of a design; they differ in cost and in what they need to know.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from bellcrank.registry import Registry

if TYPE_CHECKING:
    from bellcrank.mechanics.kernels.arrays import (
        Bytes,
        Floats,
        Known,
        Scratch,
        Structure,
        System,
    )

FORCE_TOLERANCE = 1e-12
"""Largest force, in units of bond stiffness times lattice spacing, at which the
first-order minimisers stop."""

Minimiser = Callable[
    ["System", "Bytes", int, "Known", bool, float, float, "Structure", "Floats", "Scratch"],
    tuple[int, float, float],
]
"""``(system, mask, core, known, nearby, least, largest_increment, structure, u, scratch)`` to
status, efficiency and energy. Brings the design `mask` to equilibrium at full load, in
increments of at most `largest_increment` from rest or, if `nearby`, from the known equilibrium
of a similar design; what is then no more efficient than `least` need not be verified. Fills
`structure` and `u`."""

minimisers: Registry[Callable[[], Minimiser]] = Registry("minimiser")


@minimisers.register("newton")
def newton() -> Minimiser:
    """Newton's method along the loading path, with sparse factorisation; the default."""
    from bellcrank.mechanics.kernels.response import respond

    return respond


@minimisers.register("cg")
def conjugate_gradient() -> Minimiser:
    """Non-linear conjugate gradient (Polak-Ribiere), as in the paper."""
    return _first_order("CG")


@minimisers.register("fire")
def fire() -> Minimiser:
    """Fast inertial relaxation engine (Bitzek et al. 2006), as in the paper's published code."""
    return _first_order("FIRE")


def _first_order(name: str) -> Minimiser:
    from bellcrank.mechanics.kernels import arrays
    from bellcrank.mechanics.kernels.relaxed_loading import respond_by_relaxation

    code: int = getattr(arrays, name)

    def respond(
        system: System,
        mask: Bytes,
        core: int,
        known: Known,
        nearby: bool,
        least: float,  # noqa: ARG001
        largest_increment: float,  # noqa: ARG001
        structure: Structure,
        u: Floats,
        scratch: Scratch,
    ) -> tuple[int, float, float]:
        tolerance = FORCE_TOLERANCE * system.bond
        result: tuple[int, float, float] = respond_by_relaxation(
            system, mask, core, code, tolerance, known, nearby, structure, u, scratch
        )
        return result

    return respond
