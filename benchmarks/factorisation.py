"""Cost of machines as a function of the number of beams: ``python -m benchmarks.factorisation``.

The machines are series of 1 to 40 actuators. For each number of actuators, measure the times of
the assembly, of the preparation of arrays, of the response, and of one factorisation of the same
stiffness matrix by three methods: the block Cholesky factorisation of the package, LAPACK's band
Cholesky factorisation in reverse Cuthill-McKee order, and SuperLU. A Markdown table is printed,
and the results are written to ``docs/machines/factorisation.json``.
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
ABSENT_FRACTION = 0.25
"""Fraction of the designable beams that are absent in each actuator."""


@dataclass(frozen=True, slots=True)
class Row:
    """Results for one number of actuators; times in milliseconds.

    Parameters
    ----------
    actuators, beams, unknowns
        Numbers of actuators, beams and unknowns.
    assembly
        Time to assemble one design from the plan.
    preparation
        Time to compute the arrays of the kernels, including the order of elimination.
    response, verification
        Time of the response from rest to the full stroke, in the increments of a search and in
        increments of 1/32.
    sparse, banded, superlu
        Time of one factorisation by each method.
    half_bandwidth
        Half bandwidth of the band matrix.
    error
        Largest difference between the solutions by the sparse factorisation and by SuperLU,
        divided by the largest component.
    """

    actuators: int
    beams: int
    unknowns: int
    assembly: float
    preparation: float
    response: float
    verification: float
    sparse: float
    banded: float
    superlu: float
    half_bandwidth: int
    error: float


@entry
def factorise(structure: Structure, scratch: Scratch) -> bool:
    """Factorise the last assembled stiffness matrix."""
    return cholesky.factorise(structure, scratch)


@entry
def solve(structure: Structure, scratch: Scratch) -> None:
    """Replace the right-hand side by the solution."""
    cholesky.solve(structure, scratch)


def actuator(columns: int) -> Design:
    """Return an actuator in which a random choice of designable beams is absent."""
    task = elementary(columns, "down")
    mask = task.initial.copy()
    rng = np.random.default_rng(0)
    count = round(ABSENT_FRACTION * len(task.designable))
    mask[rng.choice(task.designable, count, replace=False)] = False
    return Design(task, mask)


def series(part: Design, actuators: int) -> Machine:
    """Return a machine of actuators in series; the output of each is the input of the next."""
    parts: dict[str, Any] = {"p0": {"entry": "part"}}
    for number in range(1, actuators):
        parts[f"p{number}"] = {"entry": "part", "join": f"p{number - 1}.output"}
    content = {
        "name": "series", "parts": parts, "input": {"ports": ["p0.input"]},
        "output": {"ports": [f"p{actuators - 1}.output"]},
    }  # fmt: skip
    return assemble(plan_of(MachineTable.model_validate(content), "series"), lambda _entry: part)


def stiffness_of(evaluator: SpringEvaluator) -> csc_array:
    """Return the last assembled stiffness matrix as a SciPy sparse array."""
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
    permuted = matrix[order][:, order].tocoo()
    width = int(np.abs(permuted.coords[0] - permuted.coords[1]).max())
    band = np.zeros((width + 1, matrix.shape[0]))
    lower = permuted.coords[0] >= permuted.coords[1]
    i, j = permuted.coords[0][lower], permuted.coords[1][lower]
    band[i - j, j] = permuted.data[lower]
    return band


def milliseconds(function: Callable[[], object], repeats: int) -> float:
    """Return the minimum time of a number of calls, in milliseconds."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        function()
        times.append(time.perf_counter() - start)
    return round(1e3 * min(times), 3)


def measure(part: Design, actuators: int, repeats: int) -> Row:
    """Measure a series of a number of actuators."""
    machine = series(part, actuators)
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
        assembly=milliseconds(lambda: series(part, actuators), repeats),
        preparation=milliseconds(lambda: SpringEvaluator(problem), repeats),
        response=milliseconds(lambda: evaluator.evaluate(mask), repeats),
        verification=milliseconds(lambda: evaluator.evaluate(mask, VERIFICATION_INCREMENT), 1),
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
    """Return the relative difference between the solution of the package and SuperLU's."""
    load = np.random.default_rng(1).normal(size=evaluator.scratch.step.shape)
    evaluator.scratch.step[:] = load
    solve(evaluator.structure, evaluator.scratch)
    expected = splu(matrix).solve(load.ravel()[: matrix.shape[0]])
    solution = evaluator.scratch.step.ravel()[: matrix.shape[0]]
    return float(np.abs(solution - expected).max() / np.abs(expected).max())


def main() -> None:
    """Measure, print the table and write the record."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--columns", type=int, default=12, help="columns of cells of an actuator")
    parser.add_argument(
        "--actuators",
        type=int,
        nargs="+",
        default=[1, 2, 5, 10, 20, 40],
        help="numbers of actuators",
    )
    parser.add_argument("--repeats", type=int, default=5, help="calls of each timed function")
    parser.add_argument("--out", type=Path, default=RECORD, help="JSON file")
    options = parser.parse_args()
    part = actuator(options.columns)
    measure(part, 1, 1)  # compiles
    rows = []
    print("| actuators | beams | unknowns | assembly | preparation | response "
          "| response, increments of 1/32 | sparse factorisation "
          "| band factorisation (half bandwidth) | SuperLU |")  # fmt: skip
    print("|---|---|---|---|---|---|---|---|---|---|")
    for actuators in options.actuators:
        row = measure(part, actuators, options.repeats)
        rows.append(asdict(row))
        print(
            f"| {row.actuators} | {row.beams} | {row.unknowns} | {row.assembly:.0f} "
            f"| {row.preparation:.1f} | {row.response:.1f} | {row.verification:.1f} "
            f"| {row.sparse:.2f} | {row.banded:.2f} ({row.half_bandwidth}) "
            f"| {row.superlu:.2f} |",
            flush=True,
        )
    record = {"columns": options.columns, "rows": rows, "provenance": provenance()}
    options.out.parent.mkdir(parents=True, exist_ok=True)
    write_text(options.out, json.dumps(record, indent=1) + "\n", overwrite=True)


if __name__ == "__main__":
    main()
