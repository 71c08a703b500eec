"""Topology optimisation by topoptlab: ``python densities_topoptlab.py JOB RESULT``.

This program runs in an environment of its own, in which topoptlab is installed, and shares files
only with bellcrank. It uses the settings of the force inverter among the examples of topoptlab:
sensitivity filter, stiffness by the power 3, optimality criteria for mechanisms.

JOB is a JSON file in the numbering of topoptlab: elements (across, down), load and output (n,),
held, springs (degrees of freedom and stiffness), solid, empty, volume, radius, iterations. RESULT
has the densities of the elements and the processor time.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np


def main(job: dict[str, Any]) -> dict[str, Any]:
    """Return the densities with a large output displacement."""
    from topoptlab.objectives import var_maximization
    from topoptlab.topology_optimization import main as optimise

    across, down = job["elements"]
    load, output = (np.array(job[name], dtype=float) for name in ("load", "output"))
    held = np.array(job["held"], dtype=int)
    places, stiffness = np.array(job["springs"][0], dtype=int), np.array(job["springs"][1])
    flags = np.zeros(across * down, dtype=int)
    flags[job["empty"]], flags[job["solid"]] = 1, 2

    def boundary(**_sizes: int) -> tuple[Any, ...]:
        count = len(load)
        free = np.setdiff1d(np.arange(count), held)
        return np.zeros((count, 1)), load[:, None].copy(), held, free, [places, stiffness]

    began = time.process_time()
    density, _ = optimise(
        nelx=across,
        nely=down,
        volfrac=job["volume"],
        rmin=job["radius"],
        ft=0,
        bcs=boundary,
        obj_func=var_maximization,
        obj_kw={"l": output[:, None]},
        el_flags=flags,
        optimizer="ocm",
        matinterpol_kw={"eps": job["least"], "penal": 3.0},
        materials_kw={"E": 1.0, "nu": job["poisson"]},
        nouteriter=job["iterations"],
        output_kw={
            "file": "unused", "display": False, "export": False, "write_log": False,
            "profile": False, "output_movie": False, "verbosity": 20,
        },
    )  # fmt: skip
    seconds = time.process_time() - began
    return {"density": np.asarray(density).ravel().tolist(), "seconds": seconds}


if __name__ == "__main__":
    given, wanted = map(Path, sys.argv[1:])
    wanted.write_text(json.dumps(main(json.loads(given.read_text()))))
