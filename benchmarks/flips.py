"""How well single flips are foreseen: ``python -m benchmarks.flips DATASET``.

At designs where searches of the dataset stood, each from another run, the mechanics computes every
flip; networks and low-rank screening say what they expect. Give a dataset that the networks have
not learnt from. Prints Markdown and writes ``docs/surrogate/flips.json``.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np

from bellcrank.learning.fitting import model_files
from bellcrank.model.storage import write_text
from bellcrank.provenance import provenance
from bellcrank.surrogate.dataset import read_dataset
from bellcrank.surrogate.flips import (
    flip_accuracy,
    flip_effects,
    held_out_designs,
    screening_accuracy,
)
from bellcrank.surrogate.metrics import accuracy
from bellcrank.surrogate.predictor import load_predictor

RECORD = Path(__file__).parents[1] / "docs" / "surrogate" / "flips.json"


def main() -> None:
    options = parse()
    data = read_dataset(options.dataset)
    predictor = load_predictor(
        data.problem, [file for path in options.model for file in model_files(path)]
    )
    rng = np.random.default_rng(options.seed)
    rows = np.arange(len(data))
    masks = held_out_designs(data, rows, options.designs, rng)
    effects = flip_effects(data.problem, masks)
    found = {
        "network": flip_accuracy(predictor, data.problem, masks, effects).to_dict(),
        "screening": screening_accuracy(effects).to_dict(),
    }
    some = np.sort(rng.permutation(rows)[: options.tested])
    bits = np.unpackbits(data.packed[some], axis=1, count=data.problem.lattice.beam_count)
    whole = accuracy(predictor.predict(bits.astype(bool)).efficiency, data.efficiency[some])
    print(f"R2 of the network {whole.r_squared:.4f}, of {whole.count} designs")
    print("| by | correlation | rank correlation | of the 30 best, found |\n|---|---|---|---|")
    for name, each in found.items():
        figures = (each[key]["mean"] for key in ("pearson", "spearman", "recall"))
        print(f"| {name} | " + " | ".join(f"{figure:.3f}" for figure in figures) + " |")
    record = {
        "provenance": provenance(seed=options.seed), "runs": data.run_count,
        "designs": whole.to_dict(), "flips": found,
    }  # fmt: skip
    options.out.parent.mkdir(parents=True, exist_ok=True)
    write_text(options.out, json.dumps(record, indent=1) + "\n", overwrite=True)


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("dataset", type=Path)
    parser.add_argument("--model", nargs="*", default=[], help="trained models, or the shipped one")
    parser.add_argument("--designs", type=int, default=30)
    parser.add_argument("--tested", type=int, default=20_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=RECORD)
    return parser.parse_args()


if __name__ == "__main__":
    main()
