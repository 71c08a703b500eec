"""A straight, loaded motion on a box, by each method, scored on the whole specification."""

from __future__ import annotations

import time
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import NoDesignFound
from bellcrank.fem.specification import sheet_records
from bellcrank.machines.library.tasks import straight_motion
from bellcrank.mechanics import item_results
from bellcrank.search import read_settings
from bellcrank.workflows import complete_design, start_design
from bellcrank.workflows.specification import item_data
from reproduction.boxes import Box, box_of
from reproduction.outline_analysis import mesh_of, narrowest, polygon_of
from reproduction.searching import design_with, geometry_of
from reproduction.topology_designs import rival_designs

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from shapely import Polygon

    from reproduction.result_store import ResultStore
    from reproduction.rivals_settings import Settings

PAYLOAD = 0.1
"""Smallest force in N that halves the travel."""
OFF_AXIS = 0.05
"""Largest off-axis motion in the optimisation of densities, which is that of the specification."""
UNSTABLE = 1e3
"""Violation of a design that is not stable, above all sums of violations."""


def straight_lift(
    settings: Settings, store: ResultStore, packages: Sequence[str]
) -> dict[str, Any]:
    """Design a lift by each method at equal mass; return the items of each in the sheet.

    The input moves right, the output up. The items are those of straight entries of the library:
    gain, off-axis motion, rotation, sag, payload and strain. Contact is not scored.
    """
    assert settings.lift is not None
    title, columns, rows = settings.lift
    box = box_of("lift", columns, rows, settings.stroke, None, settings.width)
    ours, shape = _ours(box, settings, store)
    size = float(np.prod(box.high - box.low))
    volume = shape.area / size
    rivals = {each: _rival(each, box, volume, settings, store) for each in packages}
    return {
        "title": title,
        "payload_N": PAYLOAD,
        "box_mm": (box.high - box.low).tolist(),
        "volume": volume,
        "ours": ours,
        "rivals": rivals,
    }


def _ours(box: Box, settings: Settings, store: ResultStore) -> tuple[dict[str, Any], Polygon]:
    """Return the score and the outline of the best of several seeds."""
    tried = []
    for seed in range(settings.lift_seeds):
        made = store.compute(f"lift-ours-{seed}", partial(_designed, box, settings, seed))
        shape = polygon_of(box.spec.of(design_with(box.problem, made))) if made["mask"] else None
        score = store.compute(
            f"lift-ours-scored-{seed}", partial(scored, box, shape, settings.triangle)
        )
        tried.append(({"seed": seed, **made, **score}, shape))
    best, shape = min(tried, key=lambda each: _rank(each[0]))
    assert shape is not None
    return {**best, "tried": [_short(row, "seed") for row, _ in tried]}, shape


def _designed(box: Box, settings: Settings, seed: int) -> dict[str, Any]:
    """Search and refine a design, as `bellcrank design` does for a task."""
    began = time.perf_counter()
    problem = straight_motion(box.problem, PAYLOAD, box.spec)
    values = read_settings({"steps": settings.steps, "chains": settings.chains, "seed": seed})
    with TemporaryDirectory() as folder:
        run = start_design(problem, values, Path(folder) / "lift", box.spec)
        try:
            report = complete_design(run)
        except NoDesignFound:
            return {"mask": None, "design_seconds": time.perf_counter() - began}
    assert report is not None
    seconds = time.perf_counter() - began
    return {**geometry_of(report.selection.design), "design_seconds": seconds}


def _rival(
    package: str, box: Box, volume: float, settings: Settings, store: ResultStore
) -> dict[str, Any]:
    """Return the score of the best design of a volume by a package of topology optimisation.

    pyMOTO designs with and without a limit on the off-axis motion; topoptlab has no such limit.
    """
    score = partial(scored, box, triangle=settings.triangle)
    limits = (OFF_AXIS, None) if package == "pyMOTO" else (None,)
    tried = []
    for off_axis in limits:
        more = {"off_axis": off_axis} if off_axis else {}
        name = f"lift-{off_axis}"
        found = rival_designs(package, box, name, volume, settings, store, score, **more)
        tried += [{"off_axis": off_axis, **row} for row, _ in found]
    best = min(tried, key=_rank)
    return {**best, "tried": [_short(row, "off_axis", "springs", "radius") for row in tried]}


def scored(box: Box, shape: Polygon | None, triangle: float) -> dict[str, Any]:
    """Return the items of an outline in the sheet; None if it is not stable or not connected."""
    if shape is None:
        return {"items": None, "area_mm2": None, "narrowest_mm": None}
    problem = straight_motion(box.problem, PAYLOAD, box.spec)
    wanted = problem.specification
    assert wanted is not None
    items = [item for item in wanted.items if item.quantity != "clearance"]
    part = box.spec.of(problem.full_design())
    records = sheet_records(part, mesh=mesh_of(part, shape, triangle))
    row: dict[str, Any] = {
        "items": None,
        "area_mm2": float(shape.area),
        "narrowest_mm": narrowest(box, shape),
    }
    if records is not None:
        found = item_data(problem, box.spec, {"sheet": item_results(items, records)})
        row["items"] = [
            {
                **{key: item[key] for key in ("quantity", "at_least", "at_most") if key in item},
                "unit": item["unit"],
                **item["reached"]["sheet"],
            }
            for item in found
        ]
    return row


def _rank(row: Mapping[str, Any]) -> tuple[float, float]:
    """Return how bad a design is: the sum of its violations, then its negative gain."""
    if row["items"] is None:
        return UNSTABLE, 0.0
    gain = next(item["value"] for item in row["items"] if item["quantity"] == "gain")
    return sum(item["violation"] for item in row["items"]), -gain


def _short(row: Mapping[str, Any], *of: str) -> dict[str, Any]:
    """Return a summary of an attempt."""
    values = {item["quantity"]: item["value"] for item in row["items"] or ()}
    violation = _rank(row)[0]
    short = {key: row[key] for key in (*of, "design_seconds")}
    return {**short, "violation": violation, "gain": values.get("gain")}
