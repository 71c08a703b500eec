"""Kernels that only other kernels call, made callable from Python."""

from __future__ import annotations

from bellcrank.mechanics.kernels._compile import entry
from bellcrank.mechanics.kernels.energy import (
    elastic_energy,
    find_gradient,
    find_stiffness,
    measure_held_beams,
)
from bellcrank.mechanics.kernels.newton import find_tension
from bellcrank.mechanics.kernels.structure import build_structure


@entry
def energy_and_gradient(system, mask, u, structure, scratch):
    """Elastic energy at `u`; leaves the gradient in `scratch.gradient`."""
    build_structure(system, mask, False, structure)
    measure_held_beams(system, structure, u, scratch)
    find_gradient(system, structure, 0.0, u, scratch)
    return elastic_energy(system, structure, u, scratch)


@entry
def assemble_stiffness(system, mask, u, structure, scratch):
    """Leave the stiffness at `u` in `scratch.diagonal` and `scratch.off_diagonal`."""
    build_structure(system, mask, False, structure)
    measure_held_beams(system, structure, u, scratch)
    find_gradient(system, structure, 0.0, u, scratch)
    find_tension(system, structure, scratch)
    find_stiffness(system, structure, 1.0, scratch)
