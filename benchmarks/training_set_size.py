"""Accuracy of a network as a function of the number of training designs.

    python -m benchmarks.training_set_size DATASET --models resnet18-w16,mlp --runs 50,200,800

Each network is trained on increasing numbers of runs and tested on the same runs, which are in
none of the training sets. Each training uses every design ``--epochs`` times. The accuracies and
the training times are written to ``docs/surrogate/training-set-size.json``.
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

RECORD = Path(__file__).parents[1] / "docs" / "surrogate" / "training-set-size.json"
TEST_DESIGNS = 20_000


def main() -> None:
    """Train and test the networks, and write the record after each training."""
    options = read_options()
    data = read_dataset(options.dataset)
    runs = np.random.default_rng(0).permutation(np.unique(data.run))
    test_runs, training_runs = runs[: options.test_runs], runs[options.test_runs :]
    rows = np.flatnonzero(np.isin(data.run, test_runs))
    test = data.take(np.sort(np.random.default_rng(1).permutation(rows)[:TEST_DESIGNS]))
    record = read_record(options.record)
    for name in options.models.split(","):
        for count in (int(text) for text in options.runs.split(",")):
            if count > len(training_runs):
                raise SystemExit(
                    f"--runs: expected at most {len(training_runs)}, the number of runs in the "
                    f"dataset that are not test runs, not {count}"
                )
            training = data.take(np.flatnonzero(np.isin(data.run, training_runs[:count])))
            row = measure(name, training, test, options)
            others = [old for old in record["rows"] if key_of(old) != key_of(row)]
            record = {"provenance": provenance(), "rows": [*others, row]}
            options.record.parent.mkdir(parents=True, exist_ok=True)
            write_text(options.record, json.dumps(record, indent=1) + "\n", overwrite=True)
            print(table_row(row), flush=True)


def measure(
    name: str, training_set: Dataset, test: Dataset, options: argparse.Namespace
) -> dict[str, Any]:
    """Train and test one network."""
    if name == "linear":
        return measure_linear(training_set, test)
    recipe = recipe_of(options.recipe, model=name, epochs=options.epochs, batch=options.batch)
    # A training holds out at least one run; the accuracy below is that on the test runs.
    recipe = replace(recipe, held_out=1e-6, tested=1000)
    if recipe.warm_up:
        steps = len(training_set) * recipe.epochs // recipe.batch
        recipe = replace(recipe, warm_up=min(recipe.warm_up, max(steps // 5, 1)))
    training = begin(training_set, recipe)
    for _ in training.run():
        pass
    model = training.finish()
    predicted = model.predict(test.packed, precision=training.precision)
    return {
        "model": name, "recipe": options.recipe, "epochs": recipe.epochs, "batch": recipe.batch,
        "runs": training_set.run_count - 1, "designs": len(training.split.training),
        "seen": model.record["designs"], "seconds": model.record["seconds"],
        **accuracy(predicted, test.efficiency).to_dict(),
    }  # fmt: skip


def measure_linear(training_set: Dataset, test: Dataset) -> dict[str, Any]:
    """Fit and test a linear function of the bits (least squares with a small ridge penalty)."""
    start = time.perf_counter()
    bits = bits_of(training_set)
    gram = bits.T @ bits + 1e-3 * len(bits) * np.eye(bits.shape[1])
    weights = np.linalg.solve(gram, bits.T @ training_set.efficiency)
    seconds = time.perf_counter() - start
    return {
        "model": "linear", "recipe": "least squares", "epochs": 1, "batch": 0,
        "runs": training_set.run_count, "designs": len(training_set), "seen": len(training_set),
        "seconds": round(seconds, 2),
        **accuracy(bits_of(test) @ weights, test.efficiency).to_dict(),
    }  # fmt: skip


def bits_of(data: Dataset) -> np.ndarray:
    """Return the masks of a dataset as float32, with a column of ones for the intercept."""
    beams = data.problem.lattice.beam_count
    bits = np.unpackbits(data.packed, axis=1, count=beams).astype(np.float32)
    return np.column_stack([bits, np.ones(len(bits), np.float32)])


def key_of(row: dict[str, Any]) -> tuple[Any, ...]:
    """Return the settings that identify a row of the record."""
    return tuple(row[name] for name in ("model", "recipe", "epochs", "batch", "runs"))


def table_row(row: dict[str, Any]) -> str:
    """Return a row of the Markdown table."""
    return (
        f"| {row['model']} | {row['designs']} | {row['seen']} | {row['seconds']:.0f} | "
        f"{row['r_squared']:.4f} | {row['determination']:.4f} |"
    )


def read_record(path: Path) -> dict[str, Any]:
    """Return the record in a file, or an empty record."""
    return json.loads(path.read_text()) if path.exists() else {"rows": []}


def read_options() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("dataset", type=Path, help="Parquet file of a dataset")
    parser.add_argument("--models", default="linear,mlp,resnet18-w16", help="names of models")
    parser.add_argument("--runs", default="50,200,800", help="numbers of training runs")
    parser.add_argument("--test-runs", type=int, default=200, help="number of test runs")
    parser.add_argument("--recipe", default="own", help="name of the training recipe")
    parser.add_argument("--epochs", type=int, default=1, help="number of epochs")
    parser.add_argument("--batch", type=int, help="batch size; default: that of the recipe")
    parser.add_argument("--record", type=Path, default=RECORD, help="JSON file")
    return parser.parse_args()


if __name__ == "__main__":
    main()
