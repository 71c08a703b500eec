"""Tasks and designs as text: uploads and downloads of the page."""

from __future__ import annotations

import json
import math
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from bellcrank.errors import InvalidFile, InvalidProblem
from bellcrank.model import problem_from_dict, read_design
from bellcrank.model.parsing import read_table
from bellcrank.part import PartSpec
from bellcrank.task import is_task
from bellcrank.task.outlines import read_outline
from bellcrank.web.limits import check_lattice, check_size
from bellcrank.web.task_tables import plain_table, table_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from bellcrank.model import Design, Problem

COORDINATE_DIGITS = 3
"""Digits of the corners of an outline, mm."""
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
    return problem


def read_upload(text: str, suffix: str) -> tuple[dict[str, Any] | None, Design | None]:
    """Read an uploaded file.

    Returns
    -------
    table
        Table of the task, if the file has a task or a problem.
    design
        Design, if the file has one.

    Raises
    ------
    InvalidFile, InvalidProblem
    """
    with _uploaded(text, suffix) as path:
        return _read(path)


@contextmanager
def _uploaded(text: str, suffix: str) -> Iterator[Path]:
    """Write an upload to a temporary file, which errors name `UPLOAD`."""
    with TemporaryDirectory(prefix="bellcrank-") as folder:
        path = Path(folder) / f"upload{suffix}"
        path.write_text(text, encoding="utf-8")
        try:
            yield path
        except (InvalidFile, InvalidProblem, OverflowError) as error:
            kind = InvalidProblem if isinstance(error, InvalidProblem) else InvalidFile
            raise kind(str(error).replace(str(path), UPLOAD)) from None


def _read(path: Path) -> tuple[dict[str, Any] | None, Design | None]:
    table = read_table(path)
    if str(table.get("schema", "")).startswith("bellcrank/design/"):
        inner = table.get("problem")
        check_lattice(inner.get("lattice") if isinstance(inner, dict) else None)
        design = read_design(path)
        _check(design.problem)
        return None, design
    if is_task(table):
        return plain_table(table, UPLOAD), None
    problem = problem_of(table, UPLOAD)
    _check(problem)
    return table_of(problem, PartSpec()), None


def _check(problem: Problem) -> None:
    check_size(problem.lattice.node_count, problem.lattice.beam_count)


def read_region(text: str, suffix: str) -> dict[str, Any]:
    """Return the region inside the closed curves of a DXF or SVG file, as keys of a domain.

    Its lower left corner is moved to the origin.

    Raises
    ------
    InvalidFile
        If the file has no closed curve, or several regions.
    """
    with _uploaded(text, suffix) as path:
        region = read_outline(path)
    if region.geom_type != "Polygon":
        raise InvalidFile(f"{UPLOAD}: expected one region, got {len(region.geoms)}")
    left, bottom, _, _ = region.bounds

    def corners(ring: Any) -> list[list[float]]:
        return [
            [round(x - left, COORDINATE_DIGITS), round(y - bottom, COORDINATE_DIGITS)]
            for x, y in list(ring.coords)[:-1]
        ]

    holes = [{"polygon": corners(ring)} for ring in region.interiors]
    return {"outline": corners(region.exterior), **({"holes": holes} if holes else {})}


def to_toml(data: Mapping[str, Any]) -> str:
    """Write tables as TOML, without the keys that are None; inner tables are on one line.

    Examples
    --------
    >>> data = {"name": "lift", "part": {"width": 2.0}, "cases": [{"inputs": [{"force": 0.5}]}]}
    >>> print(to_toml(data), end="")
    name = "lift"
    <BLANKLINE>
    [part]
    width = 2.0
    <BLANKLINE>
    [[cases]]
    inputs = [{ force = 0.5 }]
    """
    lines = _entries({key: value for key, value in data.items() if not _is_table(value)})
    for key, value in data.items():
        if isinstance(value, dict):
            lines += ["", f"[{key}]", *_entries(value)]
        elif _is_table(value):
            for each in value:
                lines += ["", f"[[{key}]]", *_entries(each)]
    return "\n".join(lines) + "\n"


def _is_table(value: object) -> bool:
    """Whether a value of the first level is a table, or a list of tables."""
    is_list = isinstance(value, list) and bool(value) and isinstance(value[0], dict)
    return is_list or isinstance(value, dict)


def _entries(table: Mapping[str, Any]) -> list[str]:
    return [f"{key} = {_value(value)}" for key, value in table.items() if value is not None]


def _value(value: object) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, list):
        return f"[{', '.join(map(_value, value))}]"
    if isinstance(value, dict):
        return f"{{ {', '.join(_entries(value))} }}"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)  # TOML escapes as JSON does
    if isinstance(value, float) and math.isfinite(value):
        return repr(value) if "." in repr(value) or "e" in repr(value) else f"{value!r}.0"
    if isinstance(value, int):
        return str(value)
    raise InvalidFile(f"TOML cannot hold {value!r}")
