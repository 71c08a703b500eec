"""Task files."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bellcrank.errors import InvalidFile, InvalidProblem
from bellcrank.model.parsing import parse, read_table
from bellcrank.task.build import Task, build_task
from bellcrank.task.schema import SCHEMA, TaskTable

if TYPE_CHECKING:
    from collections.abc import Mapping


FOLDERS = (
    Path(__file__).parent / "bundled",
    Path(__file__).parents[3] / "examples" / "tasks",
)
"""Folders of the bundled tasks: in an installed package, and in its source."""


def bundled_tasks() -> dict[str, Path]:
    """Return the files of the bundled tasks by name.

    Examples
    --------
    >>> "slider" in bundled_tasks()
    True
    """
    folder = next((each for each in FOLDERS if each.is_dir()), None)
    return {} if folder is None else {path.stem: path for path in sorted(folder.glob("*.toml"))}


def find_task(name_or_path: str | os.PathLike[str]) -> Task | None:
    """Return the bundled task of a name, or that of a task file; None if there is neither.

    Raises
    ------
    InvalidFile, InvalidProblem
        If the file is a task but not a valid one.

    Examples
    --------
    >>> find_task("slider").problem.name
    'slider'
    """
    name = os.fspath(name_or_path)
    if name in (known := bundled_tasks()):
        return read_task(known[name])
    path = Path(name)
    if path.suffix.lower() not in {".toml", ".json"} or not path.is_file():
        return None
    data = read_table(path)
    if not is_task(data):
        return None
    return task_from_dict(data, source=name, folder=path.parent)


def read_task(path: str | os.PathLike[str]) -> Task:
    """Read a task file, TOML or JSON.

    Raises
    ------
    InvalidFile, InvalidProblem
        With the file and the key of the first error.
    """
    return task_from_dict(read_table(path), source=os.fspath(path), folder=Path(path).parent)


def task_from_dict(
    data: Mapping[str, Any], source: str = "task", folder: Path | None = None
) -> Task:
    """Return the task that plain data describes.

    Parameters
    ----------
    data
        Content of a task file (`bellcrank.task.schema`).
    source
        Name of the data in errors, usually the file.
    folder
        Folder in which outlines are looked up.

    Raises
    ------
    InvalidFile, InvalidProblem
        With the key of the first error.

    Examples
    --------
    >>> task = task_from_dict({
    ...     "name": "slider",
    ...     "domain": {"size": ["62mm", "54mm"]},
    ...     "supports": [{"at": {"edge": "bottom"}}],
    ...     "cases": [{
    ...         "inputs": [
    ...             {"at": {"point": [51, 53], "count": 2}, "direction": "down",
    ...              "displacement": "3mm"},
    ...         ],
    ...         "outputs": [
    ...             {"at": {"point": [11, 53], "count": 2}, "direction": "left",
    ...              "gain": "maximise", "off_axis": "10%"},
    ...         ],
    ...     }],
    ... })
    >>> [item.name for item in task.problem.specification.items]
    ['case.output.off_axis', 'case.strain', 'case.clearance']
    """
    table = parse(TaskTable, data, source)
    try:
        return build_task(table, folder)
    except (InvalidFile, InvalidProblem) as error:
        raise type(error)(f"{source}: {error}") from None


def is_task(data: Mapping[str, Any]) -> bool:
    """Whether plain data say that they are a task."""
    return data.get("schema") == SCHEMA
