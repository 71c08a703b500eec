from __future__ import annotations

import json
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bellcrank.errors import CorruptRun, InvalidFile
from reproduction import ResultStore, draw_record, read_record, read_records, run_study, studies
from reproduction.angular_springs import resistance
from reproduction.page import page_of
from reproduction.records import MAX_BYTES, as_text, rounded, shrunk
from reproduction.scaling import slope

RECORDS = Path(__file__).parents[2] / "docs" / "studies"
PAGE = RECORDS.parent / "paper.md"

SMALL: dict[str, dict[str, Any]] = {
    "paths": {"problem": "scaling-8", "steps": 300, "chains": 2},
    "angular-springs": {},
    "measured": {"models": ("bars", "frame-clamped-linear"), "effects": ("base",), "samples": 3},
    "benchmarks": {"names": ("cantilever", "toggle", "roll-up-space", "ring"), "points": 4},
}
LARGER: dict[str, dict[str, Any]] = {
    "structure": {"problem": "crane", "steps": 600, "chains": 1},
    "crane": {"paper_steps": 600, "paper_chains": 1, "steps": 500, "chains": 1, "levels": ()},
    "scaling": {"sizes": (8, 9), "runs": (1, 1), "proposals_per_beam": 4},
    "disorder": {"lattices": 2, "steps": 600},
    "amplitude": {
        "problems": ("crane",), "points": 3, "steps": 600, "chains": 1, "frames": False,
    },
}  # fmt: skip


def run_with(name: str, changes: dict[str, Any], out: Path) -> dict[str, Any]:
    """Run a study with changed quick settings."""
    study = studies[name]
    with pytest.MonkeyPatch.context() as patch:
        changed = replace(study, quick=replace(study.quick, **changes))
        patch.setitem(studies._entries, name, changed)
        return run_study(name, out, quick=True, workers=2)


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, dict[str, Any]]]:
    """Records of small studies and their folder, shared by tests that do not change them."""
    out = tmp_path_factory.mktemp("studies")
    return out, {name: run_with(name, changes, out) for name, changes in SMALL.items()}


def check_outputs(name: str, record: dict[str, Any], out: Path) -> None:
    assert json.loads(json.dumps(record)) == read_record(out / f"{name}.json")
    assert record["mode"] == "quick"
    assert record["provenance"]["version"]
    assert 2_000 < (out / f"{name}.png").stat().st_size <= MAX_BYTES
    claims = [claim.to_dict() for claim in studies[name].claims(record["figures"])]
    assert claims == record["comparison"]


def test_a_study_writes_a_record_and_a_small_picture(small) -> None:
    out, records = small
    assert set(read_records(out)) == set(SMALL)
    for name, record in records.items():
        check_outputs(name, record, out)


@pytest.mark.slow
@pytest.mark.parametrize("name", LARGER)
def test_each_study_of_searches_writes_a_record_and_a_small_picture(
    name: str, tmp_path: Path
) -> None:
    check_outputs(name, run_with(name, LARGER[name], tmp_path), tmp_path)


def test_a_picture_is_drawn_again_from_its_record(small, tmp_path: Path) -> None:
    out, _ = small
    draw_record(read_record(out / "paths.json"), tmp_path / "again.png")
    assert (tmp_path / "again.png").read_bytes() == (out / "paths.png").read_bytes()


def test_the_page_has_every_claim_of_every_record(small) -> None:
    _, records = small
    page = page_of(records)
    for name, record in records.items():
        shown = studies[name].page == "paper"
        assert (f"## {name}\n" in page) == shown
        for row in record["comparison"] if shown else ():
            assert row["ours"] in page


def test_stored_results_are_not_computed_again(tmp_path: Path) -> None:
    store = ResultStore.for_study(tmp_path, "some", {"n": 1})
    assert store.compute_all("piece", {"a": lambda: 1, "b": lambda: 2}) == {"a": 1, "b": 2}

    def never() -> int:
        raise AssertionError

    again = ResultStore.for_study(tmp_path, "some", {"n": 1})
    assert again.compute_all("piece", {"a": never, "b": never, "c": lambda: 3})["c"] == 3
    other = ResultStore.for_study(tmp_path, "some", {"n": 2})
    assert other.compute("piece-a", lambda: 7) == 7


def test_results_before_an_error_are_stored(tmp_path: Path) -> None:
    store = ResultStore.for_study(tmp_path, "some", {})

    def fail() -> int:
        raise RuntimeError("killed")

    with pytest.raises(RuntimeError, match="killed"):
        store.compute_all("piece", {"a": lambda: 1, "b": fail}, workers=1)
    assert [path.name for path in store.folder.iterdir()] == ["piece-a.json"]


def test_a_damaged_result_file_is_named(tmp_path: Path) -> None:
    store = ResultStore.for_study(tmp_path, "some", {})
    (store.folder / "a.json").write_text("{")
    with pytest.raises(CorruptRun, match=r"a\.json: expected JSON"):
        store.compute("a", lambda: 1)


def test_other_files_are_rejected(tmp_path: Path) -> None:
    path = tmp_path / "x.json"
    path.write_text('{"schema": "other"}')
    with pytest.raises(InvalidFile, match="bellcrank/study/1"):
        read_record(path)
    path.write_text('{"schema": "bellcrank/study/1", "study": "none"}')
    with pytest.raises(InvalidFile, match="unknown study"):
        read_record(path)


def test_settings_of_all_studies_are_plain_data_and_quick_ones_do_less() -> None:
    for study in studies.values():
        assert json.dumps([asdict(study.full), asdict(study.quick)])
        assert study.title
        assert study.after


def test_lists_of_numbers_take_one_line() -> None:
    text = as_text({"a": [1.5, None, -2e-05], "b": [[1, 2], [3, 4]]})
    assert '"a": [1.5, null, -2e-05]' in text
    assert json.loads(text) == {"a": [1.5, None, -2e-05], "b": [[1, 2], [3, 4]]}
    assert rounded([float("inf"), np.pi]) == [None, 3.14159]


def test_a_large_picture_is_made_smaller(monkeypatch: pytest.MonkeyPatch) -> None:
    from io import BytesIO

    from PIL import Image

    monkeypatch.setattr("reproduction.records.MAX_BYTES", 1000)
    noise = np.random.default_rng(0).integers(0, 255, (70, 90, 3), dtype=np.uint8)
    content = BytesIO()
    Image.fromarray(noise).save(content, format="PNG")
    with Image.open(BytesIO(shrunk(content.getvalue()))) as small:
        assert small.size == (38, 29)


def test_a_slope_is_that_of_a_power_law() -> None:
    rows = [{"beams": n, "t": 0.3 * n**2.5} for n in (100, 200, 400)]
    assert slope(rows, lambda row: row["t"]) == pytest.approx(2.5)
    assert slope(rows[:1], lambda row: row["t"]) is None


def test_dead_ends_put_springs_in_series_unless_they_are_pruned() -> None:
    assert resistance([0, 120], [], 0.01, "keep") == pytest.approx(2.0, abs=1e-4)
    assert resistance([0, 60, 120], [1], 0.01, "keep") == pytest.approx(1.5, abs=1e-4)
    assert resistance([0, 60, 120], [1], 0.01, "prune_dead_ends") == pytest.approx(2.0, abs=1e-4)


def test_the_committed_page_agrees_with_the_records() -> None:
    records = read_records(RECORDS)
    assert set(records) == set(studies)
    assert page_of(records, pictures="studies/") == PAGE.read_text(encoding="utf-8")


@pytest.mark.parametrize("name", studies.names())
def test_committed_records_agree_with_their_claims(name: str) -> None:
    record = read_record(RECORDS / f"{name}.json")
    assert record["mode"] == "full"
    assert record["provenance"]["commit"]
    claims = [claim.to_dict() for claim in studies[name].claims(record["figures"])]
    assert claims == record["comparison"]
    assert (RECORDS / f"{name}.png").stat().st_size < 150_000
