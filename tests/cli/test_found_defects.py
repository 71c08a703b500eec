"""Ways in which the command line once failed its users."""

from __future__ import annotations

import json
import shutil
import threading
from typing import TYPE_CHECKING, Any
from unittest import mock

import pytest

from bellcrank.model import find_problem
from bellcrank.search import parallel

from .helpers import PROBLEM, SMALL, call, refusal, write

if TYPE_CHECKING:
    from pathlib import Path

PAPER = ("--search", "paper")


@pytest.mark.parametrize("name", ["a[/b]", "b[red]x", "c:warning:x"])
def test_a_folder_of_any_name_is_named_as_it_is(here: Path, name: str) -> None:
    outcome = call("design", PROBLEM, "--steps", "10", "--chains", "1", "--out", name)
    assert outcome.code == 0
    assert f"{name}/" in outcome.out
    assert (here / name / "design.json").exists()


@pytest.mark.parametrize("name", [":warning:x", "a\\[b]", "[red]x"])
def test_an_unknown_name_is_repeated_as_it_was_typed(here: Path, name: str) -> None:
    assert name in refusal("evaluate", name).replace("\\\\", "\\")
    assert not list(here.iterdir())


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("design", PROBLEM, "--steps", "many"), "--steps"),
        (("design", PROBLEM, "--frob"), "--frob"),
        (("design", PROBLEM, "--chains", "32769"), "chains: expected a whole number of at most"),
        (("frobnicate",), "frobnicate"),
        (("evaluate",), "problem"),
        (("plot", PROBLEM, "--rest", "--compare", "nowhere"), "--compare"),
        (("plot", PROBLEM, "--rest", "--paths"), "--rest or --paths"),
    ],
)
def test_a_command_that_cannot_be_followed_is_refused_in_one_line(
    here: Path, words: tuple[str, ...], said: str
) -> None:
    assert said in refusal(*words)
    assert not list(here.iterdir())


def test_a_result_folder_takes_precedence_over_the_bundled_problem(here: Path, whole: Path) -> None:
    shutil.copytree(whole, here / PROBLEM)
    mask = json.loads((whole / "design.json").read_text())["mask"]
    for name in (PROBLEM, f"{PROBLEM}/"):
        outcome = call("evaluate", name, "--json")
        assert outcome.data["results"][0]["mask"] == mask
        assert ("note:" in outcome.err) == (name == PROBLEM)
    small = ("--seconds", "0.2", "--size", "320x240")
    assert "note:" in call("animate", PROBLEM, "motion.gif", *small).err
    assert (here / "motion.gif").stat().st_size > 1000
    record = here / "record.json"
    assert "note:" in call("validate", PROBLEM, "--elements", "1", "--record", record).err
    assert json.loads(record.read_text())["mask"] == mask


def test_the_name_of_a_problem_is_designed_for_whatever_folder_exists(
    here: Path, whole: Path
) -> None:
    shutil.copytree(whole, here / PROBLEM)
    outcome = call(
        "design", PROBLEM, "--search", "paper", "--steps", "2", "--chains", "1", "--out", "again"
    )
    assert outcome.code in {0, 3}, outcome.err  # two steps may find no design
    run = json.loads((here / "again" / "run.json").read_text())
    assert run["problem"]["initial"] == find_problem(PROBLEM).full_design().mask_hex


def test_an_unfinished_run_points_to_the_option_that_resumes_it(half: Path) -> None:
    message = refusal("export", half, "part.svg", folder=half)
    assert str(half) in message
    assert "--resume" in message


def test_an_error_in_one_chain_is_reported_though_another_was_stopped_by_it(half: Path) -> None:
    (half / "segments/001/00000000.parquet").write_bytes(b"")
    failed = threading.Event()
    real = parallel.ChainRunner.run

    def run(self: parallel.ChainRunner, stopped: Any, tell: Any) -> None:
        if self.chain == 0:
            failed.wait(10.0)
        try:
            real(self, stopped, tell)
        finally:
            failed.set()

    with mock.patch.object(parallel.ChainRunner, "run", run):
        outcome = call("design", "--resume", half, "--workers", "2")
    assert outcome.code == 1
    assert "error:" in outcome.err


def test_ctrl_c_outside_a_search_says_so(here: Path) -> None:
    with mock.patch("bellcrank.workflows.find.find_design", side_effect=KeyboardInterrupt):
        outcome = call("evaluate", PROBLEM)
    assert (outcome.code, outcome.err.strip()) == (130, "Interrupted.")
    assert not list(here.iterdir())


def test_a_file_nested_too_deeply_is_refused(here: Path) -> None:
    (here / "deep.json").write_text("[" * 50_000 + "]" * 50_000)
    assert "deep.json: not valid JSON" in refusal("evaluate", "deep.json")


def test_a_displacement_beyond_the_lattice_is_refused(here: Path) -> None:
    huge = {**SMALL, "input": {**SMALL["input"], "amount": 1e300}}
    write(here / "huge.json", huge)
    assert "input.amount" in refusal("evaluate", "huge.json")


def test_a_stroke_is_given_in_beam_lengths_and_millimetres(here: Path, lift: str) -> None:
    few = ("--model", "springs", "--search", "paper", "--steps", "2", "--chains", "1")
    small = call("design", lift, *few, "--out", "small").err
    assert "0.2 beam lengths" in small
    assert "2 mm" in small
    text = (here / lift).read_text().replace("amount = 0.2", "amount = 1.5")
    write(here / "large.toml", text)
    large = call("design", "large.toml", *few, "--out", "large").err
    assert "1.5 beam lengths" in large
    assert "15 mm" in large
    assert "note:" in large
    assert "note:" not in small
