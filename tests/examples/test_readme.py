"""The commands, figures and links of the README."""

from __future__ import annotations

import json
import re
import shlex
import sys
from pathlib import Path

import numpy as np
import pytest

from bellcrank.cli import main
from bellcrank.cli.app import NOT_MET
from bellcrank.model import human_design, read_design, write_design
from bellcrank.part.units import GRAVITY
from bellcrank.search.verification import ELEMENTS
from bellcrank.workflows import find_design, spec_for
from bellcrank.workflows.part_figures import part_figures
from benchmarks.task_figures import carried, table
from tools.draw_tasks import identity, recorded_runs

README = Path(__file__).parents[2] / "README.md"
START = "pip install '.[fem]' && bellcrank design straight-crane"
TEST = "pip install '.[test]' && pytest"


def blocks(language: str) -> list[str]:
    """Code blocks of the README in one language."""
    text = README.read_text(encoding="utf-8")
    found = re.findall(r"^```(\w*)\n(.*?)^```$", text, re.DOTALL | re.MULTILINE)
    return [code for named, code in found if named == language]


def run(
    command: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    codes: tuple[int | None, ...] = (0, None),
) -> str:
    """Run a command line in this process; return what it printed."""
    monkeypatch.setattr(sys, "argv", shlex.split(command))
    with pytest.raises(SystemExit) as left:
        main()
    printed = capsys.readouterr()
    assert left.value.code in codes, printed.err
    return printed.out


def test_the_two_commands_stand_by_themselves() -> None:
    assert [block.strip() for block in blocks("")[:2]] == [START, TEST]


@pytest.mark.slow
def test_the_start_leaves_what_the_readme_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("ngsolve", reason="the first command installs it")
    monkeypatch.chdir(tmp_path)
    run(START.partition(" && ")[2], monkeypatch, capsys)
    table = "".join(re.findall(r"^\| `.*$", README.read_text(encoding="utf-8"), re.MULTILINE))
    promised = set(re.findall(r"`([\w-]+\.\w+)`", table))
    folder = Path("straight-crane")
    assert promised == {path.name for path in folder.iterdir()}
    design = read_design(folder / "design.json")
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["refinement"]["met_after"]
    assert summary["refinement"]["met_in_sheet"]
    human = summary["human_efficiency"]
    assert design.efficiency is not None
    assert design.efficiency > 4.0 * human


def test_a_part_of_ones_own_is_designed_and_exported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    lib3mf = pytest.importorskip("lib3mf")
    monkeypatch.chdir(tmp_path)
    [task] = blocks("toml")
    Path("lift.toml").write_text(task)
    search, export, film = blocks("")[2].strip().splitlines()
    # So short a search may miss items of the specification, which has its own exit code.
    run(f"{search} --steps 1500 --no-refine", monkeypatch, capsys, (0, None, NOT_MET))
    summary = json.loads(Path("lift/summary.json").read_text())
    assert summary["as_part"]["status"] == "converged"
    assert summary["as_part"]["efficiency"] > 1.0
    run(export, monkeypatch, capsys)
    model = lib3mf.get_wrapper().CreateModel()
    model.QueryReader("3mf").ReadFromFile(export.split()[3])
    objects = model.GetMeshObjects()
    assert objects.Count() == 1
    objects.MoveNext()
    assert objects.GetCurrentMeshObject().IsManifoldAndOriented()
    run(film, monkeypatch, capsys)
    assert Path("lift.gif").stat().st_size > 50_000


def test_the_part_of_the_readme_is_that_of_its_record() -> None:
    record = json.loads((README.parent / "docs" / "start" / "summary.json").read_text())
    text = " ".join(README.read_text(encoding="utf-8").split())
    part = record["as_part"]
    assert f"efficiency {record['efficiency']:.2f} by frames of 8 elements" in text
    assert f"{record['search_efficiency']:.2f} in the search" in text
    (figures,) = record["part_figures"]
    assert f"at most {100.0 * figures['off_axis']:.1f} % of its travel" in text
    assert f"turns by at most {figures['rotation_deg']:.1f} degrees" in text
    assert (part["status"], part["contacts"], part["part"]["width"]) == ("converged", [], 2.0)
    assert f"4 mm down, output {figures['travel_mm']:.1f} mm up" in text
    assert f"{figures['efficiency_half']:.2f} at half of the stroke" in text
    assert f"sags by {figures['sag_mm']:.1f} mm" in text
    weight = 1000.0 * figures["dead_load_N"] / GRAVITY
    assert f"a weight of {weight:.0f} g that hangs on it before the push halves" in text
    sheet = json.loads((README.parent / "docs" / "start" / "validation.json").read_text())
    (plane,) = [each for each in sheet["results"] if each["level"] == "plane"]
    assert f"it moves {plane['mean_output_displacement_mm'][1]:.1f} mm up" in text
    reached = {each["quantity"]: each["reached"]["sheet"] for each in sheet["specification"]}
    assert f"leaves its direction by {100.0 * reached['off_axis']['value']:.1f} %" in text
    assert f"turns by {abs(reached['rotation']['value']):.1f} degrees" in text
    assert all(each["met"] for each in reached.values())


def test_the_part_on_the_front_of_the_readme_is_that_of_its_record() -> None:
    folder = README.parent / "docs" / "start"
    text = " ".join(README.read_text(encoding="utf-8").split())
    record = json.loads((folder / "crane-summary.json").read_text())
    (figures,) = record["part_figures"]
    sheet = json.loads((folder / "crane-validation.json").read_text())
    (plane,) = [each for each in sheet["results"] if each["level"] == "plane"]
    reached = {each["quantity"]: each["reached"]["sheet"] for each in sheet["specification"]}
    assert all(each["met"] for each in reached.values())
    assert record["refinement"]["met_after"]
    assert f"moves its output by {figures['travel_mm']:.1f} mm" in text
    gain, own = figures["efficiency"], plane["efficiency"]
    assert f"{gain:.1f} times as far as the input ({own:.1f} in finite elements" in text
    aside, own = figures["off_axis"], reached["off_axis"]["value"]
    assert f"at most {100.0 * aside:.1f} % of that ({100.0 * own:.1f} %)" in text
    turn, own = figures["rotation_deg"], abs(reached["rotation"]["value"])
    assert f"turns by {turn:.1f} degrees ({own:.1f})" in text
    grams = [1000.0 * figures[name] / GRAVITY for name in ("payload_N", "dead_load_N")]
    assert f"sags by {figures['sag_mm']:.1f} mm" in text
    assert f"to {grams[0]:.0f} g, or {grams[1]:.0f} g hung on before the push" in text


def test_the_bundled_crane_moves_as_the_readme_and_the_validation_say() -> None:
    design = find_design("machine:crane")
    (found,) = part_figures(design, spec_for(design), ELEMENTS)
    left, down = -np.array(found["path_mm"][-1])
    turn, payload, weight = (
        found["rotation_deg"], found["payload_N"] / GRAVITY * 1e3,
        found["dead_load_N"] / GRAVITY * 1e3,
    )  # fmt: skip
    readme = " ".join(README.read_text(encoding="utf-8").split())
    assert f"moves its output {found['efficiency']:.1f} times as far as the input:" in readme
    assert f"{left:.0f} mm to the left and also {down:.0f} mm down" in readme
    assert f"turns it by {turn:.0f} degrees; a weight of {weight:.0f} g that hangs" in readme
    page = (README.parent / "docs" / "validation.md").read_text(encoding="utf-8")
    page = " ".join(page.split())
    assert f"{left:.1f} mm to the left and {down:.1f} mm down, turns it by {turn:.1f}" in page
    assert f"sags by {found['sag_mm']:.1f} mm" in page
    assert f"grows with the input to {payload:.1f} g, or a weight of {weight:.1f} g" in page


def test_every_command_is_known_with_all_its_options(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    text = README.read_text(encoding="utf-8")
    written = [*blocks(""), *re.findall(r"`([^`\n]+)`", text)]
    commands = re.findall(r"(?:^|&& )(bellcrank .*?)(?=$| &&)", "\n".join(written), re.MULTILINE)
    assert len(commands) > 15
    for command in commands:
        words = shlex.split(command)
        nested = words[1] in ("campaign", "library", "machine")
        said = run(f"{shlex.join(words[: 3 if nested else 2])} --help", monkeypatch, capsys)
        for option in (word for word in words if word.startswith("--")):
            assert option in said, command


def test_an_actuator_is_characterised(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    text = README.read_text(encoding="utf-8")
    [command] = re.findall(r"`(bellcrank characterise[^`]*)`", text)
    assert "spring:0.1" in run(command, monkeypatch, capsys)


def test_a_network_predicts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("torch")
    monkeypatch.chdir(tmp_path)
    human = human_design("crane")
    assert human is not None
    Path("crane").mkdir()
    write_design(human, "crane/design.json")
    [predict] = re.findall(r"`(bellcrank predict[^`]*)`", README.read_text(encoding="utf-8"))
    assert str(human.beam_count) in run(predict, monkeypatch, capsys)


def test_the_library_has_as_many_actuators_as_the_readme_says() -> None:
    from bellcrank.machines.library import Library, bundled_folder

    assert f"{len(Library((bundled_folder(),)))} elementary actuators" in README.read_text(
        encoding="utf-8"
    )


def test_the_table_of_tasks_is_that_of_the_record_of_the_recorded_designs() -> None:
    record = json.loads((README.parent / "docs" / "tasks" / "figures.json").read_text())["rows"]
    text = README.read_text(encoding="utf-8")
    rows = re.findall(r"^\| `[\w-]+` \| [\d–].*$", text, re.MULTILINE)
    assert rows == table(record)
    sentence = "{} tasks ask for a payload, and {} parts carry it as a dead load"
    for page in (README, README.parent / "docs" / "tasks.md"):
        text = " ".join(page.read_text(encoding="utf-8").split())
        assert sentence.format(*carried(record)) in text
    runs = recorded_runs()
    for each in record:
        designs = {identity(run): run["met"] for run in runs if run["task"] == each["task"]}
        assert designs[each["design"]] == each["met"]


def test_the_python_example_runs(capsys: pytest.CaptureFixture[str]) -> None:
    [example] = blocks("python")
    exec(compile(example, "README.md", "exec"), {})
    assert float(capsys.readouterr().out) == pytest.approx(-0.0641, abs=5e-5)


def test_the_pictures_are_there() -> None:
    pictures = re.findall(r"!\[.*?\]\((.*?)\)", README.read_text(encoding="utf-8"), re.DOTALL)
    assert pictures
    for picture in pictures:
        assert (README.parent / picture).stat().st_size > 10_000, picture
