"""Topology-optimised designs of a box with several settings, by each package."""

from __future__ import annotations

from functools import partial
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from reproduction import topology, topoptlab_peer
from reproduction.outline_analysis import contour_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from shapely import Polygon

    from reproduction.boxes import Box
    from reproduction.result_store import ResultStore
    from reproduction.rivals_settings import Settings

    Row = dict[str, Any]

PACKAGES: dict[str, Callable[..., Row]] = {
    "pyMOTO": topology.optimise,
    "topoptlab": topoptlab_peer.optimise,
}
"""Function that returns the densities of a box, by package."""


def packages() -> tuple[str, ...]:
    """Return the packages that take part: topoptlab only if its interpreter is given.

    Raises
    ------
    InvalidSettings
        If pyMOTO is not installed, or the given interpreter has no topoptlab.
    """
    topology.pymoto()
    return ("pyMOTO", "topoptlab") if topoptlab_peer.interpreter() else ("pyMOTO",)


def rival_designs(
    package: str,
    box: Box,
    name: str,
    volume: float,
    settings: Settings,
    store: ResultStore,
    score: Callable[[Polygon | None], Row],
    **more: Any,
) -> list[tuple[Row, Polygon | None]]:
    """Return topology-optimised designs of a volume: their settings and scores, and outlines.

    Parameters
    ----------
    package
        One of `PACKAGES`.
    name
        Prefix of the stored results.
    score
        Function of an outline; None if input, output and support are not connected.
    **more
        Further arguments of the function of the package.
    """
    area = volume * float(np.prod(box.high - box.low))
    attempts = tuple(product(settings.radii, settings.springs))
    tried: list[tuple[Row, Polygon | None]] = []
    for radius, springs in attempts:
        key = f"{package}-{springs[0]:g}-{springs[1]:g}-{radius:g}"
        work = partial(
            PACKAGES[package],
            box,
            settings.elements,
            volume,
            springs,
            radius,
            settings.iterations,
            **more,
        )
        made = store.compute(f"{name}-{key}", work)
        shape = contour_of(box, np.array(made["density"]), area)
        row = {
            "springs": list(springs),
            "radius": radius,
            "design_seconds": made["seconds"],
            **store.compute(f"{name}-judged-{key}", partial(score, shape)),
        }
        tried.append((row, shape))
        store.progress(f"{name}-{package}", len(tried), len(attempts))
    return tried
