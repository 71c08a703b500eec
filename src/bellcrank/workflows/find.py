"""Find a design by the name that a user gives it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import cast, get_args

from bellcrank.errors import InvalidSettings, UnknownName
from bellcrank.model import Design, builtin, find_problem, gallery_design, read_design
from bellcrank.model.gallery import Kind
from bellcrank.storage import is_unfinished_run
from bellcrank.task import find_task

DESIGN_FILE = "design.json"
"""Name of the design in a result folder."""


def find_design(name_or_path: str) -> Design:
    """Return the design of a given name.

    Names are tried in this order:

    1. ``human:NAME`` and ``machine:NAME``, the bundled designs of a bundled problem; or
       ``machine:NAME``, a bundled machine,
    2. a result folder, which holds a ``design.json``; the folder of an unfinished run is an error,
    3. a bundled problem: its initial design,
    4. a design file,
    5. a bundled task or a task file: its initial design,
    6. an entry of the library, a bundled machine or a strut (``strut-6``), unless a file of that
       name exists,
    7. a problem file: its initial design.

    Parameters
    ----------
    name_or_path
        Name or path, as above. A result folder takes precedence over a bundled problem of the
        same name (`hides_problem` distinguishes the two cases).

    Raises
    ------
    UnknownName
        If there is no such design, file or problem; says if there is a task file of that name.
    InvalidSettings
        If the folder is that of an unfinished run.
    InvalidFile, InvalidProblem
        If the file does not describe a valid design or problem.

    Examples
    --------
    >>> find_design("crane").beam_count
    352
    >>> find_design("strut-6").problem.name
    'strut-6'
    """
    kind, colon, name = name_or_path.partition(":")
    if colon and kind in get_args(Kind):
        return _bundled_design(cast("Kind", kind), name)
    path = Path(name_or_path)
    if (path / DESIGN_FILE).exists():
        return read_design(path / DESIGN_FILE)
    if is_unfinished_run(path):
        raise InvalidSettings(
            f"{path}: this run is not finished and has no {DESIGN_FILE} yet; finish it with "
            f"bellcrank design --resume {path}"
        )
    if name_or_path in builtin:
        return find_problem(name_or_path).full_design()
    if path.suffix == ".json" and path.is_file() and _is_design(path):
        return read_design(path)
    task = find_task(name_or_path)
    found = None if task is None else task.initial_design()
    if found is None and not path.exists():
        found = _design_of_machines(name_or_path)
    task_file = Path(f"{name_or_path}.toml")
    if found is None and not path.exists() and task_file.is_file():
        raise UnknownName(f"no design {name_or_path!r}; bellcrank design {task_file} makes it")
    return find_problem(name_or_path).full_design() if found is None else found


def hides_problem(name: str) -> bool:
    """Return whether a result folder takes precedence over the bundled problem of that name."""
    return name in builtin and (Path(name) / DESIGN_FILE).exists()


def _bundled_design(kind: Kind, name: str) -> Design:
    design = gallery_design(kind, name)
    if design is None and kind == "machine":
        design = _design_of_machines(f"{kind}:{name}")
    if design is None:
        known = ", ".join(problem for problem in builtin if gallery_design(kind, problem))
        raise UnknownName(f"no {kind} design for {name!r}; known: {known}")
    return design


def _design_of_machines(name: str) -> Design | None:
    """Return the strut, library entry or bundled machine of that name, or None."""
    from bellcrank.machines.names import design_from_name

    return design_from_name(name)


def _is_design(path: Path) -> bool:
    try:
        data = json.loads(path.read_bytes())
    except (OSError, ValueError, RecursionError):
        return False
    return isinstance(data, dict) and str(data.get("schema", "")).startswith("bellcrank/design/")
