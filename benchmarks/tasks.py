"""How often searches meet the bundled tasks: ``python -m benchmarks.tasks``.

Every bundled task in the plane is designed as by `bellcrank design TASK` with several seeds, on two
cores. The chosen design is evaluated by frames with eight elements in each strut, and in the sheet.
Each run is added to ``docs/tasks/runs.json`` (or ``--out FILE``) as soon as it is done; runs that
are in the record are not repeated unless ``--again`` is given. ``selector:A`` after ``--only``
designs a load case of a task alone; ``straight-crane:free`` asks for the largest gain within the
strain limit and without contact, ``:tolerant`` for all items over widths that are 20 % off,
``:kept`` for 80 % of the gain where all widths deviate by as much together, and ``:redundant`` for
a loss of any strut that costs at most 30 %. ``--first N`` is the first seed. A table of medians is
printed; times include the sheet of the refinement, not the compilation.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import replace
from pathlib import Path
from resource import RUSAGE_CHILDREN, RUSAGE_SELF, getrusage
from statistics import median
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidSettings, NoDesignFound
from bellcrank.fem.continuum.mesh import COARSE
from bellcrank.fem.results import finite
from bellcrank.fem.specification import sheet_items
from bellcrank.mechanics.frames.joints import with_joints
from bellcrank.model import Design, Item, Tolerances, unpack_mask
from bellcrank.provenance import provenance
from bellcrank.search import read_settings
from bellcrank.task import Task, bundled_tasks, find_task
from bellcrank.workflows import complete_design, start_design
from bellcrank.workflows.refinement import BEFORE_REFINEMENT, refinement_data
from bellcrank.workflows.specification import binding, item_data
from bellcrank.workflows.tolerance import (
    as_item,
    compute_tolerance,
    deviations_of,
    tolerances_of,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bellcrank.mechanics import ItemResult
    from bellcrank.part import PartSpec
    from bellcrank.workflows import DesignReport

RECORD = Path(__file__).parents[1] / "docs" / "tasks" / "runs.json"
SEEDS = 5
"""Number of searches of each task."""
CORES = 2
LIMIT = 180.0
"""Time in s within which a task is to be designed."""
FREE = {"strain", "clearance"}
"""Quantities of the items of ``TASK:free``."""
WIDTH, NODE = 0.2, 0.1
"""Deviations of all widths, and of coordinates of nodes in mm, of ``TASK:tolerant``."""
LEAST_YIELD = 0.99
"""Part of the prints that meets all items of ``TASK:tolerant``."""
KEEP = 0.8
"""Smallest gain over these deviations as a part of that as drawn, of ``TASK:kept``."""
STRUT_LOSS = 0.3
"""Largest part of the efficiency that the loss of a strut costs in ``TASK:redundant``."""


def tasks_in(dimension: int) -> list[str]:
    """Return the names of the bundled tasks in the plane (2) or in space (3)."""
    found = ((name, find_task(name)) for name in bundled_tasks())
    return [
        name
        for name, task in found
        if task is not None and task.problem.lattice.dimension == dimension
    ]


def task_named(name: str) -> Task:
    """Return a task, ``TASK:CASE``, one of its load cases alone, or ``TASK:VARIANT``."""
    base, _, case = name.partition(":")
    task = find_task(base)
    assert task is not None
    problem = task.problem
    wanted = problem.specification
    if not case or wanted is None:
        return task
    if case == "free":
        items = tuple(item for item in wanted.items if item.quantity in FREE)
        asked = replace(wanted, items=items)
    elif case in {"tolerant", "kept"}:
        sizes = Tolerances(width=WIDTH, node=NODE / task.part.scale, least_yield=LEAST_YIELD)
        if case == "kept":
            sizes = replace(sizes, each_width=0.0, least_yield=1.0, keep=KEEP)
        asked = replace(wanted, tolerances=sizes)
    elif case == "redundant":
        item = Item(quantity="strut_loss", at_most=STRUT_LOSS)
        asked = replace(wanted, items=(*wanted.items, item))
    else:
        problem = problem.cases[case]
        own = problem.specification
        assert own is not None
        asked = replace(
            own,
            items=tuple(item for item in wanted.items if item.case in {"", case}),
            maximise=tuple(each for each in wanted.maximise if each.case in {"", case}),
            weight=wanted.weight,
            symmetry=wanted.symmetry,
            domain=wanted.domain,
        )
    return replace(task, problem=replace(problem, specification=asked))


def core_seconds() -> float:
    """Return the time that this process and those that it waited for spent on the cores."""
    return sum(
        each.ru_utime + each.ru_stime for each in map(getrusage, (RUSAGE_SELF, RUSAGE_CHILDREN))
    )


def run(name: str, seed: int) -> dict[str, Any]:
    """Design a task with one seed, and evaluate the design."""
    task = task_named(name)
    row: dict[str, Any] = {"task": name, "seed": seed, "commit": provenance()["commit"]}
    started, used = time.perf_counter(), core_seconds()
    with TemporaryDirectory() as temporary:
        folder = start_design(
            task.problem,
            read_settings({**BEFORE_REFINEMENT, "seed": seed}),
            Path(temporary) / "run",
            task.part,
        )
        try:
            report = complete_design(folder, workers=CORES)
        except NoDesignFound as error:
            return {**row, "seconds": time.perf_counter() - started, "error": str(error)}
    assert report is not None
    row["seconds"] = round(time.perf_counter() - started, 1)
    row["core_seconds"] = round(core_seconds() - used, 1)
    design, models = report.selection.design, dict(report.items)
    missed = binding(list(models.values())[-1])
    row["met"] = not missed
    row["binding"] = missed[0].item.name if missed else None
    started = time.perf_counter()
    sheet = _in_sheet(report, task)
    row["sheet_seconds"] = round(time.perf_counter() - started, 1)
    row["stable_in_sheet"] = sheet is not None
    row["met_in_sheet"] = sheet is not None and not binding(sheet)
    row["binding_in_sheet"] = None
    if sheet is not None:
        models["sheet"] = sheet
        missed = binding(sheet)
        row["binding_in_sheet"] = missed[0].item.name if missed else None
    gains = [figures.get("efficiency") for figures in report.part_figures]
    row["efficiency"] = min((gain for gain in gains if gain is not None), default=None)
    row["beams"] = design.beam_count
    row["mask"] = design.mask_hex
    row["positions"] = design.problem.lattice.positions.round(5).tolist()
    row["widths"] = design.problem.beam_widths.round(5).tolist()
    if report.refinement is not None:
        row["refinement"] = refinement_data(report.refinement)
    if report.tolerance is not None:
        row["tolerance"] = {
            name: over_tolerances(design, task.part, **changes)
            for name, changes in (("", {}), ("without_own_widths", {"each_width": 0.0}))
        }
    row["proposals"] = report.proposals
    row["items"] = item_data(design.problem, task.part, models)
    return row


def over_tolerances(design: Design, part: PartSpec, **changes: float) -> dict[str, Any]:
    """Return yield and objectives of a design over its tolerances, some of them changed."""
    sizes = replace(tolerances_of(design, part), **changes)
    deviations = deviations_of(
        design, part, tolerances=sizes, width=0.0, thin=0.0, shortest=1.0, longest=1.0,
        struts=False,
    )  # fmt: skip
    report = compute_tolerance(design, deviations, part)
    assert report is not None
    found, rows = report.tolerance, report.tolerance.rows()
    objectives = [row for row in rows if not isinstance(row.quantity, Item)]
    return {
        "scenarios": len(found.scenarios),
        "yield": found.print_yield,
        "met": sum(result.met for result in found.results),
        "objectives": [
            {
                "name": as_item(row.quantity).name,
                "nominal": finite(row.nominal),
                "worst": {kind: finite(worst.value) for kind, worst in row.worst.items()},
                "percentile_5": finite(row.percentile),
            }
            for row in objectives
        ],
    }


def recorded_design(task: Task, row: dict[str, Any]) -> Design:
    """Return the refined design of a run of a task in the record."""
    problem, mask = task.problem, unpack_mask(row["mask"], task.problem.lattice.beam_count)
    moved = problem.with_geometry(np.array(row["positions"]), np.array(row["widths"]))
    return Design(with_joints(moved, mask), mask, provenance={"part": task.part.to_dict()})


def _in_sheet(report: DesignReport, task: Task) -> Sequence[ItemResult] | None:
    """Return the items of a design in the sheet; None if it has no stable path or outline there."""
    if report.refinement is not None and report.refinement.after.sheet:
        return report.refinement.after.sheet
    try:
        return sheet_items(task.part.of(report.selection.design), fineness=COARSE)
    except InvalidSettings:
        return None


def write(rows: list[dict[str, Any]], path: Path) -> None:
    """Write the record."""
    ordered = sorted(rows, key=lambda row: (row["task"], row["seed"]))
    data = {"provenance": provenance(), "runs": ordered}
    path.write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")


def summary(rows: list[dict[str, Any]]) -> list[str]:
    """Return the rows of the table.

    Runs that met all items by frames of 8 elements, and in the sheet; the median gain of the
    refined designs, the median time on two cores in s, and the binding items of the others.
    """
    lines = []
    for name in sorted({row["task"] for row in rows}):
        own = [row for row in rows if row["task"] == name]
        gains = [row["efficiency"] for row in own if row.get("efficiency") is not None]
        missed = sorted({row["binding"] for row in own if row.get("binding")})
        sheet = sorted({row["binding_in_sheet"] for row in own if row.get("binding_in_sheet")})
        lines.append(
            f"| `{name}` | {_met(own, 'met')} of {len(own)} "
            f"| {_met(own, 'met_in_sheet')} of {len(own)} "
            f"| {median(gains):.2f} | {median(row['seconds'] for row in own):.0f} s "
            f"| {', '.join(map(_item, missed)) or '-'} | {', '.join(map(_item, sheet)) or '-'} |"
        )
    return lines


def counts(rows: list[dict[str, Any]]) -> list[str]:
    """Return how many runs of whole tasks meet all items, and within the time limit, as text.

    Those within the limit without the straight tasks, which have more seeds.
    """
    whole = [row for row in rows if ":" not in row["task"]]
    if not whole:
        return []
    plain = [row for row in whole if not row["task"].startswith("straight-")]
    quick = [row for row in plain if row["seconds"] <= LIMIT]
    seconds = median(row["seconds"] for row in whole)
    tasks = len({row["task"] for row in plain})
    all_runs = (
        f"Of {len(whole)} runs, {_met(whole, 'met')} meet everything by frames and "
        f"{_met(whole, 'met_in_sheet')} in the sheet; the median time is {seconds:.0f} s."
    )
    within_limit = (
        f"Of the {len(plain)} runs of the other {tasks} tasks, {_met(quick, 'met')} meet "
        "everything by frames within three minutes, and "
        f"{_met(quick, 'met_in_sheet')} in the sheet."
    )
    return [all_runs, within_limit]


def _met(rows: list[dict[str, Any]], key: str) -> int:
    """Return how many runs meet all items in a model."""
    return sum(row.get(key, False) for row in rows)


def _item(name: str) -> str:
    """Return the name of a quantity as it is written, without its load case and output."""
    return name.rpartition(".")[2].replace("_", " ")


def main() -> None:
    """Run what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", default=",".join(tasks_in(2)))
    parser.add_argument("--seeds", type=int, default=SEEDS)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--again", action="store_true")
    parser.add_argument("--out", type=Path, default=RECORD)
    given = parser.parse_args()
    rows: list[dict[str, Any]] = []
    if given.out.exists():
        rows = json.loads(given.out.read_text(encoding="utf-8"))["runs"]
    for seed in range(given.first, given.first + given.seeds):
        for name in given.only.split(","):
            known = [row for row in rows if (row["task"], row["seed"]) == (name, seed)]
            if known and not given.again:
                continue
            row = run(name, seed)
            rows = [each for each in rows if each not in known] + [row]
            write(rows, given.out)
            print(
                f"{name} {seed}: met {row.get('met')}, in the sheet {row.get('met_in_sheet')}, "
                f"{row['seconds']:.0f} s, {row.get('binding')} {row.get('binding_in_sheet')}",
                flush=True,
            )
    print("\n".join([*summary(rows), *counts(rows)]))


if __name__ == "__main__":
    main()
