"""Assembly, simulation and optimisation of the bundled machines: ``python -m benchmarks.machines``.

For each machine, measure the times of the assembly of the lattice, of the linear assembly and of
the simulation; the efficiency by the linear assembly, of the lattice for a small stroke and at
the full stroke; and the efficiency after a search over all beams. A Markdown table is printed, and
the results are written to ``docs/machines/bundled.json``. ``--work`` is the folder of the
searches; a search in it is resumed. ``--contact`` checks the contact of struts instead, and writes
the record that is part of the package.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from bellcrank.machines import Machine, linear_assembly
from bellcrank.machines.bundled import bundled_machine, bundled_machines
from bellcrank.machines.bundled.contact import RECORD as RECORD_NAME
from bellcrank.mechanics import VERIFICATION_INCREMENT, SpringEvaluator
from bellcrank.model.storage import write_text
from bellcrank.provenance import provenance
from bellcrank.search import HoppingSettings
from bellcrank.workflows import complete_design, reopen_design, start_design
from bellcrank.workflows.validation import check_contact

ROOT = Path(__file__).parents[1]
CONTACT_RECORD = ROOT / "src" / "bellcrank" / "machines" / "bundled" / RECORD_NAME
RECORD = ROOT / "docs" / "machines" / "bundled.json"
SMALL_STROKE = 1e-3
"""Fraction of the stroke for the efficiency for small displacements."""
GOALS = {"gripper": ("mirror x",)}
"""Constraints of the searches."""
WITHOUT_SEARCH = ("wave",)
"""Machines that are too large for a search in a benchmark."""


@dataclass(frozen=True, slots=True)
class Row:
    """Results for one machine; times in seconds.

    Parameters
    ----------
    name
        Name of the machine.
    parts, nodes, beams, all_beams
        Numbers of parts, nodes and beams; `all_beams` includes absent beams.
    assembly_seconds, linear_assembly_seconds, simulation_seconds
        Times of the assembly of the lattice, of the linear assembly, and of the response at the
        full stroke in increments of 1/32.
    linear_assembly, small_stroke, full_stroke
        Efficiency by the linear assembly, of the lattice for a small stroke, and of the lattice
        at the full stroke.
    after_search
        Efficiency after a search that starts from the assembled machine; None without a search.
    """

    name: str
    parts: int
    nodes: int
    beams: int
    all_beams: int
    assembly_seconds: float
    linear_assembly_seconds: float
    simulation_seconds: float
    linear_assembly: float
    small_stroke: float
    full_stroke: float
    after_search: float | None


def searched_efficiency(machine: Machine, name: str, options: argparse.Namespace) -> float | None:
    """Return the efficiency after a search; the result of a finished search is read."""
    if not options.steps or name in WITHOUT_SEARCH:
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
    linear_assembly(bundled_machine(name))  # loads files and kernels before the measurement
    start = time.perf_counter()
    machine = bundled_machine(name)
    assembled = time.perf_counter()
    problem, mask = machine.design.problem, machine.design.mask
    response = SpringEvaluator(problem).evaluate(mask, VERIFICATION_INCREMENT)
    simulated = time.perf_counter()
    linear = linear_assembly(machine)
    linearized = time.perf_counter()
    amount = SMALL_STROKE * problem.input.amount
    small = replace(problem, input=replace(problem.input, amount=amount))
    return Row(
        name=name,
        parts=len(machine.parts),
        nodes=problem.lattice.node_count,
        beams=machine.design.beam_count,
        all_beams=problem.lattice.beam_count,
        assembly_seconds=assembled - start,
        linear_assembly_seconds=linearized - simulated,
        simulation_seconds=simulated - assembled,
        linear_assembly=linear.efficiency,
        small_stroke=SpringEvaluator(small).evaluate(mask).efficiency,
        full_stroke=response.efficiency,
        after_search=searched_efficiency(machine, name, options),
    )


def write_contact(names: list[str]) -> None:
    """Check the contact of struts in machines, and write the record of the package."""
    results = {name: asdict(check_contact(bundled_machine(name).design)) for name in names}
    record = {"machines": results, "provenance": provenance()}
    write_text(CONTACT_RECORD, json.dumps(record, indent=1) + "\n", overwrite=True)


def main() -> None:
    """Measure, print the table and write the record."""
    options = parse()
    if options.contact:
        write_contact(bundled_machines())
        return
    rows = []
    print(
        "| machine | parts | beams | assembly, s | simulation, s | linear assembly "
        "| small stroke | full stroke | after a search |"
    )
    print("|---" * 9 + "|")
    for name in options.machines:
        row = measure(name, options)
        rows.append(asdict(row))
        print(
            f"| {row.name} | {row.parts} | {row.beams} of {row.all_beams} "
            f"| {row.assembly_seconds:.2f} | {row.simulation_seconds:.2f} "
            f"| {row.linear_assembly:.3f} | {row.small_stroke:.3f} | {row.full_stroke:.3f} "
            f"| {'-' if row.after_search is None else f'{row.after_search:.2f}'} |",
            flush=True,
        )
    record = {
        "steps": options.steps, "chains": options.chains, "rows": rows, "provenance": provenance(),
    }  # fmt: skip
    options.out.parent.mkdir(parents=True, exist_ok=True)
    write_text(options.out, json.dumps(record, indent=1) + "\n", overwrite=True)


def parse() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--work", type=Path, default=Path("machines"), help="folder of searches")
    parser.add_argument("--contact", action="store_true", help="only check the contact of struts")
    parser.add_argument(
        "--machines", nargs="+", default=bundled_machines(), help="names of machines"
    )
    parser.add_argument(
        "--steps", type=int, default=10_000, help="steps of each chain; 0 for no search"
    )
    parser.add_argument("--chains", type=int, default=2, help="chains of a search")
    parser.add_argument("--out", type=Path, default=RECORD, help="JSON file")
    return parser.parse_args()


if __name__ == "__main__":
    main()
