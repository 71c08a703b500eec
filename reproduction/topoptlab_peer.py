"""Topology optimisation of a box by topoptlab, as a separate program.

topoptlab is under the GNU GPL and needs Python 3.12. It is not a dependency: the environment
variable ``BELLCRANK_TOPOPTLAB`` is the path of a Python interpreter that has it. Without the
variable it takes no part in the comparison.
"""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import BellcrankError, InvalidSettings
from reproduction.box_elements import grid_of
from reproduction.topology import LEAST, POISSON

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from reproduction.boxes import Box

INTERPRETER = "BELLCRANK_TOPOPTLAB"
"""Environment variable with the path of an interpreter that has topoptlab."""
PROGRAM = Path(__file__).parent / "programs" / "densities_topoptlab.py"


def interpreter() -> str | None:
    """Return the path of the interpreter that has topoptlab, or None.

    Raises
    ------
    InvalidSettings
        If the path is given and has no topoptlab.
    """
    path = os.environ.get(INTERPRETER)
    if not path:
        return None
    try:
        found = subprocess.run(  # the user's own interpreter
            [path, "-c", "import topoptlab"], capture_output=True, check=False
        )
    except OSError as problem:
        raise InvalidSettings(f"{INTERPRETER}: {path}: {problem.strerror}") from None
    if found.returncode:
        raise InvalidSettings(f"{INTERPRETER}: {path} has no package topoptlab")
    return path


def optimise(
    box: Box,
    elements: int,
    volume: float,
    springs: tuple[float, float],
    radius: float,
    iterations: int,
) -> dict[str, Any]:
    """Return densities with a large output displacement, by the interpreter that is given.

    Parameters and results are those of `reproduction.topology.optimise`; only density, elements,
    seconds and springs are returned. topoptlab has springs at single degrees of freedom: the
    stiffness is distributed over the nodes of the input and of the output.

    Raises
    ------
    BellcrankError
        If topoptlab fails.
    """
    grid = grid_of(box, elements)
    freedoms, numbers = _numbering(grid.counts)
    load, output = (_placed(vector, freedoms) for vector in (grid.load, grid.output))
    stiffness = springs[0] * np.abs(load) + springs[1] * np.abs(output)
    places = np.flatnonzero(stiffness)
    job = {
        "elements": list(grid.counts),
        "load": load.tolist(),
        "output": output.tolist(),
        "held": np.sort(freedoms[grid.held]).tolist(),
        "springs": [places.tolist(), stiffness[places].tolist()],
        "solid": numbers[grid.solid].tolist(),
        "empty": numbers[grid.empty].tolist(),
        "volume": volume,
        "radius": radius,
        "iterations": iterations,
        "least": LEAST,
        "poisson": POISSON,
    }
    made = _run(job)
    across, up = grid.counts
    density = np.array(made["density"])[numbers].reshape(up, across)
    return {
        "density": density.round(4).tolist(),
        "elements": [across, up],
        "seconds": round(made["seconds"], 2),
        "springs": list(springs),
    }


def _run(job: dict[str, Any]) -> dict[str, Any]:
    with TemporaryDirectory() as folder:
        given, wanted = Path(folder) / "job.json", Path(folder) / "result.json"
        given.write_text(json.dumps(job), encoding="utf-8")
        found = subprocess.run(
            [os.environ[INTERPRETER], str(PROGRAM), str(given), str(wanted)],
            capture_output=True, text=True, check=False, cwd=folder,
        )  # fmt: skip
        if found.returncode:
            raise BellcrankError(f"topoptlab failed: {found.stderr.strip()[-200:]}")
        result: dict[str, Any] = json.loads(wanted.read_text(encoding="utf-8"))
    return result


def _numbering(counts: tuple[int, ...]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the numbers in topoptlab of the degrees of freedom and of the elements of a grid.

    topoptlab numbers columns from the left, each from the top.
    """
    across, up = counts
    corners = _columns(across + 1, up + 1)
    freedoms = np.column_stack([2 * corners, 2 * corners + 1]).ravel()
    return freedoms, _columns(across, up)


def _columns(across: int, up: int) -> NDArray[np.int64]:
    """Return the numbers by columns from the top of a table that is numbered by rows."""
    row, column = np.divmod(np.arange(across * up), across)
    found: NDArray[np.int64] = up * column + (up - 1 - row)
    return found


def _placed(vector: NDArray[np.float64], freedoms: NDArray[np.int64]) -> NDArray[np.float64]:
    found = np.zeros_like(vector)
    found[freedoms] = vector
    return found
