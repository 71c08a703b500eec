"""A slow, obvious twin of the kernels: the energy as the paper writes it, in NumPy.

Angles are angles here, between two beams that are neighbours in the cyclic order around
a node; the kernels work with the rotations of single beams instead.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.model import Problem


def direction(vector: NDArray[np.float64]) -> NDArray[np.float64]:
    """Angle of each vector to the x axis."""
    return np.arctan2(vector[..., 1], vector[..., 0])


def wrapped(angle: NDArray[np.float64]) -> NDArray[np.float64]:
    """The same angle between -pi and pi."""
    return (angle + np.pi) % (2 * np.pi) - np.pi


def angular_springs(problem: Problem, mask: NDArray[np.bool_]) -> NDArray[np.int64]:
    """(S, 3) node, far end of one beam, far end of the next one counter-clockwise."""
    positions, beams = problem.lattice.positions, problem.lattice.beams[mask]
    springs = []
    for node in range(len(positions)):
        far = [int(b) if a == node else int(a) for a, b in beams if node in (a, b)]
        far.sort(key=lambda other: float(direction(positions[other] - positions[node])))
        if len(far) >= 2:
            springs += [(node, far[i - 1], far[i]) for i in range(len(far))]
    return np.array(springs, dtype=np.int64).reshape(-1, 3)


@dataclass
class Twin:
    """Energy and gradient of one design."""

    problem: Problem
    mask: NDArray[np.bool_]
    springs: NDArray[np.int64] = field(init=False)

    def __post_init__(self) -> None:
        self.springs = angular_springs(self.problem, self.mask)

    def bond_energy(self, u: NDArray[np.float64]) -> float:
        rest = self.problem.lattice.positions
        a, b = self.problem.lattice.beams[self.mask].T
        length = np.linalg.norm((rest + u)[b] - (rest + u)[a], axis=1)
        rest_length = np.linalg.norm(rest[b] - rest[a], axis=1)
        return self.problem.stiffness.bond * float(((length - rest_length) ** 2).sum())

    def angle_changes(self, u: NDArray[np.float64]) -> NDArray[np.float64]:
        """theta - theta0 of each angular spring."""
        node, first, second = self.springs.T
        rest = self.problem.lattice.positions
        now = rest + u
        theta0 = direction(rest[second] - rest[node]) - direction(rest[first] - rest[node])
        theta = direction(now[second] - now[node]) - direction(now[first] - now[node])
        return wrapped(theta - theta0)

    def energy(self, u: NDArray[np.float64]) -> float:
        """Elastic energy of beams, angular springs and output springs."""
        bend = self.problem.stiffness.angle * float((self.angle_changes(u) ** 2).sum())
        return self.bond_energy(u) + bend + self.output_energy(u)

    def output_energy(self, u: NDArray[np.float64]) -> float:
        output = self.problem.output
        if output.spring is None:
            return 0.0
        moved = u[output.nodes]
        if output.spring_kind == "directional":
            moved = (output.direction * moved).sum(axis=1)
        return 0.5 * output.spring * float((moved**2).sum())

    def gradient(self, u: NDArray[np.float64]) -> NDArray[np.float64]:
        """(N, 2) derivative of `energy`; itself tested against differences of it."""
        rest = self.problem.lattice.positions
        now = rest + u
        gradient = np.zeros_like(u)
        a, b = self.problem.lattice.beams[self.mask].T
        vector = now[b] - now[a]
        length = np.linalg.norm(vector, axis=1)
        stretch = length - np.linalg.norm(rest[b] - rest[a], axis=1)
        pull = 2 * self.problem.stiffness.bond * (stretch / length)[:, None] * vector
        np.add.at(gradient, b, pull)
        np.add.at(gradient, a, -pull)
        node, first, second = self.springs.T
        moment = 2 * self.problem.stiffness.angle * self.angle_changes(u)
        for far, sign in ((second, 1.0), (first, -1.0)):
            arm = now[far] - now[node]
            turn = np.stack([-arm[:, 1], arm[:, 0]], axis=1) / (arm**2).sum(axis=1)[:, None]
            np.add.at(gradient, far, sign * moment[:, None] * turn)
            np.add.at(gradient, node, -sign * moment[:, None] * turn)
        return gradient + self.output_force(u)

    def output_force(self, u: NDArray[np.float64]) -> NDArray[np.float64]:
        force = np.zeros_like(u)
        output = self.problem.output
        if output.spring is not None:
            moved = u[output.nodes]
            if output.spring_kind == "directional":
                moved = (output.direction * moved).sum(axis=1)[:, None] * output.direction
            force[output.nodes] = output.spring * moved
        return force


@dataclass
class Blend:
    """The energy (1 - t) E + t E_other, on the way from one design to another."""

    one: Twin
    other: Twin
    t: float

    @property
    def problem(self) -> Problem:
        return self.one.problem

    def gradient(self, u: NDArray[np.float64]) -> NDArray[np.float64]:
        return (1 - self.t) * self.one.gradient(u) + self.t * self.other.gradient(u)


def free_coordinates(problem: Problem, nodes: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Flat indices of the coordinates of `nodes` that neither supports nor drive hold."""
    free = np.repeat(nodes[:, None], 2, axis=1)
    free[problem.supports.fixed] = False
    free[problem.supports.fixed_x, 0] = False
    free[problem.supports.fixed_y, 1] = False
    if problem.input.drive == "displacement":
        free[problem.input.nodes] = False
    return np.flatnonzero(free)


def stiffness(twin: Twin | Blend, u: NDArray[np.float64], free: NDArray[np.int64]):
    """Dense second derivative of the energy, by differences of the gradient."""
    h = 1e-5
    columns = []
    for coordinate in free:
        shift = np.zeros(u.size)
        shift[coordinate] = h
        shift = shift.reshape(u.shape)
        difference = twin.gradient(u + shift) - twin.gradient(u - shift)
        columns.append(difference.ravel()[free] / (2 * h))
    return np.array(columns)


def solve(
    twin: Twin | Blend,
    nodes: NDArray[np.bool_],
    start: NDArray[np.float64] | None = None,
    load_steps: int = 5,
) -> NDArray[np.float64]:
    """Equilibrium at full load by dense Newton; only `nodes` move."""
    problem = twin.problem
    free = free_coordinates(problem, nodes)
    motion = np.zeros_like(problem.lattice.positions)
    motion[problem.input.nodes] = problem.input.amount * problem.input.direction
    driven = problem.input.drive == "displacement"
    u = np.zeros_like(motion) if start is None else start.copy()
    for fraction in np.linspace(0, 1, load_steps + 1)[1:] if start is None else [1.0]:
        if driven:
            u[problem.input.nodes] = fraction * motion[problem.input.nodes]
        load = np.zeros_like(motion) if driven else fraction * motion
        for _ in range(30):
            residual = (twin.gradient(u) - load).ravel()[free]
            step = -np.linalg.solve(stiffness(twin, u, free), residual)
            u.ravel()[free] += step
            if np.abs(step).max(initial=0.0) < 1e-12:
                break
        else:
            raise AssertionError("the twin's Newton did not converge")
    return u


def efficiency(problem: Problem, u: NDArray[np.float64]) -> float:
    """Mean output motion over mean input motion (paper, eq. 1)."""
    out = (problem.output.direction * u[problem.output.nodes]).sum(axis=1)
    given = (problem.input.direction * u[problem.input.nodes]).sum(axis=1)
    return float(out.mean() / given.mean())
