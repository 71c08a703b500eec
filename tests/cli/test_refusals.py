"""Whatever is wrong with a command is said in one line, and nothing is written."""

from __future__ import annotations

import copy
import json
import os
from typing import TYPE_CHECKING, Any

import pytest

from bellcrank.model import design_to_dict, problem_to_dict
from bellcrank.storage.locking import LOCK, locked
from tests.reference3d import read_reference

from .helpers import LIFT, PROBLEM, SETTINGS, SMALL, call, files, refusal, write

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

SEARCHES = "paper, tempering, basin-hopping"

pytestmark = pytest.mark.usefixtures("here")


@pytest.mark.parametrize("command", ["design", "evaluate", "plot"])
def test_an_unknown_problem_is_refused_with_the_known_ones(command: str) -> None:
    line = refusal(command, "cran")
    assert line.startswith("error: unknown problem 'cran'; known: crane, anti-parallel, ")
    assert line.endswith("; and there is no such file")


@pytest.mark.parametrize("command", ["design", "evaluate", "plot"])
def test_a_missing_problem_file_is_named(command: str) -> None:
    line = refusal(command, "my.toml")
    assert line.startswith("error: unknown problem 'my.toml'; known: ")
    assert line.endswith("; and there is no such file")


def test_a_task_that_has_not_been_designed_is_named(here: Path) -> None:
    (here / "lift.toml").write_text(LIFT)
    line = refusal("export", "lift", "lift.stl")
    assert line == "error: no design 'lift'; bellcrank design lift.toml makes it"
    assert "unknown problem 'crane-2'" in refusal("export", "crane-2", "lift.stl")


@pytest.mark.parametrize("name", ["a[b]", "a[/b]", "[bold]"])
def test_what_was_typed_comes_back_as_it_was(name: str) -> None:
    line = refusal("design", PROBLEM, "--search", name)
    assert line == f"error: unknown search {name!r}; known: {SEARCHES}"


@pytest.mark.parametrize("command", ["design", "evaluate", "plot"])
@pytest.mark.parametrize(
    ("file", "text", "message"),
    [
        ("bad.toml", LIFT.replace("[input]", "[input"), "not valid TOML: Expected ']' at the end"),
        ("bad.toml", "", "key 'schema' is missing"),
        ("bad.json", '{"schema":', "not valid JSON: Expecting value (line 1, column 11)"),
        ("bad.json", "[]", "expected a JSON object, got a list"),
        ("bad.toml", LIFT.replace("amount", "amuont"), "unknown key 'input.amuont'; known here: "),
        ("bad.toml", "colour = 3\n" + LIFT, "unknown key 'colour'; known here: schema, name,"),
        ("bad.json", json.dumps(SMALL | {"colour": 3}), "unknown key 'colour'; known here: "),
        ("bad.yaml", LIFT, "expected a file ending in .toml or .json, got .yaml"),
    ],
)
def test_a_malformed_problem_file_is_refused(
    here: Path, command: str, file: str, text: str, message: str
) -> None:
    write(here / file, text)
    assert refusal(command, file).startswith(f"error: {file}: {message}")


def small_with(**changes: Any) -> dict[str, Any]:
    """Return the small problem with some nested keys replaced."""
    data = copy.deepcopy(SMALL)
    for key, value in changes.items():
        part, _, last = key.partition("__")
        if last:
            data[part][last] = value  # type: ignore[index]
        else:
            data[part] = value
    return data


ISLAND = small_with(
    positions=[*SMALL["positions"], [5.0, 5.0], [6.0, 5.0]],  # type: ignore[misc]
    beams=[*SMALL["beams"], [6, 7]],  # type: ignore[misc]
    initial="ff80",
    output__nodes=[6],
)


@pytest.mark.parametrize("command", ["design", "evaluate"])
@pytest.mark.parametrize(
    ("data", "message"),
    [
        (
            small_with(positions=[*SMALL["positions"][:5], [1.0, float("nan")]]),  # type: ignore[index]
            "positions[5][1]: expected a finite number, got nan",
        ),
        (small_with(initial="fff"), "initial: expected 2 hexadecimal digits for 8 beams, got 3"),
        (small_with(initial="xx"), "initial: expected hexadecimal digits, got 'x' at position 0"),
        (
            small_with(output__nodes=[5]),
            "output.nodes: node 5 is also in input.nodes; regions must not overlap",
        ),
        (small_with(input__nodes=[0]), "input.nodes: node 0 is also in supports.fixed"),
        (small_with(designable=[]), "designable: no beam is left to design"),
        (
            ISLAND,
            "output.nodes: node 6 and all other output nodes are not connected to the input",
        ),
        (small_with(input__amount=-0.1), "input.amount: expected a number greater than 0"),
        (small_with(objective="force"), "objective 'force' needs a problem with drive = 'force'"),
    ],
)
def test_an_impossible_problem_is_refused(
    here: Path, command: str, data: dict[str, Any], message: str
) -> None:
    write(here / "bad.json", data)
    line = refusal(command, "bad.json")
    assert line.startswith((f"error: bad.json: {message}", f"error: {message}"))


def test_overlapping_regions_of_a_toml_file_are_refused(here: Path) -> None:
    write(here / "bad.toml", LIFT.replace("leftmost = 2", "leftmost = 5"))
    assert "also in input.nodes; regions must not overlap" in refusal("design", "bad.toml")


def test_a_toml_file_without_any_designable_beam_is_refused(here: Path) -> None:
    text = LIFT.replace("[lattice]", "frozen = [{ rows = [1, 2, 3, 4, 5] }]\n[lattice]")
    write(here / "bad.toml", text)
    assert "designable: no beam is left to design" in refusal("design", "bad.toml")


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ({"masks": ["ff", "fff"]}, "masks[1]: expected 2 hexadecimal digits for 8 beams, got 3"),
        ({"masks": ["zz"]}, "masks[0]: expected hexadecimal digits, got 'z' at position 0"),
        ({"masks": [255]}, "masks[0]: expected hexadecimal text, got 255"),
        (
            {"results": [{"mask": "ff"}, {"mask": ""}]},
            "results[1].mask: expected 2 hexadecimal digits for 8 beams, got 0",
        ),
        ({"results": [{}]}, "results[0].mask: expected hexadecimal text, got None"),
        ({}, "expected a list 'masks', or 'results' with a 'mask' in each"),
        ("{", "not valid JSON: "),
    ],
)
def test_bad_designs_are_refused(here: Path, small: str, content: object, message: str) -> None:
    write(here / "masks.json", content)
    line = refusal("evaluate", small, "--designs", "masks.json", "--json")
    assert line.startswith(f"error: masks.json: {message}")


def test_a_missing_file_of_designs_is_refused(small: str) -> None:
    line = refusal("evaluate", small, "--designs", "masks.json")
    assert line == "error: masks.json: no such file"


@pytest.mark.parametrize(
    ("option", "message"),
    [
        ("--objective", "unknown objective 'best'; known: displacement, directional, force"),
        ("--search", f"unknown search 'best'; known: {SEARCHES}"),
        ("--schedule", "unknown schedule 'best'; known: linear, constant"),
        ("--cost", "unknown cost 'best'; known: exponential, negative"),
        (
            "--unloaded-beams",
            "unloaded_beams must be one of keep, prune_dead_ends, prune_all; got 'best'",
        ),
    ],
)
def test_an_unknown_choice_is_refused_with_the_known_ones(option: str, message: str) -> None:
    chain = ("--search", "paper") if option in ("--schedule", "--cost") else ()
    assert refusal("design", PROBLEM, *chain, option, "best") == f"error: {message}"
    if option in ("--objective", "--unloaded-beams"):
        assert refusal("evaluate", PROBLEM, option, "best") == f"error: {message}"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--steps", "-1"), "steps: expected a whole number of at least 1, got -1"),
        (("--steps", "0"), "steps: expected a whole number of at least 1, got 0"),
        (("--chains", "-2"), "chains: expected a whole number of at least 1, got -2"),
        (("--seed", "-1"), "seed: expected a whole number of at least 0, got -1"),
        (("--workers", "-1"), "workers: expected at least 1, got -1"),
        (("--workers", "0"), "workers: expected at least 1, got 0"),
        (("--cost", "negative"), "search 'basin-hopping' has no setting 'cost'; it has: before"),
        (("--set", "radius"), "--set radius: expected KEY=VALUE"),
        (("--set", "radius=-1"), "radius: expected a number above 0, got -1"),
        (("--set", "radius=wide"), "radius: expected a number above 0, got 'wide'"),
        (("--set", "min_density=[1]"), "min_density: expected a fraction from 0 to 1, got (1,)"),
        (
            ("--set", "max_failures=2.5"),
            "max_failures: expected a whole number of at least 1, got 2.5",
        ),
        (("--set", "colour=3"), "search 'basin-hopping' has no setting 'colour'; it has: "),
        (("--search", "tempering", "--set", 'moves=["jump"]'), "unknown move 'jump'; known: "),
        (
            ("--search", "tempering", "--set", "moves=flip"),
            "moves: expected names of moves, such as",
        ),
        (("--search", "tempering", "--set", "cold=1"), "cold: expected at most hot = 0.2, got 1"),
        (("--objective", "directional:1"), "objective directional:1: the part after the colon"),
        (("--objective", "force"), "objective 'force' needs a problem with drive = 'force'"),
    ],
)
def test_settings_that_make_no_sense_are_refused(words: tuple[str, ...], message: str) -> None:
    assert refusal("design", PROBLEM, *words).startswith(f"error: {message}")


def test_a_design_job_needs_either_a_problem_or_a_run(whole: Path) -> None:
    before = files(whole)
    for words in ((), (PROBLEM, "--resume", whole)):
        line = refusal("design", *words)
        assert (
            line
            == "error: give one of these: a problem to design for, --from DESIGN, or --resume DIR"
        )
    assert files(whole) == before


@pytest.mark.parametrize(
    ("words", "what"),
    [
        (("--steps", 9000), "steps"),
        (("--cost", "negative"), "cost"),
        (("--set", "depth=3"), "depth"),
        (("--out", "elsewhere"), "out"),
    ],
)
def test_a_run_goes_on_as_it_was_begun(half: Path, words: tuple[str, ...], what: str) -> None:
    line = refusal("design", "--resume", half, *words, folder=half)
    assert line.startswith(f"error: --{what} cannot be changed with --resume")
    assert line.endswith(f"--from {half}")


def test_one_process_at_a_time_is_at_work_on_a_run(half: Path) -> None:
    with locked(half / LOCK):
        line = refusal("design", "--resume", half, code=1, folder=half)
    assert line.startswith(f"error: {half}: process {os.getpid()} is working in this folder")
    assert "--out" in line
    assert call("design", "--resume", half).code == 0
    assert not (half / LOCK).exists()


# Places where nothing can be written, or should not be.


def test_a_folder_that_cannot_be_made_is_named(here: Path) -> None:
    write(here / "file", "in the way")
    line = refusal("design", PROBLEM, *SETTINGS, "--out", "file/run", code=1)
    assert line.startswith("error: file/run: cannot be written (Not a directory); ")
    line = refusal("plot", PROBLEM, "--rest", "--out", "file/p.png", code=1)
    assert line.startswith("error: file/p.png: cannot be written (Not a directory)")


def test_a_file_is_never_taken_for_an_output_folder(here: Path) -> None:
    write(here / "file", "precious")
    line = refusal("design", PROBLEM, *SETTINGS, "--out", "file")
    assert line == "error: file: is a file; choose another folder (--out)"


def test_an_earlier_run_is_not_written_over(copy: Path) -> None:
    line = refusal("design", PROBLEM, *SETTINGS, "--out", copy, folder=copy)
    assert line.startswith(f"error: {copy}: exists already and is not empty (it holds ")
    assert line.endswith(
        f"choose another folder (--out), or continue the run in it (--resume {copy})"
    )


def test_a_folder_of_other_things_is_not_written_into(here: Path) -> None:
    (here / "thesis").mkdir()
    write(here / "thesis" / "thesis.tex", "years of work")
    line = refusal("design", PROBLEM, *SETTINGS, "--out", "thesis")
    assert line == (
        "error: thesis: exists already and is not empty (it holds thesis.tex); "
        "choose another folder (--out)"
    )


# Runs that are none, or are damaged.


def test_what_is_no_run_cannot_be_resumed(here: Path) -> None:
    write(here / "file", "no run")
    (here / "empty").mkdir()
    assert "error: nowhere: no such folder" in refusal("design", "--resume", "nowhere")
    assert "error: file: no such folder" in refusal("design", "--resume", "file")
    line = refusal("design", "--resume", "empty")
    assert line.startswith("error: empty: not the folder of a run: it has no run.json")


def truncate(data: bytes) -> bytes:
    return data[: len(data) // 2]


def retouch(data: bytes) -> bytes:
    changed = data.replace(b'"seed": 5', b'"seed": 6')
    assert changed != data
    return changed


@pytest.mark.parametrize(
    ("spoil", "code", "message"),
    [
        (truncate, 1, "not valid JSON"),
        (lambda _: b"", 1, "not valid JSON"),
        (retouch, 1, "was changed after the run had started"),
        (lambda _: b"\xff\xfe\x00", 2, "expected UTF-8 text"),
        (lambda _: b"{}", 2, "expected schema 'bellcrank/run/1', got None"),
    ],
)
def test_a_damaged_description_of_a_run_is_named(
    half: Path, spoil: Callable[[bytes], bytes], code: int, message: str
) -> None:
    path = half / "run.json"
    path.write_bytes(spoil(path.read_bytes()))
    line = refusal("design", "--resume", half, code=code, folder=half)
    assert line.startswith(f"error: {path}: {message}")


def garble(data: bytes) -> bytes:
    return data[:-200] + bytes(200)


@pytest.mark.parametrize("spoil", [truncate, garble, lambda _: b""])
def test_a_damaged_shard_is_named_and_left_as_it_is(
    half: Path, spoil: Callable[[bytes], bytes]
) -> None:
    path = half / "segments" / "000" / "00000000.parquet"
    path.write_bytes(spoil(path.read_bytes()))
    before = path.read_bytes()
    outcome = call("design", "--resume", half, "--workers", 1)
    assert outcome.code == 1
    assert outcome.out == ""
    assert outcome.complaints.startswith(f"error: {path}: damaged")
    assert "delete" in outcome.complaints
    assert outcome.complaints.count("\n") == 1
    assert path.read_bytes() == before
    assert not (half / "design.json").exists()


def test_a_flipped_bit_in_a_shard_is_noticed_before_anything_is_concluded(half: Path) -> None:
    path = half / "segments" / "000" / "00000000.parquet"
    data = bytearray(path.read_bytes())
    data[300] ^= 0x10
    path.write_bytes(data)
    outcome = call("design", "--resume", half)
    assert outcome.code == 1
    assert outcome.out == ""
    assert outcome.complaints.startswith(f"error: {path}: damaged")
    assert outcome.complaints.count("\n") == 1
    assert path.read_bytes() == data
    assert not (half / "design.json").exists()
    assert not (half / "history.parquet").exists()


@pytest.mark.parametrize("spoil", [truncate, garble, lambda _: b""])
def test_a_damaged_history_is_named(copy: Path, spoil: Callable[[bytes], bytes]) -> None:
    path = copy / "history.parquet"
    path.write_bytes(spoil(path.read_bytes()))
    for words in (("design", "--resume", copy), ("plot", copy, "--paths")):
        line = refusal(*words, code=1, folder=copy)
        assert line.startswith(f"error: {path}: damaged (")


def test_an_existing_picture_is_not_written_over(here: Path) -> None:
    write(here / "p.png", "precious")
    line = refusal("plot", PROBLEM, "--rest", "--out", "p.png")
    assert line.startswith("error: p.png: exists already; remove it")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (
            ("--elements", "1"),
            "elements: only beams of frames are divided, the spring model is not",
        ),
        (("--model", "frames", "--elements", "0"), "elements: expected at least 1 in each beam"),
        (("--model", "shells"), "unknown model 'shells'; known: springs, frames"),
    ],
)
def test_models_that_do_not_exist_are_refused(words: tuple[str, ...], message: str) -> None:
    assert refusal("evaluate", "crane", *words).startswith(f"error: {message}")


def test_the_spring_model_is_refused_in_space(here: Path) -> None:
    problem, _ = read_reference("octet-crane")
    write(here / "space.json", problem_to_dict(problem))
    line = refusal("evaluate", "space.json", "--model", "springs")
    assert line == (
        "error: spring model: problem 'octet-crane' is in space; only problems in the plane are "
        "accepted here"
    )


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--paper", "--model", "frames"), "--paper: --model frames contradicts it; "),
        (("--paper", "--search", "tempering"), "--paper: --search tempering contradicts it; "),
        (("--paper", "--strut-width", "2mm"), "--paper: --strut-width 2mm contradicts it; "),
        (("--paper", "--unloaded-beams", "prune_all"), "--paper: --unloaded-beams prune_all"),
        (("--paper", "--set", "hot=1"), "--paper: --set hot 1 contradicts it; "),
        (("--model", "springs", "--material", "pla"), "--material: a part is made of frames; "),
        (("--model", "shells"), "unknown model 'shells'; known: springs, frames"),
    ],
)
def test_contradictory_models_of_a_design_are_refused(words: tuple[str, ...], message: str) -> None:
    assert refusal("design", PROBLEM, *words).startswith(f"error: {message}")


def test_pictures_of_stress_are_for_the_plane(here: Path) -> None:
    problem, _ = read_reference("octet-crane")
    write(here / "space.json", design_to_dict(problem.full_design()))
    words = ("validate", "space.json", "--level", "solid", "--picture", "stress.png")
    assert refusal(*words).startswith("error: --picture: problem 'octet-crane' is in space; only")


def test_designs_in_space_have_no_spring_model_and_need_a_symmetric_lattice(here: Path) -> None:
    problem, _ = read_reference("octet-crane")
    write(here / "space.json", problem_to_dict(problem))
    line = refusal("design", "space.json", "--model", "springs")
    assert line.startswith("error: spring model: problem 'octet-crane' is in space")
    line = refusal("design", "space.json", "--goal", "mirror x")
    assert line.startswith("error: goal 'mirror x': problem 'octet-crane' is not symmetric in x")
