"""Quantities of the crane along its stroke: ``python -m benchmarks.quantities [--quick]``.

Measured on one core, with struts of 2 mm: the times of the values, gradients and predicted flips of
each quantity at full stroke, and the rank correlation of the predictions with the computed changes
for the designs that short searches end at.
"""

from __future__ import annotations

import argparse
import time
from typing import TYPE_CHECKING

import numpy as np
from scipy.stats import spearmanr

from bellcrank.mechanics import FrameEvaluator, Quantities, quantities
from bellcrank.model import find_problem, human_design
from bellcrank.part import PartSpec, frame_problem

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from bellcrank.model import Problem

FRACTIONS = (0.25, 0.5, 0.75, 1.0)
WEIGHT = (0.0, -1e-4)
"""Force on a unit of volume; the sag is proportional to it."""


def least_time(compute: Callable[[], object], repeats: int = 50) -> float:
    """Return the least time of a call, ms."""
    times = []
    for _ in range(repeats):
        began = time.perf_counter()
        compute()
        times.append(time.perf_counter() - began)
    return 1e3 * min(times)


def print_times(problem: Problem, mask: NDArray[np.bool_]) -> None:
    """Print the times of each quantity and of all, from a stored response."""
    evaluator = FrameEvaluator(problem)
    response = least_time(lambda: evaluator.evaluate(mask))
    print(f"Response from rest: {response:.2f} ms.\n")
    print("| quantity | value, ms | gradient, ms | all flips, ms |\n|---|---|---|---|")
    rows: list[tuple[str, Sequence[str], Sequence[float]]] = [
        (name, [name], (1.0,)) for name in quantities
    ]
    rows += [("all", list(quantities), (1.0,)), ("all, 4 fractions", list(quantities), FRACTIONS)]
    for title, names, fractions in rows:
        found = Quantities(evaluator, names, fractions, WEIGHT)
        found.evaluate(mask)
        times = [
            least_time(lambda found=found: found.evaluate(mask)),
            least_time(found.sensitivity),
            least_time(found.predict_flips),
        ]
        print(f"| {title} | " + " | ".join(f"{each:.2f}" for each in times) + " |", flush=True)


def improved(problem: Problem, steps: int, seed: int) -> tuple[float, NDArray[np.bool_]]:
    """Return efficiency and design after random flips that are kept if the efficiency rises."""
    evaluator, rng = FrameEvaluator(problem), np.random.default_rng(seed)
    mask = problem.initial.copy()
    best = evaluator.evaluate(mask).efficiency
    evaluator.set_reference()
    for beam in rng.choice(problem.designable, steps):
        flipped = mask.copy()
        flipped[beam] ^= True
        response = evaluator.evaluate(flipped, warm_start=True, lower_bound=best)
        if response.is_admissible and response.efficiency > best:
            mask, best = flipped, response.efficiency
            evaluator.set_reference()
    return best, mask


def correlations(problem: Problem, mask: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return (3, F, k) rank correlations over all flips, removed beams and added ones."""
    found = Quantities(FrameEvaluator(problem), list(quantities), FRACTIONS, WEIGHT)
    before = found.evaluate(mask)
    predicted = found.predict_flips()
    found.set_reference()
    gained = np.full(predicted.shape, np.nan)
    for index, beam in enumerate(problem.designable):
        flipped = mask.copy()
        flipped[beam] ^= True
        after = found.evaluate(flipped, warm_start=True)
        response = found.evaluator.response_of(flipped)
        if response is not None and response.is_admissible:
            gained[:, :, index] = after - before
    removed = mask[problem.designable]
    result = np.full((3, *predicted.shape[:2]), np.nan)
    for row, chosen in enumerate((removed | ~removed, removed, ~removed)):
        for entry in np.ndindex(predicted.shape[:2]):
            known = chosen & np.isfinite(predicted[entry]) & np.isfinite(gained[entry])
            if known.sum() > 10:
                result[row][entry] = spearmanr(predicted[entry][known], gained[entry][known])[0]
    return result


def main() -> None:
    """Measure and print both tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="few searches")
    quick = parser.parse_args().quick
    crane = frame_problem(find_problem("crane"), PartSpec())
    print_times(crane, human_design("crane").mask)
    found = []
    for seed in range(2 if quick else 8):
        best, mask = improved(crane, 1_000, seed)
        found.append(correlations(crane, mask))
        print(f"\nsearch {seed}: efficiency {best:.2f}", end="", flush=True)
    median = np.nanmedian(found, axis=0)
    title = " | ".join(["rank correlation at", *map(str, FRACTIONS), "removed, 1.0", "added, 1.0"])
    print(f"\n\n| {title} |\n|" + 7 * "---|")
    for column, name in enumerate(quantities):
        along = " | ".join(f"{each:.2f}" for each in median[0, :, column])
        print(f"| {name} | {along} | {median[1, -1, column]:.2f} | {median[2, -1, column]:.2f} |")


if __name__ == "__main__":
    main()
