"""How a network does on searches made elsewhere: ``python -m benchmarks.elsewhere``.

The searches are written a second time here, from the equations alone, with energy, equilibrium,
chain and random numbers of their own: of bellcrank they take the plain numbers of the problem and,
in the end, the network that is to be tested. Beam vectors, angles between neighbouring beams and
dense Newton steps: plain and slow (about 25 designs a second). Half of the runs look for the most
negative efficiency. Writes ``docs/surrogate/elsewhere.json``.
"""

from __future__ import annotations

import argparse
import json
import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve
from scipy.sparse import bsr_array, coo_array, csr_array
from scipy.sparse.csgraph import connected_components

from bellcrank.model import find_problem
from bellcrank.model.storage import write_text
from bellcrank.provenance import provenance
from bellcrank.surrogate.metrics import accuracy
from bellcrank.surrogate.predictor import load_predictor

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.model import Problem

RECORD = Path(__file__).parents[1] / "docs" / "surrogate" / "elsewhere.json"
INCREMENTS = (0.5, 1.0)
FORCE = 1e-9
"""Largest component of the force on a free node at an equilibrium."""
NEWTON_STEPS = 40
SOFTEST = 1e-9
"""Stiffness that every free coordinate gets in addition: what nothing holds stays where it is."""


class Simulation:
    """Equilibria of designs of a problem that is driven by displacements."""

    def __init__(self, problem: Problem) -> None:
        self.rest = np.asarray(problem.lattice.positions, float)[:, :2]
        self.beams = np.asarray(problem.lattice.beams)
        self.bond, self.angle = problem.stiffness.bond, problem.stiffness.angle
        self.held = np.asarray(problem.supports.fixed)
        self.driven = np.asarray(problem.input.nodes)
        self.pushed = np.asarray(problem.input.direction, float) * problem.input.amount
        self.amount = problem.input.amount
        self.output = np.asarray(problem.output.nodes)
        self.wanted = np.broadcast_to(problem.output.direction, (len(self.output), 2))
        fixed = np.zeros(len(self.rest), bool)
        fixed[self.held] = fixed[self.driven] = True
        self.anchored = fixed

    def efficiency(self, mask: NDArray[np.bool_]) -> float:
        """Return the mean output motion over the mean input motion; nan if none is found."""
        beams = self.beams[mask]
        free = self._free_coordinates(beams)
        pairs = self._neighbours(beams)
        moved = self.rest.copy()
        for part in INCREMENTS:
            moved[self.driven] = self.rest[self.driven] + part * self.pushed
            if not self._relax(moved, beams, pairs, free):
                return math.nan
        travel = moved[self.output] - self.rest[self.output]
        return float((travel * self.wanted).sum(axis=1).mean() / self.amount)

    def _free_coordinates(self, beams: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the coordinates of nodes that hang together with something held or driven."""
        count = len(self.rest)
        links = coo_array((np.ones(len(beams)), tuple(beams.T)), shape=(count, count))
        _, piece = connected_components(links, directed=False)
        loose = ~np.isin(piece, piece[self.anchored])
        nodes = np.flatnonzero(~self.anchored & ~loose)
        return (2 * nodes[:, None] + np.arange(2)).ravel()

    def _neighbours(self, beams: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return pairs of beams that are neighbours around a node, the outer pair included."""
        along = self.rest[beams[:, 1]] - self.rest[beams[:, 0]]
        pairs = []
        for node in range(len(self.rest)):
            starts = np.flatnonzero(beams[:, 0] == node)
            ends = np.flatnonzero(beams[:, 1] == node)
            around = np.concatenate([starts, ends])
            if len(around) < 2:
                continue
            away = np.concatenate([along[starts], -along[ends]])
            order = around[np.argsort(np.arctan2(away[:, 1], away[:, 0]))]
            pairs += zip(order, np.roll(order, -1), strict=True)
        return np.array(pairs, np.int64).reshape(-1, 2)

    def _relax(
        self,
        moved: NDArray[np.float64],
        beams: NDArray[np.int64],
        pairs: NDArray[np.int64],
        free: NDArray[np.int64],
    ) -> bool:
        """Bring the free coordinates to a stable equilibrium, in place."""
        flat = moved.reshape(-1)
        energy, force, stiffness = self._state(moved, beams, pairs)
        for _ in range(NEWTON_STEPS):
            if np.abs(force[free]).max(initial=0.0) < FORCE:
                return True
            shift = SOFTEST
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
                found = self._state(moved, beams, pairs)
                if found[0] <= energy + 1e-13 or length < 1e-4:
                    break
                length *= 0.5
            energy, force, stiffness = found
        return False

    def _state(
        self, moved: NDArray[np.float64], beams: NDArray[np.int64], pairs: NDArray[np.int64]
    ) -> tuple[float, NDArray[np.float64], NDArray[np.float64]]:
        """Return the energy, the force (2N,) and the stiffness (2N, 2N)."""
        count = len(moved)
        rest = self.rest[beams[:, 1]] - self.rest[beams[:, 0]]
        now = moved[beams[:, 1]] - moved[beams[:, 0]]
        length = np.hypot(*now.T)
        stretch = length - np.hypot(*rest.T)
        cross = rest[:, 0] * now[:, 1] - rest[:, 1] * now[:, 0]
        turn = np.arctan2(cross, (rest * now).sum(axis=1))
        normal = now / length[:, None]
        side = np.column_stack([-normal[:, 1], normal[:, 0]])
        bend = turn[pairs[:, 1]] - turn[pairs[:, 0]]
        energy = self.bond * (stretch**2).sum() + self.angle * (bend**2).sum()

        # Derivatives by the vector of each beam, then by the positions of its two ends.
        moment = np.zeros(len(beams))
        np.add.at(moment, pairs[:, 1], 2.0 * self.angle * bend)
        np.add.at(moment, pairs[:, 0], -2.0 * self.angle * bend)
        slope = side / length[:, None]
        pull = 2.0 * self.bond * stretch[:, None] * normal + moment[:, None] * slope
        force = np.zeros((count, 2))
        np.add.at(force, beams[:, 1], -pull)
        np.add.at(force, beams[:, 0], pull)

        outer = np.einsum("ni,nj->nij", normal, normal)
        across = np.einsum("ni,nj->nij", side, side)
        mixed = np.einsum("ni,nj->nij", normal, side)
        own = 2.0 * self.bond * (outer + (stretch / length)[:, None, None] * across)
        own -= (moment / length**2)[:, None, None] * (mixed + mixed.transpose(0, 2, 1))
        span = _spans(beams, count)
        turning = _blocks(slope[:, None, :]) @ span
        bending = turning[pairs[:, 1]] - turning[pairs[:, 0]]
        stiffness = span.T @ _blocks(own) @ span + 2.0 * self.angle * (bending.T @ bending)
        return float(energy), force.ravel(), stiffness.toarray()


def _spans(beams: NDArray[np.int64], nodes: int) -> csr_array:
    """Return the matrix (2 beams, 2 nodes) from positions to beam vectors."""
    axes = np.arange(2)
    rows = (2 * np.arange(len(beams))[:, None] + axes).ravel()
    heads, tails = ((2 * beams[:, end][:, None] + axes).ravel() for end in (1, 0))
    ones = np.ones(len(rows))
    where = (np.tile(rows, 2), np.concatenate([heads, tails]))
    return csr_array((np.concatenate([ones, -ones]), where), shape=(2 * len(beams), 2 * nodes))


def _blocks(blocks: NDArray[np.float64]) -> csr_array:
    """Return small matrices (n, rows, columns) along the diagonal of a large one."""
    count, rows, columns = blocks.shape
    where = (blocks, np.arange(count), np.arange(count + 1))
    return csr_array(bsr_array(where, shape=(rows * count, columns * count)))


def search(
    simulation: Simulation, problem: Problem, steps: int, sign: int, rng: np.random.Generator
) -> tuple[list[NDArray[np.bool_]], list[float]]:
    """Run the paper's search once; return what it proposed, masks and efficiencies."""
    mask = np.asarray(problem.initial).copy()
    cost = math.exp(-sign * simulation.efficiency(mask))
    masks, found, accepted = [], [], 0
    for _ in range(steps):
        proposed = mask.copy()
        proposed[rng.choice(problem.designable)] ^= True
        efficiency = simulation.efficiency(proposed)
        if math.isnan(efficiency):
            continue
        masks.append(proposed)
        found.append(efficiency)
        dearer = math.exp(-sign * efficiency) - cost
        temperature = max(0.06 - (0.06 - 1e-3) * accepted / 100, 1e-3)
        if dearer <= 0 or rng.random() < math.exp(-dearer / temperature):
            mask, cost, accepted = proposed, cost + dearer, accepted + 1
    return masks, found


def main() -> None:
    options = parse()
    problem = find_problem("crane")
    predictor = load_predictor(problem, options.model)
    simulation = Simulation(problem)
    rng = np.random.Generator(np.random.MT19937(options.seed))
    masks: list[NDArray[np.bool_]] = []
    efficiencies: list[float] = []
    for run in range(options.runs):
        made, found = search(simulation, problem, options.steps, 1 - 2 * (run % 2), rng)
        masks += made
        efficiencies += found
        print(f"run {run + 1} / {options.runs}: the last design has {found[-1]:.3f}", flush=True)
    predicted = predictor.predict(np.array(masks)).efficiency
    told = accuracy(predicted, np.array(efficiencies)).to_dict()
    asked = {"runs": options.runs, "steps": options.steps, "seed": options.seed}
    print(f"R2 {told['r_squared']:.4f}, determination {told['determination']:.4f}, "
          f"{told['count']} designs")  # fmt: skip
    found_here = {"provenance": provenance(), **asked, **told}
    options.out.parent.mkdir(parents=True, exist_ok=True)
    write_text(options.out, json.dumps(found_here, indent=1) + "\n", overwrite=True)


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=12)
    parser.add_argument("--steps", type=int, default=582)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--model", nargs="*", default=[], help="trained models, or the shipped one")
    parser.add_argument("--out", type=Path, default=RECORD)
    return parser.parse_args()


if __name__ == "__main__":
    main()
