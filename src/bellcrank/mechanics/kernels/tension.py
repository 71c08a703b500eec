"""The tension of the beams that a stiffness is assembled with."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from bellcrank.mechanics.kernels._compile import kernel
from bellcrank.mechanics.kernels.fields import pair

if TYPE_CHECKING:
    from bellcrank.mechanics.kernels.arrays import Floats, Scratch, Structure, System


@kernel
def find_tension(system: System, structure: Structure, scratch: Scratch) -> None:
    """Tension of the movable beams at the displacement where they were measured."""
    for index in range(structure.sizes[1]):
        beam = structure.beam[index]
        stretch = scratch.length[beam] - system.rest_length[beam]
        scratch.tension[beam] = 2.0 * system.bond * stretch


@kernel
def clear_tension(scratch: Scratch) -> None:
    """Set all tensions to zero."""
    for beam in range(len(scratch.tension)):
        scratch.tension[beam] = 0.0


@kernel
def add_tension_at(
    system: System, structure: Structure, u: Floats, share: float, scratch: Scratch
) -> None:
    """Add a share of the tension of the movable beams at the displacement `u`."""
    for index in range(structure.sizes[1]):
        beam = structure.beam[index]
        first, second = pair(system.beams, beam)
        x = system.rest_vector[beam, 0] + (u[second, 0] - u[first, 0])
        y = system.rest_vector[beam, 1] + (u[second, 1] - u[first, 1])
        stretch = math.sqrt(x * x + y * y) - system.rest_length[beam]
        scratch.tension[beam] += share * 2.0 * system.bond * stretch


@kernel
def foresee_tension(system: System, structure: Structure, scale: float, scratch: Scratch) -> None:
    """Tension to first order after `scale` times the step, from where beams were measured.

    A Newton step turns beams along straight lines and so stretches them, by far more than
    they are stretched at the equilibrium that it leads to. With the tension taken from the
    linear step instead, as an unknown of its own, the stiffness there is right at once
    (Magisano, Leonetti and Garcea, Comput. Methods Appl. Mech. Eng. 313, 2017).
    """
    for index in range(structure.sizes[1]):
        beam = structure.beam[index]
        first, second = pair(system.beams, beam)
        stretch = scratch.length[beam] - system.rest_length[beam]
        for end in range(2):
            block = system.block[second if end else first]
            if block >= 0:
                sign = scale if end else -scale
                stretch += sign * scratch.axis[beam, 0] * scratch.step[block, 0]
                stretch += sign * scratch.axis[beam, 1] * scratch.step[block, 1]
        scratch.tension[beam] = 2.0 * system.bond * stretch
