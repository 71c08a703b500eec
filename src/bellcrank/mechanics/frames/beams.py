"""Beams of frames: their triads, elements, stiffness and shortening."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.registry import Registry

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from bellcrank.mechanics.frames.kernels.arrays import Frame
    from bellcrank.mechanics.kernels.arrays import Floats, Ints
    from bellcrank.model import Elasticity, Problem, Section

    Complex = NDArray[np.complexfloating[Any, Any]]


def triads(chord: Floats) -> Floats:
    """Return (M, 4, 3) the vectors along beams and a triad of each, one vector a row."""
    axis = chord / np.linalg.norm(chord, axis=1)[:, None]
    # Any normal serves a round section; that of the plane is kept for beams in the plane.
    up = np.where((np.abs(axis[:, 2]) < 0.9)[:, None], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0])
    side = np.cross(up, axis)
    side /= np.linalg.norm(side, axis=1)[:, None]
    return np.stack([chord, axis, side, np.cross(axis, side)], axis=1)


def subdivided(
    positions: Floats, beams: Ints, elements: int, joint: Floats | float = 0.0
) -> tuple[Floats, Ints, Floats]:
    """Divide every beam into elements.

    Parameters
    ----------
    joint : float, (M,) or (M, 2)
        Length of each end of a beam that does not bend. It belongs to the first and to the last
        element; what lies between is divided equally.

    Returns
    -------
    positions : (N + M (elements - 1), d)
        The nodes, then the inner nodes of each beam in order.
    beams : (M elements, 2) int64
        The elements of each beam in order.
    rigid : (M elements, 2)
        Lengths of their ends that do not bend.
    """
    count, inner = len(positions), elements - 1
    start, end = positions[beams[:, 0]], positions[beams[:, 1]]
    given = np.asarray(joint, dtype=np.float64)
    joints = np.broadcast_to(given if given.ndim == 2 else given[..., None], (len(beams), 2))
    ratio = joints / np.linalg.norm(end - start, axis=1)[:, None]
    bending = 1.0 - ratio.sum(axis=1, keepdims=True)
    fraction = ratio[:, :1] + bending * np.arange(1, elements) / elements
    between = start[:, None] + fraction[:, :, None] * (end - start)[:, None]
    numbers = count + np.arange(len(beams) * inner).reshape(len(beams), inner)
    along = np.column_stack([beams[:, 0], numbers, beams[:, 1]])
    ends = np.stack([along[:, :-1], along[:, 1:]], axis=-1).reshape(-1, 2)
    rigid = np.zeros((len(beams), elements, 2))
    rigid[:, 0, 0], rigid[:, -1, 1] = joints.T
    inner_nodes = between.reshape(-1, positions.shape[1])
    return np.concatenate([positions, inner_nodes]), ends, rigid.reshape(-1, 2)


theories: Registry[Callable[[Section, Elasticity], float]] = Registry("theory")
"""Beam theories: functions of a section and a material that return the flexibility of a beam of
unit length in shear, 1 / (kappa G A)."""


@theories.register("euler-bernoulli")
def euler_bernoulli(_section: Section, _material: Elasticity) -> float:
    """Return 0: cross-sections stay normal to the axis."""
    return 0.0


@theories.register("timoshenko")
def timoshenko(section: Section, material: Elasticity) -> float:
    """Return the flexibility of cross-sections that stay plane but not normal to the axis."""
    return 1.0 / (section.shear_coefficient * material.shear_modulus * section.area)


def beam_stiffness(
    section: Section,
    material: Elasticity,
    length: Floats | Complex,
    theory: str,
    dimension: int,
    rigid: Floats | Complex | None = None,
    ratio: Floats | Complex | float = 1.0,
) -> Any:
    """Return (m, 4) or (m, 8) the stiffness of beams, as the kernels expect it.

    Parameters
    ----------
    length : (m,)
        Their lengths.
    theory
        Name in the registry of theories.
    rigid : (m, 2), optional
        Lengths of their ends that do not bend or twist; they stretch like the rest.
    ratio : (m,), optional
        Width of each beam over that of the section; 1 by default.

    Raises
    ------
    UnknownName
        If there is no such theory.
    """
    flexibility = theories[theory](section, material)
    ends = np.zeros((len(length), 2)) if rigid is None else rigid
    whole_length, length = length, length - ends.sum(axis=1)
    # The thickness of a rectangle is the same for all widths, a round section has no other size.
    both = ratio if section.shape == "round" else 1.0
    columns = [material.young * section.area * ratio * both / whole_length]
    bending = [section.inertia * ratio**3 * both]
    if dimension == 3:
        columns.append(material.shear_modulus * section.torsion_constant * ratio**4 / length)
        bending.append(section.inertia_out_of_plane * ratio * both**3)
    # Rotations of the ends of the part that bends, relative to its own chord.
    (one, two) = (ends / length[:, None]).T
    for inertia in bending:
        rigidity = material.young * inertia
        shear = 12.0 * rigidity * flexibility / (ratio * both * length**2)
        flexural = rigidity / (length * (1.0 + shear))
        own, other = (4.0 + shear) * flexural, (2.0 - shear) * flexural
        whole = own + other
        columns += [
            own + 2.0 * one * whole * (1.0 + one),
            other + (one + two + 2.0 * one * two) * whole,
            own + 2.0 * two * whole * (1.0 + two),
        ]
    return np.stack(columns, axis=1)


def bow_coefficients(length: Floats | Complex, rigid: Floats | Complex) -> Any:
    """Return (m, 3) the coefficients p, q and r of the shortening of bent beams.

    Half the integral of the squared slope along a beam of straight ends and a cubic between them
    is p a^2 + q a b + r b^2 for end rotations a and b relative to its chord. Without straight ends
    p and r are L / 15 and q is -L / 30.

    Parameters
    ----------
    length : (m,)
    rigid : (m, 2)
        Lengths of the ends that do not bend.
    """
    inner = length - rigid.sum(axis=1)
    one, two = (rigid / inner[:, None]).T
    columns = [
        0.5 * joint + 0.5 * inner * ratio**2 + inner / 30.0 * (2.0 + 3.0 * ratio * (1.0 + ratio))
        for joint, ratio in ((rigid[:, 0], one), (rigid[:, 1], two))
    ]
    both = inner * one * two + inner / 30.0 * (3.0 * (one + two) + 6.0 * one * two - 1.0)
    return np.stack([columns[0], both, columns[1]], axis=1)


def reshaped(
    problem: Problem, frame: Frame, beams: Ints, chord: Floats, width: Floats, rigid: Floats
) -> Frame:
    """Return a frame with other beams, each like one of a frame but of another shape.

    Parameters
    ----------
    beams : (m,)
        Beams of the frame, of one element each.
    chord : (m, 3)
        Vectors from their first to their second end.
    width : (m,)
    rigid : (m, 2)
        Lengths of their joints.
    """
    assert problem.section is not None
    assert problem.material is not None
    length = np.linalg.norm(chord, axis=1)
    ratio = width / problem.section.width
    bowed = np.asarray(frame.bow[beams] != 0.0).max(axis=1, keepdims=True)
    return replace(
        frame,
        rest=triads(chord),
        rest_length=length,
        section=beam_stiffness(
            problem.section, problem.material, length, "euler-bernoulli",
            problem.lattice.dimension, rigid, ratio,
        ),
        bow=bow_coefficients(length, rigid) * bowed,
        width=width,
        rigid=rigid,
    )  # fmt: skip
