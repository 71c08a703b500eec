"""Accuracy of a network on short and long searches of its problem.

    python -m benchmarks.surrogate_long_runs
    python -m benchmarks.surrogate_long_runs --network "before=crane-before.safetensors"

The runs are in none of the trainings: their seeds are their own. Half of the runs of each set
search for the most negative efficiency. Consecutive proposals of a run are similar, so that each
set is a sample of its runs (`every`). ``--set NAME=FILE`` tests on a dataset in place of these
runs, such as that of ``python -m benchmarks.independent_simulation FILE``. The accuracies are
written to ``docs/surrogate/long-runs.json``; a row of the same network and set is replaced.

The bias is the mean of predicted - actual efficiency over the designs whose actual efficiency is
beyond `BOUND` on one side.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bellcrank.campaign.dataset import DatasetSpec, build_dataset
from bellcrank.model import find_problem
from bellcrank.model.storage import write_text
from bellcrank.provenance import provenance
from bellcrank.surrogate.dataset import read_dataset
from bellcrank.surrogate.metrics import accuracy, finite
from bellcrank.surrogate.predictor import load_model

if TYPE_CHECKING:
    from collections.abc import Iterator

    from bellcrank.surrogate.dataset import Dataset
    from bellcrank.surrogate.trained_model import TrainedModel

RECORD = Path(__file__).parents[1] / "docs" / "surrogate" / "long-runs.json"
PROBLEM = "crane"
BUNDLED = "bundled"
BOUND = 3.0
HOPPING = {"search": "basin-hopping", "unloaded_beams": "keep"}
SETS: dict[str, dict[str, Any]] = {
    "582 steps": {"runs": 60, "steps": 582, "seed": 210_000, "every": 24},
    "3,000 steps": {"runs": 24, "steps": 3000, "seed": 230_000, "every": 40},
    "10,000 steps": {"runs": 24, "steps": 10_000, "seed": 200_000, "every": 120},
    "default search": {
        "runs": 12, "steps": 25_000, "seed": 220_000, "every": 100, "search": HOPPING,
    },
}  # fmt: skip
"""Specifications of the held-out runs."""


def held_out(folder: Path, workers: int | None) -> Iterator[tuple[str, Dataset]]:
    """Yield the held-out runs of each set; finished runs in the folder are used again."""
    for name, spec in SETS.items():
        whole = DatasetSpec(problem=find_problem(PROBLEM), **spec)
        data = build_dataset(
            whole, folder / name.replace(" ", "-").replace(",", ""), workers=workers
        )
        assert data is not None  # nothing stops it
        yield name, data


def measure(model: TrainedModel, data: Dataset) -> dict[str, Any]:
    """Return the accuracy of a network on a dataset, and its bias at both ends."""
    predicted, actual = model.predict(data.packed), data.efficiency
    row = {"runs": data.run_count, **accuracy(predicted, actual).to_dict()}
    for name, beyond in (("below", actual < -BOUND), ("above", actual > BOUND)):
        error = (predicted - actual)[beyond]
        row[name] = {
            "count": len(error), "bias": finite(float(error.mean())) if len(error) else None
        }  # fmt: skip
    row["range"] = [float(actual.min()), float(actual.max())]
    return row


def main() -> None:
    """Build the runs, test the networks, and write the record."""
    options = read_options()
    networks = dict(each.split("=", 1) for each in options.network) or {BUNDLED: None}
    models = {
        name: load_model(find_problem(PROBLEM), file) for name, file in networks.items()
    }  # fmt: skip
    given = [each.split("=", 1) for each in options.set]
    record = json.loads(options.record.read_text()) if options.record.exists() else {"rows": []}
    sets: list[tuple[str, Dataset]] = [(name, read_dataset(file)) for name, file in given]
    for set_name, data in sets or held_out(options.folder, options.workers):
        for network, model in models.items():
            row = {"network": network, "set": set_name, **measure(model, data)}
            others = [old for old in record["rows"] if key_of(old) != key_of(row)]
            record = {
                "provenance": provenance(), "bound": BOUND, "sets": SETS, "rows": [*others, row],
            }  # fmt: skip
            options.record.parent.mkdir(parents=True, exist_ok=True)
            write_text(options.record, json.dumps(record, indent=1) + "\n", overwrite=True)
            print(table_row(row), flush=True)


def key_of(row: dict[str, Any]) -> tuple[str, str]:
    """Return what identifies a row of the record."""
    return row["network"], row["set"]


def table_row(row: dict[str, Any]) -> str:
    """Return a row of the Markdown table.

    Examples
    --------
    >>> end = {"count": 12, "bias": -0.25}
    >>> table_row({"network": "first", "set": "long", "runs": 3, "count": 4000, "r_squared": 0.98,
    ...            "determination": 0.97, "rms_error": 0.4, "below": {"count": 0, "bias": None},
    ...            "above": end})
    '| long | first | 3 | 4,000 | 0.980 | 0.970 | 0.40 | - | -0.25 |'
    """
    ends = ["-" if row[end]["bias"] is None else f"{row[end]['bias']:+.2f}" for end in
            ("below", "above")]  # fmt: skip
    figures = [f"{row[name]:.3f}" for name in ("r_squared", "determination")]
    cells = [
        row["set"],
        row["network"],
        row["runs"],
        f"{row['count']:,}",
        *figures,
        f"{row['rms_error']:.2f}",
    ]
    return "| " + " | ".join(map(str, [*cells, *ends])) + " |"


def read_options() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--network", action="append", default=[], help="NAME=FILE of a network [the bundled one]"
    )
    parser.add_argument(
        "--set", action="append", default=[], help="NAME=FILE of a dataset [the held-out runs]"
    )
    parser.add_argument(
        "--folder", type=Path, default=Path("surrogate-long-runs"), help="folder of the runs"
    )
    parser.add_argument("--workers", type=int, help="number of processes [all cores]")
    parser.add_argument("--record", type=Path, default=RECORD, help="JSON file")
    return parser.parse_args()


if __name__ == "__main__":
    main()
