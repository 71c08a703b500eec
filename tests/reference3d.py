"""Frame problems of the folder ``shared/reference3d`` beside the repository.

An independent code computed the responses; see the README there. Tests skip where the folder is
missing.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from bellcrank.model import Problem, problem_from_dict

FOLDER = Path(__file__).parents[2] / "shared" / "reference3d"
NAMES = (
    "cubic-bcc",
    "cubic-bcc-force",
    "octet-crane",
    "octet-twist",
    "planar-crane",
    "star-dome",
)
SAME_KEYS = ("name", "positions", "beams", "input", "output", "section", "material")


def read_reference(name: str) -> tuple[Problem, dict[str, Any]]:
    """Return a problem and the content of its file, with ``results``; skip if it is missing.

    The file lists supports as nodes. Efficiencies of forces against springs are ratios of sums. A
    planar file has a third coordinate of zero, which is left out here.
    """
    path = FOLDER / f"{name}.json"
    if not path.is_file():
        pytest.skip(f"the shared reference problems are not at {FOLDER}")
    data = json.loads(path.read_text())
    content = {key: data[key] for key in SAME_KEYS}
    content |= {"schema": "bellcrank/problem/1", "supports": {"fixed": data["supports"]}}
    if "spring" in data["output"]:
        content["aggregate"] = "sum"
    if data.get("planar"):
        content["positions"] = [position[:2] for position in data["positions"]]
        for region in ("input", "output"):
            content[region] = data[region] | {"direction": data[region]["direction"][:2]}
    return problem_from_dict(content, path.name), data
