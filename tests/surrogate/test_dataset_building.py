"""A dataset is all that a campaign proposed, both ways, whatever interrupts its making."""

from __future__ import annotations

import shutil
import threading
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from bellcrank.campaign import Store
from bellcrank.campaign import dataset as building
from bellcrank.campaign.dataset import CAMPAIGN, DatasetSpec, build_dataset, gather
from bellcrank.errors import InvalidSettings, OutputExists, StorageError
from bellcrank.mechanics import SpringEvaluator, Status
from bellcrank.model import find_problem
from bellcrank.surrogate.dataset import DATASET_FILE, read_dataset

from .helpers import equal

if TYPE_CHECKING:
    from pathlib import Path

    from bellcrank.model import Problem


def test_all_proposals_of_all_runs_are_there_with_the_efficiency_that_the_mechanics_gives(
    built: Path, problem: Problem
) -> None:
    data = read_dataset(built)
    assert data.run_count == 4
    assert len(data) + data.origin["left_out"] == 1200
    assert (~data.accepted).any()
    evaluator = SpringEvaluator(problem)
    masks = np.unpackbits(data.packed, axis=1, count=problem.lattice.beam_count).astype(bool)
    for row in range(0, len(data), 97):
        response = evaluator.evaluate(masks[row])
        assert response.status is Status.CONVERGED
        assert data.efficiency[row] == pytest.approx(response.efficiency, abs=1e-8)


def test_half_of_the_runs_go_for_the_most_negative_efficiency(built: Path) -> None:
    data = read_dataset(built)
    start = data.efficiency[data.step == 0].mean()
    late = [data.efficiency[(data.run == run) & (data.step > 200)].mean() for run in range(4)]
    assert min(late[:2]) > start > max(late[2:])


def test_a_second_call_leaves_the_same_bytes_and_mends_a_damaged_file(
    built: Path, spec: DatasetSpec, tmp_path: Path
) -> None:
    folder = shutil.copytree(built, tmp_path / "again", symlinks=True)
    file = folder / DATASET_FILE
    whole = file.read_bytes()
    build_dataset(spec, folder, engine="serial")
    assert file.read_bytes() == whole
    file.write_bytes(whole[:-50])
    build_dataset(spec, folder, engine="serial")
    assert file.read_bytes() == whole


@pytest.mark.parametrize("looks", [1, 2])
def test_a_build_that_was_stopped_goes_on_to_the_same_dataset(
    built: Path, spec: DatasetSpec, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, looks: int
) -> None:
    monkeypatch.setattr("bellcrank.campaign.completion.STATUS_INTERVAL", 0.0)
    stop, seen = threading.Event(), []

    def tell(status: object) -> None:
        seen.append(status)
        if len(seen) > looks:
            stop.set()

    folder = tmp_path / "stopped"
    assert build_dataset(spec, folder, engine="serial", report=tell, stop=stop) is None
    assert not (folder / DATASET_FILE).exists()
    resumed = build_dataset(spec, folder, engine="serial")
    whole = read_dataset(built)
    assert resumed is not None
    assert equal(replace(resumed, origin={}), replace(whole, origin={}))


def test_rows_come_in_the_same_order_from_segments_and_from_the_table(
    spec: DatasetSpec, built: Path, tmp_path: Path, problem: Problem, monkeypatch: Any
) -> None:
    monkeypatch.setattr("bellcrank.campaign.completion.compact", lambda _store: None)
    folder = tmp_path / "segments"
    loose = build_dataset(spec, folder, engine="serial")
    store = Store.open(folder / CAMPAIGN)
    assert not store.compacted
    assert loose is not None
    tabled = gather(Store.open(built / CAMPAIGN), problem)
    assert equal(replace(loose, origin={}), replace(tabled, origin={}))


def test_designs_without_a_unique_response_are_left_out_and_counted(
    built: Path, problem: Problem, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = building._tables

    def with_trouble(store: Store) -> Any:
        for number, part in enumerate(real(store)):
            part["status"] = part["status"].copy()
            if number == 0:
                part["status"][[3, 5]] = [int(Status.SNAPPED), int(Status.MECHANISM)]
            yield part

    whole = gather(Store.open(built / CAMPAIGN), problem)
    monkeypatch.setattr(building, "_tables", with_trouble)
    data = gather(Store.open(built / CAMPAIGN), problem)
    assert data.origin["left_out"] == whole.origin["left_out"] + 2
    assert np.array_equal(data.efficiency, np.delete(whole.efficiency, [3, 5]))
    gone = set(whole.step[:10].tolist()) - set(data.step[:8].tolist())
    assert gone == {3, 5}


def test_a_sample_has_every_nth_proposal_of_each_run(
    built: Path, spec: DatasetSpec, tmp_path: Path
) -> None:
    folder = shutil.copytree(built, tmp_path / "sample", symlinks=True)
    sample = build_dataset(replace(spec, every=7), folder, engine="serial")
    assert sample is not None
    whole = read_dataset(built)
    assert equal(replace(sample, origin={}), replace(whole.take(whole.step % 7 == 0), origin={}))
    assert sample.origin["every"] == 7
    assert len(sample) + sample.origin["left_out"] == 4 * 43  # steps 0, 7, ..., 294
    again = build_dataset(spec, folder, engine="serial")  # the campaign kept all proposals
    assert again is not None
    assert equal(again, whole)


def test_another_dataset_in_the_folder_is_never_written_over(
    built: Path, spec: DatasetSpec, tmp_path: Path
) -> None:
    with pytest.raises(InvalidSettings, match="another"):
        build_dataset(replace(spec, steps=400), built, engine="serial")
    lonely = tmp_path / "lonely"
    lonely.mkdir()
    shutil.copy(built / DATASET_FILE, lonely)
    before = (lonely / DATASET_FILE).read_bytes()
    with pytest.raises(OutputExists, match="without its campaign"):
        build_dataset(spec, lonely, engine="serial")
    assert (lonely / DATASET_FILE).read_bytes() == before
    file = tmp_path / "file"
    file.write_text("something")
    with pytest.raises(StorageError, match="cannot be written"):
        build_dataset(spec, file, engine="serial")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"runs": 0}, "runs: expected at least 1, got 0"),
        ({"steps": 0}, "steps: expected at least 1, got 0"),
        ({"seed": -1}, "seed: expected at least 0, got -1"),
        ({"every": 0}, "every: expected at least 1, got 0"),
        (
            {"search": {"unloaded_beams": "prune_dead_ends"}},
            "unloaded_beams: .*prune_dead_ends.*'keep'",
        ),
        ({"search": {"objective": "directional:4"}}, "objective: .*directional:4"),
        ({"search": {"strokes": [0.5, 1.0]}}, "strokes: "),
        ({"search": {"steps": 7}}, "^steps: "),
        ({"search": {"chains": 7}}, "^chains: "),
        ({"search": {"colour": 1}}, "has no setting 'colour'"),
    ],
)
def test_specs_that_make_no_sense_are_refused(
    spec: DatasetSpec, changes: dict[str, Any], message: str
) -> None:
    with pytest.raises(InvalidSettings, match=message):
        replace(spec, **changes)


def test_an_objective_that_is_not_odd_has_no_reversed_runs() -> None:
    crane = replace(find_problem("crane"), objective="directional:4")
    evaluator = SpringEvaluator(crane)
    there = evaluator.evaluate(crane.initial).efficiency
    back = SpringEvaluator(building.reverse(crane)).evaluate(crane.initial).efficiency
    assert there != pytest.approx(-back, abs=1e-3)
    with pytest.raises(InvalidSettings, match="not opposite"):
        DatasetSpec(problem=crane, runs=2)
    assert DatasetSpec(problem=crane, runs=1).campaign().run_count == 1
