"""Prediction and simulation of the bundled machines: ``python -m benchmarks.machines``.

For each machine, measure the times of the assembly of the lattice, of the prediction from its parts
and of the simulation; the efficiency at rest, predicted, simulated, and of frames with eight
elements of each strut; and the figures of the part. A Markdown table is printed, and the results
are written to ``docs/machines/bundled.json``. ``--contact`` checks the contact of struts instead,
and writes the record that is part of the package.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.machines import assembled_ports, predict, simulate, two_port_at
from bellcrank.machines.bundled import bundled_machine, bundled_machines
from bellcrank.machines.bundled.contact import RECORD as RECORD_NAME
from bellcrank.mechanics import VERIFICATION_INCREMENT, model_evaluator
from bellcrank.model import Output
from bellcrank.model.storage import write_text
from bellcrank.provenance import provenance
from bellcrank.workflows.library_measurement import entry_figures
from bellcrank.workflows.validation import check_contact

if TYPE_CHECKING:
    from bellcrank.machines import Machine
    from bellcrank.model import Design

ROOT = Path(__file__).parents[1]
CONTACT_RECORD = ROOT / "src" / "bellcrank" / "machines" / "bundled" / RECORD_NAME
RECORD = ROOT / "docs" / "machines" / "bundled.json"
POINTS = 20
"""Increments of the stroke."""
ELEMENTS = 8
"""Elements of each strut in the frame analysis that validates."""


@dataclass(frozen=True, slots=True)
class Row:
    """Results for one machine; times in seconds.

    Parameters
    ----------
    name
        Name of the machine.
    parts, nodes, beams, all_beams
        Numbers of parts, nodes and beams; `all_beams` includes absent beams.
    assembly_seconds, prediction_seconds, simulation_seconds
        Times of the assembly of the lattice, of the prediction and of the simulation.
    rest
        Efficiency for small strokes.
    predicted, simulated
        Efficiency at the full stroke, from the condensed parts and of the whole lattice.
    divided
        Efficiency of the whole lattice with eight elements of each strut.
    figures
        Figures of the first output of the part with eight elements of each strut (`FIGURES` of
        library entries).
    """

    name: str
    parts: int
    nodes: int
    beams: int
    all_beams: int
    assembly_seconds: float
    prediction_seconds: float
    simulation_seconds: float
    rest: float
    predicted: float
    simulated: float
    divided: float
    figures: dict[str, float | None]


def measure(name: str) -> Row:
    """Measure one machine."""
    for run in (predict, simulate):
        run(bundled_machine(name), 1)  # loads files and kernels before the measurement
    start = time.perf_counter()
    machine = bundled_machine(name)
    assembled = time.perf_counter()
    predicted = predict(machine, POINTS)
    condensed = time.perf_counter()
    simulated = simulate(machine, POINTS)
    end = time.perf_counter()
    problem, mask = machine.design.problem, machine.design.mask
    parts = assembled_ports(machine)
    divided = model_evaluator(problem, elements=ELEMENTS).evaluate(mask, VERIFICATION_INCREMENT)
    return Row(
        name=name,
        parts=len(machine.parts),
        nodes=problem.lattice.node_count,
        beams=machine.design.beam_count,
        all_beams=problem.lattice.beam_count,
        assembly_seconds=assembled - start,
        prediction_seconds=condensed - assembled,
        simulation_seconds=end - condensed,
        rest=two_port_at(parts, parts.rest()).efficiency,
        predicted=float(predicted.efficiency[-1]),
        simulated=float(simulated.efficiency[-1]),
        divided=divided.efficiency,
        figures=entry_figures(with_one_output(machine)),
    )


def with_one_output(machine: Machine) -> Design:
    """Return a machine with its first output alone; in the mean, rotations of two jaws cancel."""
    problem = machine.design.problem
    nodes = machine.port_nodes(machine.plan.outputs[0])
    direction = problem.output.direction[np.searchsorted(problem.output.nodes, nodes)]
    alone = replace(problem, output=Output(nodes, direction))
    return replace(machine.design, problem=alone)


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
        "| machine | parts | beams | prediction, s | simulation, s | at rest | predicted "
        "| simulated | 8 elements a strut |"
    )
    print("|---" * 9 + "|")
    for name in options.machines:
        row = measure(name)
        rows.append(asdict(row))
        print(
            f"| {row.name} | {row.parts} | {row.beams} of {row.all_beams} "
            f"| {row.prediction_seconds:.2f} | {row.simulation_seconds:.2f} | {row.rest:.3f} "
            f"| {row.predicted:.3f} | {row.simulated:.3f} | {row.divided:.3f} |",
            flush=True,
        )
    record = {"points": POINTS, "elements": ELEMENTS, "rows": rows, "provenance": provenance()}
    options.out.parent.mkdir(parents=True, exist_ok=True)
    write_text(options.out, json.dumps(record, indent=1) + "\n", overwrite=True)


def parse() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--contact", action="store_true", help="only check the contact of struts")
    parser.add_argument(
        "--machines", nargs="+", default=bundled_machines(), help="names of machines"
    )
    parser.add_argument("--out", type=Path, default=RECORD, help="JSON file")
    return parser.parse_args()


if __name__ == "__main__":
    main()
