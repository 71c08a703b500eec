"""Topology-optimised designs of a box with several settings."""

from __future__ import annotations

from functools import partial
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from reproduction.outline_analysis import contour_of
from reproduction.topology import optimise

if TYPE_CHECKING:
    from collections.abc import Callable

    from shapely import Polygon

    from reproduction.boxes import Box
    from reproduction.result_store import ResultStore
    from reproduction.rivals_settings import Settings

    Row = dict[str, Any]


def rival_designs(
    box: Box,
    name: str,
    volume: float,
    settings: Settings,
    store: ResultStore,
    score: Callable[[Polygon | None], Row],
    off_axis: float | None = None,
) -> list[tuple[Row, Polygon | None]]:
    """Return topology-optimised designs of a volume: their settings and scores, and outlines.

    Parameters
    ----------
    name
        Prefix of the stored results.
    score
        Function of an outline; None if input, output and support are not connected.
    off_axis
        As in `optimise`.
    """
    area = volume * float(np.prod(box.high - box.low))
    attempts = tuple(product(settings.radii, settings.springs))
    tried: list[tuple[Row, Polygon | None]] = []
    for radius, springs in attempts:
        key = f"{springs[0]:g}-{springs[1]:g}-{radius:g}"
        work = partial(
            optimise, box, settings.elements, volume, springs, radius, settings.iterations, off_axis
        )
        made = store.compute(f"{name}-rival-{key}", work)
        shape = contour_of(box, np.array(made["density"]), area)
        row = {
            "springs": list(springs),
            "radius": radius,
            "model": made["output_over_input"],
            "design_seconds": made["seconds"],
            **store.compute(f"{name}-rival-judged-{key}", partial(score, shape)),
        }
        tried.append((row, shape))
        store.progress(f"{name}-rival", len(tried), len(attempts))
    return tried
