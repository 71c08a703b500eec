"""Names and descriptions of registered entries, from which the page builds its choices."""

from __future__ import annotations

from functools import cache
from typing import Any

from bellcrank.fem import levels
from bellcrank.fem.results import finite
from bellcrank.part import materials
from bellcrank.search import DEFAULT_SEARCH, searches
from bellcrank.task.schema import ToleranceSection
from bellcrank.task.space import CELLS
from bellcrank.web.page_files import page_files

MATERIAL_TITLES = {"ninjaflex": "NinjaFlex"}
"""Display names of materials that are no abbreviations."""

CELL_TITLES = {
    "octet": "octet: stiff, 12 struts at a node",
    "cubic": "cubic with diagonals: nodes in vertical lines",
    "body-centred": "body centred: soft, 8 struts at a node",
    "kelvin": "kelvin: open, 4 struts at a node",
    "displaced-delaunay-space": "irregular nodes",
}
"""Display names of lattices in space."""


@cache
def registered() -> dict[str, list[dict[str, Any]]]:
    """Return searches, materials, file formats, levels and lattices in space as plain data.

    ``tolerance`` has the usual deviations, for the fields of a task that are empty. The strain
    limit of a material is None if it is not known. The default search comes first; the other
    entries are in the order of registration. Each entry has ``name`` and ``title``.
    """
    usual = ToleranceSection()
    methods = sorted(searches, key=lambda name: name != DEFAULT_SEARCH)
    return {
        "tolerance": [
            {"name": name, "title": text}
            for name, text in (
                ("width", f"{usual.width:.0%}"),
                ("each_width", f"{usual.each_width:.0%}"),
                ("node", f"{usual.node:g} mm"),
                ("angle", f"{usual.angle:g} degrees"),
                ("least_yield", f"{usual.least_yield:.0%}"),
            )
        ],
        "cells": [{"name": name, "title": CELL_TITLES[name]} for name in CELLS],
        "searches": [
            {
                "name": name,
                "title": searches[name].title or name,
                "summary": searches[name].summary,
                "running_best": searches[name].plot_running_best,
            }
            for name in methods
        ],
        "materials": [
            {
                "name": name,
                "title": MATERIAL_TITLES.get(name, name.replace("-", " ").upper()),
                "young": material.young,
                "poisson": material.poisson,
                "strain_limit": finite(material.strain_limit),
            }
            for name, material in materials.items()
        ],
        "files": [
            {
                "name": name,
                "title": entry.title,
                "purpose": entry.purpose,
                "in_space": entry.in_space,
            }
            for name, entry in page_files.items()
        ],
        "levels": [
            {
                "name": name,
                "title": level.title or name,
                "duration": level.duration,
                "missing": level.missing() or "",
                "in_space": level.in_space,
            }
            for name, level in levels.items()
        ],
    }
