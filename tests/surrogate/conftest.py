"""What several tests of the surrogate share."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
import torch

from bellcrank.campaign.dataset import DatasetSpec, build_dataset
from bellcrank.model import Problem, find_problem

from .helpers import random_dataset

if TYPE_CHECKING:
    from collections.abc import Iterator

    from bellcrank.surrogate.dataset import Dataset

SHARED_REFERENCE = Path(__file__).parents[3] / "shared" / "reference"


@pytest.fixture(scope="session", autouse=True)
def one_thread() -> Iterator[None]:
    """Keep small networks from waiting for each other's threads."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


@pytest.fixture(scope="session")
def problem() -> Problem:
    return find_problem("scaling-8")


@pytest.fixture(scope="session")
def crane() -> Problem:
    return find_problem("crane")


@pytest.fixture(scope="session")
def data(problem: Problem) -> Dataset:
    """Random designs of eight runs, labelled with how many beams they have."""
    return random_dataset(problem)


@pytest.fixture(scope="session")
def spec(problem: Problem) -> DatasetSpec:
    return DatasetSpec(problem=problem, runs=4, steps=300, seed=3)


@pytest.fixture(scope="session")
def built(tmp_path_factory: pytest.TempPathFactory, spec: DatasetSpec) -> Path:
    """The folder of a dataset made by the mechanics. Not to be changed."""
    folder = tmp_path_factory.mktemp("built") / "data"
    made = build_dataset(spec, folder, engine="serial")
    assert made is not None
    return folder


@pytest.fixture
def reference() -> Path:
    """The folder of reference problems that lies beside the repository."""
    if not SHARED_REFERENCE.is_dir():
        pytest.skip(f"the shared reference problems are not at {SHARED_REFERENCE}")
    return SHARED_REFERENCE


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(11)
