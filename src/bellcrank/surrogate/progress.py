"""Progress of a training and records of its epochs."""

from __future__ import annotations

import csv
import io
import math
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any, Self

from bellcrank.errors import RunFailed
from bellcrank.surrogate.metrics import finite

if TYPE_CHECKING:
    from collections.abc import Sequence

    import torch

SMOOTHING = 0.02
"""Weight of the newest batch in the smoothed loss."""


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
        variance.
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

    def to_dict(self) -> dict[str, Any]:
        """Return the record as plain data; nan becomes None."""
        return {name: finite(value) for name, value in asdict(self).items()}


@dataclass(frozen=True, slots=True)
class Progress:
    """Progress of a training.

    Parameters
    ----------
    done, total
        Training designs so far, and in all epochs.
    loss
        Smoothed mean squared error in units of the variance; nan before the first batch.
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


@dataclass(slots=True)
class LossMeter:
    """Smoothed and mean loss, evaluated in groups, since each evaluation waits for the device.

    Parameters
    ----------
    smoothed
        Exponentially smoothed loss; nan before the first batch.
    total, count
        Sum over the current epoch and number of batches.
    """

    smoothed: float = math.nan
    total: float = 0.0
    count: int = 0
    _pending: list[torch.Tensor] = field(default_factory=list)

    def add(self, loss: torch.Tensor) -> None:
        """Add the loss of a batch, to be evaluated later."""
        self._pending.append(loss.detach())

    def settle(self) -> None:
        """Evaluate pending losses one by one; the result does not depend on when this is done.

        Raises
        ------
        RunFailed
            If a loss is not finite.
        """
        if not self._pending:
            return
        import torch

        losses = torch.stack(self._pending).tolist()
        self._pending.clear()
        for loss in losses:
            if not math.isfinite(loss):
                raise RunFailed(
                    f"the training diverged: its loss is {loss}; train again with a lower "
                    f"learning_rate"
                )
            first = math.isnan(self.smoothed)
            self.smoothed = loss if first else (1.0 - SMOOTHING) * self.smoothed + SMOOTHING * loss
            self.total += loss
            self.count += 1

    def end_epoch(self) -> float:
        """Return the mean loss of the epoch, and start the next."""
        mean = self.total / self.count if self.count else self.smoothed
        self.total, self.count = 0.0, 0
        return mean

    def to_dict(self) -> dict[str, Any]:
        """Return the figures for a checkpoint."""
        return {"loss": self.smoothed, "loss_total": self.total, "loss_count": self.count}

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Self:
        """Rebuild the figures from a checkpoint."""
        return cls(float(data["loss"]), float(data["loss_total"]), int(data["loss_count"]))


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
