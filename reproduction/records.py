"""Running of studies, their records and pictures."""

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
from reproduction.registry import studies
from reproduction.result_store import ResultStore, no_progress

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from reproduction.registry import Study
    from reproduction.result_store import Progress

SCHEMA = "bellcrank/study/1"
MAX_BYTES = 145_000
"""Largest size of a stored picture."""
SIZES = ((1.0, 160), (0.85, 160), (0.72, 160), (0.6, 160), (0.6, 64), (0.5, 64), (0.42, 64))
"""Scales and numbers of colours, tried in order: 160 colours suffice for thin lines on white and
need a third of the bytes."""
DIGITS = 6
"""Significant digits of the figures in a record."""


def run_study(
    name: str,
    out: Path,
    *,
    quick: bool = False,
    workers: int | None = None,
    progress: Progress = no_progress,
) -> dict[str, Any]:
    """Run a study and write ``NAME.json`` and ``NAME.png`` to a folder.

    Raw results that the folder already has for the same settings are not computed again, so that
    an interrupted run resumes. Record and picture are replaced.

    Parameters
    ----------
    name
        Name of the study.
    out
        Folder.
    quick
        Whether the quick settings are used.
    workers
        Number of threads; all cores by default.
    progress
        Called with the current activity, the number of finished computations, and their total.

    Returns
    -------
    dict
        The record.

    Raises
    ------
    UnknownName
        If the study is unknown.
    InvalidSettings
        If a package is not installed.
    StorageError, CorruptRun
    """
    study = studies[name]
    make_folder(out)
    settings = study.quick if quick else study.full
    store = ResultStore.for_study(out, name, settings, workers, progress)
    began = time.perf_counter()
    figures = rounded(study.run(settings, store))
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
    """Update the texts and the picture of a record from its figures; nothing is computed.

    Returns
    -------
    dict
        The updated record.

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
    """Return the command that runs a study."""
    return f"bellcrank study {study.name}" + (" --quick" if quick else "")


def draw_record(record: Mapping[str, Any], path: Path) -> None:
    """Draw the picture of a record, small enough for the repository; replaces an existing file."""
    studies[str(record["study"])].draw(record["figures"], path)
    if path.suffix == ".png":
        write_bytes(path, shrunk(path.read_bytes()), overwrite=True)


def shrunk(png: bytes) -> bytes:
    """Return a PNG picture with fewer colours and, if necessary, fewer pixels."""
    from PIL import Image

    with Image.open(BytesIO(png)) as opened:
        picture = opened.convert("RGB")
    width, height = picture.size
    found = b""
    for scale, colours in SIZES:
        size = (round(scale * width), round(scale * height))
        scaled = picture if scale == 1.0 else picture.resize(size, Image.Resampling.LANCZOS)
        few = scaled.quantize(colours, kmeans=1, dither=Image.Dither.NONE)
        content = BytesIO()
        few.save(content, format="PNG", optimize=True, dpi=(200 * scale, 200 * scale))
        found = content.getvalue()
        if len(found) <= MAX_BYTES:
            break
    return found


def read_record(path: Path) -> dict[str, Any]:
    """Read the record of a study.

    Raises
    ------
    InvalidFile
        If the file is no record, or its study is unknown.
    """
    record = read_json(path)
    if not isinstance(record, dict) or record.get("schema") != SCHEMA:
        raise InvalidFile(f"{path}: expected a record with schema {SCHEMA!r}")
    if record.get("study") not in studies:
        raise InvalidFile(f"{path}: study: unknown study {record.get('study')!r}")
    return record


def read_records(folder: Path) -> dict[str, dict[str, Any]]:
    """Read the records in a folder, in the order of the studies."""
    found = {name: folder / f"{name}.json" for name in studies}
    return {name: read_record(path) for name, path in found.items() if path.is_file()}


def rounded(value: Any) -> Any:
    """Return plain data with rounded numbers; values that are not finite become None.

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
    """Return a record as indented JSON with each list of numbers on one line."""
    import re

    text = json.dumps(record, indent=1, ensure_ascii=False)
    flat = re.compile(r"\[\s*((?:-?[\d.e+-]+|null|true|false)(?:,\s+(?:-?[\d.e+-]+|null))*)\s*\]")
    return flat.sub(lambda hit: "[" + re.sub(r"\s+", " ", hit[1]) + "]", text) + "\n"
