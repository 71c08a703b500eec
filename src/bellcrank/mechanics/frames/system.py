"""Arrays of a frame for the kernels."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidProblem
from bellcrank.mechanics.frames.beams import (
    beam_stiffness,
    bow_coefficients,
    subdivided,
    triads,
)
from bellcrank.mechanics.frames.kernels.arrays import (
    POINTS,
    Frame,
    Memory,
    Reference,
    State,
    Structure,
)
from bellcrank.mechanics.ordering import elimination_order, factor_size
from bellcrank.mechanics.system import EFFICIENCY_TOLERANCE, incident_beams
from bellcrank.model.stroke_ranges import WHOLE

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.mechanics.kernels.arrays import Floats
    from bellcrank.mechanics.objectives import Objective
    from bellcrank.model import Problem


def allocate_state(nodes: int, size: int) -> State:
    """Allocate a state at rest of nodes with `size` unknowns each."""
    q = np.zeros((nodes if size == 6 else 0, 4))
    q[:, 0] = 1.0
    return State(np.zeros((nodes, 3)), q)


def allocate_structure(frame: Frame) -> Structure:
    """Allocate the load-bearing part of any design of a frame."""
    nodes, beams = len(frame.positions), len(frame.beams)
    blocks = int(frame.block.max(initial=-1)) + 1
    width = blocks // 64 + 1
    return Structure(
        present=np.zeros(beams, np.uint8),
        loaded=np.zeros(beams, np.uint8),
        search=np.zeros((nodes, 6), np.int64),
        active=np.zeros(nodes, np.uint8),
        order=np.zeros(nodes, np.int64),
        parent=np.full(nodes, -1),
        beam=np.zeros(beams, np.int64),
        beam_entry=np.full(beams, -1),
        column_bits=np.zeros((blocks, width), np.uint64),
        word_start=np.zeros((blocks, width), np.int64),
        column_start=np.zeros(blocks + 1, np.int64),
        row=np.zeros(factor_size(frame.beams, frame.block, springs=False).entries, np.int64),
        sizes=np.zeros(2, np.int64),
    )


def allocate_reference(frame: Frame) -> Reference:
    """Allocate a reference equilibrium."""
    nodes = len(frame.positions)
    return Reference(
        present=np.zeros(len(frame.beams), np.uint8),
        active=np.zeros(nodes, np.uint8),
        state=allocate_state(nodes, len(frame.unit)),
        count=np.array([0, 1]),
        load=np.zeros(POINTS),
        points=allocate_state(POINTS * nodes, len(frame.unit)),
        tension=np.zeros((POINTS + 1, len(frame.beams))),
        mode=np.zeros((POINTS + 2, nodes, len(frame.unit))),
        stiffness=np.zeros(POINTS + 2),
    )


def allocate_memory(frame: Frame, structure: Structure) -> Memory:
    """Allocate working memory for one thread."""
    nodes, beams, size = len(frame.positions), len(frame.beams), len(frame.unit)
    blocks, entries = len(structure.column_bits), len(structure.row)
    states: dict[str, Any] = {name: allocate_state(nodes, size) for name in ("previous",)}
    motions: dict[str, Any] = {
        name: np.zeros((nodes, size))
        for name in (
            "gradient", "difference", "change", "full_change", "tangent", "next_tangent",
            "last_tangent", "mode",
        )
    }  # fmt: skip
    return Memory(
        tension=np.zeros(beams),
        path_tension=np.zeros((2, beams)),
        tension_change=np.zeros((2, beams)),
        diagonal=np.zeros((blocks, size, size)),
        entries=np.zeros((entries, size, size)),
        column=np.zeros((blocks, size, size)),
        link=np.zeros((blocks, 3), np.int64),
        step=np.zeros((blocks, size)),
        force=np.zeros(12),
        tangent_block=np.zeros((12, 12)),
        work=np.zeros((9, 9, 9)),
        axial=np.zeros(beams),
        axial_slope=np.zeros((beams, 2 * size)),
        reached=np.zeros(nodes, np.uint8),
        path=np.zeros(1, np.int64),
        queue=np.zeros(nodes, np.int64),
        count=np.array([0, 1]),
        load=np.zeros(POINTS),
        points=allocate_state(POINTS * nodes, size),
        point_tension=np.zeros((POINTS + 1, beams)),
        point_mode=np.zeros((POINTS + 2, nodes, size)),
        point_stiffness=np.zeros(POINTS + 2),
        reached_load=np.ones(2),
        **states,
        **motions,
    )


def in_space(vectors: NDArray[np.float64]) -> Floats:
    """Return vectors (n, 2) or (n, 3) with three components."""
    out = np.zeros((len(vectors), 3))
    out[:, : vectors.shape[1]] = vectors
    return out


def held_unknowns(problem: Problem, nodes: int, size: int) -> NDArray[np.bool_]:
    """Return (nodes, size) the unknowns that supports and the drive prescribe.

    Supports that hold all displacements hold rotations too; the nodes of a displacement drive
    rotate freely.
    """
    supports, dimension = problem.supports, problem.lattice.dimension
    held = np.zeros((nodes, size), dtype=bool)
    held[supports.fixed] = True
    for axis, name in enumerate(("fixed_x", "fixed_y", "fixed_z")[:dimension]):
        held[getattr(supports, name), axis] = True
    if problem.input.drive == "displacement":
        held[problem.input.nodes, :dimension] = True
    return held


def prescribed_motion(problem: Problem, nodes: int, size: int) -> tuple[Floats, Floats]:
    """Return (nodes, size) the full motion of the drive and (nodes, 2) the ranges of its nodes.

    The ranges are the fractions of the load between which they move.
    """
    drive, ramps = np.zeros((nodes, size)), np.tile(WHOLE, (nodes, 1))
    given = problem.input
    if given.drive == "displacement":
        drive[given.nodes, : problem.lattice.dimension] = given.amount * given.direction
        ramps[given.nodes] = given.ranges
    return drive, ramps


def applied_forces(problem: Problem, nodes: int, size: int) -> tuple[Floats, Floats, int]:
    """Return (G, nodes, size) the full forces, (G, 2) their ranges, and the group of the weight.

    Forces that grow between the same fractions of the load are one group; the first one is that of
    the whole load. The own weight has a group even if no force has its range.
    """
    groups = {WHOLE: np.zeros((nodes, size))}
    groups.setdefault(problem.loads.weight_range, np.zeros((nodes, size)))
    axes, given = slice(problem.lattice.dimension), problem.input
    forces = [(each.range, each.nodes, each.force) for each in problem.loads.forces]
    if given.drive == "force":
        pushes = zip(given.ranges.tolist(), given.nodes, given.direction, strict=True)
        forces += [((begin, end), at, given.amount * along) for (begin, end), at, along in pushes]
    for span, at, force in forces:
        group = groups.setdefault(span, np.zeros((nodes, size)))
        group[at, axes] += force
    weight_group = list(groups).index(problem.loads.weight_range)
    return np.array(list(groups.values())), np.array(list(groups)), weight_group


def spring_stiffness(problem: Problem, nodes: int) -> Floats:
    """Return (nodes, 3, 3) the stiffness of the springs at outputs and at other nodes."""
    ground = np.zeros((nodes, 3, 3))
    for output in problem.outputs.values():
        if output.spring:
            each = _along(output.direction)
            if output.spring_kind == "isotropic":
                each = np.zeros_like(each)
                axes = np.arange(problem.lattice.dimension)
                each[:, axes, axes] = 1.0
            ground[output.nodes] += output.spring * each
    for spring in problem.loads.springs:
        ground[spring.nodes] += spring.stiffness * _along(spring.direction)
    return ground


def _along(direction: NDArray[np.float64]) -> Floats:
    """Return (n, 3, 3) the products of unit vectors with themselves."""
    vectors = in_space(direction)
    return np.asarray(vectors[:, :, None] * vectors[:, None, :])


def build_frame(
    problem: Problem,
    objective: Objective,
    elements: int | None = None,
    theory: str = "euler-bernoulli",
    mask: NDArray[np.bool_] | None = None,
    weight: Floats | None = None,
) -> Frame:
    """Convert a problem with a section to the arrays of a frame.

    Parameters
    ----------
    elements : int, optional
        None for one element of each beam that is shorter when it is bent, so that its axial force
        acts on its bending; a number for that many linear elements.
    theory
        Name in the registry of theories.
    mask : (M,) bool, optional
        Beams of the lattice that the frame has; all by default.
    weight : (d,), optional
        Force on a unit of volume, which grows along the whole load; by default that of the
        problem.

    Raises
    ------
    InvalidProblem
        If the problem has no section.
    """
    if problem.section is None or problem.material is None:
        raise InvalidProblem(
            f"problem {problem.name!r}: the beams of a frame need a section, such as "
            "section = {shape = 'rectangle', width = 0.2, thickness = 0.5}"
        )
    lattice, dimension = problem.lattice, problem.lattice.dimension
    size = 3 * (dimension - 1)
    chosen = lattice.beams if mask is None else lattice.beams[mask]
    wide = problem.beam_widths if mask is None else problem.beam_widths[mask]
    ratio = wide / problem.section.width
    joints = problem.beam_joints if mask is None else problem.beam_joints[mask]
    positions, beams, rigid = subdivided(
        np.array(lattice.positions), chosen.astype(np.int64), elements or 1, joints
    )  # fmt: skip
    ratio = np.repeat(ratio, elements or 1)
    nodes = len(positions)
    held = held_unknowns(problem, nodes, size)
    any_held, all_held = np.asarray(held.any(axis=1)), np.asarray(held.all(axis=1))
    drive, ramps = prescribed_motion(problem, nodes, size)
    load, load_range, weight_group = applied_forces(problem, nodes, size)
    kinks = problem.kinks
    protected = any_held.astype(np.uint8)
    protected[problem.special_nodes] = 1
    grounded, prescribed = np.zeros(nodes, np.uint8), np.zeros(nodes, np.uint8)
    grounded[problem.supports.fixed] = 1
    prescribed[problem.input.nodes] = problem.input.drive == "displacement"
    ground = spring_stiffness(problem, nodes)
    space = in_space(positions)
    rest = triads(space[beams[:, 1]] - space[beams[:, 0]])
    length = np.linalg.norm(rest[:, 0], axis=1)
    section = beam_stiffness(
        problem.section, problem.material, length, theory, dimension, rigid, ratio
    )
    incident_start, incident_beam = incident_beams(positions[:, :2], beams)
    scale = objective.numerator_scale / (objective.denominator or problem.input.amount)
    sensitivity = abs(scale) * len(problem.output.nodes) * max(1.0, objective.exponent - 1.0)
    of_beam = np.zeros((len(beams), 3))
    if weight is None:
        weight = problem.loads.weight
    else:
        weight_group = 0
    if weight is not None:
        area = problem.section.area_of(problem.section.width * ratio)
        of_beam[:, :dimension] = (area * length)[:, None] * np.asarray(weight)
    return Frame(
        unit=(0.0,) * size,
        positions=space,
        beams=beams,
        rest=rest,
        rest_length=length,
        section=section,
        bow=bow_coefficients(length, rigid) if elements is None else np.zeros((len(length), 3)),
        width=problem.section.width * ratio,
        rigid=rigid,
        incident_start=incident_start,
        incident_beam=incident_beam,
        held=held.astype(np.uint8),
        protected=protected,
        grounded=grounded,
        prescribed=prescribed,
        partly=(any_held & ~all_held).astype(np.uint8),
        block=elimination_order(beams, all_held, springs=False),
        drive=drive,
        ramp=ramps,
        has_ramps=len(kinks) > 0,
        kinks=np.array(kinks, dtype=np.float64),
        load=load,
        load_range=load_range,
        weight=of_beam,
        weight_group=weight_group,
        has_weight=weight is not None,
        ground=ground,
        spring_nodes=np.flatnonzero(ground.any(axis=(1, 2))),
        input_nodes=np.array(problem.input.nodes),
        input_direction=in_space(problem.input.direction),
        output_nodes=np.array(problem.output.nodes),
        output_direction=in_space(problem.output.direction),
        numerator_scale=float(objective.numerator_scale),
        exponent=float(objective.exponent),
        denominator=math.nan if objective.denominator is None else float(objective.denominator),
        denominator_scale=float(objective.denominator_scale),
        tolerance=float(np.clip(EFFICIENCY_TOLERANCE / sensitivity, 1e-12, 1e-8)),
    )
