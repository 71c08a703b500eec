"""Actuators in space: ``python -m benchmarks.space``.

- ``tasks``: every bundled task in space, designed as by `bellcrank design TASK` on two cores. Its
  objective by frames with eight elements in each strut, and in the solid, beside that of the full
  lattice and that of a design by hand where there is one; its items in both models.
- ``mesh``: the objectives of the recorded gripper in solids with finer grids.
- ``cost``: the time of a step of a search on one core, against the number of beams.

Each run is added to ``docs/space/runs.json`` as soon as it is done; runs that are in the record are
not repeated. ``--only`` gives the first words of the names of runs, such as ``tasks`` or
``tasks twist-column``.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import NoDesignFound
from bellcrank.fem.specification import sheet_items
from bellcrank.mechanics import VERIFICATION_INCREMENT, FrameEvaluator
from bellcrank.model import Design, Item, find_problem, human_design
from bellcrank.model.builtin.space import IN_SPACE
from bellcrank.provenance import provenance
from bellcrank.search import SpecificationEvaluator, read_settings
from bellcrank.task import find_task
from bellcrank.workflows import complete_design, start_design
from bellcrank.workflows.refinement import BEFORE_REFINEMENT
from bellcrank.workflows.specification import binding, item_data

from .frames import DESIGNS, PROPOSALS, diluted, octet, step_time
from .record import add_runs
from .tasks import CORES, core_seconds, recorded_design, tasks_in

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from bellcrank.mechanics import ItemResult
    from bellcrank.model import Problem
    from bellcrank.task import Task

RECORD = Path(__file__).parents[1] / "docs" / "space" / "runs.json"
BY_HAND = {
    "straight-orthogonal": "orthogonal", "straight-space-anti-parallel": "space-anti-parallel",
}  # fmt: skip
"""Bundled problems with a design by hand for the motion of a task."""
SEED = 0
GRIPPER = "three-jaw-gripper"
GRID, FINER_GRIDS = 1.1, (0.95, 0.85)
"""Edges of the cubes of the grids of its solids, mm."""


def _named(name: str) -> Task:
    task = find_task(name)
    assert task is not None
    return task


def designed(name: str) -> dict[str, Any]:
    """Design a task, and compute the part in the solid."""
    task = _named(name)
    row: dict[str, Any] = {"commit": provenance()["commit"], "seed": SEED}
    started, used = time.perf_counter(), core_seconds()
    with TemporaryDirectory() as temporary:
        settings = read_settings({**BEFORE_REFINEMENT, "seed": SEED})
        folder = start_design(task.problem, settings, Path(temporary) / "run", task.part)
        try:
            report = complete_design(folder, workers=CORES)
        except NoDesignFound as error:
            return {**row, "error": str(error)}
    assert report is not None
    row["seconds"] = round(time.perf_counter() - started, 1)
    row["core_seconds"] = round(core_seconds() - used, 1)
    found = report.selection.design
    design = Design(_with_objectives(found.problem), found.mask)
    frames = _by_frames(design.problem, design.mask)
    assert frames is not None
    started = time.perf_counter()
    solid = sheet_items(task.part.of(design))
    row["solid_seconds"] = round(time.perf_counter() - started, 1)
    models: dict[str, Sequence[ItemResult]] = {"frames, 8 elements": frames}
    if solid is not None:
        models["solid"] = solid
    row["beams"] = int(design.mask.sum())
    row["met"] = not binding(frames)
    row["met_in_solid"] = solid is not None and not binding(solid)
    full = _by_frames(_with_objectives(task.problem), task.problem.initial)
    for key, items in (("", frames), ("_in_solid", solid), ("_of_full_lattice", full)):
        row[f"objective{key}"] = None if items is None else _objective(task.problem, items)
    row["by_hand"] = _by_hand(name)
    row["items"] = item_data(design.problem, task.part, models)
    row["mask"] = design.mask_hex
    row["positions"] = design.problem.lattice.positions.round(5).tolist()
    row["widths"] = design.problem.beam_widths.round(5).tolist()
    return row


def _by_frames(problem: Problem, mask: NDArray[np.bool_]) -> list[ItemResult] | None:
    evaluator = SpecificationEvaluator(problem, elements=8)
    response = evaluator.evaluate(mask, VERIFICATION_INCREMENT)
    return evaluator.results() if response.is_admissible else None


def _with_objectives(problem: Problem) -> Problem:
    """Return a problem whose objectives are items too, at least 0."""
    wanted = problem.specification
    assert wanted is not None
    items = (
        Item(quantity=each.quantity, case=each.case, output=each.output, at_least=0.0)
        for each in wanted.maximise
    )
    return replace(problem, specification=replace(wanted, items=(*wanted.items, *items)))


def _objective(problem: Problem, items: Sequence[ItemResult]) -> float:
    """Return the smallest value of the objectives, which are the last items."""
    wanted = problem.specification
    assert wanted is not None
    return min(each.value for each in items[-len(wanted.maximise) :])


def _by_hand(name: str) -> float | None:
    """Return the gain of the design by hand for the motion of a task; None if there is none."""
    if name not in BY_HAND:
        return None
    design = human_design(BY_HAND[name])
    assert design is not None
    evaluator = FrameEvaluator(design.problem, elements=8)
    return evaluator.evaluate(design.mask, VERIFICATION_INCREMENT).efficiency


def with_grid(name: str, size: float) -> dict[str, Any]:
    """Return the objectives of the recorded design of a task in a solid with another grid."""
    task = _named(name)
    row = json.loads(RECORD.read_text(encoding="utf-8"))["runs"][f"tasks {name}"]
    design = recorded_design(task, row)
    wanted = design.problem.specification
    assert wanted is not None
    problem = _with_objectives(replace(design.problem, specification=replace(wanted, items=())))
    started = time.perf_counter()
    items = sheet_items(task.part.of(replace(design, problem=problem)), size)
    return {
        "commit": provenance()["commit"],
        "grid_mm": size,
        "seconds": round(time.perf_counter() - started, 1),
        "objectives": None if items is None else [round(each.value, 4) for each in items],
    }


def cost() -> dict[str, Any]:
    """Return the time of a step of lattices, diluted at random, and the exponent of its growth."""
    problems = [octet(2), octet(3), *(find_problem(name) for name in IN_SPACE[2:])]
    steps = []
    for problem in problems:
        masks = [diluted(problem, seed) for seed in range(DESIGNS)]
        seconds = step_time(problem, masks, PROPOSALS)
        steps.append(
            {
                "name": problem.name,
                "beams": problem.lattice.beam_count,
                "present": round(float(np.mean(masks)), 3),
                "ms": round(1e3 * seconds, 3),
            }
        )
    beams, times = ([each[key] for each in steps] for key in ("beams", "ms"))
    exponent = float(np.polyfit(np.log(beams), np.log(times), 1)[0])
    return {"commit": provenance()["commit"], "steps": steps, "exponent": round(exponent, 3)}


def runs() -> dict[str, Callable[[], dict[str, Any]]]:
    """Return all runs by name."""
    out: dict[str, Callable[[], dict[str, Any]]] = {
        f"tasks {name}": lambda name=name: designed(name) for name in tasks_in(3)
    }
    for size in FINER_GRIDS:
        out[f"mesh {GRIPPER} {size:g}"] = partial(with_grid, GRIPPER, size)
    return {**out, "cost": cost}


def task_rows(rows: dict[str, dict[str, Any]]) -> list[str]:
    """Return a row for each task.

    Struts; time on two cores; objective by hand, of the full lattice, by frames of 8 elements and
    in the solid; largest off-axis motion by both; whether the items are met in both; time of the
    solid.
    """
    lines = []
    for name, row in sorted(rows.items()):
        kind, _, task = name.partition(" ")
        if kind != "tasks":
            continue
        off_axis = [
            max(
                (
                    each["reached"][model]["value"]
                    for each in row["items"]
                    if each["quantity"] == "off_axis" and model in each["reached"]
                ),
                default=None,
            )
            for model in ("frames, 8 elements", "solid")
        ]
        values = (
            row.get(key)
            for key in ("by_hand", "objective_of_full_lattice", "objective", "objective_in_solid")
        )
        met = ["yes" if row[key] else "no" for key in ("met", "met_in_solid")]
        lines.append(
            f"| `{task}` | {row['beams']} | {row['seconds']:.0f} s "
            f"| {' | '.join(map(_text, values))} | {' | '.join(map(_percent, off_axis))} "
            f"| {', '.join(met)} | {row['solid_seconds']:.0f} s |"
        )
    return lines


def cost_rows(rows: dict[str, dict[str, Any]]) -> list[str]:
    """Return a row for each lattice: beams, part of them that is present, time of a step in ms."""
    return [
        f"| `{each['name']}` | {each['beams']} | {each['present']:.0%} | {each['ms']:.1f} |"
        for each in rows.get("cost", {}).get("steps", [])
    ]


def mesh_rows(rows: dict[str, dict[str, Any]]) -> list[str]:
    """Return a row for each grid of the gripper: smallest gain, and how far below frames it is."""
    recorded = rows[f"tasks {GRIPPER}"]
    smallest = {GRID: recorded["objective_in_solid"]}
    for name, row in rows.items():
        if name.startswith("mesh "):
            smallest[row["grid_mm"]] = min(row["objectives"])
    return [
        f"| {size:.2f} mm | {gain:.3g} | {_percent(1.0 - gain / recorded['objective'])} |"
        for size, gain in sorted(smallest.items(), reverse=True)
    ]


def _text(value: float | None) -> str:
    return "-" if value is None else f"{value:.3g}"


def _percent(value: float | None) -> str:
    return "-" if value is None else f"{100.0 * value:.1f} %"


def main() -> None:
    """Run what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", default="", help="first words of the names of runs")
    given = parser.parse_args()
    rows = add_runs(RECORD, runs(), given.only)
    for line in (*task_rows(rows), *mesh_rows(rows), *cost_rows(rows)):
        print(line)


if __name__ == "__main__":
    main()
