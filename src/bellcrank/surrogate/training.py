"""Training: a generator of what happens, that can be killed at any time and gone on with.

All random numbers come from streams named by seed and epoch, and a checkpoint is the weights,
the optimiser's running figures and two counters: a training that was stopped and resumed ends
with the same weights, to the last bit on the same machine, as one that was not.
"""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING, Any

from bellcrank.model.storage import write_bytes, write_text
from bellcrank.provenance import provenance
from bellcrank.surrogate.backend import autocast, import_torch, name_of
from bellcrank.surrogate.checkpoints import checkpoint_bytes
from bellcrank.surrogate.folder import CHECKPOINT, LOG, MODEL
from bellcrank.surrogate.metrics import accuracy
from bellcrank.surrogate.progress import EpochRecord, LossMeter, Progress, log_text
from bellcrank.surrogate.schedule import move_average, neighbours_of, rate_of, rows_of_epoch
from bellcrank.surrogate.splitting import overlap
from bellcrank.surrogate.trained import run_network

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    import torch

    from bellcrank.surrogate.dataset import Dataset
    from bellcrank.surrogate.feeding import Feeder
    from bellcrank.surrogate.metrics import Accuracy
    from bellcrank.surrogate.recipes import Recipe
    from bellcrank.surrogate.splitting import Split
    from bellcrank.surrogate.trained import TrainedModel
    from bellcrank.surrogate.views import View

CHECKPOINT_SECONDS = 60.0
"""Between two checkpoints: what a kill can cost."""
TELL_SECONDS = 0.5
"""Between two reports."""
STEPS_AT_ONCE = 50
"""That a GPU makes between two looks at the clock: asking how it goes waits for it."""


@dataclass(slots=True, eq=False)
class Training:
    """A training under way. Made by `begin` or `resume` of `bellcrank.surrogate.beginning`.

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
            self.log.append(self._end_epoch())
            self.save()
            saved = time.monotonic()
            yield self._progress(self.log[-1])

    def look_through(self, view: View) -> None:
        """Let the network see designs in another way, pictures of another size for example."""
        from bellcrank.surrogate.feeding import feeder_of

        self.model = replace(self.model, view=view)
        self.feeder = feeder_of(view, self.device)

    def finish(
        self,
        most: int | None = None,
        tell: Callable[[Progress], None] = lambda _progress: None,
    ) -> TrainedModel:
        """Test on what is held out, and return the model; write it to the folder.

        Parameters
        ----------
        most
            Held-out designs to test on; by default as the recipe says.
        tell
            Called now and then with where the test is.
        """

        def tested(done: int, total: int) -> None:
            tell(replace(self._progress(), testing=(done, total)))

        record = self._record(self._test(most or self.recipe.tested_last, tested))
        model = replace(self.model, network=self._kept, record=record)
        if self.folder is not None:
            self._write_log(self.folder)  # a kill may have come between checkpoint and log
            model.write(self.folder / MODEL, overwrite=True)
        return model

    def _record(self, found: Accuracy) -> dict[str, Any]:
        """Return how the network was trained and how well it does."""
        record = {
            "recipe": self.recipe.to_dict(),
            "precision": self.precision,
            "device": name_of(self.device),
            "designs": self.step * self.recipe.batch,
            "seconds": round(self.seconds, 1),
            "data": {**asdict(overlap(self.data, self.split)), "runs": self.data.run_count},
            "held_out": found.to_dict(),
            "epochs": [epoch.to_dict() for epoch in self.log],
            "provenance": provenance(torch=import_torch().__version__),
        }
        return record if self.before is None else {**record, "before": self.before}

    def _progress(self, epoch: EpochRecord | None = None) -> Progress:
        batch = self.recipe.batch
        self.losses.settle()
        return Progress(self.step * batch, self.total_steps * batch, self.losses.running, epoch)

    @property
    def _kept(self) -> torch.nn.Module:
        """The network that is kept in the end: the average, if there is one."""
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

    def _test(
        self, most: int | None, tell: Callable[[int, int], None] = lambda _done, _total: None
    ) -> Accuracy:
        """Test the network that is kept on held-out rows, at most so many."""
        rows = self.split.some_held_out(most, self.recipe.split_seed)
        found = run_network(self._kept, self.feeder, self.data.packed[rows], self.precision, tell)
        return accuracy(self.model.efficiencies(found), self.data.efficiency[rows])

    def _end_epoch(self) -> EpochRecord:
        """Return how the network stands after the epoch at hand."""
        found = self._test(self.recipe.tested)
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
