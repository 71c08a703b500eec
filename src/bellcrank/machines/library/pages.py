"""Pages of the library: an HTML page, a Markdown page, and drawings for the latter."""

from __future__ import annotations

import html
import math
import re
from importlib.resources import files
from string import Template
from typing import TYPE_CHECKING

from bellcrank.machines.elementary import DIRECTIONS
from bellcrank.machines.library.entry import kind_title
from bellcrank.machines.library.thumbnails import Thumbnail, thumbnail
from bellcrank.mechanics import SpringEvaluator
from bellcrank.model.storage import already_exists, write_text
from bellcrank.storage.files import make_folder

if TYPE_CHECKING:
    from pathlib import Path

    from bellcrank.machines.library.catalogue import Library
    from bellcrank.machines.library.entry import Entry

PAGE, TABLE = "index.html", "README.md"
PICTURE = re.compile(r"[a-z0-9-]+-[0-9a-f]{8}\.svg")
"""File name of the drawing of an entry; other files in the folder are left alone."""
ORDER = ("up-left", "up", "up-right", "right", "down-right", "down", "down-left", "left")
"""Directions in clockwise order."""
ABOUT = (
    "{} entries, {} of them more efficient than the plain lever for the same problem. Each is "
    "pushed down on the right (orange) and moves its left port (blue). An "
    '<a href="index.html">HTML page</a> shows the same entries with filters. `docs/machines.md` '
    "defines the figures. This page is written by `bellcrank library index`. *Contact*: struts of "
    "the part touch along the stroke."
)
COLUMNS = (
    "", "name", "efficiency", "plain lever", "frame analysis", "input stiffness",
    "output stiffness", "share of work",
)  # fmt: skip


def write_pages(known: Library, out: Path, *, overwrite: bool = False) -> list[Path]:
    """Write both pages and the drawings into a folder.

    Returns
    -------
    list of Path
        The two pages.

    Raises
    ------
    OutputExists, StorageError
    InvalidFile
        If an entry is damaged.
    """
    pages = [out / PAGE, out / TABLE]
    for path in pages:
        if path.exists() and not overwrite:
            raise already_exists(path)
    make_folder(out)
    entries = sorted((known.find(each.name) for each in known.summaries), key=_position)
    drawn = {entry.name: draw(entry) for entry in entries}
    for name, picture in drawn.items():
        write_text(out / f"{name}.svg", picture.svg(name), overwrite=True)
    for old in out.glob("*.svg"):
        if PICTURE.fullmatch(old.name) and old.stem not in drawn:
            old.unlink()
    write_text(pages[0], page(entries, drawn), overwrite=overwrite)
    write_text(pages[1], table(entries), overwrite=overwrite)
    return pages


def draw(entry: Entry) -> Thumbnail:
    """Draw an entry at rest and at its full stroke, under the load that it was designed for."""
    response = SpringEvaluator(entry.design.problem).evaluate(entry.design.mask)
    return thumbnail(entry.design, response.displacement)


def page(entries: list[Entry], drawn: dict[str, Thumbnail]) -> str:
    """Return the HTML page, without external files."""
    found = [entry.direction for entry in entries]
    sizes = sorted({entry.columns for entry in entries if entry.columns is not None})
    kinds = list(dict.fromkeys(entry.kind for entry in entries))
    checks = [entry.validation for entry in entries]
    parts = {f"{c.material}, struts of {c.width:g} mm, spacing {c.scale:g} mm" for c in checks}
    cards = [
        _card(entry, drawn[entry.name], position, _longest(entries, entry))
        for position, entry in enumerate(entries)
    ]
    return Template((files(__package__) / "page.html").read_text(encoding="utf-8")).substitute(
        count=len(entries),
        better=sum(entry.better for entry in entries),
        stable=sum(check.status == "converged" for check in checks),
        clear=sum(not entry.warnings for entry in entries),
        directions=_choices(
            "direction",
            [("", "all"), *((name, _pointer(name)) for name in ORDER if name in found)],
        ),
        kinds=_choices("kind", [("", "all"), *((kind, kind_title(kind)) for kind in kinds)]),
        sizes=_choices("columns", [("", "all"), *((str(size), str(size)) for size in sizes)]),
        cards="\n".join(cards),
        part="; ".join(sorted(parts)),
    )


def table(entries: list[Entry]) -> str:
    """Return the Markdown page, with a table for each kind."""
    better = sum(entry.better for entry in entries)
    lines = ["# Library of elementary actuators", "", ABOUT.format(len(entries), better)]
    for kind in dict.fromkeys(entry.kind for entry in entries):
        lines += [
            "",
            f"## {kind_title(kind).capitalize()} (`{kind}`)",
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
    rest = entry.characterisation.rest
    lever = _figure(entry.lever.efficiency)
    cells = [
        f'<img src="{entry.name}.svg" width="130" alt="{entry.name}">',
        f"`{entry.name}`",
        f"**{_figure(entry.efficiency)}**",
        lever if entry.better else f"{lever} (more efficient)",
        _frame(entry) + (f" ({_warning_label(entry)})" if entry.warnings else ""),
        _figure(rest.input_stiffness),
        _figure(rest.output_stiffness),
        f"{rest.best_work_share:.1%}".replace("%", " %"),
    ]
    return f"| {' | '.join(cells)} |"


def _card(entry: Entry, picture: Thumbnail, position: int, longest: float) -> str:
    """Return the card of an entry on the HTML page."""
    rest = entry.characterisation.rest
    lever = entry.lever.efficiency
    attributes = {
        "direction": entry.direction,
        "kind": entry.kind,
        "columns": "" if entry.columns is None else str(entry.columns),
        "e": f"{entry.efficiency:.4f}",
        "g": f"{entry.efficiency - (lever if math.isfinite(lever) else 0.0):.4f}",
        "k": f"{rest.input_stiffness:.6f}",
        "o": f"{rest.output_stiffness:.6f}",
        "w": f"{rest.best_work_share:.5f}",
        "p": str(position),
    }
    data = " ".join(f'data-{key}="{value}"' for key, value in attributes.items())
    name = html.escape(entry.name)
    size = "" if entry.columns is None else f" · {entry.columns} columns"
    bars = "".join(
        f'<div><span>{label}</span><i style="--w:{100.0 * _part(value, longest):.0f}"></i>'
        f"<span>{_short(value)}</span></div>"
        for label, value in (("entry", entry.efficiency), ("lever", lever))
    )
    figures = [
        ("frame", _frame(entry) + _warning(entry)),
        ("work", f"{100.0 * rest.best_work_share:.1f} %"),
        ("input k", _figure(rest.input_stiffness)),
        ("output k", _figure(rest.output_stiffness)),
        ("beams", str(entry.design.beam_count)),
        ("strain", f"{100.0 * entry.validation.strain:.1f} %"),
    ]
    rows = "".join(f"<div><dt>{key}</dt><dd>{value}</dd></div>" for key, value in figures)
    verdict = "efficiency" if entry.better else '<span class="w">below lever</span>'
    return (
        f'<li {data}><svg viewBox="{picture.view_box}" role="img" aria-label="{name}">'
        f'{picture.content}</svg><div class="t"><b>{entry.direction.replace("-", " ")}{size}</b>'
        f'<span class="k {entry.kind}">{kind_title(entry.kind)}</span></div>'
        f'<div class="e"><div><strong>{entry.efficiency:.2f}</strong><small>{verdict}</small></div>'
        f'<div class="b">{bars}</div></div><dl class="f">{rows}</dl>'
        f'<button class="n" type="button" data-name="{name}">{name}</button></li>'
    )


def _warning(entry: Entry) -> str:
    """Return a label with the warnings of an entry as its tooltip."""
    if not entry.warnings:
        return ""
    text = html.escape("; ".join(entry.warnings))
    return f' <abbr class="w" title="{text}">{_warning_label(entry)}</abbr>'


def _warning_label(entry: Entry) -> str:
    return "warning" if entry.characterisation.warnings else "contact"


def _longest(entries: list[Entry], entry: Entry) -> float:
    """Return the largest efficiency among entries and levers of a kind: a bar of full length."""
    values = [
        value
        for each in entries
        if each.kind == entry.kind
        for value in (each.efficiency, each.lever.efficiency)
        if math.isfinite(value)
    ]
    return max(values, default=1.0)


def _part(value: float, whole: float) -> float:
    return min(max(value / whole, 0.0), 1.0) if math.isfinite(value) and whole > 0.0 else 0.0


def _choices(name: str, options: list[tuple[str, str]]) -> str:
    """Return radio buttons; the first is selected."""
    return "".join(
        f'<label class="c" title="{value or "all"}"><input type="radio" name="{name}" '
        f'value="{value}"{" checked" * (number == 0)} aria-label="{value or "all"}">'
        f"<span>{shown}</span></label>"
        for number, (value, shown) in enumerate(options)
    )


def _pointer(direction: str) -> str:
    """Return an arrow in a direction."""
    return (
        f'<svg viewBox="-12 -12 24 24" aria-hidden="true"><path transform="rotate('
        f'{-DIRECTIONS[direction]})" d="M-8 0H8M2 -6L8 0L2 6"/></svg>'
    )


def _frame(entry: Entry) -> str:
    check = entry.validation
    return _figure(check.efficiency) if check.status == "converged" else check.status


def _figure(value: float) -> str:
    """Return three digits, or a dash for a value that is not finite."""
    return f"{value:.3g}" if math.isfinite(value) else "–"


def _short(value: float) -> str:
    return f"{value:.2f}" if math.isfinite(value) else "none"
