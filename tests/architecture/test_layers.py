"""Imports point downward, form no circle, and load no slow library before it is needed."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import grimp
import pytest

ROOT = Path(__file__).parents[2]
HELP = """
from contextlib import suppress
from bellcrank.cli import app
import bellcrank.cli.main
with suppress(SystemExit):
    app.app(["--help"], standalone_mode=False)
"""


def imported_by(statement: str) -> set[str]:
    """Top-level modules that a fresh interpreter holds after a statement."""
    code = f"{statement}\nimport sys\nprint(' '.join({{m.split('.')[0] for m in sys.modules}}))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(done.stdout.splitlines()[-1].split())


def test_imports_point_downward_only() -> None:
    command = Path(sys.executable).with_name("lint-imports")
    done = subprocess.run([command], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize("package", ["bellcrank", "reproduction"])
def test_no_modules_import_each_other_in_a_circle(package: str) -> None:
    graph = grimp.build_graph(package)
    imports = {module: graph.find_modules_directly_imported_by(module) for module in graph.modules}
    while leaves := [module for module, others in imports.items() if not others]:
        for leaf in leaves:
            del imports[leaf]
        imports = {module: others & imports.keys() for module, others in imports.items()}
    circles = {module: sorted(others) for module, others in imports.items()}
    assert not circles


def test_importing_the_package_loads_nothing_heavy() -> None:
    loaded = imported_by("import bellcrank")
    assert not loaded & {"numpy", "numba", "scipy", "matplotlib", "pyarrow", "torch", "pydantic"}


@pytest.mark.parametrize(
    "statement",
    [
        "import bellcrank.cli.main",
        "import bellcrank.surrogate.predictor, bellcrank.surrogate.training_setup",
        "from bellcrank.surrogate.dataset import read_dataset",
        HELP,
    ],
    ids=["cli", "surrogate", "dataset", "help"],
)
def test_nothing_loads_pytorch_before_a_network_is_needed(statement: str) -> None:
    assert not imported_by(statement) & {"torch", "onnx", "onnxruntime", "safetensors"}


def test_nothing_loads_a_web_server_before_it_serves() -> None:
    assert not imported_by("import bellcrank.cli.main") & {"fastapi", "starlette", "uvicorn"}


@pytest.mark.parametrize("module", ["bellcrank.cli", "bellcrank.model", "bellcrank.storage"])
def test_light_layers_leave_compiler_and_plotting_alone(module: str) -> None:
    assert not imported_by(f"import {module}") & {"numba", "matplotlib", "scipy", "torch"}
