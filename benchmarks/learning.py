"""How much a network learns from how many designs, and what that costs.

    python -m benchmarks.learning DATASET --models resnet18-w16,mlp --runs 50,200,800

Networks are trained on growing numbers of runs and tested on the same runs, which none has
seen. Each sees every design `--epochs` times. The record goes to docs/surrogate/learning.json.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from bellcrank.model.storage import write_text
from bellcrank.provenance import provenance
from bellcrank.surrogate.dataset import Dataset, read_dataset
from bellcrank.surrogate.metrics import accuracy
from bellcrank.surrogate.recipes import recipe_of
from bellcrank.surrogate.training_setup import begin

RECORD = Path("docs/surrogate/learning.json")
TESTED = 20_000


def main() -> None:
    options = read_options()
    data = read_dataset(options.dataset)
    runs = np.random.default_rng(0).permutation(np.unique(data.run))
    test_runs, others = runs[: options.test_runs], runs[options.test_runs :]
    rows = np.flatnonzero(np.isin(data.run, test_runs))
    test = data.take(np.sort(np.random.default_rng(1).permutation(rows)[:TESTED]))
    found = read_record(options.record)
    for name in options.models.split(","):
        for count in (int(text) for text in options.runs.split(",")):
            if count > len(others):
                raise SystemExit(f"only {len(others)} runs to train with, not {count}")
            learnt = data.take(np.flatnonzero(np.isin(data.run, others[:count])))
            row = measure(name, learnt, test, options)
            kept = [old for old in found["rows"] if key_of(old) != key_of(row)]
            found = {"provenance": provenance(), "rows": [*kept, row]}
            options.record.parent.mkdir(parents=True, exist_ok=True)
            write_text(options.record, json.dumps(found, indent=1) + "\n", overwrite=True)
            print(as_line(row), flush=True)


def measure(
    name: str, learnt: Dataset, test: Dataset, options: argparse.Namespace
) -> dict[str, Any]:
    """Train one network and test it."""
    if name == "linear":
        return measure_linear(learnt, test)
    recipe = recipe_of(options.recipe, model=name, epochs=options.epochs, batch=options.batch)
    # One run is held out of the training, as it must be; the test is on runs of our own.
    recipe = replace(recipe, held_out=1e-6, tested=1000)
    if recipe.warm_up:
        steps = len(learnt) * recipe.epochs // recipe.batch
        recipe = replace(recipe, warm_up=min(recipe.warm_up, max(steps // 5, 1)))
    training = begin(learnt, recipe)
    for _ in training.run():
        pass
    model = training.finish()
    told = accuracy(model.predict(test.packed, precision=training.precision), test.efficiency)
    return {
        "model": name, "recipe": options.recipe, "epochs": recipe.epochs, "batch": recipe.batch,
        "runs": learnt.run_count - 1, "designs": len(training.split.training),
        "seen": model.record["designs"], "seconds": model.record["seconds"], **told.to_dict(),
    }  # fmt: skip


def measure_linear(learnt: Dataset, test: Dataset) -> dict[str, Any]:
    """Fit a linear function of the bits, by least squares with a little ridge."""
    start = time.perf_counter()
    bits = bits_of(learnt)
    gram = bits.T @ bits + 1e-3 * len(bits) * np.eye(bits.shape[1])
    weights = np.linalg.solve(gram, bits.T @ learnt.efficiency)
    seconds = time.perf_counter() - start
    told = accuracy(bits_of(test) @ weights, test.efficiency)
    return {
        "model": "linear", "recipe": "least squares", "epochs": 1, "batch": 0,
        "runs": learnt.run_count, "designs": len(learnt), "seen": len(learnt),
        "seconds": round(seconds, 2), **told.to_dict(),
    }  # fmt: skip


def bits_of(data: Dataset) -> np.ndarray:
    beams = data.problem.lattice.beam_count
    bits = np.unpackbits(data.packed, axis=1, count=beams).astype(np.float32)
    return np.column_stack([bits, np.ones(len(bits), np.float32)])


def key_of(row: dict[str, Any]) -> tuple[Any, ...]:
    return tuple(row[name] for name in ("model", "recipe", "epochs", "batch", "runs"))


def as_line(row: dict[str, Any]) -> str:
    return (
        f"| {row['model']} | {row['designs']} | {row['seen']} | {row['seconds']:.0f} | "
        f"{row['r_squared']:.4f} | {row['determination']:.4f} |"
    )


def read_record(path: Path) -> dict[str, Any]:
    return json.loads(path.read_text()) if path.exists() else {"rows": []}


def read_options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("dataset", type=Path)
    parser.add_argument("--models", default="linear,mlp,resnet18-w16")
    parser.add_argument("--runs", default="50,200,800")
    parser.add_argument("--test-runs", type=int, default=200)
    parser.add_argument("--recipe", default="own")
    parser.add_argument("--epochs", type=int, default=1)
    parser.add_argument("--batch", type=int)
    parser.add_argument("--record", type=Path, default=RECORD)
    return parser.parse_args()


if __name__ == "__main__":
    main()
