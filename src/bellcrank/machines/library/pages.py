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
    "{} actuators, frames of struts 2 mm wide on 10 mm. Each is pushed down on the right (orange) "
    "and moves its left port (blue). `docs/machines.md` defines the figures, those of the part at "
    "full stroke by frames with 8 elements in each strut; *in the sheet* is the gain by finite "
    "elements in the plane. This page is written by `bellcrank "
    "library index`."
)
COLUMNS = (
    "", "name", "gain", "in the sheet", "travel, mm", "off-axis", "rotation, degrees", "payload, N",
    "blocked force, N", "sag, mm", "input force, N",
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
    """Draw an entry at rest and at its full stroke."""
    response = model_evaluator(entry.design.problem).evaluate(entry.design.mask)
    return thumbnail(entry.design, response.displacement)


def page(entries: list[Entry]) -> str:
    """Return the Markdown page."""
    lines = ["# Library of elementary actuators", "", ABOUT.format(len(entries))]
    known = [*kinds, *sorted({entry.kind for entry in entries} - set(kinds))]
    for kind in known:
        rows = [_row(entry) for entry in entries if entry.kind == kind]
        if not rows:
            continue
        lines += [
            "",
            f"## {kind_title(kind).capitalize()}",
            "",
            f"Kind `{kind}`.",
            "",
            f"| {' | '.join(COLUMNS)} |",
            f"|{'---|' * len(COLUMNS)}",
        ]
        lines += rows
    return "\n".join(lines) + "\n"


def _position(entry: Entry) -> tuple[int, int, str]:
    """Return the sort key of an entry: clockwise direction, then size."""
    position = ORDER.index(entry.direction) if entry.direction in ORDER else len(ORDER)
    return position, entry.columns or 0, entry.kind


def _gain_in_sheet(entry: Entry) -> float | None:
    """Return the gain by finite elements in the plane; None if it is unknown."""
    for item in entry.provenance.get("items", ()):
        if item["quantity"] == "gain" and "sheet" in item["reached"]:
            return float(item["reached"]["sheet"]["value"])
    return None


def _row(entry: Entry) -> str:
    def figure(name: str, form: str) -> str:
        value = entry.figures.get(name)
        return form.format(value) if value is not None and math.isfinite(value) else "–"

    sheet = _gain_in_sheet(entry)
    warning = " (see its warnings)" if entry.warnings else ""
    cells = [
        f'<img src="{entry.name}.svg" width="130" alt="{entry.name}">',
        f"`{entry.name}`{warning}",
        f"**{figure('efficiency', '{:.2f}')}**",
        "–" if sheet is None else f"{sheet:.2f}",
        figure("travel_mm", "{:.1f}"),
        figure("off_axis", "{:.1%}"),
        figure("rotation_deg", "{:.1f}"),
        figure("payload_N", "{:.2f}"),
        figure("blocked_force_N", "{:.2f}"),
        figure("sag_mm", "{:.2f}"),
        figure("largest_input_force_N", "{:.1f}"),
    ]
    return f"| {' | '.join(cells)} |"
