"""The store holds each row once, in the same bytes, whoever wrote it and however often."""

from __future__ import annotations

import itertools
import shutil
import threading
from typing import TYPE_CHECKING

import numpy as np
import pyarrow.parquet as pq
import pytest

from bellcrank.campaign import StatusReader, Store, best_designs, complete, verify, work
from bellcrank.campaign.compaction import compact, expand, read_parts
from bellcrank.errors import CorruptRun, InvalidSettings
from bellcrank.mechanics import SpringEvaluator
from bellcrank.model import find_problem, unpack_mask
from bellcrank.search import chain_blocks, make_evaluator, read_settings
from bellcrank.storage import Proposals

from .helpers import ROWS, RUNS, SEGMENTS, Killed, content, everything, killed_at

if TYPE_CHECKING:
    from pathlib import Path

    from bellcrank.campaign import Spec


def test_the_store_holds_what_the_search_proposes(finished: Path, spec: Spec) -> None:
    run = spec.run(1)
    settings = read_settings(run.settings)
    evaluator = make_evaluator(find_problem("scaling-8"), settings)
    blocks = [proposals for _, proposals in chain_blocks(evaluator, settings, 0)]
    expected = Proposals(*(np.concatenate(column) for column in zip(*blocks, strict=True)))
    found = pq.read_table(finished / "proposals", filters=[("run", "=", run.id)])
    assert found.column("step").to_pylist() == list(range(600))
    for name in ("efficiency", "cost", "temperature", "accepted", "status"):
        np.testing.assert_array_equal(found.column(name).to_numpy(), getattr(expected, name))
    width = expected.mask.shape[1]
    masks = [mask[:width] for mask in found.column("mask").to_pylist()]
    assert masks == [mask.tobytes() for mask in expected.mask]
    assert not any(any(mask[width:]) for mask in found.column("mask").to_pylist())


def test_segments_end_at_fixed_steps(finished: Path) -> None:
    names = [name.split("/")[1] for name in content(finished)]
    assert len(names) == SEGMENTS
    assert set(names) == {"00000000.parquet", "00000250.parquet", "00000500.parquet"}


def test_a_run_done_twice_changes_nothing(segments: Store) -> None:
    before = everything(segments.path)
    assert work(str(segments.path), 0) == segments.spec.run(0).id
    assert everything(segments.path) == before


def test_two_writers_at_the_same_run_leave_the_same_bytes(
    tmp_path: Path, spec: Spec, finished: Path
) -> None:
    store = Store.create(tmp_path / "store", spec)
    threads = [
        threading.Thread(target=work, args=(str(store.path), number))
        for number in (0, 0, 1, 1, 2, 3)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert everything(store.path) == everything(finished)


def test_an_unequal_second_result_is_an_error(segments: Store) -> None:
    run = segments.spec.run(0)
    rows = Proposals(
        np.zeros((250, run.task.mask_bytes), np.uint8), *(np.zeros(250) for _ in range(3)),
        np.zeros(250, np.bool_), np.zeros(250, np.int8),
    )  # fmt: skip
    before = everything(segments.path)
    with pytest.raises(CorruptRun, match=r"00000000\.parquet: exists with another content"):
        segments.append(run, 0, rows, {}, best=0.0, done=False)
    assert everything(segments.path) == before


def test_compaction_keeps_every_row_in_order_and_expansion_undoes_it(
    segments: Store, finished: Path
) -> None:
    order = [("task", "descending"), ("seed", "ascending"), ("step", "ascending")]
    rows = pq.read_table(finished / "proposals").sort_by(order)
    compact(segments)
    assert list(content(segments.path)) == ["part-00000.parquet"]
    assert pq.read_table(segments.path / "proposals").equals(rows)
    expand(segments, read_parts(segments))
    assert everything(segments.path) == everything(finished)


@pytest.mark.slow
def test_a_campaign_killed_before_any_call_to_the_system_ends_the_same(
    tmp_path: Path, spec: Spec, tabled: Path
) -> None:
    expected = everything(tabled)
    seen: set[str] = set()
    for instant in itertools.count(5, 7):
        folder = tmp_path / str(instant)
        try:
            with killed_at(instant) as calls:
                whole_story(folder, spec)
        except Killed:
            seen.add(calls[instant])
        else:
            break
        if (folder / "proposals").exists() and content(folder):
            read = pq.read_table(folder / "proposals", columns=["run", "step"])
            pairs = list(zip(*read.to_pydict().values(), strict=True))
            assert len(pairs) == len(set(pairs))
        whole_story(folder, spec)
        assert everything(folder) == expected
        shutil.rmtree(folder)
    assert instant > 100
    assert {"fsync", "link", "unlink"} <= seen


def whole_story(folder: Path, spec: Spec) -> None:
    """Begin or go on, to the end, in this thread."""
    store = Store.create(folder, spec)
    if not store.compacted:
        for run in spec.runs():
            work(str(folder), run.number)
    compact(store)


@pytest.mark.parametrize("where", ["finished", "tabled"])
def test_status_counts_what_is_there(where: str, request: pytest.FixtureRequest) -> None:
    store = Store.open(request.getfixturevalue(where))
    watcher = StatusReader(store)
    status = watcher.read()
    assert status.done
    assert (status.runs, status.runs_done) == (RUNS, RUNS)
    assert (status.steps, status.steps_done) == (ROWS, ROWS)
    assert status.compacted == (where == "tabled")
    assert watcher.pending() == []
    table = pq.read_table(store.path / "proposals")
    for task in status.tasks:
        rows = [r for r in table.to_pylist() if r["task"] == task.name and r["accepted"]]
        best = max(rows, key=lambda row: row["efficiency"])
        assert (task.best, task.best_seed) == (best["efficiency"], best["seed"])


def test_a_watcher_sees_segments_come_and_the_table_replace_them(
    tmp_path: Path, spec: Spec
) -> None:
    store = Store.create(tmp_path / "store", spec)
    watcher = StatusReader(store)
    assert watcher.read().steps_done == 0
    work(str(store.path), 2)
    assert watcher.read().steps_done == 600
    assert [run.number for run in watcher.pending()] == [0, 1, 3]
    complete(store, "serial")
    assert watcher.read().compacted
    assert watcher.read().done


@pytest.mark.parametrize("where", ["finished", "tabled"])
@pytest.mark.parametrize("task", [None, "scaling-8-paper", "large"])
def test_the_ranking_is_that_of_a_full_sort(
    where: str, task: str | None, request: pytest.FixtureRequest
) -> None:
    store = Store.open(request.getfixturevalue(where))
    rows = pq.read_table(store.path / "proposals").to_pylist()
    best: dict[tuple[str, bytes], float] = {}
    for row in rows:
        if row["status"] == 0 and task in (None, row["task"]):
            key = (row["task"], row["mask"])
            best[key] = max(best.get(key, -np.inf), row["efficiency"])
    for count in (1, 40, 10_000):
        found = best_designs(store, count, task)
        assert [d.efficiency for d in found] == sorted(best.values(), reverse=True)[:count]
        assert len({(d.task, d.mask) for d in found}) == len(found)


def test_a_ranked_design_has_the_efficiency_it_is_ranked_by(tabled: Path) -> None:
    best = best_designs(Store.open(tabled), 1, "large")[0]
    problem = find_problem("crane")
    mask = unpack_mask(best.mask, problem.lattice.beam_count)
    response = SpringEvaluator(problem, unloaded_beams="keep").evaluate(mask)
    assert response.efficiency == pytest.approx(best.efficiency, abs=1e-8)


def test_a_ranking_of_an_unknown_task_is_refused(tabled: Path) -> None:
    with pytest.raises(InvalidSettings, match="no task 'lerge' in this campaign; it has: scaling"):
        best_designs(Store.open(tabled), 3, "lerge")


@pytest.mark.parametrize("where", ["finished", "tabled"])
def test_a_whole_store_verifies(where: str, request: pytest.FixtureRequest) -> None:
    found = verify(Store.open(request.getfixturevalue(where)))
    assert found.damage == []
    assert found.rows == ROWS
    assert found.files == (SEGMENTS if where == "finished" else 1)


def test_a_run_can_be_computed_after_the_serial_engine_has_ended(segments: Store) -> None:
    assert complete(segments, "serial", compacting=False)
    last = segments.folder_of(segments.spec.run(0)) / "00000500.parquet"
    before = last.read_bytes()
    last.unlink()
    work(str(segments.path), 0)
    assert last.read_bytes() == before
