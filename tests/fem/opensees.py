"""The same frames in OpenSees, built from the design alone: an independent answer."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from bellcrank.part.part import Part


def respond(
    part: Part, elements: int, theory: str, *, nonlinear: bool, increments: int = 16
) -> tuple[np.ndarray, np.ndarray]:
    """Return (N, 2) the motion of the lattice's nodes and (N, 2) the forces on held ones."""
    import openseespy.opensees as ops

    lattice = part.design.problem.lattice
    ops.wipe()
    ops.model("basic", "-ndm", 2, "-ndf", 3)
    ops.geomTransf("Corotational" if nonlinear else "Linear", 1)
    used = np.unique(lattice.beams[part.design.mask]).tolist()
    for node in used:
        ops.node(node + 1, *(lattice.positions[node] * part.scale).tolist())
    add_struts(ops, part, elements, theory)
    hold_and_drive(ops, part, set(used))
    ops.constraints("Transformation")
    ops.numberer("RCM")
    ops.system("UmfPack")
    ops.test("NormDispIncr", 1e-13, 50)
    ops.algorithm("Newton")
    ops.integrator("LoadControl", 1.0 / increments if nonlinear else 1.0)
    ops.analysis("Static", "-noWarnings")
    if ops.analyze(increments if nonlinear else 1) != 0:
        raise RuntimeError("OpenSees found no equilibrium")
    ops.reactions()
    moved, force = np.zeros((2, lattice.node_count, 2))
    for node in used:
        moved[node] = ops.nodeDisp(node + 1)[:2]
        force[node] = ops.nodeReaction(node + 1)[:2]
    ops.wipe()
    return moved, force


def add_struts(ops: Any, part: Part, elements: int, theory: str) -> None:
    """Add nodes and elements within the struts."""
    lattice, section, material = part.design.problem.lattice, part.section, part.material
    tag = element = lattice.node_count + 1
    widths = part.design.problem.widths
    relative = np.ones(len(lattice.beams))
    if widths is not None:
        relative = widths / part.design.problem.section.width
    struts = lattice.beams[part.design.mask].tolist()
    for (first, last), wide in zip(struts, relative[part.design.mask].tolist(), strict=True):
        start, end = lattice.positions[[first, last]] * part.scale
        chain = [first + 1, *range(tag, tag + elements - 1), last + 1]
        for inner in range(1, elements):
            ops.node(tag, *(start + (end - start) * inner / elements).tolist())
            tag += 1
        for a, b in pairwise(chain):
            element += 1
            if theory == "timoshenko":
                ops.element(
                    "ElasticTimoshenkoBeam", element, a, b, material.young, material.shear,
                    wide * section.area, wide**3 * section.inertia,
                    5.0 / 6.0 * wide * section.area, 1,
                )  # fmt: skip
            else:
                ops.element(
                    "elasticBeamColumn", element, a, b,
                    wide * section.area, material.young, wide**3 * section.inertia, 1,
                )  # fmt: skip


def hold_and_drive(ops: Any, part: Part, there: set[int]) -> None:
    """Add supports and the input."""
    problem = part.design.problem
    supports, given = problem.supports, problem.input
    fixities = ((1, 1, 1), (1, 0, 0), (0, 1, 0))
    for nodes, fixity in zip(
        (supports.fixed, supports.fixed_x, supports.fixed_y), fixities, strict=True
    ):
        for node in there.intersection(nodes.tolist()):
            ops.fix(node + 1, *fixity)
    ops.timeSeries("Linear", 1)
    ops.pattern("Plain", 1, 1)
    for node, direction in zip(given.nodes.tolist(), given.direction, strict=True):
        if node not in there:
            continue
        if given.drive == "force":
            force = given.amount * part.scale * part.stiffness_unit * direction
            ops.load(node + 1, *force.tolist(), 0.0)
            continue
        for column in (0, 1):
            ops.sp(node + 1, column + 1, given.amount * part.scale * float(direction[column]))
