"""Two actuators joined by hand in one lattice, to compare chains of two-ports with."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bellcrank.model import Design, Input, Lattice, Output, Problem, Supports


def mirrored(design: Design, height: float, shift: float) -> Design:
    """A design upside down: y becomes height - y, and all goes sideways by a shift."""
    problem = design.problem
    positions = problem.lattice.positions * [1.0, -1.0] + [shift, height]
    turned = replace(
        problem,
        lattice=Lattice(positions, problem.lattice.beams),
        input=replace(problem.input, direction=problem.input.direction * [1.0, -1.0]),
        output=replace(problem.output, direction=problem.output.direction * [1.0, -1.0]),
    )
    return Design(turned, design.mask)


def joined(first: Design, second: Design) -> Design:
    """One lattice of two designs: nodes at the same place are one; likewise beams."""
    one, two = first.problem, second.problem
    before = one.lattice.positions
    distance = np.linalg.norm(two.lattice.positions[:, None] - before[None], axis=2)
    match, near = distance.argmin(axis=1), distance.min(axis=1) < 1e-6
    number = np.where(near, match, len(before) + np.cumsum(~near) - 1)
    positions = np.concatenate([before, two.lattice.positions[~near]])
    beams: dict[tuple[int, int], bool] = {}
    for lattice, mask, names in (
        (one.lattice, first.mask, np.arange(len(before))),
        (two.lattice, second.mask, number),
    ):
        for ends, present in zip(names[lattice.beams].tolist(), mask, strict=True):
            key = (min(ends), max(ends))
            beams[key] = beams.get(key, False) or bool(present)
    problem = Problem(
        name="chain",
        lattice=Lattice(positions, np.array(list(beams))),
        supports=Supports(fixed=np.union1d(one.supports.fixed, number[two.supports.fixed])),
        input=Input(one.input.nodes, one.input.direction, "displacement", one.input.amount),
        output=Output(number[two.output.nodes], two.output.direction),
        stiffness=one.stiffness,
    )
    return Design(problem, np.array(list(beams.values())))
