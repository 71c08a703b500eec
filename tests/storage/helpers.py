"""Runs whose every value is known beforehand."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bellcrank.storage import COLUMNS, Proposals

if TYPE_CHECKING:
    from pathlib import Path

    from bellcrank.model import Problem
    from bellcrank.storage import RunFolder

SETTINGS = {"steps": 40, "chains": 2, "seed": 3, "objective": None, "hot": 0.06}
SEGMENT = 10


def proposals(problem: Problem, chain: int, first: int, count: int = SEGMENT) -> Proposals:
    """Make proposals that depend on chain and step alone, like those of a real chain."""
    parts = []
    for step in range(first, first + count):
        rng = np.random.default_rng((chain, step))
        mask = problem.initial.copy()
        mask[problem.designable[rng.integers(len(problem.designable))]] ^= True
        efficiency = rng.normal() if step % 7 else np.nan
        parts.append((
            np.packbits(mask), efficiency, np.exp(-efficiency), max(1e-3, 0.06 - 1e-4 * step),
            rng.random() < 0.3, np.int8(rng.integers(-1, 5)),
        ))  # fmt: skip
    return Proposals(*(np.array(column) for column in zip(*parts, strict=True)))


def fill(run: RunFolder, steps: int = 40, chains: int = 2) -> None:
    """Go on with every chain from where its files end, as a search does."""
    for chain in range(chains):
        step, state = run.progress(chain)
        assert state == ({"step": step, "chain": chain} if step else None)
        while step < steps:
            count = min(SEGMENT, steps - step)
            run.append(
                chain, step, proposals(run.problem, chain, step, count),
                {"step": step + count, "chain": chain},
            )  # fmt: skip
            step += count


def assert_holds(run: RunFolder, steps: int = 40, chains: int = 2) -> None:
    """Check every value of every row: nothing lost, nothing doubled, nothing changed."""
    assert run.chains == list(range(chains))
    for chain in range(chains):
        expected = proposals(run.problem, chain, 0, steps)
        found = run.read(chain)
        assert list(found) == list(COLUMNS)
        np.testing.assert_array_equal(found["step"], np.arange(steps))
        for name, column in expected._asdict().items():
            np.testing.assert_array_equal(found[name], column)
            assert found[name].dtype == column.dtype


def files(folder: Path) -> dict[str, bytes]:
    """All files under a folder, hidden ones included, with their content."""
    paths = [path for path in sorted(folder.rglob("*")) if path.is_file()]
    return {str(path.relative_to(folder)): path.read_bytes() for path in paths}
