"""Search of a large lattice for ten minutes, against a lever: ``python -m benchmarks.lever``.

The problem is ``scaling`` (`bellcrank.model.builtin.scaling`) with 100 x 100 nodes, in springs. The
lever is drawn by hand: a plate that turns about a node next to the supports; a rod hangs from the
input to the plate beside that node. Of several levers the most efficient counts: arms of 2 to 10
beam lengths, with the rod at several heights and of several widths. The default search has two
chains on two cores. Designs are verified with small load increments. The result is
``docs/lever.json``, and the figure ``docs/images/lever.png``.
"""

from __future__ import annotations

import argparse
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
from bellcrank.model import Design, pack_mask, unpack_mask
from bellcrank.model.builtin.scaling import scaling
from bellcrank.plots import Motion, draw_comparison
from bellcrank.provenance import provenance
from bellcrank.search import HoppingSettings, advance_chain, make_evaluator, start_chain
from tools.draw_tasks import shrink

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


def measure(problem: Problem) -> dict[str, Any]:
    """Search, compare with the best lever, and return the record."""
    with ProcessPoolExecutor(CHAINS) as pool:
        runs = [*pool.map(search, [SIZE] * CHAINS, range(CHAINS), [SECONDS] * CHAINS)]
    drawn, by_hand = best_lever(problem, SIZE)
    for run in runs:
        run["efficiency"] = float(f"{verified(problem, run['mask'])[1].efficiency:.5g}")
    return {
        "provenance": provenance(), "beams": problem.lattice.beam_count, "seconds": SECONDS,
        "lever": float(f"{by_hand.efficiency:.5g}"), "lever_mask": pack_mask(drawn), "runs": runs,
    }  # fmt: skip


def verified(problem: Problem, text: str) -> tuple[NDArray[np.bool_], Response]:
    """Return the beams of a design that carry load, and its response in small increments."""
    evaluator = SpringEvaluator(problem, unloaded_beams="prune_all")
    mask = evaluator.load_bearing(unpack_mask(text, problem.lattice.beam_count))
    return mask, evaluator.evaluate(mask, VERIFICATION_INCREMENT)


def draw(problem: Problem, record: dict[str, Any], path: Path) -> None:
    """Draw the lever and the best design of the searches."""
    best = max(record["runs"], key=lambda run: run["efficiency"])
    motions = []
    for name, text in (("lever", record["lever_mask"]), ("search", best["mask"])):
        mask, response = verified(problem, text)
        design = Design(problem, mask)
        motions.append(Motion(design, response.displacement, response.efficiency, name=name))
    draw_comparison(motions[0], motions[1], path, overwrite=True)
    shrink(path, "lever", 1500)


def main() -> None:
    """Search and write the record, or draw the figure of the record alone."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--draw", action="store_true", help="draw the figure of the record")
    problem, path = scaling(SIZE), DOCS / "lever.json"
    if not parser.parse_args().draw:
        text = json.dumps(measure(problem), indent=1)
        path.write_text(text + "\n", encoding="utf-8")
    record = json.loads(path.read_text(encoding="utf-8"))
    found = [(run["MB"], run["efficiency"]) for run in record["runs"]]
    print(f"lever {record['lever']:.2f}; MB and efficiency of each chain: {found}")
    draw(problem, record, DOCS / "images" / "lever.png")


if __name__ == "__main__":
    main()
