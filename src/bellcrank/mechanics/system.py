"""Arrays of a problem for the kernels."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.mechanics.kernels.arrays import (
    HELD,
    HELD_X,
    HELD_Y,
    MAX_KNOTS,
    Bytes,
    Floats,
    Ints,
    Reference,
    Scratch,
    Structure,
    System,
    Vectors,
)
from bellcrank.mechanics.kernels.flip_prediction import RANK, FlipWorkspace
from bellcrank.mechanics.kernels.inverse import Inverse
from bellcrank.mechanics.ordering import elimination_order, factor_size, near_blocks
from bellcrank.model import require_plane

if TYPE_CHECKING:
    from bellcrank.mechanics.objectives import Objective
    from bellcrank.model import Problem

EFFICIENCY_TOLERANCE = 1e-9
"""Error in efficiency at which an equilibrium counts as converged."""


def incident_beams(positions: Floats, beams: Ints) -> tuple[Ints, Ints]:
    """List the beams incident to each node, counter-clockwise at rest.

    Returns
    -------
    start : (N + 1,) int64
    beam : (2 M,) int64
        The beams of node c are ``beam[start[c]:start[c + 1]]``.
    """
    node = beams.T.ravel()
    beam = np.tile(np.arange(len(beams)), 2)
    offset = positions[beams[:, 1]] - positions[beams[:, 0]]
    offset = np.concatenate([offset, -offset])
    order = np.lexsort((np.arctan2(offset[:, 1], offset[:, 0]), node))
    start = np.searchsorted(node[order], np.arange(len(positions) + 1))
    return start.astype(np.int64), beam[order].astype(np.int64)


def _held_coordinates(problem: Problem) -> Bytes:
    held = np.zeros(problem.lattice.node_count, dtype=np.uint8)
    held[problem.supports.fixed] = HELD
    held[problem.supports.fixed_x] |= HELD_X
    held[problem.supports.fixed_y] |= HELD_Y
    if problem.input.drive == "displacement":
        held[problem.input.nodes] = HELD
    return held


def _output_springs(problem: Problem) -> Floats:
    """Return (N, 3) components xx, xy, yy of the stiffness of the springs on the output nodes."""
    ground = np.zeros((problem.lattice.node_count, 3))
    output = problem.output
    if output.spring:
        x, y = output.direction.T
        if output.spring_kind == "isotropic":
            stiffness = np.tile([1.0, 0.0, 1.0], (len(output.nodes), 1))
        else:
            stiffness = np.stack([x * x, x * y, y * y], axis=1)
        ground[output.nodes] = output.spring * stiffness
    return ground


def build_system(problem: Problem, objective: Objective) -> System:
    """Convert a problem to arrays.

    Raises
    ------
    InvalidProblem
        If the problem is in space.
    """
    require_plane(problem, "spring model")
    lattice = problem.lattice
    beams = lattice.beams.astype(np.int64)
    positions = np.array(lattice.positions)
    incident_start, incident_beam = incident_beams(positions, beams)
    held = _held_coordinates(problem)
    protected = (held != 0).astype(np.uint8)
    protected[problem.input.nodes] = 1
    protected[problem.output.nodes] = 1
    grounded = np.zeros_like(held)
    grounded[problem.supports.fixed] = 1
    motion = np.zeros_like(positions)
    motion[problem.input.nodes] = problem.input.amount * problem.input.direction
    displaced = problem.input.drive == "displacement"
    scale = objective.numerator_scale / (objective.denominator or problem.input.amount)
    sensitivity = abs(scale) * len(problem.output.nodes) * max(1.0, objective.exponent - 1.0)
    return System(
        positions=positions,
        beams=beams,
        rest_vector=positions[beams[:, 1]] - positions[beams[:, 0]],
        rest_length=np.array(lattice.rest_length),
        movable=(held[beams] != HELD).any(axis=1).astype(np.uint8),
        incident_start=incident_start,
        incident_beam=incident_beam,
        held=held,
        protected=protected,
        grounded=grounded,
        block=elimination_order(beams, held == HELD),
        drive=motion if displaced else np.zeros_like(motion),
        load=np.zeros_like(motion) if displaced else motion,
        ground=_output_springs(problem),
        bond=float(problem.stiffness.bond),
        angle=float(problem.stiffness.angle),
        input_nodes=np.array(problem.input.nodes),
        input_direction=np.array(problem.input.direction),
        output_nodes=np.array(problem.output.nodes),
        output_direction=np.array(problem.output.direction),
        numerator_scale=float(objective.numerator_scale),
        exponent=float(objective.exponent),
        denominator=math.nan if objective.denominator is None else float(objective.denominator),
        denominator_scale=float(objective.denominator_scale),
        tolerance=float(np.clip(EFFICIENCY_TOLERANCE / sensitivity, 1e-12, 1e-8)),
    )


def allocate_structure(system: System) -> Structure:
    """Allocate the load-bearing graph of any design of a system."""
    nodes, beams = len(system.positions), len(system.beams)
    blocks = int(system.block.max(initial=-1)) + 1
    width = blocks // 64 + 1
    return Structure(
        present=np.zeros(beams, np.uint8),
        loaded=np.zeros(beams, np.uint8),
        search=np.zeros((nodes, 6), np.int64),
        active=np.zeros(nodes, np.uint8),
        order=np.zeros(nodes, np.int64),
        parent=np.full(nodes, -1),
        around=np.zeros(int(np.diff(system.incident_start).max(initial=0)), np.int64),
        beam=np.zeros(beams, np.int64),
        beam_entry=np.full(beams, -1),
        spring_beams=np.zeros((2 * beams, 2), np.int64),
        spring_node=np.zeros(2 * beams, np.int64),
        spring_weight=np.zeros(2 * beams),
        spring_entry=np.full(2 * beams, -1),
        column_bits=np.zeros((blocks, width), np.uint64),
        word_start=np.zeros((blocks, width), np.int64),
        column_start=np.zeros(blocks + 1, np.int64),
        row=np.zeros(factor_size(system.beams, system.block).entries, np.int64),
        sizes=np.zeros(5, np.int64),
    )


def allocate_reference(system: System) -> Reference:
    """Allocate a reference equilibrium."""
    return Reference(
        present=np.zeros(len(system.beams), np.uint8),
        active=np.zeros(len(system.positions), np.uint8),
        u=np.zeros((len(system.positions), 2)),
    )


def allocate_scratch(system: System, structure: Structure) -> Scratch:
    """Allocate working memory for one thread."""
    nodes, beams = len(system.positions), len(system.beams)
    blocks, entries = len(structure.column_bits), len(structure.row)
    return Scratch(
        length=np.ones(beams),
        rotation=np.zeros(beams),
        axis=np.zeros((beams, 2)),
        turn=np.zeros((beams, 2)),
        tension=np.zeros(beams),
        torque=np.zeros(beams),
        turn_weight=np.zeros(beams),
        gradient=np.zeros((nodes, 2)),
        diagonal=np.zeros((blocks, 4)),
        off_diagonal=np.zeros((entries, 4)),
        factor_diagonal=np.zeros((blocks, 4)),
        factor=np.zeros((entries, 4)),
        column=np.zeros((blocks, 4)),
        link=np.zeros((blocks, 3), np.int64),
        step=np.zeros((blocks, 2)),
        vectors=_allocate_vectors(nodes),
    )


def _allocate_vectors(nodes: int) -> Vectors:
    single = {
        name: np.zeros((nodes, 2))
        for name in Vectors.__annotations__
        if name != "rotation" and not name.startswith("knot")
    }
    return Vectors(
        **single,
        rotation=np.zeros(nodes),
        knot=np.zeros((MAX_KNOTS, nodes, 2)),
        knot_tangent=np.zeros((MAX_KNOTS, nodes, 2)),
        knot_load=np.zeros(MAX_KNOTS),
        knot_stiffness=np.zeros(MAX_KNOTS),
    )


def allocate_flip_workspace(system: System, *, first_order: bool = False) -> FlipWorkspace:
    """Allocate working memory for flip prediction.

    Parameters
    ----------
    first_order
        Leave out the inverse of the stiffness, which the sensitivity does not need.
    """
    block = np.full_like(system.block, -1) if first_order else system.block
    return FlipWorkspace(
        inverse=_allocate_inverse(system, block),
        anchored=np.zeros(len(system.positions), np.uint8),
        around=np.zeros(RANK, np.int64),
        nodes=np.zeros(RANK, np.int64),
        ends=np.zeros((RANK, 2), np.int64),
        near=np.zeros((RANK, RANK), np.int64),
        vectors=np.zeros((RANK, 2)),
        change=np.zeros((RANK, RANK)),
        coupling=np.zeros((RANK, RANK)),
        matrix=np.zeros((RANK, RANK + 1)),
        force=np.zeros(RANK),
    )


def _allocate_inverse(system: System, block: Ints) -> Inverse:
    """Allocate the inverse stiffness at the free nodes, those with a block."""
    blocks = int(block.max(initial=-1)) + 1
    near_start, near = near_blocks(system.beams, block)
    return Inverse(
        parent=np.full(blocks, -1),
        level=np.zeros(blocks, np.int64),
        columns=np.zeros((blocks, factor_size(system.beams, block).height, 4)),
        columns_are_known=np.zeros(blocks, np.uint8),
        work=np.zeros((blocks, 4)),
        near_start=near_start,
        near=near,
        near_block=np.zeros((len(near), 4)),
        near_is_known=np.zeros(len(near), np.uint8),
    )
