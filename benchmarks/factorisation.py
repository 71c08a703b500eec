"""Cost of machines against their number of beams: ``python -m benchmarks.factorisation``.

Rows of 1 to 40 actuators with half-hidden cells; at each length the time to assemble, to compile
the row into arrays, to respond, and for one factorisation of the same stiffness matrix: by the
block Cholesky of the package, by LAPACK in a band (reverse Cuthill-McKee order), by SuperLU.
Prints Markdown and writes ``docs/machines/factorisation.json``.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.linalg import cholesky_banded
from scipy.sparse import csc_array, diags_array
from scipy.sparse.csgraph import reverse_cuthill_mckee
from scipy.sparse.linalg import splu

from bellcrank.machines import Machine, assemble, elementary
from bellcrank.machines.plan import MachineTable, plan_of
from bellcrank.mechanics import VERIFICATION_INCREMENT, SpringEvaluator
from bellcrank.mechanics.kernels import cholesky
from bellcrank.mechanics.kernels._compile import entry
from bellcrank.model import Design
from bellcrank.model.storage import write_text
from bellcrank.provenance import provenance

if TYPE_CHECKING:
    from collections.abc import Callable

    from bellcrank.mechanics.kernels.arrays import Scratch, Structure

RECORD = Path(__file__).parents[1] / "docs" / "machines" / "factorisation.json"
MISSING = 0.25
"""Part of the designable beams that the actuators of the rows lack."""


@dataclass(frozen=True, slots=True)
class Row:
    """What one length of row costs; times in milliseconds.

    Parameters
    ----------
    actuators, beams, unknowns
    assembly
        From the plan to one design.
    preparation
        From the design to the arrays that the kernels work on, with the order of elimination.
    response, careful
        From rest to the full stroke; in increments of 1/32.
    sparse, banded, superlu
        One factorisation.
    half_bandwidth
        Of the band.
    error
        Largest difference of a solution by the sparse factor from SuperLU's, relative.
    """

    actuators: int
    beams: int
    unknowns: int
    assembly: float
    preparation: float
    response: float
    careful: float
    sparse: float
    banded: float
    superlu: float
    half_bandwidth: int
    error: float


@entry
def factorise(structure: Structure, scratch: Scratch) -> bool:
    """Factorise the stiffness that was assembled last."""
    return cholesky.factorise(structure, scratch)


@entry
def solve(structure: Structure, scratch: Scratch) -> None:
    """Replace the right-hand side by the solution."""
    cholesky.solve(structure, scratch)


def actuator(columns: int) -> Design:
    """Return some actuator: beams are missing anywhere outside its ports."""
    task = elementary(columns, "down")
    mask = task.initial.copy()
    rng = np.random.default_rng(0)
    count = round(MISSING * len(task.designable))
    mask[rng.choice(task.designable, count, replace=False)] = False
    return Design(task, mask)


def row(part: Design, actuators: int) -> Machine:
    """Put actuators in a row, each driving the next."""
    parts: dict[str, Any] = {"p0": {"entry": "part"}}
    for number in range(1, actuators):
        parts[f"p{number}"] = {"entry": "part", "join": f"p{number - 1}.output"}
    told = {
        "name": "row", "parts": parts, "input": {"ports": ["p0.input"]},
        "output": {"ports": [f"p{actuators - 1}.output"]},
    }  # fmt: skip
    return assemble(plan_of(MachineTable.model_validate(told), "row"), lambda _entry: part)


def stiffness_of(evaluator: SpringEvaluator) -> csc_array:
    """Return the stiffness that was assembled last, as scipy has it."""
    structure, scratch = evaluator.structure, evaluator.scratch
    blocks = int(evaluator.system.block.max()) + 1
    rows, columns, values = [], [], []
    for column in range(blocks):
        xx, xy, _, yy = scratch.diagonal[column]
        rows += [2 * column, 2 * column + 1, 2 * column + 1]
        columns += [2 * column, 2 * column, 2 * column + 1]
        values += [xx, xy, yy]
        for t in range(structure.column_start[column], structure.column_start[column + 1]):
            i = 2 * structure.row[t]
            rows += [i, i, i + 1, i + 1]
            columns += [2 * column, 2 * column + 1] * 2
            values += list(scratch.off_diagonal[t])
    lower = csc_array((values, (rows, columns)), shape=(2 * blocks, 2 * blocks))
    return csc_array(lower + lower.T - diags_array(lower.diagonal()))


def band_of(matrix: csc_array) -> np.ndarray:
    """Return the lower band of a symmetric matrix in reverse Cuthill-McKee order."""
    order = reverse_cuthill_mckee(matrix, symmetric_mode=True)
    moved = matrix[order][:, order].tocoo()
    width = int(np.abs(moved.coords[0] - moved.coords[1]).max())
    band = np.zeros((width + 1, matrix.shape[0]))
    below = moved.coords[0] >= moved.coords[1]
    i, j = moved.coords[0][below], moved.coords[1][below]
    band[i - j, j] = moved.data[below]
    return band


def milliseconds(job: Callable[[], object], repeats: int) -> float:
    """Return the least time that a job took."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        job()
        times.append(time.perf_counter() - start)
    return round(1e3 * min(times), 3)


def measure(part: Design, actuators: int, repeats: int) -> Row:
    """Measure one length of row."""
    machine = row(part, actuators)
    problem, mask = machine.design.problem, machine.design.mask
    evaluator = SpringEvaluator(problem)
    evaluator.evaluate(mask)
    matrix = stiffness_of(evaluator)
    structure, scratch = evaluator.structure, evaluator.scratch
    assert factorise(structure, scratch)
    band = band_of(matrix)
    error = _error(evaluator, matrix)
    return Row(
        actuators=actuators,
        beams=machine.design.beam_count,
        unknowns=matrix.shape[0],
        assembly=milliseconds(lambda: row(part, actuators), repeats),
        preparation=milliseconds(lambda: SpringEvaluator(problem), repeats),
        response=milliseconds(lambda: evaluator.evaluate(mask), repeats),
        careful=milliseconds(lambda: evaluator.evaluate(mask, VERIFICATION_INCREMENT), 1),
        sparse=milliseconds(lambda: factorise(structure, scratch), repeats),
        banded=milliseconds(lambda: cholesky_banded(band, lower=True), repeats),
        superlu=milliseconds(
            lambda: splu(matrix, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}),
            repeats,
        ),
        half_bandwidth=len(band) - 1,
        error=error,
    )


def _error(evaluator: SpringEvaluator, matrix: csc_array) -> float:
    right = np.random.default_rng(1).normal(size=evaluator.scratch.step.shape)
    evaluator.scratch.step[:] = right
    solve(evaluator.structure, evaluator.scratch)
    expected = splu(matrix).solve(right.ravel()[: matrix.shape[0]])
    found = evaluator.scratch.step.ravel()[: matrix.shape[0]]
    return float(np.abs(found - expected).max() / np.abs(expected).max())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--columns", type=int, default=12)
    parser.add_argument("--actuators", type=int, nargs="+", default=[1, 2, 5, 10, 20, 40])
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--out", type=Path, default=RECORD)
    options = parser.parse_args()
    part = actuator(options.columns)
    measure(part, 1, 1)  # compiles
    rows = []
    print("| actuators | beams | unknowns | assembly, ms | preparation | response | in 1/32 "
          "| factorised | in a band | SuperLU |")  # fmt: skip
    print("|---|---|---|---|---|---|---|---|---|---|")
    for actuators in options.actuators:
        found = measure(part, actuators, options.repeats)
        rows.append(asdict(found))
        print(
            f"| {found.actuators} | {found.beams} | {found.unknowns} | {found.assembly:.0f} "
            f"| {found.preparation:.1f} | {found.response:.1f} | {found.careful:.1f} "
            f"| {found.sparse:.2f} | {found.banded:.2f} ({found.half_bandwidth}) "
            f"| {found.superlu:.2f} |",
            flush=True,
        )
    record = {"columns": options.columns, "rows": rows, "provenance": provenance()}
    options.out.parent.mkdir(parents=True, exist_ok=True)
    write_text(options.out, json.dumps(record, indent=1) + "\n", overwrite=True)


if __name__ == "__main__":
    main()
