"""Frames that tests build by hand: any stiffness, supports and loads, moments included."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from bellcrank.mechanics.frames.kernels.response import find_reactions, respond
from bellcrank.mechanics.frames.system import (
    allocate_memory,
    allocate_reference,
    allocate_state,
    allocate_structure,
    build_frame,
)
from bellcrank.mechanics.objectives import objective_of
from bellcrank.mechanics.ordering import elimination_order
from bellcrank.mechanics.status import Status
from bellcrank.model import Elasticity, Input, Lattice, Output, Problem, Section, Supports

if TYPE_CHECKING:
    from bellcrank.mechanics.frames.kernels.arrays import Frame

Array = np.ndarray
MATERIAL = Elasticity(young=70.0, poisson=0.3)


class Equilibrium(NamedTuple):
    """Response of a frame at full load."""

    status: str
    u: Array
    """(N, 3) displacement, and rotation in the plane."""
    q: Array
    """(N, 4) orientation in space."""
    force: Array
    """(N, b) forces and moments on the held unknowns, residuals of the others."""
    energy: float
    reached: float
    """Largest fraction of the load on the stable path from rest."""


def chain(positions: Array, **given: object) -> Problem:
    """Return a line of beams, clamped at its first node, with a force at the last one."""
    count, dimension = np.shape(positions)
    axis = np.eye(dimension)
    content = {
        "name": "chain",
        "lattice": Lattice(positions, [[node, node + 1] for node in range(count - 1)]),
        "supports": Supports(fixed=[0]),
        "input": Input(nodes=[count - 1], direction=axis[1], drive="force", amount=1.0),
        "output": Output(nodes=[count // 2], direction=axis[1]),
        "section": Section.round(1e-3) if dimension == 3 else Section(1e-3, 1.0),
        "material": Elasticity(1.0, 0.3),
        "designable": [0],
    }
    return Problem(**(content | given))  # type: ignore[arg-type]


def random_frame(seed: int, **supports: object) -> Problem:
    """Random nodes in space, each joined to its five nearest neighbours and the next one."""
    rng = np.random.default_rng(seed)
    nodes = rng.uniform(0.0, 3.0, (16, 3))
    near = cKDTree(nodes).query(nodes, 6)[1]
    pairs = {(min(a, b), max(a, b)) for a, row in enumerate(near.tolist()) for b in row if a != b}
    pairs |= {(node, node + 1) for node in range(15)}
    return Problem(
        name="random",
        lattice=Lattice(nodes, sorted(pairs)),
        supports=Supports(fixed=[0, 5], **supports),
        input=Input(nodes=[3], direction=[1.0, 0.0, 0.0], drive="force", amount=1e-7),
        output=Output(nodes=[12], direction=[0.0, 1.0, 0.0]),
        section=Section.round(0.05),
        material=MATERIAL,
        designable=[0],
    )


def frame_of(problem: Problem, **changes: Array) -> Frame:
    """Return the linear frame of a problem with other arrays, such as section, load or held."""
    frame = build_frame(problem, objective_of(problem, None), elements=1)
    if "held" in changes:
        held = np.asarray(changes["held"], dtype=bool)
        some, fully = held.any(axis=1), held.all(axis=1)
        changes |= {
            "held": held.astype(np.uint8),
            "grounded": (fully & (frame.prescribed == 0)).astype(np.uint8),
            "partly": (some & ~fully).astype(np.uint8),
            "protected": np.maximum(frame.protected, some.astype(np.uint8)),
            "block": elimination_order(frame.beams, fully, springs=False),
        }
    return replace(frame, **changes)


def equilibrium(frame: Frame, mask: Array | None = None, increment: float = 1.0) -> Equilibrium:
    """Return the response of a frame, of all beams by default."""
    structure = allocate_structure(frame)
    memory, state = (
        allocate_memory(frame, structure),
        allocate_state(len(frame.positions), len(frame.unit)),
    )
    present = np.ones(len(frame.beams), np.uint8) if mask is None else mask.astype(np.uint8)
    status, _, energy = respond(
        frame, present, allocate_reference(frame), False, -np.inf, increment, structure, state,
        memory,
    )  # fmt: skip
    find_reactions(frame, structure, 1.0, state, memory)
    snapped = status == Status.SNAPPED
    return Equilibrium(
        Status(status).label, state.u, state.q, memory.gradient.copy(), energy,
        float(memory.reached_load[0]) if snapped else 1.0,
    )  # fmt: skip
