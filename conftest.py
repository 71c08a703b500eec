"""How the tests are spread over processors."""

import os

import pytest

MOST_WORKERS = 8
"""Each compiles the kernels when they are new, and takes about a gigabyte."""


def pytest_xdist_auto_num_workers(config: pytest.Config) -> int:
    """Share out a run of all tests; what is named on the command line runs at once, in one."""
    if config.args_source is not pytest.Config.ArgsSource.TESTPATHS:
        return 0
    return min(os.cpu_count() or 1, MOST_WORKERS)
