"""What the records of long trainings and searches by networks say, where a checkout has them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping

RECORDS = Path(__file__).parents[3] / "docs" / "surrogate"
"""Of longer trainings and searches, in a checkout; a wheel has none."""


def longer_jobs() -> dict[str, Any]:
    """Return what the records of longer jobs say, where there are any."""
    found: dict[str, Any] = {}
    for name, read in (("resnet50", _resnet50), ("driven", _driven), ("costs", _costs)):
        path = RECORDS / f"{name}.json"
        if path.is_file():
            told = json.loads(path.read_text(encoding="utf-8"))
            found[name] = {**read(told), "commit": told["provenance"]["commit"]}
    return found


def _resnet50(told: Mapping[str, Any]) -> dict[str, Any]:
    return {
        "designs": told["data"]["designs"],
        "looks": told["designs"],
        "r_squared": told["held_out"]["r_squared"],
        "epochs": [
            {"designs": each["designs"], "r_squared": each["r_squared"]} for each in told["epochs"]
        ],
    }


def _driven(told: Mapping[str, Any]) -> dict[str, Any]:
    final = [each for each in told["by_network"] if each["offer"] == "final"]
    mechanics = [each for each in told["by_mechanics"] if each["offer"] == "final"]
    return {
        "chains": told["settings"]["chains"],
        "distance": told["medians"]["final"]["distance"],
        "distances": [each["distance"] for each in final],
        "median_network": told["medians"]["final"]["network"],
        "median_mechanics": told["medians"]["final"]["mechanics"],
        "mechanics": [each["efficiency"] for each in mechanics],
        "network": [each["efficiency"] for each in final],
    }


def _costs(told: Mapping[str, Any]) -> dict[str, Any]:
    rows = {(row["what"], row["where"], row["batch"]): row["microseconds"] for row in told["costs"]}
    core = "one core"
    return {
        "fire": rows["`fire` response", core, 1],
        "newton": rows["Newton response (default)", core, 1],
        "resnet18": min(
            value for (what, where, _), value in rows.items()
            if where == core and what.startswith("resnet18-w16")
        ),
        "resnet50": min(
            (value for (what, where, _), value in rows.items()
             if where == core and what.startswith("resnet50")), default=None
        ),
    }  # fmt: skip
