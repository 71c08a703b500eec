"""From small to large lattices: ``python -m benchmarks.transfer``.

A network learns a small lattice; then it is tried on a larger one as it is, after going on with a
few designs of that, and against fresh networks that have only those few. Needs ``--work`` for the
datasets and the trained network, which are made once and used again. Writes
``docs/surrogate/transfer.json``, a table to standard output.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import TYPE_CHECKING

from bellcrank.learning.building import DatasetSpec, build_dataset
from bellcrank.learning.transfer import FITS, TransferSettings, try_transfer
from bellcrank.model import find_problem
from bellcrank.provenance import provenance
from bellcrank.surrogate.beginning import begin
from bellcrank.surrogate.folder import MODEL
from bellcrank.surrogate.recipes import recipe_of
from bellcrank.surrogate.trained import TrainedModel, read_model

if TYPE_CHECKING:
    from bellcrank.surrogate.dataset import Dataset

RECORD = Path(__file__).parents[1] / "docs" / "surrogate" / "transfer.json"


def main() -> None:
    options = parse()
    small = dataset(options.small, options.small_runs, options)
    large = dataset(options.large, options.large_runs, options)
    source = network(small, options)
    settings = TransferSettings(
        fits=tuple(options.fits),
        few=tuple(options.few),
        recipe=recipe_of(
            "own", epochs=options.epochs, epoch_size=options.epoch_size, warm_up=50,
            seed=options.seed,
        ),
        flips=options.flips,
        seed=options.seed,
    )  # fmt: skip
    rows = []
    print("| fit | how | designs | R2 | determination | flips, Spearman | top 30 | s |")
    print("|---|---|---|---|---|---|---|---|")
    start = time.monotonic()
    for trial in try_transfer(source, large, settings, device=options.device):
        seconds = time.monotonic() - start
        row = {**trial.to_dict(), "seconds": round(seconds, 1)}
        rows.append(row)
        flips = row["flips"] or {"spearman": {"mean": None}, "recall": {"mean": None}}
        figures = (row["r_squared"], row["determination"], flips["spearman"]["mean"],
                   flips["recall"]["mean"])  # fmt: skip
        told = " | ".join("-" if each is None else f"{each:.3f}" for each in figures)
        print(
            f"| {trial.fit} | {trial.how} | {trial.designs} | {told} | {seconds:.0f} |", flush=True
        )
        start = time.monotonic()
    record = {
        "small": options.small,
        "large": options.large,
        "source": {"held_out": source.record.get("held_out"), "designs": len(small)},
        "recipe": settings.recipe.to_dict(),
        "designs_there": len(large),
        "trials": rows,
        "provenance": provenance(),
    }
    options.out.parent.mkdir(parents=True, exist_ok=True)
    options.out.write_text(json.dumps(record, indent=1) + "\n")


def dataset(name: str, runs: int, options: argparse.Namespace) -> Dataset:
    """Build a dataset in the working folder, or take what lies there."""
    spec = DatasetSpec(problem=find_problem(name), runs=runs, steps=options.steps)
    data = build_dataset(spec, options.work / f"{name}-{runs}", workers=options.workers)
    assert data is not None
    return data


def network(data: Dataset, options: argparse.Namespace) -> TrainedModel:
    """Train the network of the small lattice, or take the one that lies there."""
    name = f"{options.small}-{options.small_runs}-{options.source_epochs}"
    folder = options.work / f"network-{name}"
    if (folder / MODEL).exists():
        return read_model(folder / MODEL)
    recipe = recipe_of("own", epochs=options.source_epochs)
    training = begin(data, recipe, folder, device=options.device)
    for _ in training.run():
        pass
    return training.finish()


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--work", type=Path, required=True, help="folder for data and network")
    parser.add_argument("--out", type=Path, default=RECORD)
    parser.add_argument("--small", default="scaling-8")
    parser.add_argument("--large", default="scaling-12")
    parser.add_argument("--small-runs", type=int, default=1000)
    parser.add_argument("--large-runs", type=int, default=200)
    parser.add_argument("--steps", type=int, default=582)
    parser.add_argument("--source-epochs", type=int, default=3)
    parser.add_argument("--few", type=int, nargs="+", default=[300, 1000, 3000, 10_000])
    parser.add_argument("--fits", nargs="+", choices=FITS, default=list(FITS))
    parser.add_argument("--epochs", type=int, default=2)
    parser.add_argument("--epoch-size", type=int, default=16_384)
    parser.add_argument("--flips", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--workers", type=int, default=None)
    parser.add_argument("--device", default="auto")
    return parser.parse_args()


if __name__ == "__main__":
    main()
