"""Training: a generator of what happens, that can be killed at any time and gone on with.

All random numbers come from streams named by seed and epoch, and a checkpoint is the weights,
the optimiser's running figures and two counters: a training that was stopped and resumed ends
with the same weights, to the last bit on the same machine, as one that was not.
"""

from __future__ import annotations

import copy
import time
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidModel, InvalidSettings
from bellcrank.model.storage import write_bytes, write_text
from bellcrank.provenance import provenance
from bellcrank.runs.files import make_folder
from bellcrank.surrogate.backend import (
    autocast,
    find_device,
    find_precision,
    import_torch,
    name_of,
)
from bellcrank.surrogate.checkpoints import checkpoint_bytes, restore
from bellcrank.surrogate.folder import (
    CHECKPOINT,
    DESCRIPTION,
    INITIAL,
    LOG,
    MODEL,
    Description,
    check_new,
    data_hash,
    read_description,
    read_recipe,
    require_data,
    split_hash,
    tidy,
    write_description,
)
from bellcrank.surrogate.identity import architecture_of
from bellcrank.surrogate.metrics import accuracy
from bellcrank.surrogate.progress import EpochRecord, LossMeter, Progress, log_text
from bellcrank.surrogate.schedule import (
    move_average,
    neighbours_of,
    rate_of,
    rows_of_epoch,
)
from bellcrank.surrogate.splitting import Split, overlap, split_by_run
from bellcrank.surrogate.trained import TrainedModel, read_model, run_network
from bellcrank.surrogate.views import views

if TYPE_CHECKING:
    import os
    from collections.abc import Callable, Iterator

    import torch
    from numpy.typing import NDArray

    from bellcrank.surrogate.dataset import Dataset
    from bellcrank.surrogate.feeding import Feeder
    from bellcrank.surrogate.recipes import Recipe
    from bellcrank.surrogate.views import View

__all__ = [
    "DESCRIPTION",
    "MODEL",
    "EpochRecord",
    "Progress",
    "Training",
    "begin",
    "data_hash",
    "read_recipe",
    "resume",
]

CHECKPOINT_SECONDS = 60.0
"""Between two checkpoints: what a kill can cost."""
TELL_SECONDS = 0.5
"""Between two reports."""
STEPS_AT_ONCE = 50
"""That a GPU makes between two looks at the clock: asking how it goes waits for it."""


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
    before
        Designs and seconds that the network had seen and taken before, if it goes on from one.
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
    losses: LossMeter = field(default_factory=LossMeter)
    log: list[EpochRecord] = field(default_factory=list)
    before: dict[str, float] | None = None

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
                for _ in self._steps_of_epoch():
                    now = time.monotonic()
                    if now - saved > CHECKPOINT_SECONDS:
                        self.save()
                        saved = time.monotonic()
                    if now - told > TELL_SECONDS:
                        yield self._progress()
                        told = now
                    if stop():
                        self.save()
                        return
            self.losses.settle()
            self.log.append(self._test())
            self.save()
            saved = time.monotonic()
            yield self._progress(self.log[-1])

    def go_on_from(self, model: TrainedModel) -> None:
        """Begin with the weights of a trained network, its view and its normalisation.

        Raises
        ------
        InvalidSettings
            If it is of another architecture.
        InvalidModel
            If it numbers beams otherwise than the data do.
        """
        if model.architecture != self.recipe.model:
            raise InvalidSettings(
                f"a {self.recipe.model!r} cannot go on from the weights of a "
                f"{model.architecture!r}; take the recipe that it was trained by, or begin afresh"
            )
        there, here = model.problem, self.data.problem
        if not np.array_equal(there.lattice.beams, here.lattice.beams):
            raise InvalidModel(
                f"the network knows the beams of {there.name!r}, which are not those of "
                f"{here.name!r} in their order"
            )
        self.before = model.seen
        self.look_through(model.view)
        self.model = replace(self.model, mean=model.mean, deviation=model.deviation)
        for network in (self.model.network, self.average):
            if network is not None:
                network.load_state_dict(model.network.state_dict())

    def look_through(self, view: View) -> None:
        """Let the network see designs in another way, pictures of another size for example."""
        from bellcrank.surrogate.feeding import feeder_of

        self.model = replace(self.model, view=view)
        self.feeder = feeder_of(view, self.device)

    def finish(self, most: int | None = None) -> TrainedModel:
        """Test on what is held out, and return the model; write it to the folder.

        Parameters
        ----------
        most
            Held-out designs to test on; by default all.
        """
        rows = self._tested(most)
        found = accuracy(self._predict(rows), self.data.efficiency[rows])
        record = {
            "recipe": self.recipe.to_dict(),
            "precision": self.precision,
            "device": name_of(self.device),
            "designs": self.step * self.recipe.batch,
            "seconds": round(self.seconds, 1),
            "data": {**asdict(overlap(self.data, self.split)), "runs": self.data.run_count},
            "held_out": found.to_dict(),
            "epochs": [asdict(epoch) for epoch in self.log],
            "provenance": provenance(torch=import_torch().__version__),
        }
        if self.before is not None:
            record["before"] = self.before
        model = TrainedModel(
            self.model.architecture, self.data.problem, self.model.view, self._network(),
            self.model.mean, self.model.deviation, record,
        )  # fmt: skip
        if self.folder is not None:
            self._write_log(self.folder)  # a kill may have come between checkpoint and log
            model.write(self.folder / MODEL, overwrite=True)
        return model

    def _progress(self, epoch: EpochRecord | None = None) -> Progress:
        batch = self.recipe.batch
        self.losses.settle()
        return Progress(self.step * batch, self.total_steps * batch, self.losses.running, epoch)

    def _network(self) -> torch.nn.Module:
        """Return the network that is kept: the average, if there is one."""
        return self.model.network if self.average is None else self.average

    def _steps_of_epoch(self) -> Iterator[None]:
        """Make the steps that are left of the epoch at hand; yield now and then."""
        import torch

        from bellcrank.surrogate.losses import loss_of

        epoch, first = divmod(self.step, self.steps_per_epoch)
        training, wanted = self.split.training, self.steps_per_epoch * self.recipe.batch
        efficiency = self.data.efficiency[training]
        paired = neighbours_of(self.data.run) if self.recipe.differences else None
        rows = rows_of_epoch(self.recipe, epoch, training, efficiency, wanted, paired)
        network = self.model.network.train()
        labels = ((self.data.efficiency - self.model.mean) / self.model.deviation).astype("f4")
        breath = 1 if self.device.type == "cpu" else STEPS_AT_ONCE
        for number in range(first, self.steps_per_epoch):
            start = time.monotonic()
            chosen = rows[number * self.recipe.batch : (number + 1) * self.recipe.batch]
            inputs = self.feeder.feed(self.data.packed[chosen])
            target = torch.from_numpy(labels[chosen]).to(self.device)
            for group in self.optimiser.param_groups:
                group["lr"] = rate_of(self.recipe, self.step, self.total_steps)
            with autocast(self.device, self.precision):
                output = network(inputs)
            loss = loss_of(output.float(), target, self.recipe.differences)
            self.optimiser.zero_grad(set_to_none=True)
            loss.backward()  # type: ignore[no-untyped-call]
            self.optimiser.step()
            self.step += 1
            if self.average is not None:
                move_average(self.average, network, self.recipe.averaging, self.step)
            self.losses.add(loss)
            if self.step % breath == 0:
                self.losses.settle()
            self.seconds += time.monotonic() - start
            if self.step % breath == 0:
                yield

    def _predict(self, rows: NDArray[np.int64]) -> NDArray[np.float64]:
        found = run_network(self._network(), self.feeder, self.data.packed[rows], self.precision)
        return self.model.mean + self.model.deviation * found

    def _tested(self, most: int | None) -> NDArray[np.int64]:
        """Return held-out rows, the same whenever so many are asked for."""
        rows = self.split.held_out
        if most is None or len(rows) <= most:
            return rows
        rng = np.random.default_rng(self.recipe.split_seed)
        return np.sort(rng.choice(rows, most, replace=False))

    def _test(self) -> EpochRecord:
        rows = self._tested(self.recipe.tested)
        found = accuracy(self._predict(rows), self.data.efficiency[rows])
        return EpochRecord(
            len(self.log) + 1, self.step * self.recipe.batch, round(self.seconds, 2),
            self.losses.end_epoch(), found.r_squared, found.determination, found.rms_error,
        )  # fmt: skip

    def save(self) -> None:
        """Write a checkpoint and the log, if there is a folder."""
        if self.folder is not None:
            self.losses.settle()
            write_bytes(self.folder / CHECKPOINT, checkpoint_bytes(self), overwrite=True)
            self._write_log(self.folder)

    def _write_log(self, folder: Path) -> None:
        write_text(folder / LOG, log_text(self.log), overwrite=True)


def begin(
    data: Dataset,
    recipe: Recipe,
    folder: str | os.PathLike[str] | None = None,
    *,
    device: str = "auto",
    initial: TrainedModel | None = None,
    split: Split | None = None,
) -> Training:
    """Begin a training in a new folder.

    Parameters
    ----------
    initial
        A network to go on from; by default it begins with random weights.
    split
        Rows to learn from, some perhaps more than once, and rows to hold out; by default as the
        recipe says. Whoever resumes has to give the same again.

    Raises
    ------
    InvalidDataset
        If the data come from a single run.
    InvalidSettings
        If PyTorch or the device is missing, all efficiencies are the same, or `initial` is of
        another architecture.
    InvalidModel
        If `initial` numbers beams otherwise.
    UnknownName
        If there is no such model.
    OutputExists
        If a training, or something of one, lies in the folder already.
    """
    if folder is not None:
        check_new(folder)
    where = find_device(device)
    training = _build(data, recipe, where, find_precision(recipe.precision, where), split)
    if initial is not None:
        training.go_on_from(initial)
    if folder is not None:
        training.folder = Path(folder)
        tidy(training.folder)
        if initial is not None:  # before the description: whoever finds that may go on
            make_folder(training.folder)
            initial.write(training.folder / INITIAL, overwrite=True)
        told = Description(
            recipe, training.precision, data_hash(data), _name_of(split), initial is not None
        )
        write_description(training.folder, told)
    return training


def resume(
    folder: str | os.PathLike[str],
    data: Dataset,
    *,
    device: str = "auto",
    split: Split | None = None,
) -> Training:
    """Go on with the training in a folder.

    Parameters
    ----------
    split
        As it was begun with.

    Raises
    ------
    InvalidFile
        If there is none, or its description is damaged.
    InvalidSettings
        If it was begun with other data, or another split of them.
    InvalidModel
        If its checkpoint, or the network that it goes on from, is damaged.
    """
    place = Path(folder)
    told = read_description(place)
    require_data(folder, told, data)
    if told.split != _name_of(split):
        raise InvalidSettings(f"{folder}: the training there holds out other designs")
    training = _build(data, told.recipe, find_device(device), told.precision, split)
    training.folder = place
    tidy(place)
    if told.initial:
        training.go_on_from(read_model(place / INITIAL))
    if (place / CHECKPOINT).exists():
        restore(training, place / CHECKPOINT)
    return training


def _name_of(split: Split | None) -> str | None:
    return None if split is None else split_hash(split)


def _build(
    data: Dataset,
    recipe: Recipe,
    device: torch.device,
    precision: str,
    given: Split | None,
) -> Training:
    import torch

    from bellcrank.surrogate.feeding import feeder_of

    split = given or split_by_run(data, recipe.held_out, recipe.split_seed)
    seen = data.efficiency[split.training]
    if seen.min() == seen.max():  # their deviation may be a remnant of rounding
        raise InvalidSettings(f"all efficiencies are {seen[0]:g}: there is nothing to learn")
    architecture = architecture_of(recipe.model)
    view = views[architecture.view](data.problem)
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(recipe.seed)
        network = architecture.build(view.shape)
    network = network.to(device).to(memory_format=torch.channels_last)  # type: ignore[call-overload]
    model = TrainedModel(
        recipe.model, data.problem, view, network, float(seen.mean()), float(seen.std())
    )
    average = copy.deepcopy(network) if recipe.averaging else None
    kind = torch.optim.AdamW if recipe.optimiser == "adamw" else torch.optim.Adam
    optimiser = kind(
        network.parameters(), lr=recipe.learning_rate, weight_decay=recipe.weight_decay
    )
    return Training(
        data, recipe, split, None, device, precision, model, feeder_of(view, device), optimiser,
        average,
    )  # fmt: skip
