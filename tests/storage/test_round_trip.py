"""What is put into a run comes out of it, before and after it is finished."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import numpy as np
import pyarrow.parquet as pq
import pytest

from bellcrank.errors import InvalidSettings
from bellcrank.model import find_problem, problem_to_dict
from bellcrank.search.kernels.metropolis import Records
from bellcrank.storage import COLUMNS, Proposals, RunFolder, parquet, segments

from .helpers import SETTINGS, assert_holds, files, fill, proposals

if TYPE_CHECKING:
    from pathlib import Path

    from bellcrank.model import Problem


def test_rows_and_states_come_back_as_they_were(run: RunFolder) -> None:
    fill(run)
    opened = RunFolder.open(run.path)
    assert_holds(opened)
    assert opened.progress(1) == (40, {"step": 40, "chain": 1})


def test_problem_settings_and_provenance_come_back(run: RunFolder, problem: Problem) -> None:
    opened = RunFolder.open(run.path)
    assert problem_to_dict(opened.problem) == problem_to_dict(problem)
    assert opened.settings == SETTINGS
    assert opened.provenance == run.provenance
    assert opened.status == "running"


def test_the_status_is_kept_on_disk(run: RunFolder) -> None:
    run.status = "stopped"
    assert RunFolder.open(run.path).status == "stopped"
    with pytest.raises(InvalidSettings, match="expected one of running, stopped, finished"):
        run.status = "paused"


def test_one_file_holds_a_segment_named_by_its_first_step(run: RunFolder) -> None:
    fill(run, steps=25, chains=1)
    names = [f"segments/000/000000{step}.parquet" for step in ("00", "10", "20")]
    assert sorted(files(run.path)) == ["run.json", *names]


def test_others_may_read_the_files_if_the_user_lets_them(run: RunFolder) -> None:
    fill(run, chains=1)
    (run.path / "touched").touch()
    usual = (run.path / "touched").stat().st_mode
    assert {path.stat().st_mode for path in (run.path / "segments" / "000").iterdir()} == {usual}
    run.finish()
    assert (run.path / "history.parquet").stat().st_mode == usual


def test_the_last_segment_may_be_shorter_and_the_chain_goes_on_behind_it(run: RunFolder) -> None:
    fill(run, steps=25)
    fill(run, steps=40)
    assert_holds(run)


def test_a_finished_run_is_one_history_that_equals_the_segments(run: RunFolder) -> None:
    fill(run)
    before = [run.read(chain) for chain in run.chains]
    run.finish()
    assert list(files(run.path)) == ["history.parquet", "run.json"]
    opened = RunFolder.open(run.path)
    assert opened.status == "finished"
    assert_holds(opened)
    for chain, columns in enumerate(before):
        for name, column in opened.read(chain).items():
            np.testing.assert_array_equal(column, columns[name])
    assert opened.progress(0) == (40, {"step": 40, "chain": 0})
    assert opened.progress(7) == (0, None)


def test_the_history_is_sorted_by_chain_and_step_and_describes_itself(run: RunFolder) -> None:
    fill(run)
    run.finish()
    table = pq.read_table(run.path / "history.parquet")
    assert table.column_names == ["chain", *COLUMNS]
    assert table["chain"].to_pylist() == [0] * 40 + [1] * 40
    assert table["step"].to_pylist() == [*range(40), *range(40)]
    header = json.loads(table.schema.metadata[b"bellcrank"])
    assert header["schema"] == "bellcrank/table/1"
    assert header["settings"] == SETTINGS
    assert header["problem"] == problem_to_dict(run.problem)


def test_a_chain_is_read_without_the_row_groups_of_the_others(
    run: RunFolder, monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in (parquet, segments):
        monkeypatch.setattr(module, "ROW_GROUP", 20)
    fill(run)
    run.finish()
    groups: list[int] = []
    real = pq.ParquetFile.read_row_group

    def spy(self: pq.ParquetFile, group: int, **options: object) -> object:
        groups.append(group)
        return real(self, group, **options)

    monkeypatch.setattr(pq.ParquetFile, "read_row_group", spy)
    assert len(run.read(1)["step"]) == 40
    assert groups == [2, 3]


def test_finishing_twice_changes_nothing(run: RunFolder) -> None:
    fill(run)
    run.finish()
    before = files(run.path)
    RunFolder.open(run.path).finish()
    assert files(run.path) == before


def test_a_run_without_proposals_can_be_finished_and_read(run: RunFolder) -> None:
    run.finish()
    opened = RunFolder.open(run.path)
    assert opened.chains == []
    columns = opened.read(0)
    assert columns["mask"].shape == (0, (len(run.problem.lattice.beams) + 7) // 8)
    assert all(len(column) == 0 for column in columns.values())


def test_only_the_columns_asked_for_are_read(run: RunFolder) -> None:
    fill(run)
    assert list(run.read(0, ["accepted", "step"])) == ["accepted", "step"]
    with pytest.raises(InvalidSettings, match="no column 'energy'; known: step, mask"):
        run.read(0, ["energy"])


def test_the_records_of_the_compiled_search_are_taken_as_they_are(run: RunFolder) -> None:
    rows = proposals(run.problem, 0, 0)
    run.append(
        0, 0,
        Records(
            rows.mask, rows.efficiency, rows.cost, rows.temperature,
            rows.accepted.astype(np.uint8), rows.status.astype(np.uint8),
        ),
        {},
    )  # fmt: skip
    found = run.read(0)
    np.testing.assert_array_equal(found["accepted"], rows.accepted)
    np.testing.assert_array_equal(found["status"], rows.status)


@pytest.mark.parametrize("name", ["mask", "cost", "accepted"])
def test_columns_of_the_wrong_shape_are_refused(run: RunFolder, name: str) -> None:
    rows = proposals(run.problem, 0, 0)
    wrong = rows._replace(**{name: getattr(rows, name)[:-1]})
    with pytest.raises(InvalidSettings, match=rf"proposals: {name}: expected shape \(10,"):
        run.append(0, 0, wrong, {})
    assert list(files(run.path)) == ["run.json"]


def test_proposals_without_rows_are_refused(run: RunFolder) -> None:
    with pytest.raises(InvalidSettings, match="expected at least one row, got none"):
        run.append(0, 0, Proposals(*(column[:0] for column in proposals(run.problem, 0, 0))), {})


def test_states_and_settings_that_json_cannot_hold_are_refused(
    run: RunFolder, problem: Problem, tmp_path: Path
) -> None:
    with pytest.raises(InvalidSettings, match="state: expected data that JSON"):
        run.append(0, 0, proposals(problem, 0, 0), {"cost": float("nan")})
    with pytest.raises(InvalidSettings, match="settings: expected data that JSON"):
        RunFolder.create(tmp_path / "other", problem, {"rng": object()})
    assert not (tmp_path / "other").exists()


@pytest.mark.slow
def test_a_hundred_thousand_proposals_take_less_than_six_megabytes(tmp_path: Path) -> None:
    crane = find_problem("crane")
    run = RunFolder.create(tmp_path / "crane", crane, {})
    rng = np.random.default_rng(1)
    total, segment = 100_000, 4000
    accepted = rng.random(total) < 0.05
    flips = np.zeros((total, crane.lattice.beam_count), dtype=np.uint8)
    flips[np.arange(total), rng.choice(crane.designable, total)] = 1
    # The design before a step holds the flips accepted so far; the proposal adds its own.
    kept = np.cumsum(flips * accepted[:, None], axis=0, dtype=np.int32) - flips * accepted[:, None]
    masks = np.packbits((crane.initial + kept + flips) % 2 == 1, axis=1)
    efficiency = rng.normal(size=total)
    temperature = np.maximum(1e-3, 0.06 - 5.9e-4 * np.cumsum(accepted))
    for first in range(0, total, segment):
        part = slice(first, first + segment)
        run.append(
            0, first,
            Proposals(
                masks[part], efficiency[part], np.exp(-efficiency[part]), temperature[part],
                accepted[part], np.zeros(segment, np.int8),
            ),
            {"step": first + segment, "mask": masks[part][-1].tobytes().hex()},
        )  # fmt: skip
    assert sum(map(len, files(run.path).values())) < 6e6
    run.finish()
    assert sum(map(len, files(run.path).values())) < 6e6
    np.testing.assert_array_equal(run.read(0)["mask"], masks)
