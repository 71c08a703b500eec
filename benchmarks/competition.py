"""Competition of searches at equal cost: ``python -m benchmarks.competition [PROBLEM ...]``.

Each method runs on each problem from many seeds, with the same response of a design (springs,
``prune_all``). Methods are compared at equal numbers of responses and at equal processor time: that
of the default search (median). The other methods continue until they have used both. A flip that
does not change the loaded beams counts as no response. A prediction of all flips counts as no
response either, but its processor time is included. Only designs count whose equilibrium is stable
when the load is applied in small increments; the time of this verification is not measured.

Each run is added to ``docs/competition.json`` as soon as it is done, and runs that are in the
record are not repeated. ``--responses N`` is the budget, ``--seeds N`` the number of seeds, and
``--quick`` a run of each method without a record. The tables of ``docs/searches.md`` and the page
``docs/best.md`` are printed by ``--table``, ``--cost`` and ``--best``.
"""

from __future__ import annotations

import argparse
import json
import time
from collections import defaultdict
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.stats import mannwhitneyu

from bellcrank.mechanics import VERIFICATION_INCREMENT, SpringEvaluator, Status
from bellcrank.model import builtin, find_problem
from bellcrank.provenance import provenance
from bellcrank.search import (
    DEFAULT_SEARCH,
    SearchSettings,
    Verdict,
    advance_chain,
    make_evaluator,
    read_settings,
    start_chain,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

RECORD = Path(__file__).parents[1] / "docs" / "competition.json"
PROBLEMS = [
    "crane", "anti-parallel", "scaling-14", "pliers",
    *(name for name in builtin if name.startswith("discs")),
]  # fmt: skip
METHODS = {"default": DEFAULT_SEARCH, "tempering": "tempering", "Metropolis": "paper"}
"""Name of the search of each method."""
UNLIMITED_STEPS = 10**9
BUDGETS = (10_000, 100_000, 1_000_000)
SEEDS = 20
MIN_RECORDED_GAIN = 2e-3
"""Smallest relative gain of efficiency that is stored."""


@dataclass(frozen=True, slots=True)
class Run:
    """One run: it ends when both the responses and the processor time in s are used."""

    problem: str
    method: str
    seed: int
    responses: int
    seconds: float = 0.0

    @property
    def settings(self) -> SearchSettings:
        """Settings of the search."""
        steps = self.responses if self.method == "default" else UNLIMITED_STEPS
        return read_settings(
            {
                "search": METHODS[self.method],
                "unloaded_beams": "prune_all",
                "seed": self.seed,
                "steps": steps,
            }
        )


class Verifier:
    """Verification of designs with small load increments."""

    def __init__(self, name: str) -> None:
        self._problem = find_problem(name)
        self._evaluator = SpringEvaluator(self._problem, unloaded_beams="prune_all")

    def is_stable(self, packed: np.ndarray) -> bool:
        """Return whether the equilibrium of a design is stable up to the full load."""
        mask = np.unpackbits(packed)[: self._problem.lattice.beam_count].astype(bool)
        return self._evaluator.evaluate(mask, VERIFICATION_INCREMENT).status is Status.CONVERGED


def warm_up(run: Run) -> None:
    """Load the compiled kernels before the measurement."""
    settings = replace(run.settings, steps=2)
    evaluator = make_evaluator(find_problem(run.problem), settings)
    advance_chain(evaluator, settings, 0, start_chain(evaluator, settings, 0))
    evaluator.predict_flips(evaluator.problem.initial)


def result_of(run: Run) -> dict[str, Any]:
    """Carry out a run; return its record.

    ``curve`` has responses, processor time and efficiency of better designs: of each that exceeds
    the one before by `MIN_RECORDED_GAIN`, and of the best.
    """
    warm_up(run)
    settings, verifier = run.settings, Verifier(run.problem)
    evaluator = make_evaluator(find_problem(run.problem), settings)
    state = start_chain(evaluator, settings, 0)
    current, best, packed = state.efficiency, -np.inf, None
    responses, seconds = 0, 0.0
    better: list[list[float]] = []
    while state.step < settings.steps and (responses < run.responses or seconds < run.seconds):
        start = time.process_time()
        state, rows = advance_chain(evaluator, settings, 0, state)
        elapsed = time.process_time() - start
        for index in range(len(rows.status)):
            evaluated = rows.status[index] not in (Verdict.FORBIDDEN, Verdict.REJECTED_EARLY)
            responses += bool(evaluated and rows.efficiency[index] != current)
            if rows.accepted[index]:
                current = float(rows.efficiency[index])
                if current > best and verifier.is_stable(rows.mask[index]):
                    best, packed = current, rows.mask[index]
                    reached = seconds + elapsed * (index + 1) / len(rows.status)
                    better.append([responses, float(f"{reached:.4g}"), float(f"{best:.6g}")])
        seconds += elapsed
    curve = better[:1]
    for point in better[1:]:
        if point[2] - curve[-1][2] > MIN_RECORDED_GAIN * abs(point[2]) or point is better[-1]:
            curve.append(point)
    return {
        "problem": run.problem, "method": run.method, "seed": run.seed, "budget": run.responses,
        "commit": provenance()["commit"], "responses": responses,
        "seconds": float(f"{seconds:.4g}"), "steps": state.step,
        "curve": curve, "mask": None if packed is None else packed.tobytes().hex(),
    }  # fmt: skip


def best_of(run: dict[str, Any], responses: float = np.inf, seconds: float = np.inf) -> float:
    """Return the best efficiency of a run within a number of responses and a processor time."""
    return max(
        (best for count, at, best in run["curve"] if count <= responses and at <= seconds),
        default=0.0,
    )


def read_runs(path: Path) -> list[dict[str, Any]]:
    """Return the runs of a record; none if there is no record."""
    return json.loads(path.read_text(encoding="utf-8"))["runs"] if path.exists() else []


def write_runs(path: Path, runs: list[dict[str, Any]]) -> None:
    """Write a record, one run on each line."""
    lines = ",\n".join(json.dumps(run) for run in runs)
    head = json.dumps(provenance())
    path.write_text(f'{{"provenance": {head},\n"runs": [\n{lines}\n]}}\n', encoding="utf-8")


def missing(
    runs: list[dict[str, Any]], problem: str, method: str, budget: int, seeds: Iterable[int]
) -> Iterator[Run]:
    """Yield the runs of a method that are not in the record.

    Methods other than the default run for its median time at least; runs that ended earlier are
    repeated.
    """
    known = chosen(runs, problem, method, budget)
    seconds = 0.0 if method == "default" else time_of_default(runs, problem, budget)
    for seed in seeds:
        if seed not in known or known[seed]["seconds"] < seconds:
            yield Run(problem, method, seed, budget, seconds)


def chosen(
    runs: list[dict[str, Any]], problem: str, method: str, budget: int
) -> dict[int, dict[str, Any]]:
    """Return the runs of a method on a problem with a budget, by seed."""
    wanted = (problem, method, budget)
    return {
        run["seed"]: run for run in runs if (run["problem"], run["method"], run["budget"]) == wanted
    }


def key_of(run: dict[str, Any]) -> tuple[Any, ...]:
    """Return what tells a run from others."""
    return run["problem"], run["method"], run["budget"], run["seed"]


def time_of_default(runs: list[dict[str, Any]], problem: str, budget: int) -> float:
    """Return the median processor time of the default search in s."""
    return median(run["seconds"] for run in chosen(runs, problem, "default", budget).values())


def table_rows(runs: list[dict[str, Any]]) -> Iterator[tuple[str, ...]]:
    """Yield for each problem and budget the medians of all methods, first at equal responses.

    The last two columns are the ratio of the default to Metropolis, and p of a one-sided
    Mann-Whitney test of the two.
    """
    for budget in BUDGETS:
        for problem in PROBLEMS:
            found = {name: [*chosen(runs, problem, name, budget).values()] for name in METHODS}
            if not found["default"] or not found["Metropolis"]:
                continue
            seconds = time_of_default(runs, problem, budget)
            for label, limits in (
                (f"{budget:,}", (budget, np.inf)), (f"{seconds:.1f} s", (np.inf, seconds)),
            ):  # fmt: skip
                values = {
                    name: [best_of(run, *limits) for run in each]
                    for name, each in found.items()
                    if each
                }
                medians = {name: median(each) for name, each in values.items()}
                ratio = medians["default"] / medians["Metropolis"]
                p = mannwhitneyu(values["default"], values["Metropolis"], alternative="greater")
                base, power = f"{p.pvalue:.0e}".split("e")
                yield (
                    problem, label,
                    *(f"{medians[name]:.3f}" if name in medians else "" for name in METHODS),
                    f"{ratio:.2f}", f"{base}e{int(power)}",
                )  # fmt: skip


def best_rows(runs: list[dict[str, Any]]) -> Iterator[tuple[str, ...]]:
    """Yield the best design of each problem: efficiency, method, seed and budget.

    The last column is the largest median of the default search, as a fraction of it.
    """
    by_problem: dict[str, list[dict[str, Any]]] = defaultdict(list)
    for run in runs:
        by_problem[run["problem"]].append(run)
    for problem in PROBLEMS:
        if problem not in by_problem:
            continue
        run = max(by_problem[problem], key=best_of)
        best = best_of(run)
        budgets = {each["budget"] for each in by_problem[problem] if each["method"] == "default"}
        longest = chosen(runs, problem, "default", max(budgets)).values()
        share = median(best_of(each) for each in longest) / best
        yield (
            problem, f"{best:.3f}", run["method"], str(run["seed"]), f"{run['steps']:,}",
            f"`{command_of(run)}`", f"{share:.2f} at {max(budgets):,}",
        )  # fmt: skip


def step_rows(runs: list[dict[str, Any]]) -> Iterator[tuple[str, ...]]:
    """Yield for each problem and method the processor time of a step in ms.

    The median of all runs with the smallest budget, and that of the slowest as a multiple of it.
    """
    for problem in PROBLEMS:
        row = [problem]
        for method in METHODS:
            found = chosen(runs, problem, method, BUDGETS[0]).values()
            times = [1e3 * run["seconds"] / run["steps"] for run in found]
            middle = median(times) if times else np.nan
            row += [f"{middle:.3f}", f"{max(times, default=np.nan) / middle:.1f}"]
        yield tuple(row)


def command_of(run: dict[str, Any]) -> str:
    """Return the command that repeats a run."""
    return (
        f"bellcrank design {run['problem']} --model springs --search {METHODS[run['method']]}"
        f" --unloaded-beams prune_all --chains 1 --steps {run['steps']} --seed {run['seed']}"
    )


def as_table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table in Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def main() -> None:
    """Carry out the missing runs, or print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("problems", nargs="*", default=PROBLEMS)
    parser.add_argument("--responses", type=int, default=BUDGETS[0], choices=BUDGETS)
    parser.add_argument("--seeds", type=int, default=SEEDS)
    parser.add_argument("--methods", nargs="*", default=list(METHODS), choices=list(METHODS))
    parser.add_argument("--out", type=Path, default=RECORD)
    parser.add_argument("--quick", action="store_true", help="one short run of each method")
    parser.add_argument("--table", action="store_true")
    parser.add_argument("--best", action="store_true")
    parser.add_argument("--cost", action="store_true")
    options = parser.parse_args()
    runs = [] if options.quick else read_runs(options.out)
    if options.table:
        print(as_table(["problem", "budget", *METHODS, "ratio", "p"], table_rows(runs)))
    elif options.best:
        head = ["problem", "efficiency", "method", "seed", "steps", "command", "default"]
        print(as_table(head, best_rows(runs)))
    elif options.cost:
        head = ["problem", *(each for name in METHODS for each in (f"{name}, ms", "slowest"))]
        print(as_table(head, step_rows(runs)))
    elif options.quick:
        for method in options.methods:
            found = result_of(Run(options.problems[0], method, 0, 1000))
            print(f"{method}: {best_of(found):.3f} in {found['seconds']:.1f} s")
    else:
        with ProcessPoolExecutor(2) as pool:
            for problem in options.problems:
                for method in options.methods:
                    wanted = missing(runs, problem, method, options.responses, range(options.seeds))
                    for done in as_completed([pool.submit(result_of, run) for run in wanted]):
                        run = done.result()
                        runs = [each for each in runs if key_of(each) != key_of(run)]
                        runs.append(run)
                        write_runs(options.out, runs)
                    values = [
                        best_of(run, options.responses)
                        for run in chosen(runs, problem, method, options.responses).values()
                    ]
                    print(f"{problem}, {method}: {median(values):.3f}", flush=True)


if __name__ == "__main__":
    main()
