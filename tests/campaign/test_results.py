"""What a campaign leads to: one clean design for each task."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pyarrow.parquet as pq
import pytest

from bellcrank.campaign import Store, work, write_results
from bellcrank.errors import InvalidSettings, OutputExists
from bellcrank.mechanics import VERIFICATION_INCREMENT, SpringEvaluator, Status
from bellcrank.model import Design, read_design
from bellcrank.search import clean, pieces, plateau_ends

if TYPE_CHECKING:
    from pathlib import Path

    from bellcrank.campaign import Spec


def test_each_task_gives_its_best_design_cleaned_and_checked(
    tmp_path: Path, finished: Path
) -> None:
    store = Store.open(finished)
    found = write_results(store, tmp_path / "designs")
    assert [entry.task for entry in found] == ["scaling-8-paper", "large"]
    for entry in found:
        design = read_design(entry.path)
        response = SpringEvaluator(design.problem).evaluate(design.mask, VERIFICATION_INCREMENT)
        assert response.status is Status.CONVERGED
        assert response.efficiency == pytest.approx(design.efficiency, abs=1e-9)
        assert pieces(design.problem, design.mask) == 1
        assert np.array_equal(clean(design, SpringEvaluator(design.problem)).mask, design.mask)
        assert design.provenance["settings"]["seed"] == entry.seed


def test_the_design_is_the_best_that_the_runs_offer(tmp_path: Path, finished: Path) -> None:
    entry = write_results(Store.open(finished), tmp_path, "scaling-8-paper")[0]
    problem = entry.design.problem
    rows = pq.read_table(finished / "proposals").to_pandas()
    rows = rows[(rows["task"] == entry.task) & rows["accepted"] & (rows["status"] == 0)]
    evaluator = SpringEvaluator(problem)
    best = -np.inf
    for _, run in rows.sort_values(["seed", "step"]).groupby("seed"):
        for index in plateau_ends(run["efficiency"].to_numpy(), np.empty((0, 0), np.uint8)):
            bits = np.unpackbits(np.frombuffer(run["mask"].iloc[index], np.uint8))
            mask = bits[: problem.lattice.beam_count].astype(bool)
            cleaned = clean(Design(problem, mask), evaluator)
            response = evaluator.evaluate(cleaned.mask, VERIFICATION_INCREMENT)
            if response.status is Status.CONVERGED and pieces(problem, cleaned.mask) == 1:
                best = max(best, response.efficiency)
    assert entry.design.efficiency == pytest.approx(best, abs=1e-9)


def test_segments_and_table_give_the_same_designs(
    tmp_path: Path, finished: Path, tabled: Path
) -> None:
    one, two = (
        write_results(Store.open(folder), tmp_path / folder.parent.name)
        for folder in (finished, tabled)
    )
    for a, b in zip(one, two, strict=True):
        assert (a.task, a.seed, a.step) == (b.task, b.seed, b.step)
        assert np.array_equal(a.design.mask, b.design.mask)


def test_a_campaign_under_way_gives_what_it_has(tmp_path: Path, spec: Spec) -> None:
    store = Store.create(tmp_path / "store", spec)
    with pytest.raises(InvalidSettings, match="task 'large': no accepted design is stored yet"):
        write_results(store, tmp_path / "designs", "large")
    work(str(store.path), 1)
    assert [entry.seed for entry in write_results(store, tmp_path, "scaling-8-paper")] == [1]


def test_files_that_are_there_are_kept_unless_told_otherwise(
    tmp_path: Path, finished: Path
) -> None:
    store = Store.open(finished)
    (tmp_path / "large.json").write_text("mine")
    with pytest.raises(OutputExists, match=r"large\.json"):
        write_results(store, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["large.json"]
    write_results(store, tmp_path, overwrite=True)
    assert read_design(tmp_path / "large.json").efficiency is not None
    with pytest.raises(InvalidSettings, match="no task 'lerge' in this campaign; it has: scaling"):
        write_results(store, tmp_path, "lerge")
