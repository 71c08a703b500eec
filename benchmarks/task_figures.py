"""Figures of the parts that the bundled tasks lead to: ``python -m benchmarks.task_figures``.

For each task, the part of the first search in ``docs/tasks/runs.json`` or ``docs/space/runs.json``
is computed by frames with eight elements in each strut. The record is ``docs/tasks/figures.json``;
`table` makes the rows of the README of it. A test compares both.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from bellcrank.part.units import GRAVITY
from bellcrank.provenance import provenance
from bellcrank.task import bundled_tasks, find_task, units_of
from bellcrank.workflows.part_figures import part_figures
from benchmarks.tasks import recorded_design
from tools.draw_tasks import identity, recorded_runs

RECORD = Path(__file__).parents[1] / "docs" / "tasks" / "figures.json"
FIGURES = (
    "travel_mm", "off_axis", "rotation_deg", "payload_N", "dead_load_N", "sag_mm", "strain"
)  # fmt: skip
OTHER_MOTIONS = {
    "twist": "rotation", "twist-column": "rotation", "switch": "two stable states",
    "arc": "an arc", "corner": "a right angle",
}  # fmt: skip
"""Tasks that ask for another motion than a straight one."""


def rows_of(runs: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return the figures of the first run of each task, and how many of its runs meet all items."""
    rows = []
    for name in sorted(bundled_tasks()):
        own = [run for run in runs if run["task"] == name and "mask" in run]
        if not own:
            continue
        task = find_task(name)
        assert task is not None
        first = min(own, key=lambda run: run["seed"])
        found = part_figures(recorded_design(task, first), task.part)
        units = units_of(task.problem, task.part)
        assert task.problem.specification is not None
        payloads = {
            (item.case, item.output): units.in_part("force", item.at_least)
            for item in task.problem.specification.items
            if item.quantity == "payload" and item.at_least is not None
        }
        rows.append(
            {
                "task": name,
                "design": identity(first),
                "in_space": task.problem.lattice.dimension == 3,
                "outputs": [
                    {key: each.get(key) for key in FIGURES}
                    | {"wanted_payload_N": payloads.get((each["case"], each["output"]))}
                    for each in found
                ],
                "met": first["met"],
                "met_in_sheet": first["met_in_sheet"],
                "runs": len(own),
                "met_runs": sum(run["met"] and bool(run["met_in_sheet"]) for run in own),
            }
        )
    return rows


def table(rows: list[dict[str, Any]]) -> list[str]:
    """Return the rows of the table: of several outputs or load cases the worst figure."""
    lines = []
    for each in rows:
        outputs = each["outputs"]
        travel = min(abs(output["travel_mm"]) for output in outputs)
        off_axis = max(output["off_axis"] for output in outputs)
        rotation = max(abs(output["rotation_deg"]) for output in outputs)
        loads = [_smallest(outputs, key) for key in ("payload_N", "dead_load_N")]
        moves = OTHER_MOTIONS.get(each["task"], "")
        direction_text = f"{100.0 * off_axis:.0f} %" if not moves else f"– ({moves})"
        if moves == "rotation":
            travel_text, loads = "–", ["–", "–"]
        else:
            travel_text = f"{travel:.1f} mm"
        met = {True: "all", False: "not all"}
        lines.append(
            f"| `{each['task']}` | {travel_text} | {direction_text} | {rotation:.1f}° "
            f"| {loads[0]} | {loads[1]} | {met[each['met']]}, {met[bool(each['met_in_sheet'])]} "
            f"| {each['met_runs']} of {each['runs']} |"
        )
    return lines


def carried(rows: list[dict[str, Any]]) -> tuple[int, int]:
    """Return how many tasks ask for a payload, and how many parts carry it as a dead load."""
    asked = [
        [each for each in row["outputs"] if each["wanted_payload_N"] is not None] for row in rows
    ]
    asked = [outputs for outputs in asked if outputs]
    return len(asked), sum(
        all((each["dead_load_N"] or 0.0) >= each["wanted_payload_N"] for each in outputs)
        for outputs in asked
    )


def _smallest(outputs: list[dict[str, Any]], key: str) -> str:
    """Return the smallest load of outputs as a mass; a dash where none halves the motion."""
    known = [output[key] for output in outputs if output[key] is not None]
    return f"{1000.0 * min(known) / GRAVITY:.0f} g" if known else "–"


def main() -> None:
    """Compute all figures, write the record and print the table."""
    rows = rows_of(recorded_runs())
    RECORD.write_text(json.dumps({"provenance": provenance(), "rows": rows}, indent=1) + "\n")
    print("\n".join(table(rows)))
    print("{} tasks ask for a payload; {} parts carry it as a dead load".format(*carried(rows)))


if __name__ == "__main__":
    main()
