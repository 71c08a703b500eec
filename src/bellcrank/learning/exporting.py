"""Pictures of a dataset's designs as PNG files, with a table of their efficiencies.

A style decides what a picture looks like. To add one, write a class that draws packed masks,
and register it.
"""

from __future__ import annotations

import csv
import hashlib
import io
import re
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import numpy as np

from bellcrank.errors import InvalidSettings, OutputExists
from bellcrank.model.storage import open_temporary, write_text
from bellcrank.registry import Registry
from bellcrank.storage.files import make_folder, remove_temporaries, storage_error, target_of
from bellcrank.surrogate.pictures import Canvas, Renderer, draw_lines

if TYPE_CHECKING:
    import os
    from collections.abc import Callable

    from numpy.typing import NDArray

    from bellcrank.model import Problem
    from bellcrank.surrogate.dataset import Dataset

LABELS = "labels.csv"
COLUMNS = ("name", "efficiency", "run", "step", "accepted")
UNDER_WAY = "unfinished.txt"
"""Says of a folder that its pictures are ours, and which, until the last one is written."""
NOTE = "bellcrank was drawing pictures here; the same command goes on with it\n"
OURS = re.compile(r"[0-9]+-[0-9]+\.png|labels\.csv|unfinished\.txt")
BATCH = 256
SPREAD_SEED = 0
"""Of which designs are drawn, where not all are."""


class Style(Protocol):
    """Draws designs of one problem."""

    def draw(self, packed: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Turn packed masks (n, bytes) into pictures: (n, height, width) grey or (..., 4) RGBA."""


styles: Registry[Callable[[Problem], Style]] = Registry("style")


@styles.register("fine")
class FineStyle:
    """Black on white in shades of grey, without snapping: what networks here look at."""

    def __init__(self, problem: Problem) -> None:
        self.renderer = Renderer(problem.lattice)

    def draw(self, packed: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Draw the designs; white is 255."""
        return 255 - self.renderer.render(packed)


@styles.register("paper")
class PaperStyle:
    """The paper's pictures, as far as they are known: what matplotlib's savefig writes.

    Known: the size, 192 x 128 pixels, and that pictures were saved by matplotlib with
    ``frameon=False``. From these follow, and are made here to the last bit as `savefig` makes
    them: a transparent background; pure black wherever a beam touches a pixel, with the
    antialiasing in the alpha channel alone, so that a reader that drops alpha sees jagged lines
    that are twice as fat; horizontal beams snapped to whole pixels, and sloping ones not.

    Assumed, since it is not published with the pictures: black lines of 2 pixels with round ends,
    nodes not marked, and the lattice centred, as large as fits with a margin of 2 pixels.
    """

    def __init__(self, problem: Problem) -> None:
        self.canvas = Canvas()
        self.lines = self.canvas.place(problem.lattice.positions)[problem.lattice.beams]

    def draw(self, packed: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Draw the designs; RGBA."""
        bits = np.unpackbits(packed, axis=1, count=len(self.lines)).astype(np.bool_)
        pictures = np.zeros((len(packed), self.canvas.height, self.canvas.width, 4), np.uint8)
        for picture, present in zip(pictures, bits, strict=True):
            alpha = draw_lines(self.canvas, self.lines[present], snap=True)
            picture[..., 3] = alpha
            picture[alpha == 0, :3] = 255  # as Agg leaves paper that nothing was drawn on
        return pictures


def export_pictures(
    data: Dataset,
    folder: str | os.PathLike[str],
    *,
    count: int | None = None,
    style: str = "fine",
    tell: Callable[[int, int], None] = lambda _done, _total: None,
) -> int:
    """Write pictures of designs, and ``labels.csv``, which names the efficiency of each.

    Files are called ``RUN-STEP.png``. If it was stopped or killed, the same call goes on; the
    table comes last, so that a folder with a table is complete.

    Parameters
    ----------
    count
        How many, evenly spread over the dataset; all by default.
    style
        Name in the registry of styles.
    tell
        Called now and then with how many are written, of how many.

    Returns
    -------
    int
        Number of pictures in the folder.

    Raises
    ------
    InvalidSettings
        If the count is not positive.
    UnknownName
        If there is no such style.
    OutputExists
        If the folder holds anything but a part of the same pictures.
    StorageError
        If it cannot be written.
    """
    if count is not None and count < 1:
        raise InvalidSettings(f"count: expected at least 1, got {count}")
    rows = np.arange(len(data)) if count is None else _spread(len(data), count)
    names = [f"{data.run[row]:05d}-{data.step[row]:06d}.png" for row in rows]
    if len(set(names)) < len(names):
        raise InvalidSettings("two designs of the dataset have the same run and step")
    drawing = styles[style](data.problem)
    place = Path(folder)
    table = _table(data, rows, names)
    _enter(place, f"{style} {hashlib.sha256(table.encode()).hexdigest()}")
    tell(0, len(rows))
    for first in range(0, len(rows), BATCH):
        chosen = slice(first, first + BATCH)
        missing = [n for n, name in enumerate(names[chosen], first) if not (place / name).exists()]
        if missing:
            pictures = drawing.draw(data.packed[rows[missing]])
            for number, picture in zip(missing, pictures, strict=True):
                _write_png(place / names[number], picture)
        tell(min(first + BATCH, len(rows)), len(rows))
    write_text(place / LABELS, table, overwrite=True)
    (place / UNDER_WAY).unlink()
    remove_temporaries(place, OURS)
    return len(rows)


def _spread(total: int, count: int) -> NDArray[np.int64]:
    """Return so many rows, one out of each of as many equal stretches, or all.

    Which one of a stretch is a matter of chance, the same at each call: at equal distances, all
    could be first steps of runs.
    """
    chosen = min(count, total)
    edges = np.arange(chosen + 1) * total // chosen
    rng = np.random.default_rng(np.random.SeedSequence(SPREAD_SEED))
    return np.asarray(rng.integers(edges[:-1], edges[1:]), np.int64)


def _table(data: Dataset, rows: NDArray[np.int64], names: list[str]) -> str:
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(COLUMNS)
    for name, row in zip(names, rows, strict=True):
        writer.writerow([
            name, float(data.efficiency[row]), data.run[row], data.step[row],
            int(data.accepted[row]),
        ])  # fmt: skip
    return buffer.getvalue()


def _enter(place: Path, what: str) -> None:
    """Make the folder ours, or go on in it if it was ours and unfinished."""
    if place.exists() and not place.is_dir():
        raise OutputExists(f"{place}: is a file; choose another folder")
    make_folder(place)
    note = place / UNDER_WAY
    if note.is_file() and note.read_text(encoding="utf-8") == NOTE + what:
        return
    others = sorted(path.name for path in place.iterdir() if not target_of(path.name))
    if others:
        raise OutputExists(
            f"{place}: exists already and is not empty (it holds {others[0]}); choose another "
            f"folder"
        )
    write_text(note, NOTE + what)


def _write_png(path: Path, picture: NDArray[np.uint8]) -> None:
    """Write a picture, whole or not at all.

    It is not forced to disk: a million times that would take hours, and what a power cut may
    cost is drawn again at will.
    """
    from PIL import Image

    try:
        temporary, file = open_temporary(path)
        with file:
            Image.fromarray(picture).save(file, "PNG")
        temporary.replace(path)
    except OSError as error:
        raise storage_error(path.parent, error) from error
