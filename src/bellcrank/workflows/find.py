"""From what a person types to a design."""

from __future__ import annotations

import json
from pathlib import Path
from typing import cast, get_args

from bellcrank.errors import UnknownName
from bellcrank.model import Design, builtin, find_problem, gallery_design, read_design
from bellcrank.model.gallery import Kind
from bellcrank.registry import design_sources


def find_design(name_or_path: str) -> Design:
    """Return a design named on the command line.

    Parameters
    ----------
    name_or_path
        A problem, built in or in a file, whose initial design is meant; a design file; a
        result folder with a ``design.json``; or ``human:NAME`` or ``machine:NAME`` for a
        design of a built-in problem that comes with the package. The name of a built-in
        problem means the problem even where there is a folder of that name: ``crane/`` is
        the folder. What is none of these is asked of `bellcrank.registry.design_sources`: on
        the command line, the library of actuators.

    Raises
    ------
    UnknownName, InvalidFile, InvalidProblem

    Examples
    --------
    >>> find_design("crane").beam_count
    352
    """
    kind, colon, name = name_or_path.partition(":")
    if colon and kind in get_args(Kind):
        of_kind = cast("Kind", kind)
        found = gallery_design(of_kind, name)
        if found is None:
            there = ", ".join(known for known in builtin if gallery_design(of_kind, known))
            raise UnknownName(f"no {kind} design for {name!r}; there are some for: {there}")
        return found
    path = Path(name_or_path)
    if name_or_path in builtin:
        return find_problem(name_or_path).full_design()
    if path.is_dir() and (path / "design.json").exists():
        return read_design(path / "design.json")
    if path.suffix == ".json" and path.is_file() and _is_design(path):
        return read_design(path)
    if not path.exists():
        for ask in design_sources.values():
            known: Design | None = ask(name_or_path)
            if known is not None:
                return known
    return find_problem(name_or_path).full_design()


def _is_design(path: Path) -> bool:
    try:
        data = json.loads(path.read_bytes())
    except (OSError, ValueError, RecursionError):
        return False
    return isinstance(data, dict) and str(data.get("schema", "")).startswith("bellcrank/design/")
