"""Training of a network: a generator of progress that can be killed and resumed at any time.

Random numbers come from streams named by seed and epoch, and a checkpoint holds the weights, the
state of the optimiser and counters. A training that was stopped and resumed ends, on the same
machine, with the same weights to the last bit as an uninterrupted one.
"""

from __future__ import annotations

import math
import time
from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING, Any

from bellcrank.errors import RunFailed
from bellcrank.model.storage import write_bytes
from bellcrank.provenance import provenance
from bellcrank.surrogate.backend import autocast, import_torch, name_of
from bellcrank.surrogate.checkpoints import (
    CHECKPOINT,
    TrainingTensors,
    damaged_checkpoint,
    load_checkpoint,
)
from bellcrank.surrogate.metrics import accuracy, finite
from bellcrank.surrogate.splitting import overlap, rows_of_epoch
from bellcrank.surrogate.trained_model import MODEL, inputs_of, run_network

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    import torch

    from bellcrank.surrogate.dataset import Dataset
    from bellcrank.surrogate.metrics import Accuracy
    from bellcrank.surrogate.recipes import Recipe
    from bellcrank.surrogate.splitting import Split
    from bellcrank.surrogate.trained_model import TrainedModel

CHECKPOINT_SECONDS = 60.0
"""Interval between checkpoints: the largest loss by a kill."""
REPORT_SECONDS = 0.5
"""Interval between reports of progress."""


@dataclass(frozen=True, slots=True)
class EpochRecord:
    """State of a training after an epoch.

    Parameters
    ----------
    epoch
        From 1.
    designs
        Training designs so far, in all epochs.
    seconds
        Duration of the training so far, in all sessions.
    loss
        Mean squared error over the batches of the epoch, each before its step, in units of the
        variance (of the data of the first training, if the weights are those of another one).
    r_squared, determination, rms_error
        Accuracy on held-out runs; see `bellcrank.surrogate.metrics.Accuracy`.
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
    """Progress of a training.

    Parameters
    ----------
    done, total
        Training designs so far, and in all epochs.
    loss
        Mean squared error over the epoch so far in units of the variance; nan at the start.
    epoch
        Record of the epoch that has just ended, or None.
    testing
        In the final test: held-out designs tested so far, and their number.
    """

    done: int
    total: int
    loss: float
    epoch: EpochRecord | None = None
    testing: tuple[int, int] | None = None


@dataclass(slots=True, eq=False)
class Training:
    """A training in progress, made by `begin` or `resume` of `training_setup`.

    Parameters
    ----------
    data, recipe, split
        Dataset, settings, and training and held-out rows.
    folder
        Folder of its files; None to write nothing.
    device, precision
        Device of the network; ``float32`` or ``bfloat16``.
    model
        Network with its normalisation.
    tensors
        Network, optimiser and moving average.
    step, seconds
        Steps of the optimiser so far, and their duration.
    loss_sum, loss_count
        Sum of the losses of the batches of the current epoch, and their number.
    log
        Records of finished epochs.
    start
        Record of the network whose weights the training started from; None for random weights.
    """

    data: Dataset
    recipe: Recipe
    split: Split
    folder: Path | None
    device: torch.device
    precision: str
    model: TrainedModel
    tensors: TrainingTensors
    step: int = 0
    seconds: float = 0.0
    loss_sum: float = 0.0
    loss_count: int = 0
    log: list[EpochRecord] = field(default_factory=list)
    start: dict[str, Any] | None = None

    @property
    def steps_per_epoch(self) -> int:
        """Batches in an epoch; an incomplete last batch is left out."""
        designs = self.recipe.epoch_size or len(self.split.training)
        return max(designs // self.recipe.batch, 1)

    @property
    def total_steps(self) -> int:
        """Batches in all epochs."""
        return self.steps_per_epoch * self.recipe.epochs

    @property
    def is_done(self) -> bool:
        """Whether all epochs are finished."""
        return len(self.log) == self.recipe.epochs

    def run(self, stop: Callable[[], bool] = lambda: False) -> Iterator[Progress]:
        """Train to the end, or until `stop` returns true, and yield the progress.

        The folder then contains a checkpoint.
        """
        saved = reported = time.monotonic()
        while not self.is_done:
            if self.step < (len(self.log) + 1) * self.steps_per_epoch:
                for _ in self._steps_of_epoch():
                    now = time.monotonic()
                    if now - saved > CHECKPOINT_SECONDS:
                        self.save()
                        saved = time.monotonic()
                    if now - reported > REPORT_SECONDS:
                        yield self._progress()
                        reported = now
                    if stop():
                        self.save()
                        return
            self.log.append(self._end_epoch())
            self.save()
            saved = time.monotonic()
            yield self._progress(self.log[-1])

    def finish(self, report: Callable[[Progress], None] = lambda _progress: None) -> TrainedModel:
        """Test the network on held-out runs, and return the model; write it to the folder.

        Parameters
        ----------
        report
            Called with the progress of the test.
        """

        def tested(done: int, total: int) -> None:
            report(replace(self._progress(), testing=(done, total)))

        record = self._record(self._test(self.recipe.tested_last, tested))
        model = replace(self.model, network=self._result, record=record)
        if self.folder is not None:
            model.write(self.folder / MODEL, overwrite=True)
        return model

    def save(self) -> None:
        """Write a checkpoint to the folder."""
        if self.folder is None:
            return
        data = {
            "step": self.step,
            "seconds": self.seconds,
            "loss_sum": self.loss_sum,
            "loss_count": self.loss_count,
            "log": [asdict(epoch) for epoch in self.log],
        }
        content = self.tensors.to_bytes(data)
        write_bytes(self.folder / CHECKPOINT, content, overwrite=True)

    def restore(self, path: Path) -> None:
        """Continue from a checkpoint.

        Raises
        ------
        InvalidModel
            If it is damaged or belongs to another network.
        """
        data = load_checkpoint(self.tensors, path)
        try:
            self.step, self.seconds = int(data["step"]), float(data["seconds"])
            self.loss_sum, self.loss_count = float(data["loss_sum"]), int(data["loss_count"])
            self.log = [EpochRecord(**epoch) for epoch in data["log"]]
        except (KeyError, TypeError, ValueError) as error:
            raise damaged_checkpoint(path, error) from None

    @property
    def _result(self) -> torch.nn.Module:
        """Network that becomes the model: the moving average, if there is one."""
        average = self.tensors.average
        return self.model.network if average is None else average

    def _record(self, found: Accuracy) -> dict[str, Any]:
        """Return how the network was trained, and its accuracy."""
        return {
            "recipe": self.recipe.to_dict(),
            "precision": self.precision,
            "device": name_of(self.device),
            "start": self.start,
            "designs": self.step * self.recipe.batch,
            "seconds": round(self.seconds, 1),
            "data": {**overlap(self.data, self.split), "runs": self.data.run_count},
            "held_out": found.to_dict(),
            "epochs": [
                {name: finite(value) for name, value in asdict(epoch).items()} for epoch in self.log
            ],
            "provenance": provenance(torch=import_torch().__version__),
        }

    def _progress(self, epoch: EpochRecord | None = None) -> Progress:
        batch = self.recipe.batch
        loss = math.nan if epoch is None else epoch.loss
        if self.loss_count:
            loss = self.loss_sum / self.loss_count
        return Progress(self.step * batch, self.total_steps * batch, loss, epoch)

    def _steps_of_epoch(self) -> Iterator[None]:
        """Make the remaining steps of the current epoch, and yield after each."""
        import torch

        epoch, first = divmod(self.step, self.steps_per_epoch)
        training, count = self.split.training, self.steps_per_epoch * self.recipe.batch
        efficiency = self.data.efficiency[training]
        rows = rows_of_epoch(self.recipe, epoch, training, efficiency, count)
        network, optimiser = self.model.network.train(), self.tensors.optimiser
        labels = ((self.data.efficiency - self.model.mean) / self.model.deviation).astype("f4")
        for number in range(first, self.steps_per_epoch):
            start = time.monotonic()
            chosen = rows[number * self.recipe.batch : (number + 1) * self.recipe.batch]
            arrays = self.model.view.arrays(self.data.packed[chosen])
            inputs = inputs_of(arrays, self.model.view.scale, self.device)
            target = torch.from_numpy(labels[chosen]).to(self.device)
            for group in optimiser.param_groups:
                group["lr"] = learning_rate(self.recipe, self.step, self.total_steps)
            with autocast(self.device, self.precision):
                output = network(inputs)
            loss = torch.mean((output.float() - target) ** 2)
            optimiser.zero_grad(set_to_none=True)
            loss.backward()  # type: ignore[no-untyped-call]
            optimiser.step()
            self.step += 1
            if self.tensors.average is not None:
                decay = self.recipe.averaging
                update_average(self.tensors.average, network, decay, self.step)
            value = loss.item()
            if not math.isfinite(value):
                raise RunFailed(
                    f"the training diverged: its loss is {value}; train again with a lower "
                    f"learning_rate"
                )
            self.loss_sum += value
            self.loss_count += 1
            self.seconds += time.monotonic() - start
            yield

    def _test(
        self, most: int | None, report: Callable[[int, int], None] = lambda _done, _total: None
    ) -> Accuracy:
        """Test the resulting network on at most so many held-out rows."""
        rows = self.split.some_held_out(most, self.recipe.split_seed)
        view = self.model.view
        found = run_network(
            self._result, view.arrays, self.data.packed[rows], view.scale, self.precision, report
        )
        return accuracy(self.model.efficiencies(found), self.data.efficiency[rows])

    def _end_epoch(self) -> EpochRecord:
        """Test the network and return the record of the current epoch."""
        found, loss = self._test(self.recipe.tested), self.loss_sum / self.loss_count
        self.loss_sum, self.loss_count = 0.0, 0
        return EpochRecord(
            len(self.log) + 1, self.step * self.recipe.batch, round(self.seconds, 2), loss,
            found.r_squared, found.determination, found.rms_error,
        )  # fmt: skip


def learning_rate(recipe: Recipe, step: int, total: int) -> float:
    """Return the learning rate of a step, counted from 0.

    Examples
    --------
    >>> from bellcrank.surrogate.recipes import Recipe
    >>> recipe = Recipe(learning_rate=0.1, warm_up=10, schedule="cosine")
    >>> [round(learning_rate(recipe, step, 100), 4) for step in (0, 9, 50, 100)]
    [0.01, 0.098, 0.05, 0.0]
    """
    rate = recipe.learning_rate
    if recipe.warm_up:
        rate *= min(1.0, (step + 1) / recipe.warm_up)
    if recipe.schedule == "cosine":
        rate *= 0.5 + 0.5 * math.cos(math.pi * step / total)
    return rate


def update_average(
    average: torch.nn.Module, network: torch.nn.Module, decay: float, step: int
) -> None:
    """Update the moving average of the weights; its decay is smaller in the first steps."""
    import torch

    weight = 1.0 - min(decay, (1.0 + step) / (10.0 + step))
    with torch.no_grad():
        target, source = average.state_dict(), network.state_dict()
        moving = [name for name, value in target.items() if value.is_floating_point()]
        torch._foreach_lerp_([target[n] for n in moving], [source[n] for n in moving], weight)
        for name, value in target.items():
            if not value.is_floating_point():
                value.copy_(source[name])
