"""Training: a generator of what happens, that can be killed at any time and gone on with.

All random numbers come from streams named by seed and epoch, and a checkpoint is the weights,
the optimiser's running figures and two counters: a training that was stopped and resumed ends
with the same weights, to the last bit on the same machine, as one that was not.
"""

from __future__ import annotations

import copy
import csv
import hashlib
import io
import json
import math
import time
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bellcrank.errors import InvalidFile, InvalidModel, InvalidSettings, OutputExists
from bellcrank.model.parsing import read_json
from bellcrank.model.storage import write_bytes, write_text
from bellcrank.provenance import provenance
from bellcrank.runs.files import make_folder
from bellcrank.surrogate.backend import autocast, find_device, find_precision, import_torch
from bellcrank.surrogate.metrics import accuracy
from bellcrank.surrogate.models import models
from bellcrank.surrogate.recipes import Recipe
from bellcrank.surrogate.splitting import Split, flattening_chances, overlap, split_by_run
from bellcrank.surrogate.trained import TrainedModel, run_network
from bellcrank.surrogate.views import views

if TYPE_CHECKING:
    import os
    from collections.abc import Callable, Iterator

    import torch
    from numpy.typing import NDArray

    from bellcrank.surrogate.dataset import Dataset
    from bellcrank.surrogate.feeding import Feeder

TRAINING_SCHEMA = "bellcrank/training/1"
DESCRIPTION = "training.json"
CHECKPOINT = "checkpoint.safetensors"
LOG = "log.csv"
MODEL = "model.safetensors"
CHECKPOINT_SECONDS = 60.0
"""Between two checkpoints: what a kill can cost."""
TELL_SECONDS = 0.5
"""Between two reports."""


@dataclass(frozen=True, slots=True)
class EpochRecord:
    """How a network stands after an epoch.

    Parameters
    ----------
    epoch
        From 1.
    designs
        Seen so far, in all epochs.
    seconds
        Spent on training so far, in all sessions.
    loss
        Mean squared error over the epoch, in units of the variance.
    r_squared, determination, rms_error
        On held-out runs; see `bellcrank.surrogate.metrics.Accuracy`.
    """

    epoch: int
    designs: int
    seconds: float
    loss: float
    r_squared: float
    determination: float
    rms_error: float


@dataclass(frozen=True, slots=True)
class Progress:
    """Where training is.

    Parameters
    ----------
    done, total
        Designs seen, and to be seen.
    loss
        Running mean squared error, in units of the variance.
    epoch
        The record of the epoch that has just ended, if one has.
    """

    done: int
    total: int
    loss: float
    epoch: EpochRecord | None = None


@dataclass(slots=True, eq=False)
class Training:
    """A training under way. Made by `begin` or `resume`.

    Parameters
    ----------
    data, recipe, split
        What is learnt, how, and with which rows.
    folder
        Where it is kept; None keeps nothing.
    device
        Where the network is.
    precision
        ``float32`` or ``bfloat16``.
    """

    data: Dataset
    recipe: Recipe
    split: Split
    folder: Path | None
    device: torch.device
    precision: str
    model: TrainedModel
    feeder: Feeder
    optimiser: torch.optim.Optimizer
    average: torch.nn.Module | None
    step: int = 0
    seconds: float = 0.0
    loss: float = 0.0
    log: list[EpochRecord] = field(default_factory=list)

    @property
    def epoch_size(self) -> int:
        """Designs in an epoch."""
        return self.recipe.epoch_size or len(self.split.training)

    @property
    def steps_per_epoch(self) -> int:
        """Batches in an epoch; what is left over is not seen."""
        return max(self.epoch_size // self.recipe.batch, 1)

    @property
    def total_steps(self) -> int:
        """Batches in all epochs."""
        return self.steps_per_epoch * self.recipe.epochs

    @property
    def is_done(self) -> bool:
        """Whether all epochs are over and logged."""
        return len(self.log) == self.recipe.epochs

    def run(self, stop: Callable[[], bool] = lambda: False) -> Iterator[Progress]:
        """Train to the end, or until `stop` says so; tell how it goes.

        The folder then holds a checkpoint, the log, and after the last epoch the model.
        """
        saved = told = time.monotonic()
        while not self.is_done:
            if self.step < (len(self.log) + 1) * self.steps_per_epoch:
                for loss in self._steps_of_epoch():
                    self.loss = loss if math.isnan(self.loss) else 0.98 * self.loss + 0.02 * loss
                    now = time.monotonic()
                    if now - saved > CHECKPOINT_SECONDS:
                        self._save()
                        saved = time.monotonic()
                    if now - told > TELL_SECONDS:
                        yield self._progress()
                        told = now
                    if stop():
                        self._save()
                        return
            self.log.append(self._test())
            self._save()
            saved = time.monotonic()
            yield self._progress(self.log[-1])

    def finish(self) -> TrainedModel:
        """Test on everything that is held out, and return the model; write it to the folder."""
        predicted = self._predict(self.split.held_out)
        found = accuracy(predicted, self.data.efficiency[self.split.held_out])
        record = {
            "recipe": self.recipe.to_dict(),
            "precision": self.precision,
            "device": _device_name(self.device),
            "designs": self.step * self.recipe.batch,
            "seconds": round(self.seconds, 1),
            "data": {**asdict(overlap(self.data, self.split)), "runs": self.data.run_count},
            "held_out": found.to_dict(),
            "epochs": [asdict(epoch) for epoch in self.log],
            "provenance": provenance(torch=import_torch().__version__),
        }
        model = TrainedModel(
            self.model.architecture, self.data.problem, self.model.view, self._network(),
            self.model.mean, self.model.deviation, record,
        )  # fmt: skip
        if self.folder is not None:
            model.write(self.folder / MODEL, overwrite=True)
        return model

    def _progress(self, epoch: EpochRecord | None = None) -> Progress:
        batch = self.recipe.batch
        return Progress(self.step * batch, self.total_steps * batch, self.loss, epoch)

    def _network(self) -> torch.nn.Module:
        """Return the network that is kept: the average, if there is one."""
        return self.model.network if self.average is None else self.average

    def _steps_of_epoch(self) -> Iterator[float]:
        """Make the steps that are left of the epoch at hand; yield the loss of each."""
        import torch

        epoch, first = divmod(self.step, self.steps_per_epoch)
        rows = self._order(epoch)
        network = self.model.network.train()
        labels = ((self.data.efficiency - self.model.mean) / self.model.deviation).astype("f4")
        losses: list[torch.Tensor] = []
        for number in range(first, self.steps_per_epoch):
            start = time.monotonic()
            chosen = rows[number * self.recipe.batch : (number + 1) * self.recipe.batch]
            inputs = self.feeder.feed(self.data.packed[chosen])
            target = torch.from_numpy(labels[chosen]).to(self.device)
            for group in self.optimiser.param_groups:
                group["lr"] = self._rate()
            with autocast(self.device, self.precision):
                output = network(inputs)
            loss = torch.mean((output.float() - target) ** 2)
            self.optimiser.zero_grad(set_to_none=True)
            loss.backward()  # type: ignore[no-untyped-call]
            self.optimiser.step()
            self.step += 1
            if self.average is not None:
                _average(self.average, network, self.recipe.averaging, self.step)
            losses.append(loss.detach())
            self.seconds += time.monotonic() - start
            if len(losses) == 1 or self.device.type == "cpu" or number % 50 == 0:
                yield float(torch.stack(losses).mean())  # on a GPU, asking for a number waits
                losses.clear()

    def _order(self, epoch: int) -> NDArray[np.int64]:
        """Return the rows of an epoch, in the order in which they are seen."""
        sequence = np.random.SeedSequence(self.recipe.seed, spawn_key=(epoch,))
        rng = np.random.default_rng(sequence)
        rows = self.split.training
        if self.recipe.resampling:
            chances = flattening_chances(self.data.efficiency[rows])
            return np.asarray(rng.choice(rows, self.epoch_size, p=chances))
        wanted = self.steps_per_epoch * self.recipe.batch
        order = [rng.permutation(rows) for _ in range(-(-wanted // len(rows)))]
        return np.concatenate(order)[:wanted]

    def _rate(self) -> float:
        """Return the learning rate of the step at hand."""
        recipe = self.recipe
        rate = recipe.learning_rate
        if recipe.warm_up:
            rate *= min(1.0, (self.step + 1) / recipe.warm_up)
        if recipe.schedule == "cosine":
            rate *= 0.5 + 0.5 * math.cos(math.pi * self.step / self.total_steps)
        return rate

    def _predict(self, rows: NDArray[np.int64]) -> NDArray[np.float64]:
        network = self._network().eval()
        found = run_network(network, self.feeder, self.data.packed[rows], self.precision)
        return self.model.mean + self.model.deviation * found

    def _test(self) -> EpochRecord:
        rows = self.split.held_out
        if len(rows) > self.recipe.tested:
            rng = np.random.default_rng(self.recipe.split_seed)
            rows = np.sort(rng.choice(rows, self.recipe.tested, replace=False))
        found = accuracy(self._predict(rows), self.data.efficiency[rows])
        return EpochRecord(
            len(self.log) + 1, self.step * self.recipe.batch, round(self.seconds, 2), self.loss,
            found.r_squared, found.determination, found.rms_error,
        )  # fmt: skip

    def _save(self) -> None:
        if self.folder is not None:
            write_bytes(self.folder / CHECKPOINT, _checkpoint(self), overwrite=True)
            write_text(self.folder / LOG, _log_text(self.log), overwrite=True)


def begin(
    data: Dataset,
    recipe: Recipe,
    folder: str | os.PathLike[str] | None = None,
    *,
    device: str = "auto",
) -> Training:
    """Begin a training in a new folder.

    Raises
    ------
    InvalidDataset
        If the data come from a single run.
    InvalidSettings
        If PyTorch or the device is missing, or all efficiencies are the same.
    UnknownName
        If there is no such model.
    OutputExists
        If a training lies in the folder already.
    """
    where = find_device(device)
    training = _build(data, recipe, where, find_precision(recipe.precision, where))
    if folder is None:
        return training
    training.folder = Path(folder)
    make_folder(training.folder)
    description = training.folder / DESCRIPTION
    if description.exists():
        raise OutputExists(
            f"{description}: a training lies there already; go on with it (--resume), or choose "
            f"another folder (--out)"
        )
    told = {
        "schema": TRAINING_SCHEMA,
        "recipe": recipe.to_dict(),
        "precision": training.precision,
        "data": data_hash(data),
        "provenance": provenance(),
    }
    write_text(description, json.dumps(told, indent=1) + "\n")
    return training


def resume(folder: str | os.PathLike[str], data: Dataset, *, device: str = "auto") -> Training:
    """Go on with the training in a folder.

    Raises
    ------
    InvalidFile
        If there is none.
    InvalidSettings
        If it was begun with other data.
    InvalidModel
        If its checkpoint is damaged.
    """
    place = Path(folder)
    told = _read_description(place)
    if told["data"] != data_hash(data):
        raise InvalidSettings(f"{folder}: the training there was begun with other data")
    recipe = Recipe.from_dict(told["recipe"])
    training = _build(data, recipe, find_device(device), told["precision"])
    training.folder = place
    if (place / CHECKPOINT).exists():
        _restore(training, place / CHECKPOINT)
    return training


def read_recipe(folder: str | os.PathLike[str]) -> Recipe:
    """Return the recipe of the training in a folder.

    Raises
    ------
    InvalidFile
        If there is none.
    """
    return Recipe.from_dict(_read_description(Path(folder))["recipe"])


def _read_description(place: Path) -> dict[str, Any]:
    """Return what a training's folder says about it."""
    if not (place / DESCRIPTION).exists():
        raise InvalidFile(f"{place}: no training to go on with: it has no {DESCRIPTION}")
    told = read_json(place / DESCRIPTION)
    if told.get("schema") != TRAINING_SCHEMA:
        raise InvalidFile(
            f"{place / DESCRIPTION}: expected schema {TRAINING_SCHEMA!r}, "
            f"got {told.get('schema')!r}"
        )
    return told


def _build(data: Dataset, recipe: Recipe, device: torch.device, precision: str) -> Training:
    import torch

    from bellcrank.surrogate.feeding import feeder_of

    split = split_by_run(data, recipe.held_out, recipe.split_seed)
    seen = data.efficiency[split.training]
    deviation = float(seen.std())
    if not deviation > 0.0:
        raise InvalidSettings(f"all efficiencies are {seen[0]:g}: there is nothing to learn")
    architecture = models[recipe.model]
    view = views[architecture.view](data.problem)
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(recipe.seed)
        network = architecture.build(view.shape)
    network = network.to(device).to(memory_format=torch.channels_last)  # type: ignore[call-overload]
    model = TrainedModel(recipe.model, data.problem, view, network, float(seen.mean()), deviation)
    average = copy.deepcopy(network) if recipe.averaging else None
    kind = torch.optim.AdamW if recipe.optimiser == "adamw" else torch.optim.Adam
    optimiser = kind(
        network.parameters(), lr=recipe.learning_rate, weight_decay=recipe.weight_decay
    )
    training = Training(
        data, recipe, split, None, device, precision, model, feeder_of(view, device), optimiser,
        average,
    )  # fmt: skip
    training.loss = math.nan
    return training


def _average(average: torch.nn.Module, network: torch.nn.Module, decay: float, step: int) -> None:
    """Move the running average towards the network, faster at first."""
    import torch

    weight = 1.0 - min(decay, (1.0 + step) / (10.0 + step))
    with torch.no_grad():
        mine, theirs = average.state_dict(), network.state_dict()
        moving = [name for name, value in mine.items() if value.is_floating_point()]
        torch._foreach_lerp_([mine[n] for n in moving], [theirs[n] for n in moving], weight)
        for name, value in mine.items():
            if not value.is_floating_point():
                value.copy_(theirs[name])


def data_hash(data: Dataset) -> str:
    """Return the identity of what is learnt from: masks, efficiencies and runs."""
    digest = hashlib.sha256()
    for column in (data.packed, data.efficiency, data.run):
        digest.update(np.ascontiguousarray(column).tobytes())
    return digest.hexdigest()[:16]


def _checkpoint(training: Training) -> bytes:
    from safetensors.torch import save

    tensors = {f"network.{k}": v for k, v in training.model.network.state_dict().items()}
    if training.average is not None:
        tensors |= {f"average.{k}": v for k, v in training.average.state_dict().items()}
    for index, state in training.optimiser.state_dict()["state"].items():
        tensors |= {f"optimiser.{index}.{key}": value for key, value in state.items()}
    told = {
        "step": training.step,
        "seconds": training.seconds,
        "loss": training.loss,
        "log": [asdict(epoch) for epoch in training.log],
    }
    on_host = {name: value.detach().cpu().contiguous() for name, value in tensors.items()}
    return save(on_host, {"bellcrank": json.dumps(told)})


def _restore(training: Training, path: Path) -> None:
    from safetensors import SafetensorError, safe_open

    try:
        with safe_open(path, framework="pt") as file:
            told = json.loads(file.metadata()["bellcrank"])
            tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
        _load(training, tensors)
    except (SafetensorError, OSError, RuntimeError, KeyError, TypeError, ValueError) as error:
        raise InvalidModel(
            f"{path}: damaged ({str(error).splitlines()[0]}); delete it and resume: training "
            f"begins again"
        ) from None
    training.step, training.seconds = told["step"], told["seconds"]
    training.loss = told["loss"]
    training.log = [EpochRecord(**epoch) for epoch in told["log"]]


def _load(training: Training, tensors: dict[str, Any]) -> None:
    def under(prefix: str) -> dict[str, Any]:
        cut = len(prefix)
        return {name[cut:]: value for name, value in tensors.items() if name.startswith(prefix)}

    training.model.network.load_state_dict(under("network."))
    if training.average is not None:
        training.average.load_state_dict(under("average."))
    states: dict[int, dict[str, Any]] = {}
    for name, value in under("optimiser.").items():
        index, key = name.split(".", 1)
        states.setdefault(int(index), {})[key] = value
    whole = training.optimiser.state_dict()
    training.optimiser.load_state_dict({**whole, "state": states})


def _log_text(log: list[EpochRecord]) -> str:
    buffer = io.StringIO()
    names = list(EpochRecord.__dataclass_fields__)
    writer = csv.DictWriter(buffer, names, lineterminator="\n")
    writer.writeheader()
    writer.writerows(asdict(epoch) for epoch in log)
    return buffer.getvalue()


def _device_name(device: torch.device) -> str:
    import torch

    return torch.cuda.get_device_name(device) if device.type == "cuda" else device.type
