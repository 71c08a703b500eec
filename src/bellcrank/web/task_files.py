"""Tasks as text: uploads and downloads of the page."""

from __future__ import annotations

import json
import math
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from bellcrank.errors import InvalidFile
from bellcrank.model import (
    Design,
    Problem,
    problem_from_dict,
    problem_to_dict,
    read_design,
    require_plane,
)
from bellcrank.model.parsing import read_table
from bellcrank.web.limits import check_lattice, check_size

if TYPE_CHECKING:
    from collections.abc import Mapping

UPLOAD = "the file"
"""Name of an upload in error messages, instead of its temporary path."""


def problem_of(data: Mapping[str, Any], source: str = "task") -> Problem:
    """Return the problem of a request.

    Raises
    ------
    InvalidFile, InvalidProblem
    """
    check_lattice(data.get("lattice"))
    positions, beams = data.get("positions"), data.get("beams")
    check_size(*(len(each) if isinstance(each, list) else 0 for each in (positions, beams)))
    try:
        problem = problem_from_dict(data, source)
    except (OverflowError, RecursionError) as error:
        raise InvalidFile(f"{source}: a number is too large ({error})") from None
    require_plane(problem, source)
    return problem


def read_task(text: str, suffix: str) -> tuple[Problem, dict[str, Any] | None, Design | None]:
    """Read an uploaded task or design.

    Returns
    -------
    problem
    lattice
        Table that describes the lattice, if the file has one.
    design
        Design, if the file holds one.

    Raises
    ------
    InvalidFile, InvalidProblem
    """
    with TemporaryDirectory(prefix="bellcrank-") as folder:
        path = Path(folder) / f"upload{suffix}"
        path.write_text(text, encoding="utf-8")
        try:
            return _read(path)
        except (InvalidFile, OverflowError) as error:
            raise InvalidFile(str(error).replace(str(path), UPLOAD)) from None


def _read(path: Path) -> tuple[Problem, dict[str, Any] | None, Design | None]:
    table = read_table(path)
    if str(table.get("schema", "")).startswith("bellcrank/design/"):
        inner = table.get("problem")
        check_lattice(inner.get("lattice") if isinstance(inner, dict) else None)
        design = read_design(path)
        _check(design.problem)
        return design.problem, None, design
    problem = problem_of(table, UPLOAD)
    _check(problem)
    return problem, table.get("lattice"), None


def _check(problem: Problem) -> None:
    check_size(problem.lattice.node_count, problem.lattice.beam_count)
    require_plane(problem, UPLOAD)


def write_task(problem: Problem, lattice: Mapping[str, Any] | None, suffix: str) -> str:
    """Write a task as JSON or TOML.

    Parameters
    ----------
    lattice
        Table that generates the lattice; written instead of nodes and beams if given.
    suffix
        ``.json`` or ``.toml``.

    Examples
    --------
    >>> from bellcrank.model import find_problem
    >>> text = write_task(find_problem("crane"), None, ".toml")
    >>> text.splitlines()[1], read_task(text, ".toml")[0].hash == find_problem("crane").hash
    ('name = "crane"', True)
    """
    data = problem_to_dict(problem)
    if suffix == ".json":
        return json.dumps(data, allow_nan=False) + "\n"
    if lattice is not None:
        made = problem_of({**_without_lattice(data), "lattice": dict(lattice)})
        if made.hash == problem.hash:
            data = {**_without_lattice(data), "lattice": dict(lattice)}
    return to_toml(data)


def _without_lattice(data: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in data.items() if key not in {"positions", "beams"}}


def to_toml(data: Mapping[str, Any]) -> str:
    """Write tables of numbers, strings and lists as TOML, without the keys that are None.

    Examples
    --------
    >>> print(to_toml({"name": "lift", "input": {"nodes": [1, 2], "amount": 0.5}}), end="")
    name = "lift"
    <BLANKLINE>
    [input]
    nodes = [1, 2]
    amount = 0.5
    """
    plain = {key: value for key, value in data.items() if not isinstance(value, dict)}
    lines = [f"{key} = {_value(value)}" for key, value in plain.items() if value is not None]
    for key, table in data.items():
        if isinstance(table, dict):
            entries = [
                f"{name} = {_value(value)}" for name, value in table.items() if value is not None
            ]
            lines += ["", f"[{key}]", *entries]
    return "\n".join(lines) + "\n"


def _value(value: object) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, list):
        return f"[{', '.join(map(_value, value))}]"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)  # TOML escapes as JSON does
    if isinstance(value, float) and math.isfinite(value):
        return repr(value) if "." in repr(value) or "e" in repr(value) else f"{value!r}.0"
    if isinstance(value, int):
        return str(value)
    raise InvalidFile(f"TOML cannot hold {value!r}")
