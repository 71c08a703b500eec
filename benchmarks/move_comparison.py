"""Comparison of parallel tempering with several moves: ``python -m benchmarks.move_comparison``.

Each variant runs on the problems crane, anti-parallel and discs from the same seeds, with the same
response (`unloaded_beams="prune_all"`). A design counts only if its equilibrium is stable when the
load is applied in small increments. ``docs/moves.json`` contains the best efficiency and the
processor time for each variant, problem and seed.
"""

from __future__ import annotations

import argparse
import json
import statistics
import time
from pathlib import Path

import numpy as np

from bellcrank.mechanics import VERIFICATION_INCREMENT, SpringEvaluator, Status
from bellcrank.model import find_problem
from bellcrank.provenance import provenance
from bellcrank.search import advance_chain, make_evaluator, read_settings, start_chain

RECORD = Path(__file__).parents[1] / "docs" / "moves.json"
PROBLEMS = ("crane", "anti-parallel", "discs")
TEMPERING = {"search": "tempering", "steps": 10_000}
VARIANTS = {
    "tempering: balanced": {**TEMPERING, "moves": ["balanced"]},
    "tempering: balanced, node": TEMPERING,
    "tempering: flip, node": {**TEMPERING, "moves": ["flip", "node"]},
    "tempering: flip": {**TEMPERING, "moves": ["flip"]},
}


def run(name: str, problem_name: str, seed: int) -> tuple[float, float]:
    """Return the best verified efficiency and the processor time of one run."""
    problem = find_problem(problem_name)
    settings = read_settings({**VARIANTS[name], "unloaded_beams": "prune_all", "seed": seed})
    evaluator = make_evaluator(problem, settings)
    verifier = SpringEvaluator(problem, unloaded_beams="prune_all")
    state = start_chain(evaluator, settings, 0)
    best, seconds = -np.inf, 0.0
    while state.step < settings.steps:
        start = time.process_time()
        state, rows = advance_chain(evaluator, settings, 0, state)
        seconds += time.process_time() - start
        for index in np.flatnonzero(rows.accepted & (rows.efficiency > best)):
            if rows.efficiency[index] > best:
                mask = np.unpackbits(rows.mask[index])[: problem.lattice.beam_count].astype(bool)
                if verifier.evaluate(mask, VERIFICATION_INCREMENT).status is Status.CONVERGED:
                    best = float(rows.efficiency[index])
    return best, seconds


def main() -> None:
    """Run all variants and write the record after each seed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=4, help="number of seeds")
    parser.add_argument("--out", type=Path, default=RECORD, help="JSON file")
    options = parser.parse_args()
    record = {
        "command": "python -m benchmarks.move_comparison",
        "provenance": provenance(),
        "unloaded_beams": "prune_all",
        "variants": VARIANTS,
        "results": {name: {problem: [] for problem in PROBLEMS} for name in VARIANTS},
        "seconds": {name: {problem: [] for problem in PROBLEMS} for name in VARIANTS},
    }
    for seed in range(options.seeds):
        for problem in PROBLEMS:
            for name in VARIANTS:
                best, seconds = run(name, problem, seed)
                record["results"][name][problem].append(round(best, 4))
                record["seconds"][name][problem].append(round(seconds, 1))
                print(seed, problem, name, round(best, 3), round(seconds, 1), flush=True)
                options.out.write_text(json.dumps(record, indent=1))
    for name, results in record["results"].items():
        row = " | ".join(f"{statistics.median(results[problem]):.3f}" for problem in PROBLEMS)
        print(f"| {name} | {row} |")


if __name__ == "__main__":
    main()
