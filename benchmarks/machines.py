"""Bundled machines, assembled, simulated and improved: ``python -m benchmarks.machines``.

For each machine: the time of assembly, of the linear assembly and of the simulation; the
efficiency for small strokes by the linear assembly and of the whole lattice, and at the full
stroke; and the efficiency after a search over all beams. Prints Markdown and writes
``docs/machines/bundled.json``. ``--work`` is the folder of the searches, which can be resumed.
``--contact`` checks the contact of struts instead, and writes the record of the package.
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

CONTACT = Path(__file__).parents[1] / "src" / "bellcrank" / "machines" / "bundled" / RECORD_NAME
RECORD = Path(__file__).parents[1] / "docs" / "machines" / "bundled.json"
SMALL = 1e-3
"""Fraction of the stroke in which the response is linear."""
GOALS = {"gripper": ("mirror x",)}
"""Constraints of the searches."""
LONG = ("wave",)
"""Machines whose search takes too long for a benchmark."""


@dataclass(frozen=True, slots=True)
class Row:
    """Figures of one machine; times in seconds.

    Parameters
    ----------
    name
        Name of the machine.
    parts, nodes, beams, all_beams
        Sizes; `all_beams` includes absent beams.
    building, linear_seconds, simulating
        Times of the assembly of the lattice, of the linear assembly, and of the response at the
        full stroke in increments of 1/32.
    linear, small, efficiency
        Efficiency by the linear assembly, of the lattice for a small stroke, and of the lattice
        at the full stroke.
    designed
        Efficiency after a search that starts from the assembly.
    """

    name: str
    parts: int
    nodes: int
    beams: int
    all_beams: int
    building: float
    linear_seconds: float
    simulating: float
    linear: float
    small: float
    efficiency: float
    designed: float | None


def designed(machine: Machine, name: str, options: argparse.Namespace) -> float | None:
    """Return the efficiency after a search from a machine; finished searches are read."""
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
    linear_assembly(bundled_machine(name))  # reads files and loads kernels
    start = time.perf_counter()
    machine = bundled_machine(name)
    built = time.perf_counter()
    problem, mask = machine.design.problem, machine.design.mask
    response = SpringEvaluator(problem).evaluate(mask, VERIFICATION_INCREMENT)
    simulated = time.perf_counter()
    linear = linear_assembly(machine)
    assembled = time.perf_counter()
    small = replace(problem, input=replace(problem.input, amount=SMALL * problem.input.amount))
    return Row(
        name=name,
        parts=len(machine.parts),
        nodes=problem.lattice.node_count,
        beams=machine.design.beam_count,
        all_beams=problem.lattice.beam_count,
        building=built - start,
        linear_seconds=assembled - simulated,
        simulating=simulated - built,
        linear=linear.efficiency,
        small=SpringEvaluator(small).evaluate(mask).efficiency,
        efficiency=response.efficiency,
        designed=designed(machine, name, options),
    )


def write_contact(names: list[str]) -> None:
    """Check the contact of machines, and write the record of the package."""
    found = {name: asdict(check_contact(bundled_machine(name).design)) for name in names}
    record = {"machines": found, "provenance": provenance()}
    write_text(CONTACT, json.dumps(record, indent=1) + "\n", overwrite=True)


def main() -> None:
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
            f"| {row.name} | {row.parts} | {row.beams} of {row.all_beams} | {row.building:.2f} "
            f"| {row.simulating:.2f} | {row.linear:.3f} | {row.small:.3f} | {row.efficiency:.3f} "
            f"| {'-' if row.designed is None else f'{row.designed:.2f}'} |",
            flush=True,
        )
    record = {
        "steps": options.steps, "chains": options.chains, "rows": rows, "provenance": provenance(),
    }  # fmt: skip
    options.out.parent.mkdir(parents=True, exist_ok=True)
    write_text(options.out, json.dumps(record, indent=1) + "\n", overwrite=True)


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--work", type=Path, default=Path("machines"), help="folder of searches")
    parser.add_argument("--contact", action="store_true", help="check the contact of struts")
    parser.add_argument("--machines", nargs="+", default=bundled_machines())
    parser.add_argument("--steps", type=int, default=10_000, help="0: no search")
    parser.add_argument("--chains", type=int, default=2)
    parser.add_argument("--out", type=Path, default=RECORD)
    return parser.parse_args()


if __name__ == "__main__":
    main()
