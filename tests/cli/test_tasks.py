"""`bellcrank design TASK`: items in the report, exit codes, nearest designs."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import pytest

from bellcrank.model import read_design
from bellcrank.task import bundled_tasks

from .helpers import call, refusal

if TYPE_CHECKING:
    from pathlib import Path

SETTINGS = ("--steps", 1000, "--seed", 1, "--no-refine")


@pytest.fixture(scope="module")
def met(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """A task that is met: its folder and what the command printed."""
    folder = tmp_path_factory.mktemp("met") / "inverter"
    outcome = call("design", "inverter", *SETTINGS, "--out", folder)
    assert outcome.code == 0, outcome.err
    return folder, outcome.out


@pytest.fixture(scope="module")
def missed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str, str]:
    """A task that cannot be met: its folder, the output and the messages."""
    folder = tmp_path_factory.mktemp("missed")
    task = folder / "impossible.toml"
    task.write_text(
        """
        schema = "bellcrank/task/1"
        name = "impossible"
        [domain]
        size = ["62 mm", "54 mm"]
        [[supports]]
        at = { edge = "bottom" }
        [[cases]]
        inputs = [{ at = { point = [51, 53] }, direction = "down", displacement = "3 mm" }]
        [[cases.outputs]]
        at = { point = [11, 53] }
        direction = "left"
        gain = { at_least = 50 }
        payload = "1 kg"
        """,
        encoding="utf-8",
    )
    outcome = call("design", task, "--steps", 500, "--no-refine", "--out", folder / "run")
    assert outcome.code == 3, outcome.err
    return folder / "run", outcome.out, outcome.err


def test_the_yield_over_tolerances_is_reported_and_counts(tmp_path: Path) -> None:
    task = tmp_path / "tolerant.toml"
    text = bundled_tasks()["inverter"].read_text(encoding="utf-8")
    task.write_text(f"{text}\n[tolerance]\nwidth = '30%'\nleast_yield = '99%'\n", encoding="utf-8")
    folder = tmp_path / "run"
    outcome = call("design", task, *SETTINGS, "--out", folder)
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    found = summary["tolerance"]
    assert found["deviations"]["relative_width"] == 0.3
    assert found["deviations"]["prints"] == 200
    assert found["yield"] < 0.99
    assert "of 200 random prints" in outcome.out
    assert "fewer than the 99.0% asked for" in outcome.err
    assert outcome.code == 3
    assert not summary["specification"]["met"]
    assert "of 200 random prints" in (folder / "summary.md").read_text(encoding="utf-8")


def test_every_item_is_reported_with_what_is_wanted_reached_and_met(met: tuple[Path, str]) -> None:
    folder, out = met
    rows = [line.split("  ") for line in out.splitlines()]
    names = [row[0].strip() for row in rows]
    start = names.index("item")
    assert names[start + 1 : start + 7] == [
        "gain", "off-axis motion", "rotation", "payload", "strain", "clearance",
    ]  # fmt: skip
    assert all(row[-1].strip() == "yes" for row in rows[start + 1 : start + 7])
    payload = [text.strip() for text in rows[start + 4] if text][2:]
    assert payload == [*["> 0.981 N (100 g)"] * 2, "-", "yes"]
    data = json.loads((folder / "summary.json").read_text())
    assert data["specification"]["met"] is True
    assert data["specification"]["binding"] is None
    payload = data["specification"]["items"][3]
    assert payload["unit"] == "N"
    assert payload["at_least"] == pytest.approx(0.1 * 9.80665)
    assert list(payload["reached"]) == ["frames, as searched", "frames, 8 elements"]
    assert all(each["met"] for each in payload["reached"].values())


def test_figures_of_the_part_stand_beside_the_items(met: tuple[Path, str]) -> None:
    folder, out = met
    (row,) = json.loads((folder / "summary.json").read_text())["part_figures"]
    for key in (
        "efficiency", "efficiency_half", "off_axis", "rotation_deg", "input_force_N",
        "output_stiffness_N_per_mm", "payload_N", "blocked_force_N", "sag_mm", "limit_points",
    ):  # fmt: skip
        assert row[key] is not None, key
    assert len(row["path_mm"]) == 17
    assert row["path_mm"][0] == [0.0, 0.0]
    assert "payload that halves the travel" in out
    assert "extremes of the input force" in out
    summary = (folder / "summary.md").read_text()
    assert "| item | wanted |" in summary


def test_the_design_carries_its_specification(met: tuple[Path, str]) -> None:
    folder, _ = met
    design = read_design(folder / "design.json")
    assert design.problem.specification is not None
    assert [item.quantity for item in design.problem.specification.items][:2] == [
        "gain", "off_axis",
    ]  # fmt: skip
    printed = json.loads(call("evaluate", folder, "--elements", 8, "--json").out)
    items = printed["results"][0]["specification"]
    assert all(item["reached"]["frames, 8 elements"]["met"] for item in items)
    validated = json.loads(call("validate", folder, "--level", "frame", "--json").out)
    assert len(validated["specification"]) == len(items)


def test_a_specification_that_is_missed_names_the_binding_item_and_the_nearest_designs(
    missed: tuple[Path, str, str],
) -> None:
    folder, out, err = missed
    assert "no design meets the specification; the binding item is" in err
    assert "nearest 1" in out
    data = json.loads((folder / "summary.json").read_text())["specification"]
    assert data["met"] is False
    assert data["binding"] in {"case.output.gain", "case.output.payload"}
    assert 1 <= len(data["nearest"]) <= 5
    first = data["nearest"][0]
    assert bytes.fromhex(first["mask"])
    assert any(not item["reached"][""]["met"] for item in first["items"])
    assert (folder / "design.json").exists()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--model", "springs"), "--model springs: 'slider' is a task"),
        (("--strut-width", "1mm"), "--strut-width: 'slider' is a task"),
        (("--goal", "mass <= 0.5"), "goals and strokes: problem 'slider' has a specification"),
    ],
)
def test_options_that_contradict_a_task_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...], message: str
) -> None:
    monkeypatch.chdir(tmp_path)
    assert message in refusal("design", "slider", *words)
    assert list(tmp_path.iterdir()) == []


def test_a_wrong_task_file_is_one_line(tmp_path: Path) -> None:
    path = tmp_path / "wrong.toml"
    path.write_text('schema = "bellcrank/task/1"\nname = "x"\ncases = []\n', encoding="utf-8")
    line = refusal("design", path)
    assert "key 'domain' is missing" in line
