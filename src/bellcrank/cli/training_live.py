"""How far a training is, or learning in rounds, on a live line."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from rich.progress import TextColumn, TimeRemainingColumn

from bellcrank.cli.console import notes
from bellcrank.cli.live import Live

if TYPE_CHECKING:
    from bellcrank.learning.active import Round
    from bellcrank.learning.fitting import FitProgress
    from bellcrank.learning.rounds import RoundsProgress

UNITS = {"searching": "steps", "labelling": "designs"}


class TrainingLive(Live):
    """Shows how training goes, and keeps a line of each epoch."""

    def __init__(self, title: str = "training") -> None:
        super().__init__(title, None, TextColumn("left"), TimeRemainingColumn())
        self._start = time.monotonic()
        self._first: int | None = None

    def begin(self) -> None:
        """Begin to measure speed anew."""
        self._start, self._first = time.monotonic(), None

    def __call__(self, told: FitProgress, prefix: str = "") -> None:
        """Take in where training is; `prefix` stands before what is shown."""
        progress = told.progress
        done = told.member * progress.total + progress.done
        total = told.members * progress.total
        if self._first is None:
            self._first = done
        passed = time.monotonic() - self._start
        speed = f"  {(done - self._first) / passed:.0f} designs/s" if done > self._first else ""
        which = f"network {told.member + 1} of {told.members}  " if told.members > 1 else ""
        which = prefix + which
        if progress.testing is not None:
            tested, held_out = progress.testing
            line = f"{which}testing  {tested} / {held_out} designs held out"
            self._show(done, total, line, line)
            return
        figures = f"{which}loss {progress.loss:.4f}{speed}"
        self._show(done, total, figures, f"training {100.0 * done / total:3.0f} %  {figures}")
        if (epoch := progress.epoch) is not None:
            notes.print(
                f"{which}epoch {epoch.epoch}: loss {epoch.loss:.4f}, held out R² "
                f"{epoch.r_squared:.4f}, determination {epoch.determination:.4f}, error "
                f"{epoch.rms_error:.3f}"
            )


class RoundsLive(TrainingLive):
    """Shows how learning in rounds goes, and keeps a line of each round."""

    def __init__(self) -> None:
        super().__init__("learning")
        self._number = -1

    def show(self, told: RoundsProgress) -> None:
        """Take in where it is."""
        prefix = f"round {told.number} of {told.rounds}  " if told.number else ""
        if told.found is not None:
            notes.print(f"{prefix}{_sentence(told.found)}")
        elif told.fit is not None:
            if told.number != self._number:
                self._number = told.number
                self.begin()
            self(told.fit, prefix)
        else:
            line = f"{prefix}{told.what}  {told.done} / {told.total} {UNITS[told.what]}"
            self._show(told.done, told.total, line, line)


def _sentence(found: Round) -> str:
    held_out = sum(each.r_squared for each in found.held_out) / len(found.held_out)
    left_out = found.proposed - found.labelled
    snapped = f" ({left_out} more have no unique response)" if left_out else ""
    of = "the networks' mean" if len(found.held_out) > 1 else "the network's"
    return (
        f"{found.labelled} designs labelled{snapped}, R² of the predictions for them "
        f"{found.surprise.r_squared:.4f}; after training, {of} R² on what the dataset holds out "
        f"{held_out:.4f}"
    )
