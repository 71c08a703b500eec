"""Learning in rounds ends with the same networks whatever stops it, and loses nothing."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import torch

from bellcrank.errors import (
    BellcrankError,
    CorruptRun,
    InvalidDataset,
    InvalidFile,
    InvalidModel,
    InvalidSettings,
    OutputExists,
)
from bellcrank.learning import fitting
from bellcrank.learning.active import label_round, learn_actively
from bellcrank.learning.course import begin_rounds, read_course
from bellcrank.learning.fitting import Ensemble, fit, model_files
from bellcrank.learning.heard import Heard
from bellcrank.learning.knowledge import begin_learning, grow
from bellcrank.learning.proposing import ActiveSettings, propose_designs
from bellcrank.learning.round_files import read_labelled, read_round
from bellcrank.learning.rounds import RoundsProgress, learn_in_rounds
from bellcrank.model import find_problem
from bellcrank.surrogate import beginning
from bellcrank.surrogate import training as training_module
from bellcrank.surrogate.beginning import resume
from bellcrank.surrogate.dataset import Dataset, read_dataset
from bellcrank.surrogate.folder import data_hash
from bellcrank.surrogate.predictor import Prediction, Predictor
from bellcrank.surrogate.trained import read_model
from tests.surrogate.helpers import equal, same_weights, untrained

from .tiny import RECIPE, tiny_dataset, tiny_model

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from bellcrank.learning.rounds import Learnt

FAST = replace(
    RECIPE, epochs=1, epoch_size=640, learning_rate=3e-3, averaging=0.9, optimiser="adamw"
)
SETTINGS = ActiveSettings(
    chains=3, steps=20, disputed=4, best=3, seed=5, epochs=2, epoch_size=256, learning_rate=1e-3
)
MEMBERS, ROUNDS = 2, 2
MODELS = [
    f"{place}member-{member}/model.safetensors"
    for place in ("", "round-1/", "round-2/")
    for member in range(MEMBERS)
]


@pytest.fixture(scope="module", autouse=True)
def one_thread() -> Iterator[None]:
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


@pytest.fixture(scope="module", autouse=True)
def no_pictures() -> Iterator[None]:
    """Drawing takes longer than all else here."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(fitting, "_draw", lambda *_: None)
        yield


def begun(folder: Path, rounds: int = ROUNDS) -> Path:
    begin_rounds(tiny_dataset(), Ensemble(FAST, MEMBERS), folder, SETTINGS, rounds, device="cpu")
    return folder


def gone_on_with(folder: Path, **options: Any) -> Learnt | None:
    return learn_in_rounds(folder, tiny_dataset(), device="cpu", **options)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of two rounds of two networks that nothing stopped. Not to be changed."""
    folder = begun(tmp_path_factory.mktemp("whole") / "rounds")
    assert gone_on_with(folder) is not None
    return folder


@pytest.fixture
def copy(whole: Path, tmp_path: Path) -> Path:
    """One to be changed at will."""
    return shutil.copytree(whole, tmp_path / "copy")


def record(folder: Path, number: int) -> dict[str, Any]:
    told = json.loads((folder / f"round-{number}" / "round.json").read_text())
    del told["provenance"]
    return told


def assert_same(folder: Path, whole: Path) -> None:
    """Check that learning ended as it does when nothing stops it, to the last bit."""
    for name in MODELS:
        assert same_weights(read_model(folder / name), read_model(whole / name)), name
    for number in range(1, ROUNDS + 1):
        assert record(folder, number) == record(whole, number)
        ours, theirs = (
            read_dataset(path / f"round-{number}" / "designs.parquet") for path in (folder, whole)
        )
        for each in (ours, theirs):
            each.origin.pop("provenance")
        assert equal(ours, theirs)
    names = [
        sorted(str(path.relative_to(each)) for path in each.rglob("*")) for each in (folder, whole)
    ]
    assert names[0] == names[1]


def test_rounds_are_what_learning_without_a_folder_makes(whole: Path) -> None:
    first = [read_model(whole / name) for name in MODELS[:2]]
    knowledge = begin_learning(tiny_dataset(), FAST, first)
    for number in (1, 2):
        settings = replace(SETTINGS, seed=SETTINGS.seed + number - 1)
        knowledge, found = learn_actively(knowledge, settings, device="cpu")
        told = read_round(whole / f"round-{number}", number, data_hash(knowledge.data))
        assert told == found
        kept = [read_model(whole / name) for name in MODELS[2 * number : 2 * number + 2]]
        assert all(map(same_weights, kept, knowledge.models))
    designs = [read_dataset(whole / f"round-{k}" / "designs.parquet").packed for k in (1, 2)]
    assert not np.array_equal(*designs)


def test_the_training_of_a_round_follows_its_settings(whole: Path) -> None:
    first, after = (read_model(whole / MODELS[k]) for k in (1, 5))
    assert first.record["recipe"]["learning_rate"] == 3e-3
    recipe = after.record["recipe"]
    assert (recipe["epochs"], recipe["epoch_size"], recipe["learning_rate"]) == (2, 256, 1e-3)
    assert recipe["seed"] == 1
    assert after.record["designs"] == 512
    assert after.seen["designs"] == 640 + 2 * 512
    unchanged = replace(SETTINGS, epochs=None, epoch_size=None, learning_rate=None)
    assert unchanged.adapt(FAST) == FAST


def test_what_is_held_out_is_never_learnt_from(copy: Path) -> None:
    shutil.rmtree(copy / "round-1" / "member-0")
    (copy / "round-1" / "round.json").unlink()
    told = json.loads((copy / "round-1" / "member-1" / "training.json").read_text())
    seen = []

    def begin(data: Dataset, *words: Any, **options: Any) -> Any:
        seen.append((data, options["split"]))
        return real(data, *words, **options)

    real = beginning.begin
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("bellcrank.learning.rounds.begin", begin)
        gone_on_with(copy)
    ((data, split),) = seen
    original = begin_learning(tiny_dataset(), FAST, []).split
    assert np.array_equal(split.held_out[: len(original.held_out)], original.held_out)
    assert not set(data.run[split.training]) & set(data.run[split.held_out])
    extra = split.training[split.training >= len(tiny_dataset())]
    assert len(extra) / len(split.training) == pytest.approx(SETTINGS.share, abs=0.01)
    assert told["split"] is not None


@pytest.mark.parametrize("what", ["first training", "searching", "labelling", "training"])
def test_stopped_in_any_step_it_ends_the_same(
    whole: Path, tmp_path: Path, what: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(training_module, "TELL_SECONDS", -1.0)  # of every step
    folder = begun(tmp_path / "rounds")
    seen: list[RoundsProgress] = []
    step = what.removeprefix("first ")

    def is_time() -> bool:
        last = seen[-1] if seen else None
        if last is None or (last.number == 0) != (what == "first training"):
            return False
        return last.what == step and last.done >= 3 * last.total // 8 > 0

    assert gone_on_with(folder, tell=seen.append, stop=is_time) is None
    assert seen[-1].what == step
    assert what == "labelling" or seen[-1].done < seen[-1].total
    place = folder if what == "first training" else folder / "round-1"
    assert (place / "designs.parquet").exists() == (what in ("labelling", "training"))
    assert (place / "search.npz").exists() == (what == "searching")
    assert not list(place.glob("member-*/model.safetensors"))
    assert gone_on_with(folder) is not None
    assert_same(folder, whole)


def test_stopped_again_and_again_it_ends_the_same(whole: Path, tmp_path: Path) -> None:
    folder = begun(tmp_path / "rounds")
    sessions, learnt = 0, None
    while learnt is None:
        sessions += 1
        assert sessions < 30
        answers = iter([False] * (9 + 3 * sessions))
        learnt = gone_on_with(folder, stop=lambda: next(answers, True))  # noqa: B023
    assert sessions > 5
    assert_same(folder, whole)
    told = [found.to_dict() for found in learnt.rounds]
    for number, each in enumerate(told, 1):
        assert each.items() <= record(whole, number).items()
    assert all(map(same_weights, learnt.models, (read_model(whole / name) for name in MODELS[4:])))


class Counting(Predictor):
    """Counts how often it is asked."""

    asked = 0

    def predict(self, masks: np.ndarray) -> Prediction:
        self.asked += 1
        return super().predict(masks)


@pytest.mark.parametrize("members", [1, 2])
def test_a_search_that_was_stopped_asks_nothing_twice(tmp_path: Path, members: int) -> None:
    networks = [tiny_model(k) for k in range(members)]
    problem, path = tiny_dataset().problem, tmp_path / "search.npz"
    whole = Counting(problem, networks, device="cpu")
    expected = propose_designs(whole, SETTINGS)
    assert whole.asked == 21
    asked = []
    for steps in (7, 1, 6, 100):
        predictor = Counting(problem, networks, device="cpu")
        answers = iter([False] * ((sum(asked) - len(asked)) + steps - 1))
        heard = Heard.at(path)
        found = propose_designs(
            predictor,
            SETTINGS,
            heard=heard,
            stop=lambda: next(answers, True),  # noqa: B023
        )
        asked.append(predictor.asked)
    assert asked == [8, 2, 7, 7]
    assert len(found) == len(expected)
    assert all(map(np.array_equal, found, expected))


def test_what_other_networks_said_or_half_a_file_does_not_count(tmp_path: Path) -> None:
    problem, path = tiny_dataset().problem, tmp_path / "search.npz"
    answers = iter([False] * 9)
    first = Predictor(problem, [tiny_model(0)], device="cpu")
    propose_designs(first, SETTINGS, heard=Heard.at(path), stop=lambda: next(answers, True))
    assert len(Heard.at(path).known) == 11
    for number in (1, 0):
        predictor = Counting(problem, [tiny_model(number)], device="cpu")
        found = propose_designs(predictor, SETTINGS, heard=Heard.at(path))
        assert predictor.asked == 21
        assert all(map(np.array_equal, found, propose_designs(predictor, SETTINGS)))
        path.write_bytes(path.read_bytes()[:100])


CHILD = """
import sys, torch
torch.set_num_threads(1)
from bellcrank.learning import fitting
from bellcrank.learning.rounds import learn_in_rounds
from bellcrank.surrogate import training
from bellcrank.surrogate.dataset import read_dataset
training.CHECKPOINT_SECONDS = training.TELL_SECONDS = 0.0
fitting._draw = lambda *_: None
learn_in_rounds(
    sys.argv[1], read_dataset(sys.argv[2]), device="cpu",
    tell=lambda told: print(told.number, told.what, told.done, flush=True),
)
"""


def test_killed_without_warning_it_ends_the_same(whole: Path, tmp_path: Path) -> None:
    folder = begun(tmp_path / "rounds")
    tiny_dataset().write(tmp_path / "data.parquet")
    words = [sys.executable, "-c", CHILD, folder, tmp_path / "data.parquet"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as child:
        assert child.stdout is not None
        for line in child.stdout:
            if line.split() == ["1", "training", "192"]:
                os.kill(child.pid, signal.SIGKILL)
                break
    assert child.returncode == -signal.SIGKILL
    assert (folder / "round-1" / "member-0" / "checkpoint.safetensors").exists()
    assert not (folder / "round-1" / "round.json").exists()
    assert gone_on_with(folder) is not None
    assert_same(folder, whole)


LATE = ["round-2/round.json", "round-2/member-1/model.safetensors"]
LATER = [*LATE, "round-2/member-1/checkpoint.safetensors", "round-2/member-1/log.csv"]
BEFORE_TRAINING = [*LATER, "round-2/member-1/training.json"]


@pytest.mark.parametrize(
    "lost",
    [
        ["round-2/round.json"],
        LATE,
        LATER,
        BEFORE_TRAINING,
        [*BEFORE_TRAINING, "round-2/member-1/initial.safetensors"],
        ["round-2"],
        ["member-1/model.safetensors"],
    ],
)
def test_what_a_kill_left_unwritten_is_made_again(whole: Path, copy: Path, lost: list[str]) -> None:
    for name in lost:
        shutil.rmtree(copy / name) if name == "round-2" else (copy / name).unlink()
    place = copy / "round-2"
    (place / "member-1").mkdir(parents=True, exist_ok=True)
    halves = [place / ".designs.parquet.0123abcd", place / ".round.json.0123abcd"]
    if not (place / "member-1" / "model.safetensors").exists():
        halves += [place / "member-1" / ".model.safetensors.0123abcd"]
    for half in halves:
        half.write_bytes(b"half of i")
    assert gone_on_with(copy) is not None
    assert_same(copy, whole)


def test_a_finished_course_is_only_read(whole: Path, copy: Path) -> None:
    told: list[RoundsProgress] = []
    before = {path: path.stat().st_mtime_ns for path in copy.rglob("*")}
    learnt = gone_on_with(copy, tell=told.append)
    assert learnt is not None
    assert [len(learnt.models), len(learnt.rounds), told] == [2, 2, []]
    assert {path: path.stat().st_mtime_ns for path in copy.rglob("*")} == before


def test_the_networks_of_a_folder_are_those_of_the_last_finished_round(copy: Path) -> None:
    def networks() -> list[str]:
        return [str(path.relative_to(copy)) for path in model_files(copy)]

    assert networks() == MODELS[4:]
    (copy / "round-2" / "round.json").unlink()
    assert networks() == MODELS[2:4]
    (copy / "round-1" / "round.json").unlink()
    assert networks() == MODELS[:2]
    for name in MODELS[:2]:
        (copy / name).unlink()
    with pytest.raises(InvalidFile, match="no trained model in this folder"):
        networks()


def test_members_are_counted_as_people_count(tmp_path: Path) -> None:
    names = [f"member-{number}" for number in range(12)]
    for name in names:
        (tmp_path / name).mkdir()
        (tmp_path / name / "model.safetensors").touch()
    assert [path.parent.name for path in model_files(tmp_path)] == names


def test_given_networks_search_at_once_and_are_kept(tmp_path: Path) -> None:
    given = [tiny_model(0), tiny_model(1)]
    ensemble = Ensemble(FAST, initial=given)
    begin_rounds(tiny_dataset(), ensemble, tmp_path / "r", SETTINGS, 1, device="cpu")
    assert read_course(tmp_path / "r").members == 2
    seen: list[RoundsProgress] = []
    learnt = gone_on_with(tmp_path / "r", tell=seen.append)
    assert {told.number for told in seen} == {1}
    expected = label_round(begin_learning(tiny_dataset(), FAST, given), SETTINGS, device="cpu")
    found = read_labelled(tmp_path / "r" / "round-1")
    assert (found.proposed, found.surprise) == (expected.proposed, expected.surprise)
    assert np.array_equal(found.data.packed, expected.data.packed)
    assert np.array_equal(found.data.efficiency, expected.data.efficiency)
    for kept, model in zip(sorted(tmp_path.glob("r/member-*/initial.*")), given, strict=True):
        assert same_weights(read_model(kept), model)
    assert [each.seen["designs"] for each in learnt.models] == [
        each.record["designs"] + 512 for each in given
    ]


def test_one_network_can_become_several(tmp_path: Path) -> None:
    ensemble = Ensemble(FAST, 3, [tiny_model(0)])
    begin_rounds(tiny_dataset(), ensemble, tmp_path / "r", SETTINGS, 1, device="cpu")
    learnt = gone_on_with(tmp_path / "r")
    assert len(learnt.models) == 3
    packed = tiny_dataset().packed[:50]
    first, *others = (model.predict(packed, device="cpu") for model in learnt.models)
    assert all(not np.allclose(first, other) for other in others)


def test_a_training_can_go_on_from_given_networks(tmp_path: Path) -> None:
    gently = Ensemble(replace(FAST, learning_rate=1e-12, epoch_size=64), initial=[tiny_model(0)])
    (after,) = fit(tiny_dataset(), gently, tmp_path / "on", device="cpu")
    packed = tiny_dataset().packed[:100]
    given, afresh = (tiny_model(k).predict(packed, device="cpu") for k in (0, 1))
    found = after.predict(packed, device="cpu")
    assert np.abs(found - given).mean() < 0.5 * np.abs(found - afresh).mean()
    assert after.seen["designs"] == tiny_model(0).record["designs"] + 64


def test_other_data_are_refused_at_any_time(copy: Path, tmp_path: Path) -> None:
    other = tiny_dataset().take(np.arange(len(tiny_dataset()) - 1))
    for folder in (copy, begun(tmp_path / "new")):
        with pytest.raises(InvalidSettings, match="begun with other data"):
            learn_in_rounds(folder, other, device="cpu")
    with pytest.raises(InvalidFile, match=r"it has no rounds\.json"):
        learn_in_rounds(tmp_path / "nothing", other, device="cpu")


def test_the_training_of_a_round_is_no_training_of_its_own(copy: Path) -> None:
    own = copy / "round-1" / "member-0"
    with pytest.raises(InvalidSettings, match="begun with other data"):
        resume(own, tiny_dataset(), device="cpu")
    designs = read_dataset(copy / "round-1" / "designs.parquet")
    grown = begin_learning(tiny_dataset(), FAST, [])
    with pytest.raises(InvalidSettings, match="holds out other designs"):
        resume(own, grow(grown, designs).data, device="cpu")


def damage(path: Path, **changes: Any) -> None:
    path.write_text(json.dumps({**json.loads(path.read_text()), **changes}))


@pytest.mark.parametrize(
    ("name", "changes", "message"),
    [
        ("round-1/round.json", {"surprise": {}}, r"round\.json: damaged .*; delete it and resume"),
        ("round-1/round.json", {"held_out": 7}, r"round\.json: damaged .*; delete it and resume"),
        ("round-1/round.json", {"round": 2}, r"damaged \(it is of round 2\)"),
        ("round-1/round.json", {"schema": "x"}, r"damaged \(expected schema"),
        ("rounds.json", {"rounds": 0}, r"rounds\.json: damaged \(expected a whole number"),
        ("rounds.json", {"settings": {"x": 1}}, r"rounds\.json: damaged \(x: no such key"),
        ("rounds.json", {"schema": "x"}, r"rounds\.json: expected schema"),
    ],
)
def test_damaged_records_are_named(
    copy: Path, name: str, changes: dict[str, Any], message: str
) -> None:
    damage(copy / name, **changes)
    with pytest.raises(InvalidFile, match=message):
        gone_on_with(copy)


def test_a_record_cut_short_is_made_again_after_its_removal(whole: Path, copy: Path) -> None:
    path = copy / "round-1" / "round.json"
    path.write_text(path.read_text()[:50])
    with pytest.raises(InvalidFile, match=r"round\.json: damaged \(not valid JSON.*delete it"):
        gone_on_with(copy)
    path.unlink()
    gone_on_with(copy)
    assert_same(copy, whole)


def test_damaged_designs_are_named_and_made_again_after_their_removal(
    whole: Path, copy: Path
) -> None:
    path = copy / "round-1" / "designs.parquet"
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    with pytest.raises(CorruptRun, match=r"designs\.parquet: .*delete it and resume"):
        gone_on_with(copy)
    path.unlink()
    gone_on_with(copy)
    assert_same(copy, whole)


def test_designs_of_another_round_are_noticed(copy: Path) -> None:
    shutil.copy(copy / "round-2" / "designs.parquet", copy / "round-1" / "designs.parquet")
    with pytest.raises(CorruptRun, match="learnt from other designs than those that lie there"):
        gone_on_with(copy)


REFUSED: list[tuple[dict[str, Any], type[BellcrankError], str]] = [
    ({"rounds": 0}, InvalidSettings, "rounds: expected a whole number of at least 1"),
    ({"rounds": 1.5}, InvalidSettings, "rounds: expected a whole number"),
    ({"members": 0}, InvalidSettings, "members: expected 1 to 100"),
    ({"settings": ActiveSettings(caution=1.0)}, InvalidSettings, "caution: .*only one"),
    ({"settings": ActiveSettings(epoch_size=63)}, InvalidSettings, "epoch_size: .*at least 64"),
    ({"device": "abacus"}, InvalidSettings, "device: "),
    ({"recipe": replace(FAST, model="vgg")}, BellcrankError, "unknown model 'vgg'"),
    ({"members": 3, "initial": [0, 1]}, InvalidSettings, "3 networks cannot go on from 2"),
    (
        {"recipe": replace(FAST, model="grid"), "initial": [0]},
        InvalidSettings,
        "a 'grid' cannot go on from the weights of a 'mlp'; ask for that model",
    ),
]  # fmt: skip


@pytest.mark.parametrize(("given", "kind", "message"), REFUSED)
def test_what_makes_no_sense_is_refused_before_anything_is_written(
    tmp_path: Path, given: dict[str, Any], kind: type[BellcrankError], message: str
) -> None:
    told = {"recipe": FAST, "settings": ActiveSettings(), "rounds": 1, "device": "cpu", **given}
    initial = [tiny_model(seed) for seed in told.get("initial", [])]
    with pytest.raises(kind, match=message):
        begin_rounds(
            tiny_dataset(), Ensemble(told["recipe"], told.get("members"), initial),
            tmp_path / "new", told["settings"], told["rounds"], device=told["device"],
        )  # fmt: skip
    assert not (tmp_path / "new").exists()


def test_networks_of_another_lattice_and_data_of_one_run_are_refused(tmp_path: Path) -> None:
    stranger = untrained(find_problem("scaling-8"))
    one = tiny_dataset().take(tiny_dataset().run == 0)
    strange = Ensemble(FAST, initial=[stranger])
    with pytest.raises(InvalidModel, match="has learnt 'scaling-8'"):
        begin_rounds(tiny_dataset(), strange, tmp_path / "n", SETTINGS, 1)
    with pytest.raises(InvalidModel, match="has learnt 'scaling-8'"):
        fit(tiny_dataset(), strange, tmp_path / "n", device="cpu")
    with pytest.raises(InvalidDataset, match="from one run"):
        begin_rounds(one, Ensemble(FAST), tmp_path / "n", SETTINGS, 1, device="cpu")
    assert not (tmp_path / "n").exists()


def test_a_folder_in_use_is_left_alone(whole: Path, tmp_path: Path) -> None:
    (tmp_path / "old" / "round-3").mkdir(parents=True)
    (tmp_path / "two" / "member-1").mkdir(parents=True)
    shutil.copy(whole / "member-1" / "training.json", tmp_path / "two" / "member-1")
    beginnings: list[Callable[[Path], object]] = [
        lambda place: begin_rounds(
            tiny_dataset(), Ensemble(FAST), place, SETTINGS, 1, device="cpu"
        ),
        lambda place: fit(tiny_dataset(), Ensemble(FAST), place, device="cpu"),
    ]
    for place in (whole, tmp_path / "old", tmp_path / "two"):
        before = sorted(place.rglob("*"))
        for begin in beginnings:
            with pytest.raises(OutputExists, match="lies there already; go on with it"):
                begin(place)
        assert sorted(place.rglob("*")) == before


def test_starts_are_one_for_each_or_one_for_all() -> None:
    problem, first, second = tiny_dataset().problem, tiny_model(0), tiny_model(1)
    assert Ensemble(FAST).starts(problem) == [None]
    assert Ensemble(FAST, 3).starts(problem) == [None] * 3
    assert Ensemble(FAST, initial=[first, second]).starts(problem) == [first, second]
    assert Ensemble(FAST, 2, [first]).starts(problem) == [first, first]
