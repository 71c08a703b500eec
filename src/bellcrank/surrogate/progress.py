"""How a training tells where it is, and what it keeps of each epoch."""

from __future__ import annotations

import csv
import io
import math
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

from bellcrank.errors import RunFailed
from bellcrank.surrogate.metrics import finite

if TYPE_CHECKING:
    from collections.abc import Sequence

    import torch

FORGETTING = 0.02
"""Weight of the newest batch in the running loss."""


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
        Mean squared error over the batches of the epoch, each by the weights that it found, in
        units of the variance.
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

    def to_dict(self) -> dict[str, Any]:
        """Return the record as plain data; what is not a number becomes None."""
        return {name: finite(value) for name, value in asdict(self).items()}


@dataclass(frozen=True, slots=True)
class Progress:
    """Where training is.

    Parameters
    ----------
    done, total
        Designs seen, and to be seen.
    loss
        Running mean squared error, in units of the variance; nan before the first batch.
    epoch
        The record of the epoch that has just ended, if one has.
    testing
        In the end: how many held-out designs were tested so far, of how many.
    """

    done: int
    total: int
    loss: float
    epoch: EpochRecord | None = None
    testing: tuple[int, int] | None = None


@dataclass(slots=True)
class LossMeter:
    """Collects the losses of batches without asking the device for each: asking waits.

    Parameters
    ----------
    running
        Mean that forgets; nan before the first batch.
    total, count
        Sum over the epoch at hand, and of how many batches.
    """

    running: float = math.nan
    total: float = 0.0
    count: int = 0
    _waiting: list[torch.Tensor] = field(default_factory=list)

    def add(self, loss: torch.Tensor) -> None:
        """Note the loss of a batch."""
        self._waiting.append(loss.detach())

    def settle(self) -> None:
        """Count in what was noted, one by one, so that it does not matter when this is done.

        Raises
        ------
        RunFailed
            If a loss is no number any more.
        """
        if not self._waiting:
            return
        import torch

        losses = torch.stack(self._waiting).tolist()
        self._waiting.clear()
        for loss in losses:
            if not math.isfinite(loss):
                raise RunFailed(
                    f"the training diverged: its loss is {loss}; train again with a lower "
                    f"learning_rate"
                )
            first = math.isnan(self.running)
            self.running = loss if first else (1.0 - FORGETTING) * self.running + FORGETTING * loss
            self.total += loss
            self.count += 1

    def end_epoch(self) -> float:
        """Return the mean over the epoch, and begin the next."""
        mean = self.total / self.count if self.count else self.running
        self.total, self.count = 0.0, 0
        return mean

    def to_dict(self) -> dict[str, Any]:
        """Return the figures, as a checkpoint keeps them."""
        return {"loss": self.running, "loss_total": self.total, "loss_count": self.count}

    @classmethod
    def from_dict(cls, told: dict[str, Any]) -> LossMeter:
        """Go on from a checkpoint; early ones had the running loss only."""
        return cls(
            float(told["loss"]), float(told.get("loss_total", 0.0)), int(told.get("loss_count", 0))
        )


def log_text(log: Sequence[EpochRecord]) -> str:
    """Return the records of epochs as CSV.

    Examples
    --------
    >>> print(log_text([EpochRecord(1, 64, 2.5, 0.5, 0.9, 0.8, 0.1)]), end="")
    epoch,designs,seconds,loss,r_squared,determination,rms_error
    1,64,2.5,0.5,0.9,0.8,0.1
    """
    buffer = io.StringIO()
    writer = csv.DictWriter(buffer, list(EpochRecord.__dataclass_fields__), lineterminator="\n")
    writer.writeheader()
    writer.writerows(asdict(epoch) for epoch in log)
    return buffer.getvalue()
