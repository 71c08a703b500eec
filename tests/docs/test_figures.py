"""Tables of figures in the documentation: each row is what a committed record says."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from statistics import median
from typing import Any

import pytest

from bellcrank.machines import TwoPort
from bellcrank.machines.bundled import find_plan
from bellcrank.machines.bundled.contact import bundled_contact
from bellcrank.machines.library import Library, bundled_folder, kinds
from benchmarks.accuracy import table as accuracy_rows
from benchmarks.competition import best_rows, step_rows, table_rows
from benchmarks.inverters import rows_of as inverter_rows
from benchmarks.measure import table as measure_rows
from benchmarks.refinement import mass_rows, specified_rows
from benchmarks.size import table as size_rows
from benchmarks.space import cost_rows, mesh_rows, task_rows
from benchmarks.surrogate_long_runs import table_row as long_run_row
from benchmarks.tasks import counts, summary
from benchmarks.tolerance import kept_table, redundant_table, robust_table
from benchmarks.tolerance import table as tolerance_rows
from reproduction.frame_benchmarks import tables as frame_benchmarks
from reproduction.measured import tables as measured
from tools.draw_tasks import best, identity, identity_in, recorded_runs

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
NETWORK = ROOT / "src" / "bellcrank" / "surrogate" / "pretrained" / "crane.safetensors"

Rows = Iterator[str]


def read(name: str) -> Any:
    return json.loads((DOCS / f"{name}.json").read_text(encoding="utf-8"))


def row(*cells: object) -> str:
    return "| " + " | ".join(map(str, cells)) + " |"


def three(value: float) -> str:
    """Three digits, with commas where the number is large."""
    rounded = float(f"{value:.3g}")
    return f"{rounded:,.0f}" if rounded >= 1000.0 else f"{rounded:g}"


def competition() -> Rows:
    for cells in table_rows(read("competition")["runs"]):
        yield row(*cells)


def cost_of_searches() -> Rows:
    for cells in step_rows(read("competition")["runs"]):
        yield row(*cells)


def best_designs() -> Rows:
    for cells in best_rows(read("competition")["runs"]):
        yield row(*cells)


def sizes() -> Rows:
    yield from size_rows(read("size")["runs"].values())


def tolerances() -> Rows:
    yield from tolerance_rows(read("tolerance")["runs"])
    yield from robust_table(read("tasks/robust")["runs"])
    yield from kept_table(read("tasks/robust")["runs"], recorded_runs())
    yield from redundant_table(read("tasks/robust")["runs"], recorded_runs())


def measurements() -> Rows:
    yield from measure_rows(read("benchmarks/measure"))


def move_comparison() -> Rows:
    results = read("moves")["results"]
    for moves, words in (
        ("flip", "`flip`"),
        ("flip, node", "`flip`, `node`"),
        ("balanced", "`balanced`"),
        ("balanced, node", "`balanced`, `node` (default)"),
    ):
        best = results[f"tempering: {moves}"]
        medians = (median(best[problem]) for problem in ("crane", "anti-parallel", "discs"))
        yield row(f"tempering: {words}", *(f"{value:.2f}" for value in medians))


def goals() -> Rows:
    goal = {
        "none": "none", "mass-0.5": "`mass <= 0.5`", "mass-0.4": "`mass <= 0.4`",
        "stiffness-0.2": "`stiffness >= 0.2`", "strain-0.02": "`strain <= 0.02`",
        "no-contact-0.2": "`no-contact 0.2`", "no-contact-0.4": "`no-contact 0.4`",
        "no-snapping": "`no-snapping`", "degree-3": "`degree >= 3`",
    }  # fmt: skip
    for task in read("campaigns/goals")["tasks"]:
        yield row(goal[task["name"]], f"{task['median']:.2f}", f"{task['best']:.2f}")


def levels() -> Rows:
    kinds = (
        "frame, linear", "frame, euler-bernoulli", "frame, timoshenko",
        "plane, st-venant-kirchhoff", "plane, neo-hookean", "solid, linear",
    )  # fmt: skip
    for name, told in read("validation/levels").items():
        if ":" in name:
            found = [told[kind]["efficiency"] for kind in ("discrete_model", *kinds)]
            yield row(f"`{name}`", *("-" if value is None else f"{value:.3f}" for value in found))


def joints() -> Rows:
    for name, told in read("validation/joints").items():
        if ":" in name:
            yield row(f"`{name}`", *(f"{each:.2f}" for each in told["energy_ratio"].values()))


def meshes() -> Rows:
    for told in read("validation/meshes")["rows"]:
        size = f"{told['size']:g} mm" + (" (default)" if told["size"] == 1.0 else "")
        yield row(
            size, f"{told['unknowns']:,.0f}", f"{told['small_displacements']:.6f}",
            f"{told['efficiency']:.6f}", f"{told['force_N']:.2f}",
        )  # fmt: skip


def correlation() -> Rows:
    for name in ("crane", "anti-parallel"):
        for kind, words in (("paper", "springs of the paper"), ("element", "frames, as searched")):
            told = read("validation/correlation")[name][kind]
            yield row(
                name, words, f"{told['r_squared']:.3f}", f"{told['determination']:.3f}",
                f"{told['rank_correlation']:.4f}", f"{told['slope']:.3f}",
                f"{told['median_ratio']:.3f}",
            )  # fmt: skip


def searched() -> Rows:
    for name in ("crane", "anti-parallel"):
        told = read("validation/search")[name]
        found = [each["frame"] for each in told["rows"]]
        yield row(
            name, f"{told['search']:.2f}", f"{told['frame']:.2f}",
            f"{min(found):.2f} to {max(found):.2f}",
            f"{told['median_deviation']:.2%}".replace("%", " %"),
            f"{told['not_stable_as_frames']}, {told['touching_as_frames']}",
        )  # fmt: skip


def bundled() -> Rows:
    for each in read("machines/bundled")["rows"]:
        yield row(
            each["name"], each["parts"], f"{each['beams']} of {each['all_beams']}",
            f"{each['prediction_seconds']:.2f}", f"{each['simulation_seconds']:.2f}",
            *(
                f"{each[key]:.3f}"
                for key in ("rest", "predicted", "simulated", "divided")
            ),
        )  # fmt: skip


def test_recorded_predictions_and_simulations_agree_within_2_percent() -> None:
    for each in read("machines/bundled")["rows"]:
        for simulated in (each["simulated"], each["divided"]):
            assert each["predicted"] == pytest.approx(simulated, rel=0.02), each["name"]


def contact() -> Rows:
    for each in read("machines/bundled")["rows"]:
        name, own = each["name"], each["figures"]
        plan = find_plan(name).table
        yield row(
            f"`{name}`", len(plan.parts), plan.about, f"{own['efficiency']:.1f}",
            f"{100.0 * own['off_axis']:.1f} %", f"{own['rotation_deg']:.1f}",
            f"{own['payload_N']:.2f} N", f"{own['sag_mm']:.1f} mm",
            bundled_contact(name).message,
        )  # fmt: skip


def entries() -> Rows:
    found = {
        (each.direction, each.kind, each.columns): f"{each.gain:.2f}"
        for each in Library((bundled_folder(),)).summaries
    }
    for direction in ("right", "up-right", "up", "up-left", "left", "down-left", "down",
                      "down-right"):  # fmt: skip
        yield row(
            direction,
            *(
                found.get((direction, kind, columns), "–")
                for kind in kinds
                for columns in (7, 9, 12)
            ),
        )


def lengths() -> Rows:
    for told in read("machines/factorisation")["rows"]:
        yield row(
            told["actuators"], told["beams"], told["unknowns"], f"{told['assembly']:.0f}",
            *(f"{told[key]:.1f}" for key in ("preparation", "response", "verification")),
            f"{told['sparse']:.2f}", f"{told['banded']:.2f} ({told['half_bandwidth']})",
            f"{told['superlu']:.2f}",
        )  # fmt: skip


def two_ports() -> Rows:
    for told in read("machines/two-ports")["rows"]:
        rest = told["rest"]
        port = TwoPort(rest["input_stiffness"], rest["efficiency"], rest["output_compliance"])
        yield row(
            told["design"], *(f"{value:.4g}" for value in rest_of(port)),
            f"{port.coupling:.2g}", f"{100.0 * port.best_work_share:.1f} %",
        )  # fmt: skip


def rest_of(port: TwoPort) -> tuple[float, float, float]:
    return port.efficiency, port.input_stiffness, port.output_compliance


def costs() -> Rows:
    cost = {
        (each["method"], each["batch"]): each["microseconds"]
        for each in read("surrogate/costs")["costs"]
        if each["device"] == "one core"
    }
    newton = cost["Newton response (default)", 1]
    batch = "torch bfloat16"
    for words, value in (
        ("Newton response from rest (default)", newton),
        ("low-rank update, per flip", cost["low-rank update, per flip", 1]),
        ("`mlp`, batches of 256, bfloat16", cost[f"mlp, {batch}", 256]),
        ("`resnet18-w16`, batches of 256, bfloat16", cost[f"resnet18-w16, {batch}", 256]),
        ("`resnet50`, batches of 256, bfloat16", cost[f"resnet50, {batch}", 256]),
    ):
        yield row(words, *map(three, (value, newton / value)))


def shipped() -> Rows:
    """The record in the file of the network that comes along, read without PyTorch."""
    content = NETWORK.read_bytes()
    header = json.loads(content[8 : 8 + int.from_bytes(content[:8], "little")])
    last = json.loads(header["__metadata__"]["bellcrank"])["record"]
    (other,) = last["mean_of"]
    for training in (other["start"], other, last["start"], last):
        epochs = training["epochs"]
        yield row("designs seen", *(f"{each['designs'] / 1e6:.2f} M" for each in epochs))
        yield row("R²", *(f"{each['r_squared']:.3f}" for each in epochs))


def surrogate_search() -> Rows:
    medians = read("surrogate/surrogate-search")["medians"]
    for name, words in (("final", "last"), ("verified", "best of ten as verified")):
        told = medians[name]
        yield row(
            words, *(f"{told[key]:.2f}" for key in ("network", "predicted", "mechanics")),
            f"{told['distance']:.0f}",
        )  # fmt: skip


def long_runs() -> Rows:
    yield from map(long_run_row, read("surrogate/long-runs")["rows"])


def tasks() -> Rows:
    yield from summary(read("tasks/runs")["runs"])


def equal_mass() -> Rows:
    yield from mass_rows(read("refinement/runs")["runs"])


def refined_specifications() -> Rows:
    yield from specified_rows(read("refinement/runs")["runs"])


def space() -> Rows:
    rows = read("space/runs")["runs"]
    yield from [*task_rows(rows), *mesh_rows(rows), *cost_rows(rows)]
    yield from inverter_rows(read("space/inverters")["runs"])


def published_benchmarks() -> Rows:
    figures = read("studies/benchmarks")["figures"]
    for rows in (
        frame_benchmarks.value_rows, frame_benchmarks.convergence_rows,
        frame_benchmarks.source_rows,
    ):  # fmt: skip
        for cells in rows(figures):
            yield row(*cells)
    yield from frame_benchmarks.definition_lines()


def measured_lattice() -> Rows:
    figures = read("studies/measured")["figures"]
    for rows in (
        measured.output_rows,
        measured.gradient_rows,
        measured.effect_rows,
        measured.noise_rows,
    ):
        for cells in rows(figures):
            yield row(*cells)


TABLES: dict[str, tuple[Callable[[], Rows], ...]] = {
    "accuracy": (accuracy_rows,),
    "searches": (competition, cost_of_searches, sizes, move_comparison),
    "best": (best_designs,),
    "tolerance": (tolerances,),
    "benchmarks": (published_benchmarks,),
    "measured": (measured_lattice,),
    "measure": (measurements,),
    "goals": (goals,),
    "validation": (levels, joints, meshes, correlation, searched),
    "tasks": (tasks,),
    "refinement": (equal_mass, refined_specifications),
    "space": (space,),
    "machines": (bundled, contact, entries, lengths, two_ports),
    "surrogate": (costs, shipped, surrogate_search, long_runs),
}


@pytest.mark.parametrize("page", TABLES)
def test_rows_of_tables_are_what_the_records_say(page: str) -> None:
    text = (DOCS / f"{page}.md").read_text(encoding="utf-8")
    rows = [each for table in TABLES[page] for each in table()]
    assert [each for each in rows if each not in text] == []


def test_the_counts_of_runs_of_tasks_are_those_of_the_record() -> None:
    text = " ".join((DOCS / "tasks.md").read_text(encoding="utf-8").split())
    text = text.replace("other fourteen tasks", "other 14 tasks")
    for each in counts(read("tasks/runs")["runs"]):
        assert each in text


def test_pictures_and_movies_of_tasks_show_runs_of_the_record() -> None:
    runs = recorded_runs()
    names = {run["task"] for run in runs if ":" not in run["task"]}
    assert len(names) > 15
    expected = {
        name: identity(best([run for run in runs if run["task"] == name])) for name in names
    }
    for kind in ("png", "gif"):
        shown = {name: identity_in(DOCS / "tasks" / f"{name}.{kind}") for name in names}
        assert shown == expected


NUMBER = re.compile(r"\| [-+]?\d[\d.,]*( (%|s|ms|mm|MB|kB))?(?= \|)")
"""A cell that is a figure."""
NOT_MEASURED = {
    "| status | code | means |",
    "| setting | default | meaning |",
    "| key | default | |",
    "| machine | parts | what it does |",
    "| film | reason that is given |",
    "| name | E, MPa | Poisson's ratio | density, g/cm³ | strain limit | sources |",
}
"""Heads of tables whose numbers are names, parts of the program, or have their sources beside."""
OF_OTHERS = "| the paper's ResNet50 (its own held-out runs) | | 0.966 | | |"


@pytest.mark.parametrize("page", sorted(path.stem for path in DOCS.glob("*.md")))
def test_a_table_of_figures_has_a_record(page: str) -> None:
    if page == "paper":
        return  # made whole from its records, and compared with them elsewhere
    known = {each for table in TABLES.get(page, ()) for each in table()} | {OF_OTHERS}
    text = (DOCS / f"{page}.md").read_text(encoding="utf-8")
    for head, body in re.findall(r"^(\|.*\|)\n\|[-|: ]+\|\n((?:\|.*\|\n)+)", text, re.MULTILINE):
        if head not in NOT_MEASURED:
            rows = [each for each in body.splitlines() if NUMBER.search(each)]
            assert [each for each in rows if each not in known] == []
