"""Collection of the tests, and their distribution over processors."""

import os
from importlib.util import find_spec

import pytest

MOST_WORKERS = 8
"""Each worker compiles the kernels when they are new, and uses about a gigabyte."""
PACKAGES = {
    "fastapi": [
        "src/bellcrank/web/app.py",
        "src/bellcrank/web/design_routes.py",
        "src/bellcrank/web/run_routes.py",
        "src/bellcrank/web/state.py",
        "src/bellcrank/web/task_routes.py",
        "tests/browser",
        "tests/web",
    ],
    "hatchling": ["tests/release"],
    "ngsolve": ["tests/fem/calculix.py", "tests/fem/nodes.py"],
    "pymoto": ["tests/reproduction/test_rivals.py"],
    "skfem": ["tests/fem/skfem_check.py"],
    "torch": [
        "reproduction/networks",
        "src/bellcrank/surrogate",
        "tests/cli/test_explain.py",
        "tests/cli/test_surrogate_search.py",
        "tests/cli/test_train.py",
        "tests/reproduction/test_attribution.py",
        "tests/reproduction/test_surrogate_search.py",
        "tests/surrogate",
    ],
}
"""Packages of the extra test-all, with the files that import them."""

collect_ignore = [
    file for package, files in PACKAGES.items() if find_spec(package) is None for file in files
]


def pytest_xdist_auto_num_workers(config: pytest.Config) -> int:
    """Use all processors for a run of all tests, and one process for tests that are named."""
    if config.args_source is not pytest.Config.ArgsSource.TESTPATHS:
        return 0
    return min(os.cpu_count() or 1, MOST_WORKERS)
