"""Whatever happens to a file is seen, named, and mended by computing it again."""

from __future__ import annotations

import random
from typing import TYPE_CHECKING

import pytest

from bellcrank.campaign import StatusReader, complete, repair, verify, work
from bellcrank.errors import CorruptRun, RunFailed

from .helpers import everything, rotten

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from bellcrank.campaign import Store


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-100])


def empty(path: Path) -> None:
    path.write_bytes(b"")


def overwrite(path: Path) -> None:
    path.write_text("not a Parquet file at all")


def first_segment(store: Store, number: int = 0) -> Path:
    return store.folder_of(store.spec.run(number)) / "00000000.parquet"


def test_no_bit_of_a_segment_can_change_unseen(segments: Store) -> None:
    path = first_segment(segments)
    whole = path.read_bytes()
    chance = random.Random(1)
    places = {0, len(whole) - 1, *(chance.randrange(len(whole)) for _ in range(200))}
    for place in sorted(places):
        rotten(path, place)
        damage = verify(segments).damage
        assert len(damage) == 1, place
        assert damage[0].startswith(f"{path}: damaged"), damage
        path.write_bytes(whole)
    assert verify(segments).damage == []


@pytest.mark.parametrize("harm", [cut, empty, overwrite])
def test_a_damaged_segment_is_named_deleted_with_the_later_ones_and_computed_again(
    segments: Store, finished: Path, harm: Callable[[Path], None]
) -> None:
    path = first_segment(segments)
    harm(path)
    with pytest.raises(CorruptRun, match=r"00000000\.parquet: damaged .* --repair"):
        work(str(segments.path), 0)
    found = verify(segments)
    assert [line.split(":")[0] for line in found.damage] == [str(path)]
    assert [doomed.name for doomed in found.doomed] == [
        "00000000.parquet", "00000250.parquet", "00000500.parquet",
    ]  # fmt: skip
    repair(segments, found)
    assert verify(segments).damage == []
    assert complete(segments, "serial", compacting=False)
    assert everything(segments.path) == everything(finished)


def test_a_damaged_last_segment_keeps_the_campaign_from_going_on(segments: Store) -> None:
    path = segments.folder_of(segments.spec.run(2)) / "00000500.parquet"
    cut(path)
    with pytest.raises(CorruptRun, match=r"00000500\.parquet: damaged"):
        complete(segments, "serial")


def test_other_runs_are_done_before_a_damaged_one_is_reported(segments: Store) -> None:
    first_segment(segments, 1).with_name("00000500.parquet").unlink()
    first_segment(segments, 2).with_name("00000500.parquet").unlink()
    cut(first_segment(segments, 1))
    with pytest.raises(RunFailed, match=r"run [0-9a-f]+-1 .*seed 1.*00000000\.parquet: damaged"):
        complete(segments, "serial")
    assert first_segment(segments, 2).with_name("00000500.parquet").exists()


def test_a_missing_segment_is_named_and_computed_again(segments: Store, finished: Path) -> None:
    path = first_segment(segments).with_name("00000250.parquet")
    path.unlink()
    with pytest.raises(CorruptRun, match=r"00000250\.parquet: missing"):
        work(str(segments.path), 0)
    found = verify(segments)
    assert found.damage == [f"{path}: missing, although 00000500.parquet exists"]
    repair(segments, found)
    assert complete(segments, "serial", compacting=False)
    assert everything(segments.path) == everything(finished)


def test_a_segment_in_the_wrong_place_is_named(segments: Store) -> None:
    first_segment(segments, 1).write_bytes(first_segment(segments, 0).read_bytes())
    with pytest.raises(CorruptRun, match=r"-1/00000000\.parquet: contains steps 0 to 249"):
        work(str(segments.path), 1)


@pytest.mark.parametrize("place", ["segments/x", "segments/{run}/notes.txt", "segments/x/y"])
def test_foreign_files_are_named_and_never_touched(segments: Store, place: str) -> None:
    path = segments.path / place.format(run=segments.spec.run(0).id)
    path.parent.mkdir(exist_ok=True)
    path.write_text("mine")
    named = path.parent if place.endswith("/y") else path
    with pytest.raises(CorruptRun) as raised:
        complete(segments, "serial")
    assert str(raised.value).startswith(f"{named}: does not belong to this run or campaign")
    found = verify(segments)
    assert found.damage[0].startswith(f"{named}: does not belong")
    repair(segments, found)
    assert path.read_text() == "mine"


@pytest.mark.parametrize("harm", [cut, lambda path: rotten(path, 5000), lambda path: path.unlink()])
def test_a_damaged_table_goes_back_to_segments_and_is_computed_again(
    table: Store, tabled: Path, harm: Callable[[Path], None]
) -> None:
    path = table.path / "table" / "part-00000.parquet"
    harm(path)
    found = verify(table)
    assert len(found.damage) == 1
    assert found.damage[0].startswith(f"{path}: ")
    repair(table, found)
    assert complete(table, "serial")
    assert everything(table.path) == everything(tabled)


def test_what_is_whole_in_a_damaged_table_is_not_computed_again(
    tmp_path: Path, segments: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("bellcrank.campaign.compaction.PART_ROWS", 800)
    assert complete(segments, "serial")
    expected = everything(segments.path)
    parts = sorted((segments.path / "table").iterdir())
    assert len(parts) == 3
    cut(parts[1])
    repair(segments, verify(segments))
    kept = {run.number for run in segments.spec.runs()} - {run.number for run in _pending(segments)}
    assert kept == {0, 3}
    assert complete(segments, "serial")
    assert everything(segments.path) == expected


def _pending(store: Store) -> list[object]:
    watcher = StatusReader(store)
    watcher.read()
    return list(watcher.pending())
