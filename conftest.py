"""Distribution of the tests over processors."""

import os

import pytest

MOST_WORKERS = 8
"""Each worker compiles the kernels when they are new, and uses about a gigabyte."""


def pytest_xdist_auto_num_workers(config: pytest.Config) -> int:
    """Use all processors for a run of all tests, and one process for tests that are named."""
    if config.args_source is not pytest.Config.ArgsSource.TESTPATHS:
        return 0
    return min(os.cpu_count() or 1, MOST_WORKERS)
