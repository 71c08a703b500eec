"""What several tests of runs share."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from bellcrank.model import Problem, find_problem
from bellcrank.storage import RunFolder

from .helpers import SETTINGS

if TYPE_CHECKING:
    from pathlib import Path


@pytest.fixture(scope="session")
def problem() -> Problem:
    return find_problem("scaling-8")


@pytest.fixture
def run(tmp_path: Path, problem: Problem) -> RunFolder:
    return RunFolder.create(tmp_path / "run", problem, SETTINGS)
