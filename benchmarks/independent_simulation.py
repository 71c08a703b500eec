"""Designs of an independent simulation: ``python -m benchmarks.independent_simulation FILE``.

Searches run with a second implementation of the spring model and of the paper's chain, which uses
the arrays of the problem and no other code of bellcrank: it has its own energy, equilibrium, chain
and random numbers. Newton steps with dense matrices evaluate about 25 designs per second. Half of
the runs search for the most negative efficiency. The proposed designs and their efficiencies are
written to a Parquet file; ``python -m benchmarks.surrogate_long_runs`` compares networks with them.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve
from scipy.sparse import bsr_array, coo_array, csr_array
from scipy.sparse.csgraph import connected_components

from bellcrank.model import find_problem
from bellcrank.surrogate.dataset import Dataset

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.model import Problem

INCREMENTS = (0.5, 1.0)
"""Fractions of the stroke at which the equilibrium is computed."""
FORCE_TOLERANCE = 1e-9
"""Largest component of the force on a free node at an equilibrium."""
NEWTON_STEPS = 40
REGULARISATION = 1e-9
"""Stiffness added to every free coordinate; an unsupported mechanism keeps its position."""


class Simulation:
    """Equilibria of designs of a problem whose input is a displacement."""

    def __init__(self, problem: Problem) -> None:
        self.rest = np.asarray(problem.lattice.positions, float)[:, :2]
        self.beams = np.asarray(problem.lattice.beams)
        self.bond, self.angle = problem.stiffness.bond, problem.stiffness.angle
        self.input = np.asarray(problem.input.nodes)
        self.stroke = np.asarray(problem.input.direction, float) * problem.input.amount
        self.amount = problem.input.amount
        self.output = np.asarray(problem.output.nodes)
        self.direction = np.broadcast_to(problem.output.direction, (len(self.output), 2))
        self.prescribed = np.zeros(len(self.rest), bool)
        self.prescribed[np.asarray(problem.supports.fixed)] = True
        self.prescribed[self.input] = True

    def efficiency(self, mask: NDArray[np.bool_]) -> float:
        """Return output displacement / input displacement; nan without an equilibrium."""
        beams = self.beams[mask]
        free = self._free_coordinates(beams)
        pairs = self._neighbours(beams)
        positions = self.rest.copy()
        for fraction in INCREMENTS:
            positions[self.input] = self.rest[self.input] + fraction * self.stroke
            if not self._solve(positions, beams, pairs, free):
                return math.nan
        displacement = positions[self.output] - self.rest[self.output]
        return float((displacement * self.direction).sum(axis=1).mean() / self.amount)

    def _free_coordinates(self, beams: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the free coordinates of nodes that are connected to a support or the input."""
        count = len(self.rest)
        links = coo_array((np.ones(len(beams)), tuple(beams.T)), shape=(count, count))
        _, component = connected_components(links, directed=False)
        floating = ~np.isin(component, component[self.prescribed])
        nodes = np.flatnonzero(~self.prescribed & ~floating)
        return (2 * nodes[:, None] + np.arange(2)).ravel()

    def _neighbours(self, beams: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the pairs of beams that are adjacent in the cyclic order around a node."""
        vectors = self.rest[beams[:, 1]] - self.rest[beams[:, 0]]
        pairs = []
        for node in range(len(self.rest)):
            starts = np.flatnonzero(beams[:, 0] == node)
            ends = np.flatnonzero(beams[:, 1] == node)
            incident = np.concatenate([starts, ends])
            if len(incident) < 2:
                continue
            outward = np.concatenate([vectors[starts], -vectors[ends]])
            order = incident[np.argsort(np.arctan2(outward[:, 1], outward[:, 0]))]
            pairs += zip(order, np.roll(order, -1), strict=True)
        return np.array(pairs, np.int64).reshape(-1, 2)

    def _solve(
        self,
        positions: NDArray[np.float64],
        beams: NDArray[np.int64],
        pairs: NDArray[np.int64],
        free: NDArray[np.int64],
    ) -> bool:
        """Compute a stable equilibrium in place; return whether the iteration converged."""
        flat = positions.reshape(-1)
        energy, force, stiffness = self._state(positions, beams, pairs)
        for _ in range(NEWTON_STEPS):
            if np.abs(force[free]).max(initial=0.0) < FORCE_TOLERANCE:
                return True
            shift = REGULARISATION
            while True:
                tangent = stiffness[np.ix_(free, free)] + shift * np.eye(len(free))
                try:
                    step = cho_solve(cho_factor(tangent), force[free])
                    break
                except LinAlgError:
                    shift *= 100.0
                    if shift > 1e3:
                        return False
            start, length = flat[free].copy(), 1.0
            while True:
                flat[free] = start + length * step
                state = self._state(positions, beams, pairs)
                if state[0] <= energy + 1e-13 or length < 1e-4:
                    break
                length *= 0.5
            energy, force, stiffness = state
        return False

    def _state(
        self, positions: NDArray[np.float64], beams: NDArray[np.int64], pairs: NDArray[np.int64]
    ) -> tuple[float, NDArray[np.float64], NDArray[np.float64]]:
        """Return the energy, the force (2N,) and the stiffness (2N, 2N)."""
        count = len(positions)
        rest = self.rest[beams[:, 1]] - self.rest[beams[:, 0]]
        vector = positions[beams[:, 1]] - positions[beams[:, 0]]
        length = np.hypot(*vector.T)
        elongation = length - np.hypot(*rest.T)
        cross = rest[:, 0] * vector[:, 1] - rest[:, 1] * vector[:, 0]
        rotation = np.arctan2(cross, (rest * vector).sum(axis=1))
        tangent = vector / length[:, None]
        normal = np.column_stack([-tangent[:, 1], tangent[:, 0]])
        bending = rotation[pairs[:, 1]] - rotation[pairs[:, 0]]
        energy = self.bond * (elongation**2).sum() + self.angle * (bending**2).sum()

        # Derivatives with respect to the vector of each beam, then to the positions of its ends.
        moment = np.zeros(len(beams))
        np.add.at(moment, pairs[:, 1], 2.0 * self.angle * bending)
        np.add.at(moment, pairs[:, 0], -2.0 * self.angle * bending)
        rotation_gradient = normal / length[:, None]
        beam_force = 2.0 * self.bond * elongation[:, None] * tangent
        beam_force += moment[:, None] * rotation_gradient
        force = np.zeros((count, 2))
        np.add.at(force, beams[:, 1], -beam_force)
        np.add.at(force, beams[:, 0], beam_force)

        axial = np.einsum("ni,nj->nij", tangent, tangent)
        transverse = np.einsum("ni,nj->nij", normal, normal)
        mixed = np.einsum("ni,nj->nij", tangent, normal)
        block = 2.0 * self.bond * (axial + (elongation / length)[:, None, None] * transverse)
        block -= (moment / length**2)[:, None, None] * (mixed + mixed.transpose(0, 2, 1))
        difference = _difference_matrix(beams, count)
        rotations = _block_diagonal(rotation_gradient[:, None, :]) @ difference
        bendings = rotations[pairs[:, 1]] - rotations[pairs[:, 0]]
        stiffness = difference.T @ _block_diagonal(block) @ difference
        stiffness += 2.0 * self.angle * (bendings.T @ bendings)
        return float(energy), force.ravel(), stiffness.toarray()


def _difference_matrix(beams: NDArray[np.int64], nodes: int) -> csr_array:
    """Return the matrix (2 beams, 2 nodes) that maps positions to beam vectors."""
    axes = np.arange(2)
    rows = (2 * np.arange(len(beams))[:, None] + axes).ravel()
    ends, starts = ((2 * beams[:, end][:, None] + axes).ravel() for end in (1, 0))
    ones = np.ones(len(rows))
    indices = (np.tile(rows, 2), np.concatenate([ends, starts]))
    return csr_array((np.concatenate([ones, -ones]), indices), shape=(2 * len(beams), 2 * nodes))


def _block_diagonal(blocks: NDArray[np.float64]) -> csr_array:
    """Return the block-diagonal matrix of blocks (n, rows, columns)."""
    count, rows, columns = blocks.shape
    content = (blocks, np.arange(count), np.arange(count + 1))
    return csr_array(bsr_array(content, shape=(rows * count, columns * count)))


def search(
    simulation: Simulation,
    problem: Problem,
    steps: int,
    run: int,
    rng: np.random.Generator,
) -> tuple[list[NDArray[np.bool_]], list[float]]:
    """Run the paper's search once; return masks and efficiencies of the proposed designs."""
    sign = 1 - 2 * (run % 2)
    mask = np.asarray(problem.initial).copy()
    cost = math.exp(-sign * simulation.efficiency(mask))
    masks, efficiencies, accepted = [], [], 0
    for _ in range(steps):
        proposed = mask.copy()
        proposed[rng.choice(problem.designable)] ^= True
        efficiency = simulation.efficiency(proposed)
        if math.isnan(efficiency):
            continue
        masks.append(proposed)
        efficiencies.append(efficiency)
        increase = math.exp(-sign * efficiency) - cost
        temperature = max(0.06 - (0.06 - 1e-3) * accepted / 100, 1e-3)
        if increase <= 0 or rng.random() < math.exp(-increase / temperature):
            mask, cost, accepted = proposed, cost + increase, accepted + 1
    return masks, efficiencies


def main() -> None:
    """Run the searches and write the proposed designs."""
    options = parse()
    problem = find_problem("crane")
    simulation = Simulation(problem)
    rng = np.random.Generator(np.random.MT19937(options.seed))
    masks: list[NDArray[np.bool_]] = []
    efficiencies: list[float] = []
    runs: list[int] = []
    for run in range(options.runs):
        new_masks, values = search(simulation, problem, options.steps, run, rng)
        masks += new_masks
        efficiencies += values
        runs += [run] * len(values)
        print(
            f"run {run + 1} of {options.runs}: efficiency of the last design {values[-1]:.3f}",
            flush=True,
        )
    packed = np.packbits(np.array(masks), axis=1)
    Dataset(problem, packed, np.array(efficiencies), np.array(runs)).write(
        options.file, overwrite=True
    )


def parse() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("file", type=Path, help="Parquet file for the designs")
    parser.add_argument("--runs", type=int, default=12, help="number of runs")
    parser.add_argument("--steps", type=int, default=582, help="steps of each run")
    parser.add_argument("--seed", type=int, default=0, help="seed of the random numbers")
    return parser.parse_args()


if __name__ == "__main__":
    main()
