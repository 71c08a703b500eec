"""Search of a large lattice for ten minutes, against a lever: ``python -m benchmarks.lever``.

The problem is ``scaling`` (`bellcrank.model.builtin.scaling`) with 100 x 100 nodes, in springs. The
lever is drawn by hand: a plate that turns about a node next to the supports; a rod hangs from the
input to the plate beside that node. Of several levers the most efficient counts: arms of 2 to 10
beam lengths, with the rod at several heights and of several widths. The default search has two
chains on two cores. Designs are verified with small load increments. The result is
``docs/lever.json``, and the figure ``docs/images/lever.png``.
"""

from __future__ import annotations

import json
import math
import resource
import time
from concurrent.futures import ProcessPoolExecutor
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from shapely import Polygon, box, contains, points

from bellcrank.mechanics import VERIFICATION_INCREMENT, Response, SpringEvaluator, Status
from bellcrank.model import Design, unpack_mask
from bellcrank.model.builtin.scaling import scaling
from bellcrank.plots import Motion, draw_comparison
from bellcrank.provenance import provenance
from bellcrank.search import HoppingSettings, advance_chain, make_evaluator, start_chain

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from shapely import Geometry

    from bellcrank.model import Problem

DOCS = Path(__file__).parents[1] / "docs"
SIZE = 100
CHAINS = 2
SECONDS = 600.0
"""Time of each chain by the clock."""
ARMS = (2.0, 3.0, 4.0, 6.0, 8.0, 10.0)
"""Distances of the rod from the pivot, across the rod."""
HEIGHTS = (0.03, 0.06, 0.1, 0.2, 0.3)
"""Heights of the lower end of the rod above the pivot, in units of the number of nodes."""
WIDTHS = (0.8, 1.3, 2.1)
"""Half the widths of rods."""


def lever(
    problem: Problem, size: int, arm: float, height: float, width: float
) -> NDArray[np.bool_]:
    """Return the mask of a lever; lengths in lattice units."""
    position = problem.lattice.positions
    right, top = position.max(axis=0)
    where = points(position)

    def node_at(x: float, y: float) -> int:
        return int(np.hypot(*(position - [x, y]).T).argmin())

    def around(node: int, *angles: float) -> list[int]:
        turned = [math.radians(angle) for angle in angles]
        x, y = position[node]
        return [node, *(node_at(x + math.cos(angle), y + math.sin(angle)) for angle in turned)]

    def within(shape: Geometry, *nodes: int) -> NDArray[np.bool_]:
        found: NDArray[np.bool_] = contains(shape.buffer(1e-3), where)
        found[list(nodes)] = True
        return found

    pivot = node_at(0.95 * right, 0.5 * math.sqrt(3.0))
    x, y = position[pivot]
    joint = node_at(x - arm, y + height * size)
    corners = [(x, y), tuple(position[joint]), (0.2 * right, top), (0.0, top), (0.0, 0.8 * top)]
    plate = within(Polygon(corners), *around(pivot, 60, 120), *around(joint, 180, 240, 300))
    moved = within(box(-0.1, 0.79 * top, 0.2 * right, 1.1 * top))
    x, y = position[joint]
    rod = within(box(x - width, y + 0.8, x + width, 0.83 * top), *around(joint, 60, 120))
    foot = np.isin(np.arange(len(position)), around(pivot, 240, 300))
    mask = problem.initial.copy()
    drawn = [part[problem.lattice.beams].all(axis=1) for part in (plate | moved, rod, foot)]
    mask[problem.designable] = np.any(drawn, axis=0)[problem.designable]
    return mask


def best_lever(problem: Problem, size: int) -> tuple[NDArray[np.bool_], Response]:
    """Return the most efficient lever with a stable path, and its response."""
    evaluator = SpringEvaluator(problem, unloaded_beams="prune_all")
    found = []
    for dimensions in product(ARMS, HEIGHTS, WIDTHS):
        mask = lever(problem, size, *dimensions)
        response = evaluator.evaluate(mask, VERIFICATION_INCREMENT)
        if response.status is Status.CONVERGED:
            found.append((mask, response))
    return max(found, key=lambda pair: pair[1].efficiency)


def search(size: int, chain: int, seconds: float) -> dict[str, Any]:
    """Search for a time with one chain; return its best designs along the time."""
    start = time.perf_counter()
    problem = scaling(size)
    settings = HoppingSettings(steps=10**9, unloaded_beams="prune_all")
    evaluator = make_evaluator(problem, settings)
    state = start_chain(evaluator, settings, chain)
    curve: list[tuple[float, float]] = []
    while time.perf_counter() - start < seconds:
        state, _ = advance_chain(evaluator, settings, chain, state)
        if not curve or state.best > curve[-1][1]:
            curve.append((round(time.perf_counter() - start, 1), float(f"{state.best:.5g}")))
    return {
        "chain": chain,
        "designs": state.step,
        "MB": round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024),
        "curve": curve,
        "mask": state.mask,
    }


def main() -> None:
    """Search, compare with the lever, and write the record and the figure."""
    problem = scaling(SIZE)
    beams = problem.lattice.beam_count
    with ProcessPoolExecutor(CHAINS) as pool:
        runs = [*pool.map(search, [SIZE] * CHAINS, range(CHAINS), [SECONDS] * CHAINS)]
    drawn, by_hand = best_lever(problem, SIZE)
    evaluator = SpringEvaluator(problem, unloaded_beams="prune_all")
    for run in runs:
        mask = unpack_mask(run["mask"], beams)
        response = evaluator.evaluate(mask, VERIFICATION_INCREMENT)
        run["efficiency"] = float(f"{response.efficiency:.5g}")
        print({key: value for key, value in run.items() if key != "mask"})
    best = max(runs, key=lambda run: run["efficiency"])
    mask = unpack_mask(best["mask"], beams)
    response = evaluator.evaluate(mask, VERIFICATION_INCREMENT)
    print(f"lever {by_hand.efficiency:.2f}, search {response.efficiency:.2f}")
    record = {
        "provenance": provenance(), "beams": beams, "seconds": SECONDS,
        "lever": float(f"{by_hand.efficiency:.5g}"), "runs": runs,
    }  # fmt: skip
    (DOCS / "lever.json").write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    draw_comparison(
        Motion(Design(problem, drawn), by_hand.displacement, by_hand.efficiency, name="lever"),
        Motion(Design(problem, mask), response.displacement, response.efficiency, name="search"),
        DOCS / "images" / "lever.png",
        overwrite=True,
    )


if __name__ == "__main__":
    main()
