"""Topology-optimised designs of a box with several settings."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from reproduction.outline_analysis import contour_of
from reproduction.topology import optimise

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

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
    rank: Callable[[Mapping[str, Any]], Any],
    off_axis: float | None = None,
) -> list[tuple[Row, Polygon | None]]:
    """Return topology-optimised designs of a volume: their settings and scores, and outlines.

    All springs are tried with the first filter, then the other filters with the best springs.

    Parameters
    ----------
    name
        Prefix of the stored results.
    score
        Function of an outline; None if input, output and support are not connected.
    rank
        Function of a score, smaller for better designs.
    off_axis
        As in `optimise`.
    """
    area = volume * float(np.prod(box.high - box.low))
    tried: list[tuple[Row, Polygon | None]] = []

    def attempt(springs: tuple[float, float], radius: float) -> None:
        key = f"{springs[0]:g}-{springs[1]:g}-{radius:g}"
        work = partial(
            optimise, box, settings.element, volume, springs, radius, settings.iterations, off_axis
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
        store.progress(f"{name}-rival", len(tried), len(settings.springs) + len(settings.radii) - 1)

    for springs in settings.springs:
        attempt(springs, settings.radii[0])
    good = min(tried, key=lambda each: rank(each[0]))[0]["springs"]
    for radius in settings.radii[1:]:
        attempt((good[0], good[1]), radius)
    return tried
