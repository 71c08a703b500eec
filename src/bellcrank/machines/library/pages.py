"""Page of the library: Markdown with a table for each kind, and a drawing of each entry."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING

from bellcrank.machines.library.entry import kind_title, kinds
from bellcrank.machines.library.thumbnails import Thumbnail, thumbnail
from bellcrank.mechanics import model_evaluator
from bellcrank.model.storage import already_exists, write_text
from bellcrank.storage.files import make_folder

if TYPE_CHECKING:
    from pathlib import Path

    from bellcrank.machines.library.catalogue import Library
    from bellcrank.machines.library.entry import Entry

PAGE = "README.md"
PICTURE = re.compile(r"[a-z0-9-]+-[0-9a-f]{8}\.svg")
"""File name of the drawing of an entry; other files in the folder are left alone."""
ORDER = ("up-left", "up", "up-right", "right", "down-right", "down", "down-left", "left")
"""Directions in clockwise order."""
ABOUT = (
    "{} entries, {} of them more efficient than the plain lever for the same problem. Each is "
    "pushed down on the right (orange) and moves its left port (blue). `docs/machines.md` defines "
    "the figures. This page is written by `bellcrank library index`. *Contact*: struts of the part "
    "touch along the stroke."
)
COLUMNS = (
    "", "name", "efficiency", "plain lever", "frame analysis", "input stiffness",
    "output stiffness", "share of work",
)  # fmt: skip


def write_page(known: Library, folder: Path, *, overwrite: bool = False) -> Path:
    """Write the page and the drawings into a folder.

    Returns
    -------
    Path
        The page.

    Raises
    ------
    OutputExists, StorageError
    InvalidFile
        If an entry is damaged.
    """
    path = folder / PAGE
    if path.exists() and not overwrite:
        raise already_exists(path)
    make_folder(folder)
    entries = sorted((known.find(each.name) for each in known.summaries), key=_position)
    for entry in entries:
        text = draw(entry).svg(entry.name)
        write_text(folder / f"{entry.name}.svg", text, overwrite=True)
    names = {entry.name for entry in entries}
    for old in folder.glob("*.svg"):
        if PICTURE.fullmatch(old.name) and old.stem not in names:
            old.unlink()
    write_text(path, page(entries), overwrite=overwrite)
    return path


def draw(entry: Entry) -> Thumbnail:
    """Draw an entry at rest and at its full stroke, under the load that it was designed for."""
    response = model_evaluator(entry.design.problem).evaluate(entry.design.mask)
    return thumbnail(entry.design, response.displacement)


def page(entries: list[Entry]) -> str:
    """Return the Markdown page."""
    better = sum(entry.better for entry in entries)
    lines = ["# Library of elementary actuators", "", ABOUT.format(len(entries), better)]
    for kind in dict.fromkeys(entry.kind for entry in entries):
        about = f": {kinds[kind].about}." if kind in kinds else "."
        lines += [
            "",
            f"## {kind_title(kind).capitalize()}",
            "",
            f"Kind `{kind}`{about}",
            "",
            f"| {' | '.join(COLUMNS)} |",
            f"|{'---|' * len(COLUMNS)}",
        ]
        lines += [_row(entry) for entry in entries if entry.kind == kind]
    return "\n".join(lines) + "\n"


def _position(entry: Entry) -> tuple[int, int, str]:
    """Return the sort key of an entry: clockwise direction, then size."""
    position = ORDER.index(entry.direction) if entry.direction in ORDER else len(ORDER)
    return position, entry.columns or 0, entry.kind


def _row(entry: Entry) -> str:
    rest, check = entry.characterisation.rest, entry.validation
    lever = _figure(entry.lever.efficiency)
    frame = _figure(check.efficiency) if check.status == "converged" else check.status
    if entry.warnings:
        frame += " (warning)" if entry.characterisation.warnings else " (contact)"
    cells = [
        f'<img src="{entry.name}.svg" width="130" alt="{entry.name}">',
        f"`{entry.name}`",
        f"**{_figure(entry.efficiency)}**",
        lever if entry.better else f"{lever} (more efficient)",
        frame,
        _figure(rest.input_stiffness),
        _figure(rest.output_stiffness),
        f"{100.0 * rest.best_work_share:.1f} %",
    ]
    return f"| {' | '.join(cells)} |"


def _figure(value: float) -> str:
    """Return three digits, or a dash for a value that is not finite."""
    return f"{value:.3g}" if math.isfinite(value) else "–"
