"""Ways to find an equilibrium: a registry.

A minimiser answers two calls, from rest and from a neighbouring equilibrium. All
agree on the response; they differ in cost and in what they need to know.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
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

FromRest = Callable[
    ["System", "Bytes", bool, float, "Structure", "Floats", "Scratch"], tuple[int, float, float]
]
FromNeighbour = Callable[
    ["System", "Bytes", bool, "Known", "Structure", "Floats", "Scratch"], tuple[int, float]
]


@dataclass(frozen=True, slots=True)
class Minimiser:
    """How to bring a design to equilibrium at full load.

    Parameters
    ----------
    from_rest
        ``(system, mask, core, largest_increment, structure, u, scratch)`` to status,
        efficiency and energy.
    from_neighbour
        ``(system, mask, core, known, structure, u, scratch)`` to status and efficiency.
    """

    from_rest: FromRest
    from_neighbour: FromNeighbour


minimisers: Registry[Callable[[], Minimiser]] = Registry("minimiser")


@minimisers.register("newton")
def newton() -> Minimiser:
    """Newton's method along the loading path, with sparse factorisation; the default."""
    from bellcrank.mechanics.kernels.response import respond_from_neighbour, respond_from_rest

    return Minimiser(respond_from_rest, respond_from_neighbour)


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
    from bellcrank.mechanics.kernels.relaxed_loading import relax_from_neighbour, relax_from_rest

    code: int = getattr(arrays, name)

    def from_rest(
        system: System,
        mask: Bytes,
        core: bool,
        largest_increment: float,  # noqa: ARG001
        structure: Structure,
        u: Floats,
        scratch: Scratch,
    ) -> tuple[int, float, float]:
        result: tuple[int, float, float] = relax_from_rest(
            system, mask, core, code, FORCE_TOLERANCE * system.bond, structure, u, scratch
        )
        return result

    def from_neighbour(
        system: System,
        mask: Bytes,
        core: bool,
        known: Known,
        structure: Structure,
        u: Floats,
        scratch: Scratch,
    ) -> tuple[int, float]:
        result: tuple[int, float] = relax_from_neighbour(
            system,
            mask,
            core,
            code,
            FORCE_TOLERANCE * system.bond,
            known,
            structure,
            u,
            scratch,
        )
        return result

    return Minimiser(from_rest, from_neighbour)
