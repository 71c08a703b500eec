"""Equilibria of a frame, and motions from them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.mechanics.frames.kernels.arrays import State
from bellcrank.mechanics.frames.system import allocate_state
from bellcrank.mechanics.status import Status

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.mechanics.frames.kernels.arrays import Frame, Memory, Structure
    from bellcrank.mechanics.kernels.arrays import Bytes, Floats, Ints
    from bellcrank.model import Problem


@dataclass(frozen=True, slots=True, eq=False)
class Equilibrium:
    """A configuration of a design as a frame, at a fraction of its load.

    It is valid until its evaluator computes another response. Fields are (N, b): displacements and
    rotations of the nodes (spins in space), or forces and moments on them.

    Parameters
    ----------
    problem, frame, structure, memory
        Those of the evaluator.
    fraction
        Fraction of the load.
    state
        Configuration of the nodes.
    """

    problem: Problem
    frame: Frame
    structure: Structure
    memory: Memory
    fraction: float
    state: State

    def fields(self, count: int) -> NDArray[np.float64]:
        """Return (count, N, b) fields of zeros."""
        return np.zeros((count, len(self.frame.positions), len(self.frame.unit)))

    def residual(self) -> Floats:
        """Return (N, b) the derivative of the potential energy: the reactions on held unknowns."""
        from bellcrank.mechanics.frames.kernels.response import find_reactions

        find_reactions(self.frame, self.structure, self.fraction, self.state, self.memory)
        return np.array(self.memory.gradient)

    def solve(self, forces: Floats) -> Floats | None:
        """Return (N, b) the linear motion by forces; None if the equilibrium is unstable."""
        from bellcrank.mechanics.frames.kernels.response import solve_fields

        motion = np.array(forces[None])
        stable = solve_fields(
            self.frame, self.structure, self.fraction, self.state, motion, self.memory
        )
        return np.asarray(motion[0]) if stable else None

    def forces_of(self, motion: Floats) -> Floats:
        """Return (N, b) the stiffness times a motion, held unknowns included."""
        from bellcrank.mechanics.frames.kernels.equilibria import stiffness_product

        forces = self.fields(1)[0]
        stiffness_product(self.frame, self.structure, self.state, motion, forces, self.memory)
        return np.asarray(forces)

    def moved(self, motion: Floats) -> Equilibrium:
        """Return the configuration after a motion, in general no equilibrium."""
        return replace(self, state=moved_state(self.state, motion))

    def ends(self, beams: Ints) -> tuple[State, State]:
        """Return the states of the first and of the second ends of beams."""
        u, q = self.state
        first, second = self.frame.beams[beams].T
        if not len(q):
            return State(u[first], q), State(u[second], q)
        return State(u[first], q[first]), State(u[second], q[second])


def moved_state(state: State, motion: Floats) -> State:
    """Return a state after a motion (n, b) of its nodes."""
    from bellcrank.mechanics.frames.kernels.condensation import move_by

    moved = State(state.u.copy(), state.q.copy())
    move_by(moved, motion)
    return moved


def stored_states(
    end: Equilibrium, count: int, loads: Floats, points: State
) -> list[tuple[float, State]]:
    """Return states of a path with the fractions of the load, in ascending order.

    Parameters
    ----------
    end
        The last state of the path.
    count
        Number of states between rest and the end.
    loads
        Fractions of the load there.
    points
        The states, one after the other, and others after them.
    """
    nodes = len(end.frame.positions)
    turned = nodes if len(points.q) else 0
    found = [(0.0, allocate_state(nodes, len(end.frame.unit)))]
    for index, load in enumerate(loads[:count].tolist()):
        if load < end.fraction:
            u = points.u[index * nodes : (index + 1) * nodes]
            found.append((load, State(u, points.q[index * turned : (index + 1) * turned])))
    return [*found, (end.fraction, end.state)]


def equilibrium_between(
    end: Equilibrium, stored: list[tuple[float, State]], fraction: float, design: Bytes
) -> Equilibrium | None:
    """Return the equilibrium at a fraction of the load; None if Newton's method does not find it.

    It begins between the two stored states next to it.

    Parameters
    ----------
    end
        The last state of the path; `fraction` is below its own.
    design : (M,) uint8
        The beams that are present.
    """
    from bellcrank.mechanics.frames.kernels.equilibria import find_equilibrium

    after = next(index for index, (load, _) in enumerate(stored) if load > fraction)
    (start, lower), (stop, upper) = stored[after - 1 : after + 1]
    state = allocate_state(len(end.frame.positions), len(end.frame.unit))
    status = find_equilibrium(
        end.frame, design, end.structure, fraction, lower, upper,
        (fraction - start) / (stop - start), state, end.memory,
    )  # fmt: skip
    return replace(end, fraction=fraction, state=state) if status == Status.CONVERGED else None
