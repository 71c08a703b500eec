"""Making entries: the same whatever stops it on the way."""

from __future__ import annotations

import shutil
import signal
import subprocess
import sys
import threading
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from bellcrank.errors import InvalidSettings, StorageError, UnknownName
from bellcrank.machines.library import Library, entry_to_dict
from bellcrank.machines.library.catalogue import entry_files
from bellcrank.machines.library.tasks import OFF_AXIS, ROTATION, SAG, EntryTask, MakeSettings
from bellcrank.mechanics import model_evaluator
from bellcrank.model import Section
from bellcrank.storage.locking import LOCK, locked
from bellcrank.workflows.library_making import SEARCHES, make
from bellcrank.workflows.refinement import refine_selection
from tests.refinements import make_without_sheet

if TYPE_CHECKING:
    from collections.abc import Iterator

    from bellcrank.search import Progress

KINDS = ("straight-10g", "straight-50g")
SETTINGS = MakeSettings(directions=("up",), columns=(5,), kinds=KINDS, steps=300, chains=2)
ROOT = Path(__file__).parents[2]
TIMED = ("provenance", "checksum")
SCRIPT = """
import sys
from pathlib import Path
import pytest
from tests.machines.test_library_making import SETTINGS
from tests.refinements import make_without_sheet
from bellcrank.workflows.library_making import make
make_without_sheet(pytest.MonkeyPatch())
for made in make(SETTINGS, Path(sys.argv[1]), workers=1):
    pass
"""


@pytest.fixture(scope="module", autouse=True)
def short_refinement() -> Iterator[None]:
    """Refine in a few steps, without the sheet."""
    with pytest.MonkeyPatch.context() as patch:
        make_without_sheet(patch)
        yield


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Entries that nothing stopped. Not to be changed."""
    folder = tmp_path_factory.mktemp("whole")
    made = list(make(SETTINGS, folder, workers=1))
    assert [each.note for each in made] == ["made", "made"]
    return folder


def told(folder: Path) -> dict[str, object]:
    """All entries of a folder without when they were made."""
    known = Library((folder,))
    return {
        name: {
            key: value for key, value in entry_to_dict(known.find(name)).items() if key not in TIMED
        }
        for name in known.names()
    }


@pytest.mark.slow
def test_entries_are_refined(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("ngsolve", reason="NGSolve is not installed")
    # With the sheet.
    monkeypatch.setattr("bellcrank.workflows.library_making.refine_selection", refine_selection)
    settings = MakeSettings(
        directions=("left",), columns=(7,), kinds=("straight-10g",), steps=2000, chains=1
    )
    (made,) = make(settings, tmp_path, workers=1)
    entry = made.entry
    assert entry is not None
    assert entry.provenance["refinement"]["met_after"]
    first = entry.provenance["items"][0]
    assert first["quantity"] == "gain"
    assert first["reached"]["frames, 8 elements"]["value"] == pytest.approx(
        entry.figures["efficiency"], rel=1e-6
    )
    assert all(item["reached"]["sheet"]["met"] for item in entry.provenance["items"])
    assert not entry.design.problem.is_specified
    task = EntryTask("left", 7, "straight-10g").problem()
    moved = entry.design.problem.lattice.positions - task.lattice.positions
    assert np.abs(moved).max() > 0.01
    assert not moved[task.special_nodes].any()
    figures = entry.figures
    off_axis, rotation = figures["off_axis"], figures["rotation_deg"]
    sag, travel, payload = figures["sag_mm"], figures["travel_mm"], figures["payload_N"]
    assert off_axis is not None
    assert rotation is not None
    assert sag is not None
    assert travel is not None
    assert payload is not None
    assert entry.efficiency >= 1.0
    assert off_axis <= OFF_AXIS
    assert abs(rotation) <= ROTATION
    assert sag <= SAG * travel
    assert payload >= 0.1
    found = Library((tmp_path,)).find("left-7-straight-10g")
    assert found.design.problem.lattice.positions == pytest.approx(
        entry.design.problem.lattice.positions
    )


@pytest.mark.slow
def test_each_task_makes_one_entry_and_leaves_nothing_else(whole: Path) -> None:
    names = sorted(path.name for path in whole.iterdir())
    assert len(names) == 2
    known = Library((whole,))
    light, heavy = known.find("up-5-straight-10g"), known.find("up-5-straight-50g")
    assert (light.direction, light.columns, light.kind) == ("up", 5, "straight-10g")
    assert light.provenance["settings"]["chains"] == 2
    assert light.design.problem.section == Section(0.2, 0.5, joint=0.06)
    for entry in (light, heavy):
        assert not entry.warnings
        assert not entry.design.problem.is_specified
        assert all(
            item["reached"]["frames, 8 elements"]["met"] for item in entry.provenance["items"]
        )
    assert light.efficiency > heavy.efficiency > 1.0
    assert light.efficiency == pytest.approx(
        model_evaluator(light.design.problem).evaluate(light.design.mask).efficiency,
        abs=1e-8,
    )


@pytest.mark.slow
def test_what_is_there_is_not_made_again(whole: Path) -> None:
    before = {path: path.stat().st_mtime_ns for path in whole.iterdir()}
    made = list(make(SETTINGS, whole, workers=1))
    assert [(each.note, each.entry) for each in made] == [("exists", None)] * 2
    assert {path: path.stat().st_mtime_ns for path in whole.iterdir()} == before


@pytest.mark.slow
def test_after_a_stop_it_ends_with_the_same_entries(whole: Path, tmp_path: Path) -> None:
    stop = threading.Event()
    seen: list[EntryTask] = []

    def tell(task: EntryTask, _progress: Progress) -> None:
        seen.append(task)
        if len(seen) == 4:  # in the second chain of the first task
            stop.set()

    assert list(make(SETTINGS, tmp_path, workers=1, report=tell, stop=stop)) == []
    assert (tmp_path / SEARCHES).exists()
    assert [each.note for each in make(SETTINGS, tmp_path, workers=1)] == ["made", "made"]
    assert told(tmp_path) == told(whole)


@pytest.mark.slow
def test_after_a_kill_it_ends_with_the_same_entries(whole: Path, tmp_path: Path) -> None:
    process = subprocess.Popen([sys.executable, "-c", SCRIPT, str(tmp_path)], cwd=ROOT)
    deadline = time.monotonic() + 120.0
    while not any(tmp_path.glob(f"{SEARCHES}/*/**/*.parquet")) and process.poll() is None:
        assert time.monotonic() < deadline
        time.sleep(0.005)
    process.send_signal(signal.SIGKILL)
    process.wait()
    list(make(SETTINGS, tmp_path, workers=2))
    assert told(tmp_path) == told(whole)
    assert not (tmp_path / SEARCHES).exists()


@pytest.mark.slow
def test_a_search_with_other_settings_is_not_mixed_in(tmp_path: Path) -> None:
    stop = threading.Event()
    list(make(SETTINGS, tmp_path, workers=1, report=lambda *_: stop.set(), stop=stop))
    with pytest.raises(InvalidSettings, match="other settings"):
        list(make(replace(SETTINGS, seed=1), tmp_path))


@pytest.mark.slow
def test_what_is_better_takes_the_place_of_what_was_there(whole: Path, tmp_path: Path) -> None:
    short = replace(SETTINGS, kinds=KINDS[:1], steps=20)
    (first,) = make(short, tmp_path)
    better = replace(SETTINGS, kinds=KINDS[:1])
    (second,) = make(better, tmp_path, again=True)
    assert first.entry is not None
    assert second.entry is not None
    assert second.entry.efficiency > first.entry.efficiency
    assert second.note == f"made in place of {first.entry.name}"
    assert [path.stem for path in entry_files(tmp_path)] == [second.entry.name]
    assert Library((tmp_path,)).names() == [second.entry.name]
    assert second.entry.name in told(whole)
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    (third,) = make(short, tmp_path, again=True)
    assert (third.entry, third.note) == (None, f"none better than {second.entry.name}")
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before


@pytest.mark.slow
def test_making_anew_goes_on_after_a_stop(whole: Path, tmp_path: Path) -> None:
    shutil.copytree(whole, tmp_path, dirs_exist_ok=True)
    stop, searched = threading.Event(), []

    def tell(task: EntryTask, _progress: Progress) -> None:
        searched.append(task.name)
        if task.kind == "straight-50g":
            stop.set()

    made = list(make(SETTINGS, tmp_path, workers=1, again=True, report=tell, stop=stop))
    assert [each.note.startswith("none better than") for each in made] == [True]
    searched.clear()
    made = list(make(SETTINGS, tmp_path, workers=1, again=True, report=tell))
    assert [each.note.startswith("none better than") for each in made] == [True, True]
    assert set(searched) == {"up-5-straight-50g"}
    assert told(tmp_path) == told(whole)
    assert not (tmp_path / SEARCHES).exists()


@pytest.mark.slow
def test_one_process_at_a_time_makes_entries_in_a_folder(whole: Path) -> None:
    with locked(whole / LOCK), pytest.raises(StorageError, match="is working in this folder"):
        list(make(SETTINGS, whole))
    assert not (whole / LOCK).exists()


def test_orders_for_what_there_cannot_be_are_refused() -> None:
    with pytest.raises(InvalidSettings, match="direction: expected one of"):
        MakeSettings(directions=("sideways",))
    with pytest.raises(InvalidSettings, match="columns: expected at least 5"):
        MakeSettings(columns=(3,))
    with pytest.raises(UnknownName, match="unknown kind of actuator"):
        MakeSettings(kinds=("strong",))
    with pytest.raises(InvalidSettings, match="steps"):
        MakeSettings(steps=0)


def test_a_folder_that_cannot_be_written_is_said_at_once(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(StorageError, match="cannot be written"):
        list(make(SETTINGS, tmp_path / "file" / "entries"))


def test_a_task_may_leave_supports_unused() -> None:
    problem = EntryTask("up", 7, "straight-10g").problem()
    lattice, held = problem.lattice, problem.supports.nodes
    at_one_support = np.isin(lattice.beams, held).sum(axis=1) == 1
    assert np.isin(np.flatnonzero(at_one_support), problem.designable).all()


@pytest.mark.slow
def test_without_a_design_that_meets_all_items_there_is_no_entry(tmp_path: Path) -> None:
    (outcome,) = make(replace(SETTINGS, directions=("down",), kinds=KINDS[1:]), tmp_path, workers=1)
    assert outcome.entry is None
    assert outcome.note.startswith("no design without a fault: misses case.output.")
    assert entry_files(tmp_path) == []
