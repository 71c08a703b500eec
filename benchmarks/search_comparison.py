"""Comparison of the default search with plain Metropolis at equal cost.

``python -m benchmarks.search_comparison [--quick]`` runs plain Metropolis (the paper's chain) and
the default search on each problem, from many seeds, with the same response of a design. The two
searches are compared at equal numbers of responses and at equal processor time: plain Metropolis
continues until it has used both the number of responses and the median processor time of the
default search. A flip that does not change the loaded beams is not counted as a response in either
search. A prediction of all flips is not counted as a response, but its processor time is included.
Only designs count whose equilibrium is stable when the load is applied in small increments.

The results are written to ``docs/comparison/NAME.json``, and a table is printed.
"""

from __future__ import annotations

import argparse
import json
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import get_args

import numpy as np
from scipy.stats import mannwhitneyu

from bellcrank.mechanics import VERIFICATION_INCREMENT, SpringEvaluator, Status, UnloadedBeams
from bellcrank.model import builtin, find_problem
from bellcrank.search import (
    DEFAULT_SEARCH,
    SearchSettings,
    Verdict,
    advance_chain,
    make_evaluator,
    read_settings,
    start_chain,
)

FOLDER = Path(__file__).parents[1] / "docs" / "comparison"
PLAIN = "paper"
RESPONSES = {
    "crane": 20_000,
    "anti-parallel": 20_000,
    "scaling-14": 20_000,
    "pliers": 5_000,
    **{name: 20_000 for name in builtin if name.startswith("discs")},
}
"""Number of responses in a run of each problem."""
UNLIMITED_STEPS = 10**9
MIN_RECORDED_GAIN = 2e-3
"""Smallest relative gain of efficiency that is stored in the records."""


@dataclass(frozen=True, slots=True)
class Improvement:
    """A verified design with a higher efficiency than all earlier designs of the run."""

    efficiency: float
    responses: int
    seconds: float
    mask: str


@dataclass(frozen=True, slots=True)
class RunResult:
    """Improvements of one run, with their numbers of responses and their processor times."""

    seed: int
    responses: int
    seconds: float
    improvements: list[Improvement]

    def best(self, responses: float, seconds: float) -> float:
        """Return the best efficiency within a number of responses and a processor time."""
        return max(
            (
                each.efficiency
                for each in self.improvements
                if each.responses <= responses and each.seconds <= seconds
            ),
            default=0.0,
        )

    def to_dict(self) -> dict[str, object]:
        """Return the run as plain data, without improvements below `MIN_RECORDED_GAIN`."""
        curve: list[list[float]] = []
        for each in self.improvements:
            gain = np.inf if not curve else each.efficiency - curve[-1][2]
            if gain > MIN_RECORDED_GAIN * abs(each.efficiency) or each is self.improvements[-1]:
                curve.append([each.responses, each.seconds, each.efficiency])
        return {
            "seed": self.seed,
            "responses": self.responses,
            "seconds": self.seconds,
            "curve": curve,
            "best": self.improvements[-1].mask if self.improvements else None,
        }


@dataclass(frozen=True, slots=True)
class RunSettings:
    """Settings of one run.

    Parameters
    ----------
    problem, search, unloaded_beams, seed
        Problem, name of the search, treatment of unloaded beams, and seed.
    responses, seconds
        The run ends when both the number of responses and the processor time are reached.
    """

    problem: str
    search: str
    unloaded_beams: str
    seed: int
    responses: int
    seconds: float = 0.0

    @property
    def search_settings(self) -> SearchSettings:
        """Settings of the search; the number of steps of plain Metropolis is unlimited."""
        steps = UNLIMITED_STEPS if self.search == PLAIN else self.responses
        content = {"search": self.search, "unloaded_beams": self.unloaded_beams, "seed": self.seed}
        return read_settings({**content, "steps": steps})


def run_search(run: RunSettings) -> RunResult:
    """Run one search until the number of responses and the processor time are reached."""
    problem, settings = find_problem(run.problem), run.search_settings
    evaluator = make_evaluator(problem, settings)
    warm_up(run)
    verifier = Verifier(run)
    state = start_chain(evaluator, settings, 0)
    current, best = state.efficiency, -np.inf
    responses, seconds = 0, 0.0
    improvements: list[Improvement] = []
    while state.step < settings.steps and (responses < run.responses or seconds < run.seconds):
        start = time.process_time()
        state, rows = advance_chain(evaluator, settings, 0, state)
        elapsed = time.process_time() - start
        for index in range(len(rows.status)):
            evaluated = rows.status[index] not in (Verdict.FORBIDDEN, Verdict.REJECTED_EARLY)
            responses += bool(evaluated and rows.efficiency[index] != current)
            if rows.accepted[index]:
                current = rows.efficiency[index]
                if current > best and verifier.is_stable(rows.mask[index]):
                    best = current
                    reached = seconds + elapsed * (index + 1) / len(rows.status)
                    mask = rows.mask[index].tobytes().hex()
                    improvements.append(Improvement(float(best), responses, reached, mask))
        seconds += elapsed
    return RunResult(run.seed, responses, seconds, improvements)


def warm_up(run: RunSettings) -> None:
    """Load the compiled kernels before the measurement."""
    settings = replace(run.search_settings, steps=2)
    evaluator = make_evaluator(find_problem(run.problem), settings)
    advance_chain(evaluator, settings, 0, start_chain(evaluator, settings, 0))
    evaluator.predict_flips(evaluator.problem.initial)


class Verifier:
    """Verification of designs with small load increments; its time is not measured."""

    def __init__(self, run: RunSettings) -> None:
        self._problem = find_problem(run.problem)
        self._evaluator = SpringEvaluator(
            self._problem, unloaded_beams=run.search_settings.unloaded_beams
        )
        self._cache: dict[bytes, bool] = {}

    def is_stable(self, packed: np.ndarray) -> bool:
        """Return whether the equilibrium is stable up to the full load."""
        key = packed.tobytes()
        if key not in self._cache:
            mask = np.unpackbits(packed)[: self._problem.lattice.beam_count].astype(bool)
            response = self._evaluator.evaluate(mask, VERIFICATION_INCREMENT)
            self._cache[key] = response.status is Status.CONVERGED
        return self._cache[key]


def compare(
    name: str, unloaded_beams: str, seeds: int, fraction: float, pool: ProcessPoolExecutor
) -> dict:
    """Run both searches on a problem; return the statistics and the runs."""
    responses = int(RESPONSES[name] * fraction)
    settings = [
        RunSettings(name, DEFAULT_SEARCH, unloaded_beams, seed, responses) for seed in range(seeds)
    ]
    default = list(pool.map(run_search, settings))
    seconds = float(np.median([run.seconds for run in default]))
    plain_settings = [replace(run, search=PLAIN, seconds=seconds) for run in settings]
    plain = list(pool.map(run_search, plain_settings))
    result = {
        "problem": name, "unloaded_beams": unloaded_beams,
        "responses": responses, "seconds": seconds,
        "equal responses": statistics_of(default, plain, responses, np.inf),
        "equal time": statistics_of(default, plain, np.inf, seconds),
    }  # fmt: skip
    runs = {DEFAULT_SEARCH: default, PLAIN: plain}
    return {**result, "runs": {key: [run.to_dict() for run in runs[key]] for key in runs}}


def statistics_of(
    default: list[RunResult], plain: list[RunResult], responses: float, seconds: float
) -> dict:
    """Compare the best efficiencies of two searches within a budget."""
    a = np.array([run.best(responses, seconds) for run in default])
    b = np.array([run.best(responses, seconds) for run in plain])
    return {
        "median": float(np.median(a)),
        "tenth percentile": float(np.quantile(a, 0.1)),
        "plain median": float(np.median(b)),
        "plain tenth percentile": float(np.quantile(b, 0.1)),
        "ratio": float(np.median(a) / np.median(b)),
        "p": float(mannwhitneyu(a, b, alternative="greater").pvalue),
    }


def print_rows(result: dict) -> None:
    """Print one row of the table for each kind of budget."""
    for kind in ("equal responses", "equal time"):
        f = result[kind]
        budget = result["responses"] if kind == "equal responses" else f"{result['seconds']:.1f} s"
        print(
            f"| {result['problem']} | {result['unloaded_beams']} | {budget} "
            f"| {f['plain median']:.3f} "
            f"| {f['median']:.3f} | {f['ratio']:.2f} | {f['tenth percentile']:.3f} "
            f"| {f['p']:.1e} |",
            flush=True,
        )


def main() -> None:
    """Compare the searches on all problems, or on those given as arguments."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("problems", nargs="*", default=list(RESPONSES))
    parser.add_argument("--unloaded-beams", default="prune_all", choices=get_args(UnloadedBeams))
    parser.add_argument("--seeds", type=int, default=30, help="number of seeds")
    parser.add_argument(
        "--quick",
        action="store_true",
        help="4 seeds and a tenth of the responses; no files are written",
    )
    options = parser.parse_args()
    seeds, fraction = (4, 0.1) if options.quick else (options.seeds, 1.0)
    print("| problem | unloaded beams | budget | plain, median | default, median | ratio "
          "| default, 10th percentile | p |")  # fmt: skip
    print("|---|---|---|---|---|---|---|---|")
    with ProcessPoolExecutor(2) as pool:
        for name in options.problems:
            result = compare(name, options.unloaded_beams, seeds, fraction, pool)
            print_rows(result)
            if not options.quick:
                FOLDER.mkdir(parents=True, exist_ok=True)
                target = FOLDER / f"{name}-{options.unloaded_beams}.json"
                target.write_text(json.dumps(rounded(result), indent=None))


def rounded(value: object) -> object:
    """Round all numbers to six significant digits, which keeps the records small."""
    if isinstance(value, dict):
        return {key: rounded(part) for key, part in value.items()}
    if isinstance(value, list):
        return [rounded(part) for part in value]
    return float(f"{value:.6g}") if isinstance(value, float) else value


if __name__ == "__main__":
    main()
