"""Tolerance of the bundled tasks: ``python -m benchmarks.tolerance``.

For each task the design that the documentation shows (`tools.draw_tasks`) is computed in all
scenarios of `bellcrank tolerance` with its defaults, and again after a refinement over the same
tolerances, which knows none of these prints. The results are added to ``docs/tolerance.json``,
those after the refinement under ``NAME:refined``. ``--only NAME,NAME:refined`` computes some,
``--table`` prints the table.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.fem.results import finite
from bellcrank.mechanics.frames.joints import with_joints
from bellcrank.model import Item
from bellcrank.provenance import provenance
from bellcrank.refine import RefinementSettings, refine_design
from bellcrank.task import find_task
from bellcrank.workflows.tolerance import as_item, compute_tolerance, deviations_of, with_tolerances
from benchmarks.record import add_runs
from benchmarks.tasks import recorded_design
from tools.draw_tasks import best, identity, recorded_runs

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from bellcrank.model import Design
    from bellcrank.part import PartSpec

REFINED = ":refined"
"""End of the names of runs after a refinement."""
EVALUATIONS = 400
"""Number of geometries of each refinement."""
RECORD = Path(__file__).parents[1] / "docs" / "tolerance.json"


def measure_refined(name: str, run: dict[str, Any]) -> dict[str, Any]:
    """Return the tolerance of the design of a run after a refinement over the usual tolerances."""
    task = find_task(name)
    assert task is not None
    design = with_tolerances(recorded_design(task, run), task.part)
    start = time.perf_counter()
    found = refine_design(design, RefinementSettings(evaluations=EVALUATIONS))
    seconds = time.perf_counter() - start
    refined = replace(found.design, problem=with_joints(found.design.problem, design.mask))
    return {
        **_figures(refined, task.part, run),
        "refinement": {
            "seconds": float(f"{seconds:.3g}"), "steps": found.steps,
            "evaluations": found.evaluations, "reason": found.reason,
            "met_with_8_elements": found.after.met,
        },
    }  # fmt: skip


def measure(name: str, run: dict[str, Any]) -> dict[str, Any]:
    """Return the tolerance of the design of a run."""
    task = find_task(name)
    assert task is not None
    return _figures(recorded_design(task, run), task.part, run)


def _figures(design: Design, part: PartSpec, run: dict[str, Any]) -> dict[str, Any]:
    """Return what a design does in all scenarios."""
    start = time.perf_counter()
    report = compute_tolerance(design, deviations_of(design, part), part)
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
    """Yield the rows of the table in Markdown: before and after the refinement."""
    for name in sorted({key.removesuffix(REFINED) for key in rows}):
        before, after = rows[name], rows.get(name + REFINED)
        cells = [f"`{name}`", *_cells(before), *(["-"] * 3 if after is None else _cells(after))]
        cells += [f"{before['needed']} of {before['struts']}", f"{before['half']}"]
        yield f"| {' | '.join(cells)} |"


def _cells(row: dict[str, Any]) -> list[str]:
    """Return the yield, the item that fails most, and the objective as drawn and of 95 %."""
    lowest = min(row["shares"], key=lambda item: row["shares"][item])
    which = lowest.split(".")[-1] if row["shares"][lowest] < 1.0 else "-"
    objective = row.get("objective")
    value = "-"
    if objective is not None:
        least = objective["percentile_5"]
        of_95 = "lost" if least is None else f"{least * objective['nominal']:.3g}"
        value = f"{objective['nominal']:.3g}, {of_95}"
    return [f"{row['yield']:.0%}", which, value]


def redundant_table(robust: list[dict[str, Any]], runs: list[dict[str, Any]]) -> Iterator[str]:
    """Yield the rows of the table of ``TASK:redundant`` (`benchmarks.tasks`) in Markdown.

    The gain with the same seed without the limit on the loss of a strut, with it, and its cost.
    """
    free = {(run["task"], run["seed"]): run.get("efficiency") for run in runs}
    for run in robust:
        task, _, kind = run["task"].partition(":")
        if kind == "redundant":
            whole, limited = free[task, run["seed"]], run["efficiency"]
            yield f"| `{task}` | {whole:.2f} | {limited:.2f} | {1.0 - limited / whole:.0%} |"


def robust_table(runs: list[dict[str, Any]]) -> Iterator[str]:
    """Yield the rows of the table of ``TASK:tolerant`` (`benchmarks.tasks`) in Markdown.

    The smallest objective as drawn, at worst over widths, directions and random prints, and over
    prints whose struts do not deviate each by itself; the part of the prints that meets all items;
    whether the sheet does; and the time of the design.
    """
    for run in runs:
        task, _, kind = run["task"].partition(":")
        if kind != "tolerant":
            continue
        whole, common = run["tolerance"][""], run["tolerance"]["without_own_widths"]
        nominal = min(each["nominal"] for each in whole["objectives"])
        cells = [
            f"`{task}`", f"{nominal:.3g}", *_worst(whole),
            f"{whole['yield']:.1%}", _worst(common)[-1], f"{common['yield']:.1%}",
            "yes" if run["met_in_sheet"] else "no", f"{run['seconds']:.0f} s",
        ]  # fmt: skip
        yield f"| {' | '.join(cells)} |"


def kept_table(robust: list[dict[str, Any]], runs: list[dict[str, Any]]) -> Iterator[str]:
    """Yield the rows of the table of ``TASK:kept`` (`benchmarks.tasks`) in Markdown.

    The gain as drawn, the smallest over widths, directions and random prints, the part of the
    prints that keeps its part, whether the sheet meets all items, the cost against the same seed
    without tolerances, and the time of the design.
    """
    free = {(run["task"], run["seed"]): run.get("efficiency") for run in runs}
    for run in robust:
        task, _, kind = run["task"].partition(":")
        if kind != "kept":
            continue
        found, cost = run["tolerance"][""], 1.0 - run["efficiency"] / free[task, run["seed"]]
        cells = [
            f"`{task}`", f"{run['seed']}", f"{run['efficiency']:.2f}", *_worst(found),
            f"{found['yield']:.1%}", "yes" if run["met_in_sheet"] else "no",
            "none" if cost <= 0.0 else f"{cost:.0%}", f"{run['seconds']:.0f} s",
        ]  # fmt: skip
        yield f"| {' | '.join(cells)} |"


def _worst(found: dict[str, Any]) -> list[str]:
    """Return the smallest objective over widths, directions and prints as texts."""
    values = [
        [each["worst"][kind] for each in found["objectives"]]
        for kind in ("widths", "input", "print")
    ]
    return ["lost" if None in each else f"{min(each):.3g}" for each in values]


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
    chosen = chosen_runs()
    jobs = {name: partial(measure, name, run) for name, run in chosen.items()}
    jobs |= {name + REFINED: partial(measure_refined, name, run) for name, run in chosen.items()}
    rows: Iterable[str]
    if options.table:
        rows = table(json.loads(RECORD.read_text(encoding="utf-8"))["runs"])
    else:
        rows = table(add_runs(RECORD, jobs, options.only))
    print("\n".join(rows))


if __name__ == "__main__":
    main()
