"""A training ends with the same weights after any interruption, and reduces the error."""

from __future__ import annotations

import json
import math
import os
import signal
import subprocess
import sys
from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import torch

from bellcrank.errors import (
    CorruptRun,
    InvalidFile,
    InvalidModel,
    InvalidSettings,
    OutputExists,
    RunFailed,
    UnknownName,
)
from bellcrank.surrogate import training as module
from bellcrank.surrogate.checkpoints import CHECKPOINT
from bellcrank.surrogate.metrics import accuracy
from bellcrank.surrogate.recipes import Recipe, recipe_of
from bellcrank.surrogate.splitting import rows_of_epoch, split_by_run
from bellcrank.surrogate.trained_model import MODEL, read_model
from bellcrank.surrogate.training_setup import (
    DESCRIPTION,
    START,
    TRAINING_SCHEMA,
    begin,
    resume,
)

from .helpers import TINY, random_dataset, same_weights, untrained

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from bellcrank.model import Problem
    from bellcrank.surrogate.dataset import Dataset
    from bellcrank.surrogate.trained_model import TrainedModel
    from bellcrank.surrogate.training import EpochRecord, Training

STEPS = 15
AVERAGED = replace(
    TINY, optimiser="adamw", schedule="cosine", warm_up=4, weight_decay=0.01, averaging=0.9
)


def to_the_end(training: Training) -> TrainedModel:
    for _ in training.run():
        pass
    assert training.is_done
    return training.finish()


def after(steps: int) -> Callable[[], bool]:
    """Stop when asked for the time of that number."""
    asked = 0

    def stop() -> bool:
        nonlocal asked
        asked += 1
        return asked >= steps

    return stop


def timeless(log: list[EpochRecord]) -> list[EpochRecord]:
    return [replace(epoch, seconds=0.0) for epoch in log]


@pytest.fixture(scope="module")
def whole(data: Dataset, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Training]:
    """The folder of a training that nothing interrupted."""
    folder = tmp_path_factory.mktemp("whole") / "training"
    training = begin(data, AVERAGED, folder, device="cpu")
    to_the_end(training)
    return folder, training


@pytest.mark.parametrize("steps", [1, 2, 4, 5, 6, 14])
def test_a_training_stopped_every_few_steps_ends_with_the_same_weights(
    data: Dataset, whole: tuple[Path, Training], tmp_path: Path, steps: int
) -> None:
    training = begin(data, AVERAGED, tmp_path / "t", device="cpu")
    sessions = 0
    while not training.is_done:
        sessions += 1
        assert sessions <= 2 * STEPS
        list(training.run(after(steps)))
        training = resume(tmp_path / "t", data, device="cpu")
    assert sessions >= STEPS // steps
    model = training.finish()
    assert same_weights(model, read_model(whole[0] / MODEL))
    assert timeless(training.log) == timeless(whole[1].log)
    assert model.record["held_out"] == read_model(whole[0] / MODEL).record["held_out"]


def test_a_consumer_that_walks_away_costs_what_came_after_the_last_checkpoint(
    data: Dataset, whole: tuple[Path, Training], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "REPORT_SECONDS", -1.0)
    training = begin(data, AVERAGED, tmp_path / "t", device="cpu")
    story = training.run()
    reports = [next(story) for _ in range(8)]
    story.close()
    assert [each.done for each in reports] == [16, 32, 48, 64, 80, 80, 96, 112]
    assert reports[5].epoch is not None
    assert reports[0].total == 16 * STEPS
    again = resume(tmp_path / "t", data, device="cpu")
    assert again.step == 5  # the end of the first epoch
    assert same_weights(to_the_end(again), read_model(whole[0] / MODEL))


def test_the_object_itself_goes_on_where_its_story_was_left(
    data: Dataset, whole: tuple[Path, Training], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "REPORT_SECONDS", -1.0)
    training = begin(data, AVERAGED, device="cpu")
    for number, _ in enumerate(training.run()):
        if number == 7:
            break
    assert same_weights(to_the_end(training), read_model(whole[0] / MODEL))


def test_asking_a_network_in_the_middle_of_its_training_does_not_change_what_it_learns(
    data: Dataset, whole: tuple[Path, Training], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "REPORT_SECONDS", -1.0)
    training = begin(data, AVERAGED, device="cpu")
    for _ in training.run():
        training.model.predict(data.packed[:3], device="cpu")
        training.finish()
    assert same_weights(training.finish(), read_model(whole[0] / MODEL))


def test_convolutions_resume_to_the_last_bit_too(problem: Problem, tmp_path: Path) -> None:
    data = random_dataset(problem, runs=4, steps=10)
    recipe = replace(AVERAGED, model="resnet18-w16", batch=2, epoch_size=6, epochs=2, tested=4)
    expected = to_the_end(begin(data, recipe, device="cpu"))
    training = begin(data, recipe, tmp_path / "t", device="cpu")
    list(training.run(after(2)))
    training = resume(tmp_path / "t", data, device="cpu")
    list(training.run(after(2)))
    assert same_weights(to_the_end(resume(tmp_path / "t", data, device="cpu")), expected)


CHILD = """
import json, sys, torch
torch.set_num_threads(1)
from bellcrank.surrogate import training
from bellcrank.surrogate.training_setup import begin
from bellcrank.surrogate.dataset import read_dataset
from bellcrank.surrogate.recipes import Recipe
training.CHECKPOINT_SECONDS = training.REPORT_SECONDS = 0.0
data = read_dataset(sys.argv[1])
recipe = Recipe.from_dict(json.loads(sys.argv[3]))
running = begin(data, recipe, sys.argv[2], device="cpu")
print("start", running.step, flush=True)
for progress in running.run():
    print("done", progress.done, flush=True)
"""


@pytest.mark.slow
def test_a_training_killed_without_warning_ends_with_the_same_weights(
    data: Dataset, whole: tuple[Path, Training], tmp_path: Path
) -> None:
    data.write(tmp_path / "data.parquet")
    words = [sys.executable, "-c", CHILD, tmp_path / "data.parquet", tmp_path / "t"]
    words.append(json.dumps(AVERAGED.to_dict()))
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as child:
        assert child.stdout is not None
        reports = [child.stdout.readline().split() for _ in range(5)]
        os.kill(child.pid, signal.SIGKILL)
    assert child.returncode == -signal.SIGKILL
    assert reports[-1] == ["done", "64"]
    training = resume(tmp_path / "t", data, device="cpu")
    assert 2 < training.step < STEPS
    assert same_weights(to_the_end(training), read_model(whole[0] / MODEL))


def test_the_log_has_a_record_of_each_epoch(whole: tuple[Path, Training]) -> None:
    folder, training = whole
    assert [each.epoch for each in training.log] == [1, 2, 3]
    assert [each.designs for each in training.log] == [80, 160, 240]
    seconds = [each.seconds for each in training.log]
    assert seconds == sorted(seconds)
    assert seconds[0] > 0.0
    assert read_model(folder / MODEL).record["epochs"] == [asdict(each) for each in training.log]


def test_the_loss_of_an_epoch_is_the_mean_over_its_batches(
    data: Dataset, monkeypatch: pytest.MonkeyPatch
) -> None:
    losses: list[float] = []
    real = torch.mean

    def mean(values: torch.Tensor) -> torch.Tensor:
        found = real(values)
        losses.append(float(found.detach()))
        return found

    monkeypatch.setattr(torch, "mean", mean)
    monkeypatch.setattr(module, "REPORT_SECONDS", -1.0)
    training = begin(data, TINY, device="cpu")
    for progress in training.run():
        batches = len(losses) % 5 or 5
        assert progress.loss == pytest.approx(np.mean(losses[-batches:]))
        if progress.epoch is not None:
            assert progress.epoch.loss == progress.loss
    assert len(losses) == STEPS


def test_the_figures_of_the_last_epoch_are_those_of_the_model(
    data: Dataset, whole: tuple[Path, Training]
) -> None:
    folder, training = whole
    model, rows = read_model(folder / MODEL), training.split.held_out
    found = accuracy(model.predict(data.packed[rows], device="cpu"), data.efficiency[rows])
    last = training.log[-1]
    assert last.r_squared == pytest.approx(found.r_squared, abs=1e-6)
    assert last.determination == pytest.approx(found.determination, abs=1e-6)
    assert model.record["held_out"]["rms_error"] == pytest.approx(found.rms_error, abs=1e-6)
    assert model.record["data"]["designs"] == len(data)
    assert [each["epoch"] for each in model.record["epochs"]] == [1, 2, 3]
    assert Recipe.from_dict(model.record["recipe"]) == AVERAGED


def test_the_last_test_may_be_on_a_part_and_says_how_far_it_is(data: Dataset) -> None:
    training = begin(data, replace(TINY, tested_last=40), None, device="cpu")
    for _ in training.run():
        pass
    seen: list[tuple[int, int]] = []
    model = training.finish(lambda progress: seen.append(progress.testing or (0, 0)))
    assert model.record["held_out"]["count"] == 40 < len(training.split.held_out)
    assert seen[-1] == (40, 40)
    assert [done for done, _ in seen] == sorted({done for done, _ in seen})


def test_a_network_learns_to_count_beams(problem: Problem) -> None:
    data = random_dataset(problem, runs=20, steps=50)
    recipe = Recipe(
        model="mlp", epochs=6, batch=50, held_out=0.2, averaging=0.9, optimiser="adamw",
        schedule="cosine", resampling=False, precision="float32",
    )  # fmt: skip
    model = to_the_end(begin(data, recipe, device="cpu"))
    fresh = random_dataset(problem, runs=1, steps=100, seed=99)
    predicted = model.predict(fresh.packed, device="cpu")
    assert accuracy(predicted, fresh.efficiency).determination > 0.9


def test_a_training_that_diverges_says_so(data: Dataset) -> None:
    training = begin(data, replace(TINY, learning_rate=1e30), device="cpu")
    with pytest.raises(RunFailed, match=r"diverged: its loss is .*; train again with a lower"):
        list(training.run())


def test_resuming_with_other_data_is_refused(
    data: Dataset, whole: tuple[Path, Training], problem: Problem
) -> None:
    other = random_dataset(problem, seed=5)
    with pytest.raises(InvalidSettings, match="other data"):
        resume(whole[0], other, device="cpu")
    with pytest.raises(InvalidSettings, match="other data"):
        resume(whole[0], data.take(np.arange(len(data) - 1)), device="cpu")


def test_a_folder_without_a_training_cannot_be_gone_on_with(data: Dataset, tmp_path: Path) -> None:
    for folder in (tmp_path, tmp_path / "absent"):
        with pytest.raises(InvalidFile, match=r"folder of a training"):
            resume(folder, data)


@pytest.mark.parametrize("name", [DESCRIPTION, CHECKPOINT, MODEL, START])
def test_a_folder_that_holds_anything_of_a_training_is_left_alone(
    data: Dataset, tmp_path: Path, name: str
) -> None:
    (tmp_path / name).write_text("something")
    with pytest.raises(OutputExists, match=name):
        begin(data, TINY, tmp_path, device="cpu")
    assert [path.name for path in tmp_path.iterdir()] == [name]
    assert (tmp_path / name).read_text() == "something"


def half(data: Dataset, folder: Path) -> Path:
    list(begin(data, AVERAGED, folder, device="cpu").run(after(3)))
    return folder


def test_a_damaged_checkpoint_is_named_and_training_begins_again_without_it(
    data: Dataset, whole: tuple[Path, Training], tmp_path: Path
) -> None:
    file = half(data, tmp_path / "t") / CHECKPOINT
    content = file.read_bytes()
    for damaged in (b"", content[:7], content[:500], content[:-1], b"\x00" * 100):
        file.write_bytes(damaged)
        with pytest.raises(InvalidModel, match=r"checkpoint\.safetensors: damaged .*; delete it"):
            resume(tmp_path / "t", data, device="cpu")
    file.unlink()
    again = resume(tmp_path / "t", data, device="cpu")
    assert again.step == 0
    assert same_weights(to_the_end(again), read_model(whole[0] / MODEL))


def test_a_checkpoint_of_another_network_is_refused(data: Dataset, tmp_path: Path) -> None:
    folder = half(data, tmp_path / "t")
    other = replace(TINY, model="resnet18-w16", batch=2, epoch_size=4, tested=2)
    list(begin(data, other, tmp_path / "g", device="cpu").run(after(1)))
    (folder / CHECKPOINT).write_bytes((tmp_path / "g" / CHECKPOINT).read_bytes())
    with pytest.raises(InvalidModel, match="damaged"):
        resume(folder, data, device="cpu")


@pytest.mark.parametrize("text", ["{", "[]", '{"schema": "other"}', '{"schema": "S"}'])
def test_a_damaged_description_is_refused(data: Dataset, tmp_path: Path, text: str) -> None:
    (tmp_path / DESCRIPTION).write_text(text.replace("S", TRAINING_SCHEMA))
    with pytest.raises((InvalidFile, CorruptRun), match=r"training\.json"):
        resume(tmp_path, data, device="cpu")


def test_what_cannot_be_learnt_from_is_refused(data: Dataset) -> None:
    level = replace(data, efficiency=np.full(len(data), 0.1))
    with pytest.raises(InvalidSettings, match=r"all training efficiencies are 0\.1"):
        begin(level, TINY, device="cpu")
    with pytest.raises(UnknownName, match="unknown model 'vgg'"):
        begin(data, replace(TINY, model="vgg"), device="cpu")
    with pytest.raises(InvalidSettings, match="device: "):
        begin(data, TINY, device="abacus")
    with pytest.raises(InvalidSettings, match="device: expected auto, cpu or cuda, got 'meta'"):
        begin(data, TINY, device="meta")


@pytest.mark.parametrize(
    "given",
    [
        {"epochs": 0}, {"batch": 1}, {"epochs": 1.5}, {"seed": -1}, {"warm_up": True},
        {"learning_rate": 0.0}, {"learning_rate": float("nan")}, {"weight_decay": -1.0},
        {"held_out": 0.0}, {"held_out": 1.0}, {"averaging": 1.0}, {"optimiser": "sgd"},
        {"schedule": "step"}, {"precision": "float64"}, {"epoch_size": 3},
    ],
)  # fmt: skip
def test_recipes_that_make_no_sense_are_refused(given: dict[str, Any]) -> None:
    with pytest.raises(InvalidSettings, match=rf"^{next(iter(given))}: "):
        recipe_of("paper", **given)
    with pytest.raises(InvalidSettings, match=r"^color: "):
        Recipe.from_dict({"color": 1})


def test_the_paper_s_recipe_is_the_paper_s() -> None:
    paper = recipe_of("paper")
    assert (paper.model, paper.epochs, paper.batch, paper.optimiser) == ("resnet50", 10, 32, "adam")
    assert (paper.held_out, paper.resampling, paper.averaging) == (0.25, True, 0.0)


def test_what_a_killed_training_was_writing_is_removed(data: Dataset, tmp_path: Path) -> None:
    folder = half(data, tmp_path / "t")
    for name in (".checkpoint.safetensors.0123abcd", ".mine.0123abcd", "note"):
        (folder / name).write_text("half")
    resume(folder, data, device="cpu")
    assert sorted(path.name for path in folder.iterdir()) == sorted(
        [".mine.0123abcd", "note", CHECKPOINT, DESCRIPTION]
    )


def test_short_epochs_go_through_all_designs_before_any_comes_again() -> None:
    recipe = Recipe(resampling=False, seed=3)
    rows, nothing = np.arange(10, 110), np.zeros(100)
    seen = [rows_of_epoch(recipe, epoch, rows, nothing, 30) for epoch in range(7)]
    every = np.concatenate(seen)
    assert np.array_equal(np.sort(every[:100]), rows)
    assert np.array_equal(np.sort(every[100:200]), rows)
    assert not np.array_equal(every[:100], every[100:200])
    assert np.array_equal(rows_of_epoch(recipe, 4, rows, nothing, 30), seen[4])


def test_nothing_to_test_with_is_refused(data: Dataset) -> None:
    split = split_by_run(data, TINY.held_out, TINY.split_seed)
    flat = data.efficiency.copy()
    flat[split.held_out] = 0.1
    with pytest.raises(InvalidSettings, match=r"all held-out efficiencies are 0\.1"):
        begin(replace(data, efficiency=flat), TINY, device="cpu")


def test_a_network_that_says_the_same_of_all_has_no_correlation() -> None:
    found = accuracy(np.full(5, 0.3), np.arange(5.0))
    assert math.isnan(found.r_squared)
    assert found.determination < 0.0
    assert found.to_dict()["r_squared"] is None
    constant = accuracy(np.arange(3.0), np.full(3, 0.1))
    assert math.isnan(constant.determination)


def test_a_training_starts_from_the_weights_and_the_normalisation_of_another(
    data: Dataset, problem: Problem
) -> None:
    start = untrained(problem, seed=4)
    before = start.predict(data.packed[:9], device="cpu")
    training = begin(data, AVERAGED, start=start, device="cpu")
    assert np.array_equal(training.model.predict(data.packed[:9], device="cpu"), before)
    assert (training.model.mean, training.model.deviation) == (0.25, 0.5)
    model = to_the_end(training)
    assert model.record["start"] == {"note": "untrained"}
    assert not same_weights(model, start)
    assert np.array_equal(start.predict(data.packed[:9], device="cpu"), before)
    assert begin(data, AVERAGED, device="cpu").start is None


def test_a_training_with_a_start_resumes_to_the_same_weights_even_without_its_checkpoint(
    data: Dataset, problem: Problem, tmp_path: Path
) -> None:
    start = untrained(problem, seed=4)
    whole = to_the_end(begin(data, AVERAGED, start=start, device="cpu"))
    list(begin(data, AVERAGED, tmp_path, start=start, device="cpu").run(after(7)))
    resumed = resume(tmp_path, data, device="cpu")
    assert resumed.step == 7
    assert same_weights(to_the_end(resumed), whole)
    (tmp_path / CHECKPOINT).unlink()
    again = resume(tmp_path, data, device="cpu")
    assert again.step == 0
    assert same_weights(to_the_end(again), whole)


def test_a_short_training_from_a_trained_network_is_better_than_from_random_weights(
    problem: Problem,
) -> None:
    data = random_dataset(problem, runs=20, steps=50)
    recipe = replace(AVERAGED, epochs=8, batch=50, epoch_size=None)
    trained = to_the_end(begin(data, recipe, device="cpu"))
    short = replace(recipe, epochs=1, learning_rate=1e-4)
    fresh = random_dataset(problem, runs=20, steps=50, seed=9)
    errors = [
        to_the_end(begin(fresh, short, start=each, device="cpu")).record["held_out"]["rms_error"]
        for each in (trained, None)
    ]
    assert errors[0] < 0.5 * errors[1]


def test_a_start_of_another_architecture_or_problem_is_refused(
    data: Dataset, problem: Problem, crane: Problem, tmp_path: Path
) -> None:
    with pytest.raises(
        InvalidModel, match=r"starts from a 'resnet18-w16', .* 'mlp'; .*--model resnet18-w16"
    ):
        begin(data, TINY, tmp_path / "t", start=untrained(problem, "resnet18-w16"), device="cpu")
    with pytest.raises(InvalidModel, match=r"trained on 'crane' with .* 'scaling-8' has"):
        begin(data, TINY, tmp_path / "t", start=untrained(crane), device="cpu")
    assert not (tmp_path / "t").exists()
