"""Designs as parts, by finite elements, as plain records."""

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

KEPT = ("status", "reached", "efficiency", "von_mises_MPa", "principal_strain")


def analyse(design: Design, spec: PartSpec, level: str) -> dict[str, Any]:
    """Return what finite elements say of a design as a part, and its way along the stroke."""
    found = validate(design, spec, [(level, FemSettings())]).analyses[0].to_dict()
    told = {key: found[key] for key in KEPT}
    told["theory"] = found["theory"]
    told["touching"] = len(found["contacts"])
    told["lost"] = found["loss_of_stability"]
    told["seconds"] = round(found["cost"]["seconds"], 2)
    told["stroke"] = [[point["load"], point["efficiency"]] for point in found["stroke"]]
    return told


def analyse_all(
    store: ResultStore, designs: Mapping[str, Design], spec: PartSpec, levels: Sequence[str]
) -> dict[str, dict[str, Any]]:
    """Analyse designs at several levels.

    What needs a library that is missing is left out, and so is what snaps as a frame already at
    finer levels, where it would take long to find out.
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
        # NGSolve has one heap for all threads.
        workers = None if level == "frame" else 1
        for name, told in store.compute_all(level, work, workers=workers).items():
            found[name][level] = told
    return found
