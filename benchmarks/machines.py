"""The machines that come along, foretold and simulated: ``python -m benchmarks.machines``.

For each: how long it takes to build and to simulate; the efficiency for small strokes foretold by
its condensed parts beside that of the whole lattice; the largest difference along the whole stroke,
by tables and by the parts themselves; and what a search over all beams makes of it. Prints Markdown
and writes ``docs/machines/showcases.json``. ``--work`` keeps searches, which go on after a kill.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from bellcrank.machines import Machine, compare, foretell, predict, simulate
from bellcrank.machines.bundled import bundled_machine, bundled_machines
from bellcrank.mechanics import VERIFICATION_INCREMENT, SpringEvaluator
from bellcrank.model.storage import write_text
from bellcrank.provenance import provenance
from bellcrank.search import HoppingSettings
from bellcrank.workflows import complete_design, reopen_design, start_design

RECORD = Path(__file__).parents[1] / "docs" / "machines" / "showcases.json"
SMALL = 1e-3
"""Part of the stroke in which all is linear."""
GOALS = {"gripper": ("mirror x",)}
"""What machines keep while they are designed further."""
LONG = ("wave",)
"""Machines whose search takes too long for a benchmark."""


@dataclass(frozen=True, slots=True)
class Row:
    """What there is to say about one machine; times in seconds, errors as parts of the largest.

    Parameters
    ----------
    name
    parts, nodes, beams, all_beams
        `all_beams` counts those that a search may bring back, too.
    building, simulating
        From the plan to one design; that from rest to its full stroke, in increments of 1/32.
    small, foretold_small
        Efficiency for small strokes: of the lattice, by its parts.
    efficiency, foretold, foretold_live
        At the full stroke: of the lattice, by tables, by the parts themselves.
    output_error, force_error, live_error
        Along the stroke, of output motion and input force by tables, of output motion by the parts.
    by_tables
        How many parts tables stood for.
    foretelling
        Along the stroke, when all tables are there.
    linear
        For small strokes.
    designed
        Efficiency after a search from the assembly on.
    doubts
        What was said about the tables.
    """

    name: str
    parts: int
    nodes: int
    beams: int
    all_beams: int
    building: float
    simulating: float
    small: float
    foretold_small: float
    efficiency: float
    foretold: float
    foretold_live: float
    output_error: float
    force_error: float
    live_error: float
    by_tables: int
    foretelling: float
    linear: float
    designed: float | None
    doubts: tuple[str, ...]


def designed(machine: Machine, name: str, options: argparse.Namespace) -> float | None:
    """Search on from a machine, or take what a search has found."""
    if not options.steps or name in LONG:
        return None
    folder = options.work / f"{name}-{options.steps}-{options.chains}"
    if (summary := folder / "summary.json").exists():
        return float(json.loads(summary.read_text())["efficiency"])
    settings = HoppingSettings(
        steps=options.steps, chains=options.chains, goals=GOALS.get(name, ())
    )
    if folder.exists():
        run = reopen_design(folder)
    else:
        run = start_design(machine.design.problem, settings, folder)
    report = complete_design(run)
    assert report is not None
    return report.selection.efficiency_after


def measure(name: str, options: argparse.Namespace) -> Row:
    """Measure one machine."""
    predict(bundled_machine(name))  # read and compiled
    start = time.perf_counter()
    machine = bundled_machine(name)
    built = time.perf_counter()
    problem, mask = machine.design.problem, machine.design.mask
    response = SpringEvaluator(problem).evaluate(mask, VERIFICATION_INCREMENT)
    simulated = time.perf_counter()
    small = replace(problem, input=replace(problem.input, amount=SMALL * problem.input.amount))
    linear = predict(machine)
    chained = time.perf_counter()
    whole = simulate(machine, options.points)
    tables = foretell(machine, options.points, folder=options.work / "tables")
    live = foretell(machine, options.points, live=True)
    by_tables = compare(tables, whole)
    return Row(
        name=name,
        parts=len(machine.parts),
        nodes=problem.lattice.node_count,
        beams=machine.design.beam_count,
        all_beams=problem.lattice.beam_count,
        building=built - start,
        simulating=simulated - built,
        small=SpringEvaluator(small).evaluate(mask).efficiency,
        foretold_small=linear.efficiency,
        efficiency=response.efficiency,
        foretold=tables.efficiency,
        foretold_live=live.efficiency,
        output_error=by_tables.output_error,
        force_error=by_tables.force_error,
        live_error=compare(live, whole).output_error,
        by_tables=sum(stand.kind in ("usual", "around") for stand in tables.stands),
        foretelling=tables.seconds,
        linear=chained - simulated,
        designed=designed(machine, name, options),
        doubts=tables.doubts,
    )


def main() -> None:
    options = parse()
    rows = []
    print(
        "| machine | parts | beams | built, s | simulated, s | small strokes | foretold "
        "| full stroke | by tables | largest difference | force | by parts | designed further |"
    )
    print("|---" * 13 + "|")
    for name in options.machines:
        row = measure(name, options)
        rows.append(asdict(row))
        print(
            f"| {row.name} | {row.parts} | {row.beams} of {row.all_beams} | {row.building:.2f} "
            f"| {row.simulating:.2f} | {row.small:.3f} | {row.foretold_small:.3f} "
            f"| {row.efficiency:.3f} | {row.foretold:.3f} | {row.output_error:.1%} "
            f"| {row.force_error:.1%} | {row.live_error:.1%} "
            f"| {'-' if row.designed is None else f'{row.designed:.2f}'} |",
            flush=True,
        )
    record = {
        "points": options.points,
        "steps": options.steps,
        "chains": options.chains,
        "rows": rows,
        "provenance": provenance(),
    }
    options.out.parent.mkdir(parents=True, exist_ok=True)
    write_text(options.out, json.dumps(record, indent=1) + "\n", overwrite=True)


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--work", type=Path, required=True, help="folder of searches and tables")
    parser.add_argument("--machines", nargs="+", default=bundled_machines())
    parser.add_argument("--points", type=int, default=20)
    parser.add_argument("--steps", type=int, default=10_000, help="0: no search")
    parser.add_argument("--chains", type=int, default=2)
    parser.add_argument("--out", type=Path, default=RECORD)
    return parser.parse_args()


if __name__ == "__main__":
    main()
