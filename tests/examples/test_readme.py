"""What the README says can be done, can be done."""

from __future__ import annotations

import json
import re
import shlex
import sys
from pathlib import Path

import pytest

from bellcrank.cli import main
from bellcrank.model import human_design, read_design, write_design

README = Path(__file__).parents[2] / "README.md"
START = "pip install . && bellcrank design crane"
TEST = "pip install '.[test]' && pytest"


def blocks(language: str) -> list[str]:
    """Code blocks of the README in one language."""
    text = README.read_text(encoding="utf-8")
    found = re.findall(r"^```(\w*)\n(.*?)^```$", text, re.DOTALL | re.MULTILINE)
    return [code for named, code in found if named == language]


def run(command: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> str:
    """Run a command line in this process; return what it printed."""
    monkeypatch.setattr(sys, "argv", shlex.split(command))
    with pytest.raises(SystemExit) as left:
        main()
    printed = capsys.readouterr()
    assert left.value.code in (0, None), printed.err
    return printed.out


def test_the_two_commands_stand_by_themselves() -> None:
    assert [block.strip() for block in blocks("")[:2]] == [START, TEST]


def test_the_commands_do_what_the_readme_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    run(START.partition(" && ")[2], monkeypatch, capsys)
    table = "".join(re.findall(r"^\| `.*$", README.read_text(encoding="utf-8"), re.MULTILINE))
    promised = set(re.findall(r"`([\w-]+\.\w+)`", table))
    assert promised == {path.name for path in Path("crane").iterdir()}
    design = read_design("crane/design.json")
    human = json.loads(Path("crane/summary.json").read_text())["human_efficiency"]
    assert design.efficiency is not None
    assert design.efficiency > 2.0 * human
    Path("masks.json").write_text(json.dumps({"masks": [design.mask_hex]}))

    commands = blocks("")[2].strip().splitlines()
    printed = {command: run(command, monkeypatch, capsys) for command in commands}
    assert len(commands) == 6
    assert "anti-parallel" in printed["bellcrank problems"]
    assert f"{design.efficiency:.7f}" in printed["bellcrank evaluate crane/design.json"]
    [result] = json.loads(next(out for call, out in printed.items() if "--json" in call))["results"]
    assert result["efficiency"] == pytest.approx(design.efficiency, abs=1e-6)
    assert Path("cranes.png").stat().st_size > 50_000
    assert Path("up/design.json").exists()


def test_a_task_of_ones_own_is_designed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    task, _ = blocks("toml")
    Path("lift.toml").write_text(task)
    run("bellcrank design lift.toml --chains 2 --steps 3000", monkeypatch, capsys)
    efficiency = read_design("lift/design.json").efficiency
    assert efficiency is not None
    assert efficiency > 0.3


def test_a_campaign_is_run_and_harvested(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    _, spec = blocks("toml")
    Path("many.toml").write_text(spec.replace("seeds = 30", "seeds = 3\nsteps = 500"))
    first, second = blocks("")[3].strip().splitlines()
    assert "3 / 3" in run(first, monkeypatch, capsys)
    run(second, monkeypatch, capsys)
    efficiency = read_design("many-designs/crane-basin-hopping.json").efficiency
    assert efficiency is not None
    assert efficiency > 1.0


def test_a_part_is_searched_for_and_validated(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    search, check, picture = blocks("")[4].strip().splitlines()
    run(f"{search} --steps 500 --chains 1", monkeypatch, capsys)
    assert read_design("part/design.json").provenance["part"]["width"] == 2.0
    assert "euler-bernoulli" in run(check, monkeypatch, capsys)
    record = json.loads(Path("part/validation.json").read_text())
    assert record["results"][0]["status"] == "converged"
    run(picture, monkeypatch, capsys)
    assert Path("stress.png").stat().st_size > 50_000
    commands = blocks("")[5].strip().splitlines()
    assert len(commands) == 4
    for command in commands:
        run(command, monkeypatch, capsys)
        assert Path(command.split()[3]).stat().st_size > 10_000, command


def test_a_network_predicts_and_is_explained(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    predict, explain = blocks("")[6].strip().splitlines()
    Path("crane").mkdir()
    human = human_design("crane")
    assert human is not None
    write_design(human, "crane/design.json")
    assert str(human.beam_count) in run(predict, monkeypatch, capsys)
    run(explain, monkeypatch, capsys)
    assert Path("explained.png").stat().st_size > 50_000


def test_an_actuator_is_characterised(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (command,) = blocks("")[7].strip().splitlines()
    printed = run(command, monkeypatch, capsys)
    assert "spring:0.1" in printed
    assert "0.8178" in printed


def test_the_validation_table_is_that_of_the_record() -> None:
    record = json.loads((README.parent / "docs" / "validation" / "levels.json").read_text())
    text = README.read_text(encoding="utf-8")
    rows = re.findall(r"^\| ([\w-]+) \| (hand|machine) \| (.*?) \|$", text, re.MULTILINE)
    assert len(rows) == sum(":" in name for name in record)
    columns = ("discrete_model", "frame, euler-bernoulli", "plane, neo-hookean")
    for task, by, figures in rows:
        entry = record[f"{'human' if by == 'hand' else by}:{task}"]
        expected = [f"{entry[column]['efficiency']:.2f}" for column in columns]
        assert [figure.strip() for figure in figures.split("|")][:3] == expected, task


def test_the_python_example_runs(capsys: pytest.CaptureFixture[str]) -> None:
    [example] = blocks("python")
    exec(compile(example, "README.md", "exec"), {})
    assert float(capsys.readouterr().out) == pytest.approx(-0.0641, abs=5e-5)


def test_the_pictures_are_there() -> None:
    pictures = re.findall(r"!\[.*?\]\((.*?)\)", README.read_text(encoding="utf-8"), re.DOTALL)
    assert pictures
    for picture in pictures:
        assert (README.parent / picture).stat().st_size > 10_000, picture
