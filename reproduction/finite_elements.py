"""Finite element analyses of designs as plain records."""

from __future__ import annotations

import importlib.util
from functools import partial
from typing import TYPE_CHECKING, Any

from bellcrank.fem import FemSettings
from bellcrank.workflows import validate

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from bellcrank.model import Design
    from bellcrank.part import PartSpec
    from reproduction.result_store import ResultStore

KEYS = ("status", "reached", "efficiency", "von_mises_MPa", "principal_strain", "theory")
"""Entries of an analysis that are stored unchanged."""


def analyse(design: Design, spec: PartSpec, level: str) -> dict[str, Any]:
    """Return the result of one analysis, and the efficiency along the stroke."""
    found = validate(design, spec, [(level, FemSettings())]).analyses[0].to_dict()
    return {
        **{key: found[key] for key in KEYS},
        "touching": len(found["contacts"]),
        "lost": found["loss_of_stability"],
        "seconds": round(found["cost"]["seconds"], 2),
        "stroke": [[point["load"], point["efficiency"]] for point in found["stroke"]],
    }


def analyse_all(
    store: ResultStore, designs: Mapping[str, Design], spec: PartSpec, levels: Sequence[str]
) -> dict[str, dict[str, Any]]:
    """Analyse designs at several levels.

    Levels that need a missing library are omitted. Designs that snap as frames are not analysed
    at finer levels, where the analysis would be expensive.
    """
    found: dict[str, dict[str, Any]] = {name: {} for name in designs}
    for level in levels:
        if level != "frame" and importlib.util.find_spec("ngsolve") is None:
            continue
        work = {
            name: partial(analyse, design, spec, level)
            for name, design in designs.items()
            if found[name].get("frame", {}).get("status", "converged") == "converged"
        }
        # All threads share one heap of NGSolve.
        workers = None if level == "frame" else 1
        for name, result in store.compute_all(level, work, workers=workers).items():
            found[name][level] = result
    return found
