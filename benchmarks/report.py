"""Times of the spring model: ``python -m benchmarks.report [--quick]``.

Measure the time of a Metropolis step, of a response and of the prediction of all flips. Markdown
tables are printed. All numbers of a row are measured in the same run.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass

import numpy as np
from scipy.stats import spearmanr

from bellcrank.mechanics import SpringEvaluator, Status
from bellcrank.model import find_problem
from benchmarks.chains import (
    Recording,
    evaluate_proposals,
    evaluate_section,
    record_chain,
)


@dataclass(frozen=True, slots=True)
class Effort:
    """Sizes of the measurements.

    Parameters
    ----------
    crane_steps, crane_seeds
        Steps and number of chains for the crane.
    scaling_steps, sizes
        Steps of the chains for the problems scaling-N, and the values of N.
    starts, length
        First steps and number of steps of the sections of a chain in which responses are timed.
    """

    crane_steps: int
    crane_seeds: int
    scaling_steps: int
    sizes: tuple[int, ...]
    starts: tuple[int, ...]
    length: int


FULL = Effort(20_000, 8, 5_000, tuple(range(8, 21, 2)), (200, 1000, 5000, 12_000, 19_000), 10)
QUICK = Effort(2_000, 2, 500, (8, 14, 20), (200, 1500), 5)


def fitted_exponent(beams: list[int], times: list[float]) -> float:
    """Return the exponent of a power law fitted to cost as a function of the number of beams."""
    return float(np.polyfit(np.log(beams), np.log(times), 1)[0])


def print_run(run: Recording, seed: int) -> None:
    """Print one row of the table of Metropolis steps."""
    steps, beams = run.masks.shape
    best = run.efficiency[run.accepted].max()
    print(
        f"| {run.name} | {seed} | {beams} | {steps} | {run.accepted.mean():.0%} | {best:.3f} "
        f"| {run.microseconds_per_step:.0f} |"
    )


def print_steps(effort: Effort) -> Recording:
    """Print the time of a Metropolis step; return the first chain for the crane."""
    print("| problem | seed | beams | steps | accepted | best efficiency | us per step |")
    print("|---|---|---|---|---|---|---|")
    cranes = [record_chain("crane", effort.crane_steps, seed) for seed in range(effort.crane_seeds)]
    for seed, run in enumerate(cranes):
        print_run(run, seed)
    beams, times = [], []
    names = [f"scaling-{size}" for size in effort.sizes]
    for run in (record_chain(name, effort.scaling_steps) for name in names):
        print_run(run, 0)
        beams.append(run.masks.shape[1])
        times.append(run.microseconds_per_step)
    median = np.median([run.microseconds_per_step for run in cranes])
    print(f"\nMedian for the crane: {median:.0f} us per step.")
    exponent = fitted_exponent(beams, times)
    print(
        f"The time per step is proportional to beams^{exponent:.2f} "
        f"from {names[0]} to {names[-1]}.\n"
    )
    return cranes[0]


def print_responses(crane: Recording, effort: Effort) -> None:
    """Print the time of a response, from rest and from the last accepted equilibrium."""
    seconds = {"rest": 0.0, "last accepted equilibrium": 0.0}
    count = 0
    for first_step in effort.starts:
        evaluator = SpringEvaluator(find_problem("crane"))
        section = crane.section(first_step, effort.length)
        evaluate_section(evaluator, section)
        start = time.perf_counter()
        evaluate_proposals(evaluator, section)
        seconds["last accepted equilibrium"] += time.perf_counter() - start
        start = time.perf_counter()
        for mask in section.masks[1:]:
            evaluator.evaluate(mask)
        seconds["rest"] += time.perf_counter() - start
        count += len(section.masks) - 1
    print("| crane, initial state | us per response |")
    print("|---|---|")
    for name, total in seconds.items():
        print(f"| {name} | {1e6 * total / count:.0f} |")


@dataclass(frozen=True, slots=True)
class PredictionCost:
    """Time and accuracy of the prediction of all flips.

    Parameters
    ----------
    flips
        Number of predicted flips.
    seconds, response_seconds
        Time of the prediction of all flips, and of the response of one flipped design.
    predicted, first_order
        Spearman's rank correlation of the low-rank prediction, and of the sensitivity, with the
        computed change of the efficiency.
    """

    flips: int
    seconds: float
    response_seconds: float
    predicted: float
    first_order: float


def measure_prediction(name: str, run: Recording, step: int) -> PredictionCost:
    """Compare predicted and computed flips of the current design at a step of a chain."""
    evaluator = SpringEvaluator(find_problem(name))
    mask = run.section(step, 1).masks[0] if step else evaluator.problem.initial
    before = evaluator.evaluate(mask).efficiency
    sensitivity = evaluator.sensitivity(mask)[evaluator.problem.designable]
    evaluator.predict_flips(mask)
    start = time.perf_counter()
    for _ in range(20):
        prediction = evaluator.predict_flips(mask)
    seconds = (time.perf_counter() - start) / 20
    assert prediction is not None
    evaluator.set_reference()
    change = np.full(len(prediction.beams), np.nan)
    start = time.perf_counter()
    for index, beam in enumerate(prediction.beams):
        flipped = mask.copy()
        flipped[beam] ^= True
        response = evaluator.evaluate(flipped, warm_start=True)
        if response.status is Status.CONVERGED:
            change[index] = response.efficiency - before
    response_seconds = (time.perf_counter() - start) / len(change)
    converged = np.isfinite(change)
    predicted, first_order = (
        float(spearmanr(estimate[converged], change[converged]).statistic)
        for estimate in (prediction.change, sensitivity)
    )
    return PredictionCost(len(change), seconds, response_seconds, predicted, first_order)


def print_predictions(crane: Recording, effort: Effort) -> None:
    """Print time and rank correlation of the prediction of all flips."""
    print("\n| problem | step | flips | ms, prediction of all flips | ms, one response "
          "| rank correlation of the prediction | of the sensitivity |")  # fmt: skip
    print("|---|---|---|---|---|---|---|")
    runs = [("crane", crane, step) for step in (0, *effort.starts)]
    for size in effort.sizes[:: max(1, len(effort.sizes) // 3)]:
        name = f"scaling-{size}"
        runs.append((name, record_chain(name, effort.scaling_steps), effort.scaling_steps - 1))
    for name, run, step in runs:
        cost = measure_prediction(name, run, step)
        print(
            f"| {name} | {step} | {cost.flips} | {1e3 * cost.seconds:.2f} "
            f"| {1e3 * cost.response_seconds:.2f} | {cost.predicted:.2f} "
            f"| {cost.first_order:.2f} |"
        )


def main() -> None:
    """Measure and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="short chains and few sizes")
    effort = QUICK if parser.parse_args().quick else FULL
    crane = print_steps(effort)
    print_responses(crane, effort)
    print_predictions(crane, effort)


if __name__ == "__main__":
    main()
