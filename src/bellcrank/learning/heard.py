"""What networks have said in a search, so that one that was stopped need not ask them again.

A search is determined by its random numbers and by what it hears of the designs that it asks
about. Whoever tells it the same again, question by question, leads it to where it was.
"""

from __future__ import annotations

import io
import time
import zipfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.model.storage import write_bytes
from bellcrank.surrogate.predictor import Prediction

if TYPE_CHECKING:
    import os

    from numpy.typing import NDArray

    from bellcrank.surrogate.predictor import Predictor

KEEP_SECONDS = 60.0
"""Between two savings: what a kill can cost."""


@dataclass(slots=True, eq=False)
class Heard:
    """The answers of networks in one search, in order.

    Parameters
    ----------
    path
        Where they are kept; None keeps nothing.
    known
        From before an interruption.
    said
        In this session, those told again included.
    """

    path: Path | None = None
    known: list[Prediction] = field(default_factory=list)
    said: list[Prediction] = field(default_factory=list)
    _saved: float = field(default_factory=time.monotonic)

    @classmethod
    def at(cls, path: str | os.PathLike[str]) -> Heard:
        """Take up what a file has kept; nothing if there is none that can be read."""
        place = Path(path)
        try:
            with np.load(io.BytesIO(place.read_bytes()), allow_pickle=False) as file:
                first, later = file["first"], file["later"]
            known = [_prediction(first), *map(_prediction, later)]
        except (OSError, ValueError, KeyError, EOFError, IndexError, zipfile.BadZipFile):
            known = []
        return cls(place, known)

    def ask(self, predictor: Predictor, masks: NDArray[np.bool_]) -> Prediction:
        """Return what networks say of designs (n, M), or what they said when asked before.

        The first question is always asked: networks that answer it otherwise are others, and
        nothing that is known counts.
        """
        number = len(self.said)
        if 0 < number < len(self.known) and len(self.known[number].efficiency) == len(masks):
            found = self.known[number]
        else:
            found = predictor.predict(masks)
            if number == 0 and self.known and not _same(found, self.known[0]):
                self.known.clear()
        self.said.append(found)
        return found

    def keep(self, *, now: bool = False) -> None:
        """Save what was heard, if it is time to, or at once."""
        due = now or time.monotonic() - self._saved > KEEP_SECONDS
        if self.path is None or not due or len(self.said) <= max(len(self.known), 1):
            return
        buffer = io.BytesIO()
        first, *later = map(_array, self.said)
        np.savez(buffer, first=first, later=np.stack(later))
        write_bytes(self.path, buffer.getvalue(), overwrite=True)
        self._saved = time.monotonic()


def _array(said: Prediction) -> NDArray[np.float64]:
    """Return (1, n), or (2, n) where there is a spread."""
    return np.stack([said.efficiency] if said.spread is None else [said.efficiency, said.spread])


def _prediction(rows: NDArray[np.float64]) -> Prediction:
    return Prediction(rows[0], rows[1] if len(rows) > 1 else None)


def _same(first: Prediction, second: Prediction) -> bool:
    return np.array_equal(_array(first), _array(second))
