"""Running a study, and what it leaves: a record and a picture."""

from __future__ import annotations

import json
import time
from dataclasses import asdict
from io import BytesIO
from typing import TYPE_CHECKING, Any

from bellcrank.errors import InvalidFile
from bellcrank.model.parsing import read_json
from bellcrank.model.storage import write_bytes, write_text
from bellcrank.provenance import provenance
from bellcrank.storage.files import make_folder
from reproduction.bench import Bench, silent
from reproduction.registry import studies

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    from reproduction.registry import Study

SCHEMA = "bellcrank/study/1"
LARGEST = 145_000
"""Bytes of a picture that is kept."""
SIZES = ((1.0, 160), (0.85, 160), (0.72, 160), (0.6, 160), (0.6, 64), (0.5, 64), (0.42, 64))
"""Parts of a picture's size and numbers of colours, tried in turn: 160 are enough for thin lines on
white, and take a third of the bytes."""
DIGITS = 6
"""Of the figures in a record."""


def run_study(
    name: str,
    out: Path,
    *,
    quick: bool = False,
    workers: int | None = None,
    tell: Callable[[str, int, int], None] = silent,
) -> dict[str, Any]:
    """Run a study and leave ``NAME.json`` and ``NAME.png`` in a folder.

    What the folder has of its raw records with the same settings is not computed again, so
    that a run that was killed goes on. Record and picture are replaced.

    Parameters
    ----------
    name
        Of the study.
    out
        Folder.
    quick
        Whether a look is enough.
    workers
        Pieces of work at the same time; all cores by default.
    tell
        Called with what is at hand, how many pieces of it are done, and of how many.

    Returns
    -------
    dict
        The record.

    Raises
    ------
    UnknownName
        If there is no such study.
    InvalidSettings
        If something is not installed.
    StorageError, CorruptRun
    """
    study = studies[name]
    make_folder(out)
    settings = study.quick if quick else study.full
    bench = Bench.in_folder(out, name, settings, workers, tell)
    began = time.perf_counter()
    figures = rounded(study.run(settings, bench))
    seconds = time.perf_counter() - began
    record = {
        "schema": SCHEMA,
        "study": name,
        "title": study.title,
        "after": study.after,
        "mode": "quick" if quick else "full",
        "command": command_of(study, quick=quick),
        "runs": study.runs(figures),
        "settings": asdict(settings),
        "comparison": [claim.to_dict() for claim in study.claims(figures)],
        "deviations": list(study.deviations),
        "figures": figures,
        "provenance": provenance(seconds=round(seconds, 1)),
    }
    draw_record(record, out / f"{name}.png")
    write_text(out / f"{name}.json", as_text(record), overwrite=True)
    return record


def refresh(path: Path) -> dict[str, Any]:
    """Say and draw anew what the figures of a record mean; nothing is computed.

    Returns
    -------
    dict
        The record, as it lies there then.

    Raises
    ------
    InvalidFile, StorageError
    """
    record = read_record(path)
    study = studies[str(record["study"])]
    record |= {
        "title": study.title,
        "after": study.after,
        "runs": study.runs(record["figures"]),
        "comparison": [claim.to_dict() for claim in study.claims(record["figures"])],
        "deviations": list(study.deviations),
    }
    draw_record(record, path.with_suffix(".png"))
    write_text(path, as_text(record), overwrite=True)
    return record


def command_of(study: Study, *, quick: bool) -> str:
    """Return what to type."""
    return f"bellcrank study {study.name}" + (" --quick" if quick else "")


def draw_record(record: Mapping[str, Any], path: Path) -> None:
    """Draw the picture of a record, small enough to be kept with it; replaces what is there."""
    studies[str(record["study"])].draw(record["figures"], path)
    if path.suffix == ".png":
        write_bytes(path, shrunk(path.read_bytes()), overwrite=True)


def shrunk(png: bytes) -> bytes:
    """Return a PNG picture with few colours, and smaller where that is not enough."""
    from PIL import Image

    with Image.open(BytesIO(png)) as opened:
        picture = opened.convert("RGB")
    width, height = picture.size
    found = b""
    for part, colours in SIZES:
        size = (round(part * width), round(part * height))
        scaled = picture if part == 1.0 else picture.resize(size, Image.Resampling.LANCZOS)
        few = scaled.quantize(colours, kmeans=1, dither=Image.Dither.NONE)
        content = BytesIO()
        few.save(content, format="PNG", optimize=True, dpi=(200 * part, 200 * part))
        found = content.getvalue()
        if len(found) <= LARGEST:
            break
    return found


def read_record(path: Path) -> dict[str, Any]:
    """Read the record of a study.

    Raises
    ------
    InvalidFile
        If it is none, or of a study that is not known.
    """
    record = read_json(path)
    if not isinstance(record, dict) or record.get("schema") != SCHEMA:
        raise InvalidFile(f"{path}: expected a record with schema {SCHEMA!r}")
    if record.get("study") not in studies:
        raise InvalidFile(f"{path}: study: unknown study {record.get('study')!r}")
    return record


def read_records(folder: Path) -> dict[str, dict[str, Any]]:
    """Read the records that a folder has, in the order of the studies."""
    found = {name: folder / f"{name}.json" for name in studies}
    return {name: read_record(path) for name, path in found.items() if path.is_file()}


def rounded(value: Any) -> Any:
    """Return plain data with numbers of few digits; what is not a number is None.

    Examples
    --------
    >>> rounded({"a": [1.23456789, float("nan")], "b": 3})
    {'a': [1.23457, None], 'b': 3}
    """
    if isinstance(value, dict):
        return {str(key): rounded(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [rounded(each) for each in value]
    if isinstance(value, float):
        finite = value == value and abs(value) != float("inf")  # noqa: PLR0124
        return float(f"{value:.{DIGITS}g}") if finite else None
    return value


def as_text(record: Mapping[str, Any]) -> str:
    """Return a record as JSON that can be read: a line for each list of numbers."""
    import re

    text = json.dumps(record, indent=1, ensure_ascii=False)
    flat = re.compile(r"\[\s*((?:-?[\d.e+-]+|null|true|false)(?:,\s+(?:-?[\d.e+-]+|null))*)\s*\]")
    return flat.sub(lambda hit: "[" + re.sub(r"\s+", " ", hit[1]) + "]", text) + "\n"
