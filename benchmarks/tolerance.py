"""Tolerance of the bundled tasks: ``python -m benchmarks.tolerance``.

For each task the design that the documentation shows (`tools.draw_tasks`) is computed in all
scenarios of `bellcrank tolerance` with its defaults. The results are added to
``docs/tolerance.json``. ``--only NAME,NAME`` computes some tasks, ``--table`` prints the table.
"""

from __future__ import annotations

import argparse
import json
import time
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.fem.results import finite
from bellcrank.model import Item
from bellcrank.provenance import provenance
from bellcrank.task import find_task
from bellcrank.tolerance import Deviations
from bellcrank.workflows.tolerance import as_item, compute_tolerance
from benchmarks.record import add_runs
from benchmarks.tasks import recorded_design
from tools.draw_tasks import best, identity, recorded_runs

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

RECORD = Path(__file__).parents[1] / "docs" / "tolerance.json"


def measure(name: str, run: dict[str, Any]) -> dict[str, Any]:
    """Return the tolerance of the design of a run."""
    task = find_task(name)
    assert task is not None
    design = recorded_design(task, run)
    start = time.perf_counter()
    report = compute_tolerance(design, Deviations(), task.part)
    seconds = time.perf_counter() - start
    assert report is not None
    found, rows = report.tolerance, report.tolerance.rows()
    items = [row for row in rows if isinstance(row.quantity, Item)]
    losses = np.array(list(found.strut_losses().values()))
    data = {
        "commit": provenance()["commit"],
        "design": identity(run),
        "scenarios": len(found.scenarios),
        "seconds": float(f"{seconds:.3g}"),
        "met": found.nominal.met,
        "yield": found.print_yield,
        "shares": {as_item(row.quantity).name: row.share for row in items},
        "struts": len(losses),
        "needed": int(np.isinf(losses).sum()),
        "half": int((losses > 0.5).sum()),
    }
    for row in rows[len(items) :]:
        ratios = {kind: finite(worst.value / row.nominal) for kind, worst in row.worst.items()}
        data["objective"] = {
            "name": as_item(row.quantity).name,
            "nominal": finite(row.nominal),
            "percentile_5": finite(row.percentile / row.nominal),
            "worst": ratios,
        }
    return data


def table(rows: dict[str, dict[str, Any]]) -> Iterator[str]:
    """Yield the rows of the table in Markdown."""
    for name, row in rows.items():
        lowest = min(row["shares"], key=lambda item: row["shares"][item])
        objective = row.get("objective")
        part = "-"
        if objective is not None and objective["percentile_5"] is not None:
            part = f"{objective['percentile_5']:.2f}"
        which = lowest.split(".")[-1] if row["shares"][lowest] < 1.0 else "-"
        yield (
            f"| `{name}` | {row['yield']:.0%} | {which} | {part} "
            f"| {row['needed']} of {row['struts']} | {row['half']} |"
        )


def chosen_runs() -> dict[str, dict[str, Any]]:
    """Return the run that the documentation shows, by task."""
    runs = recorded_runs()
    names = sorted({run["task"] for run in runs})
    chosen = {
        name: best([run for run in runs if run["task"] == name])
        for name in names
        if find_task(name) is not None
    }
    return {name: run for name, run in chosen.items() if "mask" in run}


def main() -> None:
    """Compute the missing tasks and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", default="", help="names of tasks, separated by commas")
    parser.add_argument("--table", action="store_true")
    options = parser.parse_args()
    jobs = {name: partial(measure, name, run) for name, run in chosen_runs().items()}
    rows: Iterable[str]
    if options.table:
        rows = table(json.loads(RECORD.read_text(encoding="utf-8"))["runs"])
    else:
        rows = table(add_runs(RECORD, jobs, options.only))
    print("\n".join(rows))


if __name__ == "__main__":
    main()
