"""One Markdown table of what a step costs: ``python -m benchmarks.report [--quick]``.

All figures of a row, and so all ratios, are measured in the same run.
"""

from __future__ import annotations

import argparse
import importlib
import time
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.stats import spearmanr

from bellcrank.mechanics import SpringEvaluator, Status
from bellcrank.model import find_problem
from benchmarks.chains import Recording, record, walk_on

if TYPE_CHECKING:
    from collections.abc import Iterator

SAME = 1e-8
"""Largest difference in efficiency at which two minimisers count as equally accurate."""
TOLERANCES = (1e-11, 3e-12, 1e-12, 3e-13, 1e-13)
"""Largest forces, in units of bond stiffness, at which first-order minimisers may stop."""
PATIENCE = 30.0
"""Seconds of one pass, above which a minimiser is not tried with a tighter tolerance."""


@dataclass(frozen=True, slots=True)
class Effort:
    """How much of everything to measure."""

    crane_steps: int
    crane_seeds: int
    scaling_steps: int
    sizes: tuple[int, ...]
    stretches: tuple[int, ...]
    length: int


FULL = Effort(20_000, 8, 5_000, tuple(range(8, 21, 2)), (200, 1000, 5000, 12_000, 19_000), 10)
QUICK = Effort(2_000, 2, 500, (8, 14, 20), (200, 1500), 5)
"""Of the chain: where stretches begin that all minimisers walk, and how long they are."""


@contextmanager
def force_tolerance(value: float) -> Iterator[None]:
    """Let the first-order minimisers stop at another force for a while."""
    module = importlib.import_module("bellcrank.mechanics.minimisers")
    before = module.FORCE_TOLERANCE
    module.FORCE_TOLERANCE = value
    try:
        yield
    finally:
        module.FORCE_TOLERANCE = before


def time_walk(name: str, minimiser: str, stretches: list[Recording]) -> tuple[float, np.ndarray]:
    """Seconds for each response along the stretches, and the efficiencies.

    The equilibrium at the start of each stretch comes from Newton, untimed.
    """
    newton, evaluator = (
        SpringEvaluator(find_problem(name)),
        SpringEvaluator(find_problem(name), minimiser=minimiser),
    )
    seconds, efficiencies = 0.0, []
    for stretch in stretches:
        newton.evaluate(stretch.masks[0])
        newton.set_reference()
        for source, target in zip(newton.known, evaluator.known, strict=True):
            target[:] = source
        start = time.perf_counter()
        efficiencies.append(walk_on(evaluator, stretch))
        seconds += time.perf_counter() - start
    found = np.concatenate(efficiencies)
    return seconds / len(found), found


@dataclass(frozen=True, slots=True)
class Comparison:
    """A first-order minimiser beside Newton, along the same proposals."""

    minimiser: str
    seconds: float
    tolerance: float
    difference: float


def compare(name: str, minimiser: str, stretches: list[Recording], exact: np.ndarray) -> Comparison:
    """Time a minimiser at the loosest force tolerance that reaches Newton's efficiencies."""
    for tolerance in TOLERANCES:
        with force_tolerance(tolerance):
            seconds, found = time_walk(name, minimiser, stretches)
        difference = float(np.abs(found - exact).max())
        if difference <= SAME or seconds * len(found) > PATIENCE:
            break
    return Comparison(minimiser, seconds, tolerance, difference)


def fitted_exponent(beams: list[int], cost: list[float]) -> float:
    """Slope of log cost against log beams."""
    return float(np.polyfit(np.log(beams), np.log(cost), 1)[0])


def print_run(run: Recording, seed: int) -> None:
    """Print one row of the table of steps."""
    steps, beams = run.masks.shape
    best = run.efficiency[run.accepted].max()
    print(
        f"| {run.name} | {seed} | {beams} | {steps} | {run.accepted.mean():.0%} | {best:.3f} "
        f"| {run.microseconds_per_step:.0f} |"
    )


def print_steps(effort: Effort) -> Recording:
    """Print the cost of a Metropolis step; return the recorded crane chain."""
    print("| problem | seed | beams | steps | accepted | best | us per step |")
    print("|---|---|---|---|---|---|---|")
    cranes = [record("crane", effort.crane_steps, seed) for seed in range(effort.crane_seeds)]
    for seed, run in enumerate(cranes):
        print_run(run, seed)
    beams, cost = [], []
    names = [f"scaling-{size}" for size in effort.sizes]
    for run in (record(name, effort.scaling_steps) for name in names):
        print_run(run, 0)
        beams.append(run.masks.shape[1])
        cost.append(run.microseconds_per_step)
    middle = np.median([run.microseconds_per_step for run in cranes])
    print(f"\nHalf of the runs on the crane take at most {middle:.0f} us per step.")
    exponent = fitted_exponent(beams, cost)
    print(f"Cost per step grows as beams^{exponent:.2f} from {names[0]} to {names[-1]}.\n")
    return cranes[0]


def print_minimisers(crane: Recording, effort: Effort) -> None:
    """Print what a response costs with each minimiser, along the same proposals."""
    stretches = [crane.stretch(start, effort.length) for start in effort.stretches]
    time_walk("crane", "newton", stretches)
    newton, exact = time_walk("crane", "newton", stretches)
    print("| crane, along the same chain | us per response | Newton is faster by | stops at force |"
          " largest difference in efficiency |")  # fmt: skip
    print("|---|---|---|---|---|")
    print(f"| newton | {1e6 * newton:.0f} | 1 | none | |")
    for name in ("cg", "fire"):
        found = compare("crane", name, stretches, exact)
        flag = "" if found.difference <= SAME else " (not as accurate)"
        print(
            f"| {name} | {1e6 * found.seconds:.0f} | {found.seconds / newton:.0f} "
            f"| {found.tolerance:.0e} k | {found.difference:.1e}{flag} |"
        )
    steps = 1e-6 * crane.microseconds_per_step
    print(
        f"\nA whole Newton step takes {1e6 * steps:.0f} us, a single FIRE response "
        f"{1e6 * found.seconds:.0f} us: {found.seconds / steps:.0f} times the steps per second."
    )


def foresee(name: str, run: Recording, start: int) -> tuple[int, float, float, float, float]:
    """FlipWorkspace all flips of the design that is current at a step of a chain.

    Returns
    -------
    flips
        How many.
    seconds, response
        Of the screening; of a response to one of the flips.
    screened, first_order
        Rank correlation of what is foreseen, and of the sensitivity, with the true changes.
    """
    evaluator = SpringEvaluator(find_problem(name))
    mask = run.stretch(start, 1).masks[0] if start else evaluator.problem.initial
    before = evaluator.evaluate(mask).efficiency
    slope = evaluator.sensitivity(mask)[evaluator.problem.designable]
    evaluator.predict_flips(mask)
    clock = time.perf_counter()
    for _ in range(20):
        screening = evaluator.predict_flips(mask)
    seconds = (time.perf_counter() - clock) / 20
    assert screening is not None
    evaluator.set_reference()
    gained = np.full(len(screening.beams), np.nan)
    clock = time.perf_counter()
    for index, beam in enumerate(screening.beams):
        flipped = mask.copy()
        flipped[beam] ^= True
        response = evaluator.evaluate(flipped, warm_start=True)
        if response.status is Status.CONVERGED:
            gained[index] = response.efficiency - before
    response_seconds = (time.perf_counter() - clock) / len(gained)
    counts = np.isfinite(gained)
    foreseen = [
        float(spearmanr(found[counts], gained[counts]).statistic)
        for found in (screening.change, slope)
    ]
    return len(gained), seconds, response_seconds, foreseen[0], foreseen[1]


def print_screening(crane: Recording, effort: Effort) -> None:
    """Print what it costs to foresee all flips, and how well they are ranked."""
    print("\n| problem | at step | flips | ms for all | a response is | rank correlation "
          "| first order alone |")  # fmt: skip
    print("|---|---|---|---|---|---|---|")
    runs = [("crane", crane, start) for start in (0, *effort.stretches)]
    for size in effort.sizes[:: max(1, len(effort.sizes) // 3)]:
        name = f"scaling-{size}"
        runs.append((name, record(name, effort.scaling_steps), effort.scaling_steps - 1))
    for name, run, start in runs:
        flips, seconds, response, screened, slope = foresee(name, run, start)
        print(
            f"| {name} | {start} | {flips} | {1e3 * seconds:.2f} | {1e3 * response:.2f} ms "
            f"| {screened:.2f} | {slope:.2f} |"
        )


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="a rough look in a few seconds")
    effort = QUICK if parser.parse_args().quick else FULL
    crane = print_steps(effort)
    print_minimisers(crane, effort)
    print_screening(crane, effort)


if __name__ == "__main__":
    main()
