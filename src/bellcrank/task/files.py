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
