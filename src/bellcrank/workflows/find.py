"""From what a person types to a design."""

from __future__ import annotations

import json
from pathlib import Path

from bellcrank.model import Design, find_problem, human_design, read_design


def find_design(name_or_path: str) -> Design:
    """Return a design named on the command line.

    Parameters
    ----------
    name_or_path
        A design file; a result folder with a ``design.json``; ``human:NAME`` for the
        human counterpart of a built-in problem; or a problem, built in or in a file,
        whose initial design is meant.

    Raises
    ------
    UnknownName, InvalidFile, InvalidProblem

    Examples
    --------
    >>> find_design("crane").beam_count
    352
    """
    path = Path(name_or_path)
    if path.is_dir() and (path / "design.json").exists():
        return read_design(path / "design.json")
    if path.suffix == ".json" and path.is_file() and _is_design(path):
        return read_design(path)
    kind, _, name = name_or_path.partition(":")
    if kind == "human" and name and (human := human_design(name)):
        return human
    return find_problem(name_or_path).full_design()


def _is_design(path: Path) -> bool:
    try:
        data = json.loads(path.read_bytes())
    except (OSError, ValueError):
        return False
    return isinstance(data, dict) and str(data.get("schema", "")).startswith("bellcrank/design/")
