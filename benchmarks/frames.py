"""Times of frames: ``python -m benchmarks.frames [--quick]``.

Measured on one core: a step of the paper's Metropolis chain on the crane with 2 mm struts, the
prediction of all flips and its rank correlation with the computed changes, in the last design of
the chain and in one found by the default search, and the growth of a step with the number of beams,
in the plane (the problems scaling-N) and in space (octet lattices pushed at a corner). Lattices of
different sizes are diluted at random by the same part, and all numbers of a table are measured in
one run.
"""

from __future__ import annotations

import argparse
import time
from typing import TYPE_CHECKING

import numpy as np
from scipy.stats import spearmanr

from bellcrank.mechanics import FrameEvaluator
from bellcrank.model import (
    Input,
    Lattice,
    Output,
    Problem,
    Section,
    Supports,
    find_problem,
    unpack_mask,
)
from bellcrank.model.builtin.scaling import scaling
from bellcrank.part import PartSpec, frame_problem
from bellcrank.search import read_settings, searches
from bellcrank.search.hopping.local_search import MIN_GAIN
from bellcrank.search.markov.metropolis import ChainState

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

REMOVED = 0.55
"""Part of the designable beams that is removed from a lattice whose growth is measured: searched
designs have 37 to 45 % of them (crane, anti-parallel, pliers, scaling-8)."""
DESIGNS = 4
"""Number of such designs of each lattice."""
PROPOSALS = 60
"""Number of flips of each design."""


def octet(cells: int) -> Problem:
    """Return a cube of octet cells: held below, pushed down at a top corner, to move sideways."""
    grid = np.argwhere(np.ones((2 * cells + 1,) * 3))
    nodes = grid[grid.sum(axis=1) % 2 == 0]
    near = {tuple(node): index for index, node in enumerate(nodes)}
    steps = [(1, 1, 0), (1, -1, 0), (1, 0, 1), (1, 0, -1), (0, 1, 1), (0, 1, -1)]
    beams = [
        (index, near[other])
        for node, index in near.items()
        for step in steps
        if (other := tuple(np.add(node, step).tolist())) in near
    ]
    top = nodes[:, 2] == 2 * cells
    across = nodes[:, 0] + nodes[:, 1]
    return Problem(
        name=f"octet-{cells}",
        lattice=Lattice(nodes / np.sqrt(2.0), beams),
        supports=Supports(fixed=np.flatnonzero(nodes[:, 2] == 0)),
        input=Input(
            nodes=np.flatnonzero(top & (across >= across[top].max() - 1)),
            direction=[0, 0, -1],
            drive="displacement",
            amount=0.2,
        ),
        output=Output(nodes=np.flatnonzero(top & (across <= 1)), direction=[-1, 0, 0]),
        section=Section.round(0.2),
    )


def chain_times(problem: Problem, steps: int, seed: int) -> tuple[float, float, NDArray[np.bool_]]:
    """Return the mean time of a step (s), the best efficiency, and the last design of a chain."""
    evaluator = FrameEvaluator(problem)
    settings = read_settings({"search": "paper", "steps": steps, "seed": seed})
    search = searches["paper"]
    state = search.start(evaluator, settings, 0)
    began = time.perf_counter()
    while not search.is_done(state, settings):
        state, _ = search.advance(evaluator, settings, 0, state)
    seconds = (time.perf_counter() - began) / steps
    assert isinstance(state, ChainState)
    return seconds, state.best, unpack_mask(state.mask, problem.lattice.beam_count)


def found_design(problem: Problem, steps: int, seed: int) -> NDArray[np.bool_]:
    """Return the best design of one chain of the default search."""
    evaluator = FrameEvaluator(problem)
    settings = read_settings({"steps": steps, "seed": seed})
    search = searches[settings.name]
    state = search.start(evaluator, settings, 0)
    while not search.is_done(state, settings):
        state, _ = search.advance(evaluator, settings, 0, state)
    return unpack_mask(state.mask, problem.lattice.beam_count)


def predictions(problem: Problem, mask: NDArray[np.bool_]) -> tuple[int, float, float]:
    """Return the number of flips, the time of their prediction (s) and its rank correlation.

    Beams that carry no load are removed first, as in the results of searches. Changes below
    `MIN_GAIN` count as none.
    """
    evaluator = FrameEvaluator(problem)
    mask = mask.copy()
    mask[problem.designable] &= evaluator.load_bearing(mask)[problem.designable]
    before = evaluator.evaluate(mask).efficiency
    evaluator.predict_flips(mask)
    began = time.perf_counter()
    for _ in range(20):
        prediction = evaluator.predict_flips(mask)
    seconds = (time.perf_counter() - began) / 20
    assert prediction is not None
    evaluator.set_reference()
    gained = np.full(len(prediction.beams), np.nan)
    for index, beam in enumerate(prediction.beams):
        flipped = mask.copy()
        flipped[beam] ^= True
        response = evaluator.evaluate(flipped, warm_start=True)
        if response.is_admissible:
            gained[index] = response.efficiency - before
    known = np.isfinite(gained)
    pair = [
        np.where(np.abs(each) < MIN_GAIN, 0.0, each)[known] for each in (prediction.change, gained)
    ]
    return len(gained), seconds, float(spearmanr(*pair)[0])


def diluted(problem: Problem, seed: int) -> NDArray[np.bool_]:
    """Return a random design that is stable."""
    evaluator = FrameEvaluator(problem)
    rng = np.random.default_rng(seed)
    while True:
        mask = problem.initial.copy()
        mask[problem.designable] = rng.random(len(problem.designable)) >= REMOVED
        if evaluator.evaluate(mask).is_admissible:
            return mask


def step_time(problem: Problem, masks: Sequence[NDArray[np.bool_]], proposals: int) -> float:
    """Return the mean time (s) of single flips of designs."""
    evaluator = FrameEvaluator(problem)
    rng, times = np.random.default_rng(0), []
    for mask in masks:
        bound = evaluator.evaluate(mask).efficiency
        evaluator.set_reference()
        for beam in rng.choice(problem.designable, proposals):
            flipped = mask.copy()
            flipped[beam] ^= True
            began = time.perf_counter()
            evaluator.evaluate(flipped, warm_start=True, lower_bound=bound)
            times.append(time.perf_counter() - began)
    return float(np.mean(times))


def print_growth(title: str, problems: Sequence[Problem], proposals: int) -> None:
    """Print the time of a step of diluted lattices, and the exponent of its growth."""
    print(f"| {title} | nodes | beams | present | ms per step |\n|---|---|---|---|---|")
    beams, times = [], []
    for problem in problems:
        masks = [diluted(problem, seed) for seed in range(DESIGNS)]
        beams.append(problem.lattice.beam_count)
        times.append(step_time(problem, masks, proposals))
        print(
            f"| {problem.name} | {problem.lattice.node_count} | {beams[-1]} "
            f"| {np.mean(masks):.0%} "
            f"| {1e3 * times[-1]:.3f} |",
            flush=True,
        )
    exponent = np.polyfit(np.log(beams), np.log(times), 1)[0]
    print(f"\nThe time of a step is proportional to beams^{exponent:.2f}.\n")


def main() -> None:
    """Measure and print all tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="few seeds and small lattices")
    quick = parser.parse_args().quick
    crane = frame_problem(find_problem("crane"), PartSpec())
    chain_times(crane, 2, 0)  # compiles
    print("| crane, seed | ms per step | best | flips | ms for all flips | rank correlation "
          "| of a found design |")  # fmt: skip
    print("|---|---|---|---|---|---|---|")
    count = 1_000 if quick else 20_000
    steps: list[float] = []
    correlations: list[tuple[float, float]] = []
    for seed in range(2 if quick else 8):
        seconds, best, mask = chain_times(crane, count, seed)
        steps.append(seconds)
        flips, needed, of_chain = predictions(crane, mask)
        *_, of_found = predictions(crane, found_design(crane, count, seed))
        correlations.append((of_chain, of_found))
        print(
            f"| {seed} | {1e3 * seconds:.3f} | {best:.2f} | {flips} | {1e3 * needed:.2f} "
            f"| {of_chain:.3f} | {of_found:.3f} |",
            flush=True,
        )
    median = float(np.median(steps))
    chain, found = np.median(correlations, axis=0)
    print(f"\nMedian {1e3 * median:.3f} ms a step; slowest seed {max(steps) / median:.1f} times.")
    print(f"Median rank correlation {chain:.3f} in chains, {found:.3f} in found designs.\n")
    sizes = (8, 14) if quick else (8, 14, 20, 28, 40)
    planar = [frame_problem(scaling(size), PartSpec()) for size in sizes]
    print_growth("plane", planar, PROPOSALS // 4 if quick else PROPOSALS)
    cells = (1, 2) if quick else (2, 3, 4, 6)
    print_growth("space", [octet(each) for each in cells], PROPOSALS // 4 if quick else PROPOSALS)


if __name__ == "__main__":
    main()
