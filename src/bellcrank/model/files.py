"""Read and write problems, designs and masks."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from pydantic import Field

from bellcrank.errors import InvalidFile, InvalidProblem, InvalidSettings, UnknownName
from bellcrank.model.builtin import builtin
from bellcrank.model.masks import unpack_mask
from bellcrank.model.parsing import Table, parse, read_json, read_table
from bellcrank.model.problem import Design, Problem, problem_to_dict
from bellcrank.model.schema import problem_from_dict
from bellcrank.model.storage import write_text

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np
    from numpy.typing import NDArray

DESIGN_SCHEMA = "bellcrank/design/1"


class DesignTable(Table):
    """A design file."""

    schema_: Literal["bellcrank/design/1"] = Field(alias="schema")
    problem: dict[str, Any]
    mask: str
    efficiency: float | None = None
    provenance: dict[str, Any] = Field(default_factory=dict)


def find_problem(name_or_path: str | os.PathLike[str]) -> Problem:
    """Return the bundled problem of a name, otherwise the problem of a file.

    Raises
    ------
    UnknownName
        If there is neither; lists the bundled names.
    InvalidFile, InvalidProblem
        If the file does not describe a valid problem.

    Examples
    --------
    >>> find_problem("crane").name
    'crane'
    >>> find_problem("crain")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    bellcrank.errors.UnknownName: unknown problem 'crain'; known: crane, ...
    """
    name = os.fspath(name_or_path)
    if name in builtin:
        return builtin[name]()
    if Path(name).is_file():
        return read_problem(name)
    raise UnknownName(
        f"unknown problem {name!r}; known: {', '.join(builtin)}; and there is no such file"
    )


def read_problem(path: str | os.PathLike[str]) -> Problem:
    """Read a problem file, TOML or JSON (see `bellcrank.model.schema`).

    Raises
    ------
    InvalidFile
        If the file cannot be read or does not follow the schema.
    InvalidProblem
        If the problem is not valid.
    """
    return problem_from_dict(read_table(path), source=str(path))


def write_problem(
    problem: Problem, path: str | os.PathLike[str], *, overwrite: bool = False
) -> None:
    """Write a problem in full as JSON.

    Raises
    ------
    OutputExists
        If the file exists and `overwrite` is not set.
    StorageError
        If it cannot be written.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> problem = find_problem("scaling-8")
    >>> with TemporaryDirectory() as folder:
    ...     write_problem(problem, f"{folder}/problem.json")
    ...     read_problem(f"{folder}/problem.json").hash == problem.hash
    True
    """
    _write_json(problem_to_dict(problem), path, overwrite=overwrite)


def read_design(path: str | os.PathLike[str]) -> Design:
    """Read a design file (JSON, schema ``bellcrank/design/1``).

    Raises
    ------
    InvalidFile
        If the file cannot be read or does not follow the schema.
    InvalidProblem
        If its problem is not valid.
    """
    return design_from_dict(read_json(path), str(path))


def design_from_dict(data: Mapping[str, Any], source: str = "design") -> Design:
    """Return the design that plain data describes.

    Parameters
    ----------
    data
        Data as returned by `design_to_dict`.
    source
        Name of the data in errors, usually the file.

    Raises
    ------
    InvalidFile, InvalidProblem
        As for `read_design`.
    """
    table = parse(DesignTable, data, source)
    problem = problem_from_dict(table.problem, source=f"{source}: problem")
    return Design(
        problem=problem,
        mask=_mask(table.mask, problem, f"{source}: mask"),
        efficiency=table.efficiency,
        provenance=table.provenance,
    )


def design_to_dict(design: Design) -> dict[str, Any]:
    """Return a design with its problem as plain data.

    Examples
    --------
    >>> design = find_problem("scaling-8").full_design()
    >>> design_from_dict(design_to_dict(design)).mask_hex == design.mask_hex
    True
    """
    return {
        "schema": DESIGN_SCHEMA,
        "problem": problem_to_dict(design.problem),
        "mask": design.mask_hex,
        "efficiency": design.efficiency,
        "provenance": dict(design.provenance),
    }


def write_design(design: Design, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Write a design with its problem as JSON.

    Raises
    ------
    OutputExists
        If the file exists and `overwrite` is not set.
    InvalidProblem
        If its provenance cannot be written as JSON.
    StorageError
        If it cannot be written.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> design = find_problem("scaling-8").full_design()
    >>> with TemporaryDirectory() as folder:
    ...     write_design(design, f"{folder}/design.json")
    ...     read_design(f"{folder}/design.json").mask_hex == design.mask_hex
    True
    """
    _write_json(design_to_dict(design), path, overwrite=overwrite)


MASK_FILE_KEYS = ("masks", "results", "schema", "problem", "measures", "note", "provenance")
"""Keys of a file with masks."""


def read_masks(path: str | os.PathLike[str], problem: Problem) -> list[NDArray[np.bool_]]:
    """Read the masks of a JSON file: its list ``masks``, or ``results[].mask``.

    Further keys of an entry of ``results`` are ignored; unknown keys of the file are refused.

    Returns
    -------
    list of (M,) bool
        In the order of the file.

    Raises
    ------
    InvalidFile
        If there is neither or both, a mask does not fit the problem, or a key is not one of
        `MASK_FILE_KEYS`.
    """
    data = read_json(path)
    for key in data:
        if key not in MASK_FILE_KEYS:
            raise InvalidFile(
                f"{path}: unknown key {key!r}; known here: {', '.join(MASK_FILE_KEYS)}"
            )
    if "masks" in data and "results" in data:
        raise InvalidFile(f"{path}: expected 'masks' or 'results', got both")
    if isinstance(data.get("masks"), list):
        found = [(f"masks[{k}]", mask) for k, mask in enumerate(data["masks"])]
    elif isinstance(data.get("results"), list):
        found = [
            (f"results[{k}].mask", result.get("mask") if isinstance(result, dict) else None)
            for k, result in enumerate(data["results"])
        ]
    else:
        raise InvalidFile(f"{path}: expected a list 'masks', or 'results' with a 'mask' in each")
    return [_mask(mask, problem, f"{path}: {key}") for key, mask in found]


def _mask(text: object, problem: Problem, where: str) -> NDArray[np.bool_]:
    if not isinstance(text, str):
        raise InvalidFile(f"{where}: expected hexadecimal text, got {text!r}")
    try:
        return unpack_mask(text, problem.lattice.beam_count)
    except InvalidFile as error:
        raise InvalidFile(f"{where}: {str(error).removeprefix('mask: ')}") from None


def _write_json(data: dict[str, Any], path: str | os.PathLike[str], *, overwrite: bool) -> None:
    if Path(path).suffix.lower() != ".json":
        raise InvalidSettings(f"{path}: expected a name ending in .json")
    try:
        text = json.dumps(data, allow_nan=False)
    except (TypeError, ValueError) as error:
        raise InvalidProblem(f"provenance: expected data for JSON ({error})") from None
    write_text(path, text + "\n", overwrite=overwrite)
