"""`bellcrank campaign` as a person types it."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import pytest

from tests.campaign.helpers import ROWS, SPEC, rotten, write_spec

from .helpers import call

if TYPE_CHECKING:
    from pathlib import Path


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a small campaign that has ended. Not to be changed."""
    place = tmp_path_factory.mktemp("campaign")
    outcome = call("campaign", "run", write_spec(place), "--out", place / "store", "--shard", "1/2")
    assert outcome.code == 0, outcome.err
    outcome = call("campaign", "resume", place / "store", "--engine", "serial")
    assert outcome.code == 0, outcome.err
    assert "4 / 4" in outcome.out
    return place / "store"


def test_the_status_is_a_table_or_json(campaign: Path) -> None:
    told = call("campaign", "status", campaign)
    assert (told.code, told.complaints) == (0, "")
    assert [line.split()[0] for line in told.out.splitlines()] == [
        "task", "scaling-8-paper", "large", "all",
    ]  # fmt: skip
    data = json.loads(call("campaign", "status", campaign, "--json").out)
    assert (data["done"], data["runs_done"], data["steps_done"]) == (True, 4, ROWS)
    assert data["tasks"][0]["best"] >= data["tasks"][0]["median"]


def test_watching_a_campaign_that_has_ended_ends(campaign: Path) -> None:
    assert call("campaign", "watch", campaign).out == call("campaign", "status", campaign).out


def test_the_best_designs_can_be_evaluated(campaign: Path, tmp_path: Path) -> None:
    found = call("campaign", "top", campaign, "-n", 3, "--task", "large", "--json")
    (tmp_path / "top.json").write_text(found.out)
    ranked = json.loads(found.out)["results"]
    told = call("evaluate", "crane", "--designs", tmp_path / "top.json", "--json")
    for one, other in zip(ranked, json.loads(told.out)["results"], strict=True):
        assert one["efficiency"] == pytest.approx(other["efficiency"], abs=1e-8)


def test_results_are_written_and_can_be_evaluated(campaign: Path, tmp_path: Path) -> None:
    told = call("campaign", "results", campaign, "--out", tmp_path / "designs")
    assert told.code == 0, told.err
    assert f"written to {tmp_path / 'designs'}/" in told.out
    assert call("evaluate", tmp_path / "designs" / "large.json").code == 0
    again = call("campaign", "results", campaign, "--out", tmp_path / "designs")
    assert again.code == 2
    assert "exists already" in again.err


def test_damage_is_named_mended_and_computed_again(tmp_path: Path) -> None:
    store = tmp_path / "store"
    words = (write_spec(tmp_path), "--out", store, "--engine", "serial")
    assert call("campaign", "run", *words, "--keep-segments").code == 0
    whole = call("campaign", "verify", store)
    assert (whole.code, whole.out) == (0, f"10 files with {ROWS} rows intact.\n")
    rotten(next(store.glob("segments/*-7/*.parquet")), 700)
    named = call("campaign", "verify", store)
    assert named.code == 1
    assert "damaged" in named.out
    mended = call("campaign", "verify", store, "--repair")
    assert mended.code == 0
    assert "Deleted 1 file; bellcrank campaign resume" in mended.out
    assert call("campaign", "resume", store, "--engine", "serial").code == 0
    assert call("campaign", "verify", store).out == f"1 file with {ROWS} rows intact.\n"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("run", "nowhere.toml"), "nowhere.toml: no such file"),
        (("run", "{spec}", "--workers", "0"), "workers: expected at least 1, got 0"),
        (("run", "{spec}", "--engine", "ray"), "unknown engine 'ray'"),
        (("run", "{spec}", "--shard", "3/2"), "shard: expected i/N"),
        (("run", "{spec}", "--scheduler", "tcp://a:1", "--engine", "processes"), "only for engine"),
        (("run", "{spec}", "--engine", "slurm", "--slurm", "queue"), "--slurm queue: expected KEY"),
        (("resume", "{place}"), "not the folder of a campaign"),
        (("status", "{place}/nowhere"), "no such folder"),
        (("watch", "{place}", "--interval", "0"), "interval: expected seconds above 0"),
        (("top", "{place}"), "not the folder of a campaign"),
        (("results", "{place}"), "not the folder of a campaign"),
        (("verify", "{place}"), "not the folder of a campaign"),
    ],
)
def test_what_makes_no_sense_is_refused_in_one_line(
    tmp_path: Path, words: tuple[str, ...], message: str
) -> None:
    spec = write_spec(tmp_path)
    filled = [word.format(spec=spec, place=tmp_path) for word in words]
    told = call("campaign", *filled)
    assert told.code == 2
    assert told.err.count("\n") == 1
    assert told.err.startswith("error: ")
    assert message in told.err
    assert [path.name for path in tmp_path.iterdir()] == ["spec.toml"]


def test_another_spec_in_the_same_folder_is_refused(campaign: Path, tmp_path: Path) -> None:
    other = write_spec(tmp_path, SPEC.replace("steps = 600", "steps = 700"))
    told = call("campaign", "run", other, "--out", campaign)
    assert told.code == 2
    assert "steps is 600 there and 700 here; undo the change" in told.err
