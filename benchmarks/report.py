"""Markdown tables of the cost of mechanics: ``python -m benchmarks.report [--quick]``.

A Metropolis step, a response and the prediction of all flips. All figures of a row are measured in
the same run.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass

import numpy as np
from scipy.stats import spearmanr

from bellcrank.mechanics import SpringEvaluator, Status
from bellcrank.model import find_problem
from benchmarks.chains import Recording, record, walk, walk_on


@dataclass(frozen=True, slots=True)
class Effort:
    """Sizes of the measurements."""

    crane_steps: int
    crane_seeds: int
    scaling_steps: int
    sizes: tuple[int, ...]
    stretches: tuple[int, ...]
    length: int


FULL = Effort(20_000, 8, 5_000, tuple(range(8, 21, 2)), (200, 1000, 5000, 12_000, 19_000), 10)
QUICK = Effort(2_000, 2, 500, (8, 14, 20), (200, 1500), 5)
"""The chain of the crane is timed from the steps `stretches` on, over `length` steps each."""


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


def print_responses(crane: Recording, effort: Effort) -> None:
    """Print the time of a response, from rest and along a chain."""
    seconds = {"from rest": 0.0, "along the chain": 0.0}
    count = 0
    for start in effort.stretches:
        evaluator = SpringEvaluator(find_problem("crane"))
        stretch = crane.stretch(start, effort.length)
        walk(evaluator, stretch)
        clock = time.perf_counter()
        walk_on(evaluator, stretch)
        seconds["along the chain"] += time.perf_counter() - clock
        clock = time.perf_counter()
        for mask in stretch.masks[1:]:
            evaluator.evaluate(mask)
        seconds["from rest"] += time.perf_counter() - clock
        count += len(stretch.masks) - 1
    print("| crane | us per response |")
    print("|---|---|")
    for name, total in seconds.items():
        print(f"| {name} | {1e6 * total / count:.0f} |")


@dataclass(frozen=True, slots=True)
class PredictionCost:
    """Time and rank correlation of a prediction of all flips.

    Parameters
    ----------
    flips
        Number of flips predicted.
    seconds, response_seconds
        Time of the prediction of all flips, and of one response to a flip.
    predicted, first_order
        Spearman's rank correlation of the predicted changes, and of the sensitivity, with the
        computed changes of the efficiency.
    """

    flips: int
    seconds: float
    response_seconds: float
    predicted: float
    first_order: float


def measure_prediction(name: str, run: Recording, start: int) -> PredictionCost:
    """Predict all flips of the design that is current at a step of a chain, and check them."""
    evaluator = SpringEvaluator(find_problem(name))
    mask = run.stretch(start, 1).masks[0] if start else evaluator.problem.initial
    before = evaluator.evaluate(mask).efficiency
    slope = evaluator.sensitivity(mask)[evaluator.problem.designable]
    evaluator.predict_flips(mask)
    clock = time.perf_counter()
    for _ in range(20):
        prediction = evaluator.predict_flips(mask)
    seconds = (time.perf_counter() - clock) / 20
    assert prediction is not None
    evaluator.set_reference()
    gained = np.full(len(prediction.beams), np.nan)
    clock = time.perf_counter()
    for index, beam in enumerate(prediction.beams):
        flipped = mask.copy()
        flipped[beam] ^= True
        response = evaluator.evaluate(flipped, warm_start=True)
        if response.status is Status.CONVERGED:
            gained[index] = response.efficiency - before
    response_seconds = (time.perf_counter() - clock) / len(gained)
    known = np.isfinite(gained)
    predicted, first_order = (
        float(spearmanr(found[known], gained[known]).statistic)
        for found in (prediction.change, slope)
    )
    return PredictionCost(len(gained), seconds, response_seconds, predicted, first_order)


def print_predictions(crane: Recording, effort: Effort) -> None:
    """Print the time of the prediction of all flips, and how well they are ranked."""
    print("\n| problem | at step | flips | ms for all | ms per response | rank correlation "
          "| of the sensitivity |")  # fmt: skip
    print("|---|---|---|---|---|---|---|")
    runs = [("crane", crane, start) for start in (0, *effort.stretches)]
    for size in effort.sizes[:: max(1, len(effort.sizes) // 3)]:
        name = f"scaling-{size}"
        runs.append((name, record(name, effort.scaling_steps), effort.scaling_steps - 1))
    for name, run, start in runs:
        cost = measure_prediction(name, run, start)
        print(
            f"| {name} | {start} | {cost.flips} | {1e3 * cost.seconds:.2f} "
            f"| {1e3 * cost.response_seconds:.2f} | {cost.predicted:.2f} "
            f"| {cost.first_order:.2f} |"
        )


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="a rough measurement in a few seconds")
    effort = QUICK if parser.parse_args().quick else FULL
    crane = print_steps(effort)
    print_responses(crane, effort)
    print_predictions(crane, effort)


if __name__ == "__main__":
    main()
