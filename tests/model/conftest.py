"""What several tests of the model share."""

from __future__ import annotations

import copy
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable

SHARED_REFERENCE = Path(__file__).parents[3] / "shared" / "reference"

GRIPPER = """
schema = "bellcrank/problem/1"
name = "my-gripper"

[lattice]
kind = "triangular-rows"
counts = [5, 6, 5, 6, 5, 6]
first_x = [0.5, 0.0, 0.5, 0.0, 0.5, 0.0]

[supports]
fixed = [{ row = 0 }]

[input]
nodes = [{ row = -1, rightmost = 2 }, { row = -2, rightmost = 1 }]
direction = [0, -1]
drive = "displacement"
amount = 0.433

[output]
nodes = [{ box = [-0.1, 4.0, 1.1, 5.0] }]
direction = [-1, 0]
"""

SMALL = {
    "schema": "bellcrank/problem/1",
    "name": "small",
    "positions": [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [0.0, 2.0], [1.0, 2.0]],
    "beams": [[0, 1], [0, 2], [1, 3], [2, 3], [1, 2], [2, 4], [3, 5], [4, 5]],
    "initial": "ff",
    "designable": [3, 4, 5, 6],
    "stiffness": {"bond": 5.0, "angle": 0.1},
    "supports": {"fixed": [0], "fixed_x": [], "fixed_y": [1]},
    "input": {"nodes": [5], "direction": [0.0, -1.0], "drive": "displacement", "amount": 0.1},
    "output": {"nodes": [4], "direction": [-1.0, 0.0], "spring": None, "spring_kind": None},
    "aggregate": "mean",
}


@pytest.fixture
def small() -> dict[str, Any]:
    """A problem of six nodes and eight beams, as the content of its file."""
    return copy.deepcopy(SMALL)


SPACE = {
    "schema": "bellcrank/problem/1",
    "name": "small-space",
    "positions": [
        [0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0],
        [0.0, 0.0, 2.0], [1.0, 0.0, 2.0], [0.0, 1.0, 2.0],
    ],
    "beams": [
        [0, 3], [1, 4], [2, 5], [3, 4], [4, 5], [5, 3], [0, 4], [1, 5], [2, 3],
        [3, 6], [4, 7], [5, 8], [6, 7], [7, 8], [8, 6], [3, 7], [4, 8], [5, 6],
    ],
    "initial": "ffffc0",
    "designable": [3, 4, 5, 12, 13],
    "stiffness": {"bond": 5.0, "angle": 0.1},
    "supports": {"fixed": [0], "fixed_x": [1], "fixed_y": [1, 2], "fixed_z": [2]},
    "input": {"nodes": [6], "direction": [0.0, 0.0, -1.0], "drive": "displacement", "amount": 0.1},
    "output": {
        "nodes": [7, 8],
        "direction": [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0]],
        "spring": None,
        "spring_kind": None,
    },
    "aggregate": "mean",
    "section": {"shape": "round", "diameter": 0.2},
    "material": {"young": 1.0, "poisson": 0.48},
}  # fmt: skip


@pytest.fixture
def space() -> dict[str, Any]:
    """A frame problem in space of nine nodes and 18 beams, as the content of its file."""
    return copy.deepcopy(SPACE)


@pytest.fixture
def reference() -> Path:
    """The folder of reference problems that lies beside the repository."""
    if not SHARED_REFERENCE.is_dir():
        pytest.skip(f"the shared reference problems are not at {SHARED_REFERENCE}")
    return SHARED_REFERENCE


@pytest.fixture
def gripper() -> str:
    """A problem as people write it, in TOML."""
    return GRIPPER


@pytest.fixture
def write(tmp_path: Path) -> Callable[..., Path]:
    """Write text, or anything that JSON can hold, to a file."""

    def write_file(content: Any, name: str = "problem.json") -> Path:
        path = tmp_path / name
        path.write_text(content if isinstance(content, str) else json.dumps(content))
        return path

    return write_file
