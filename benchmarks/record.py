"""Records of runs: a JSON file to which each run is added as soon as it is done."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from bellcrank.provenance import provenance

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    Rows = dict[str, dict[str, Any]]


def add_runs(path: Path, jobs: Mapping[str, Callable[[], dict[str, Any]]], only: str) -> Rows:
    """Make the runs that are not in a record, and return the whole record.

    Parameters
    ----------
    path
        File of the record.
    jobs
        Functions that make the runs, by name.
    only
        First words of the names of the runs that are made, separated by commas; empty for all.
    """
    rows: Rows = {}
    if path.exists():
        rows = json.loads(path.read_text(encoding="utf-8"))["runs"]
    chosen = tuple(f"{each} " for each in only.split(",")) if only else ("",)
    for name, job in jobs.items():
        if name in rows or not f"{name} ".startswith(chosen):
            continue
        rows[name] = job()
        path.parent.mkdir(exist_ok=True)
        data = {"provenance": provenance(), "runs": dict(sorted(rows.items()))}
        path.write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")
        figures = {key: value for key, value in rows[name].items() if _is_short(value)}
        print(name, figures, flush=True)
    return rows


def _is_short(value: object) -> bool:
    """Whether a value is printed: positions, masks and items are not."""
    return len(str(value)) < 80
