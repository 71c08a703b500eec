"""Read TOML and JSON files and validate their content.

An error is one sentence that names the file, the key, the expected and the given value.
"""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, get_args

from pydantic import BaseModel, ConfigDict, ValidationError

from bellcrank.errors import InvalidFile
from bellcrank.model.storage import read_text

if TYPE_CHECKING:
    import os
    from collections.abc import Mapping

    from pydantic_core import ErrorDetails


class Table(BaseModel):
    """A table of a file, without unknown keys, implicit conversions and NaN."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False, frozen=True)


AnyTable = TypeVar("AnyTable", bound=Table)


def read_json(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Read a JSON file that contains one object.

    Raises
    ------
    InvalidFile
        If it cannot be read, is not valid JSON, or repeats a key.
    """
    try:
        data = json.loads(read_text(path), object_pairs_hook=_unique_keys)
    except json.JSONDecodeError as error:
        raise InvalidFile(
            f"{path}: not valid JSON: {error.msg} (line {error.lineno}, column {error.colno})"
        ) from None
    except (_RepeatedKey, RecursionError) as error:
        raise InvalidFile(f"{path}: not valid JSON: {error}") from None
    if not isinstance(data, dict):
        raise InvalidFile(f"{path}: expected a JSON object, got {_kind(data)}")
    return data


def read_toml(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Read a TOML file.

    Raises
    ------
    InvalidFile
        If it cannot be read or is not valid TOML.
    """
    try:
        return tomllib.loads(read_text(path))
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise InvalidFile(f"{path}: not valid TOML: {error}") from None


def read_table(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Read a TOML or JSON file, selected by its suffix.

    Raises
    ------
    InvalidFile
        If the suffix is another, or the file cannot be read.
    """
    readers = {".toml": read_toml, ".json": read_json}
    suffix = Path(path).suffix.lower()
    if suffix not in readers:
        raise InvalidFile(
            f"{path}: expected a file ending in {' or '.join(readers)}, got {suffix or 'no suffix'}"
        )
    return readers[suffix](path)


def parse(model: type[AnyTable], data: Mapping[str, Any], source: str) -> AnyTable:
    """Validate `data` against the model of a table.

    Parameters
    ----------
    model
        The expected table.
    data
        Content of the file.
    source
        Name of the data in errors, usually the file.

    Raises
    ------
    InvalidFile
        With one sentence about the first error.
    """
    try:
        return model.model_validate(data)
    except ValidationError as error:
        raise InvalidFile(f"{source}: {explain(error, model)}") from None


def explain(error: ValidationError, model: type[BaseModel]) -> str:
    """Return the first error in one sentence: key, expected and given value.

    Examples
    --------
    >>> class Push(Table):
    ...     amount: float
    >>> try:
    ...     Push.model_validate({"amount": "much"})
    ... except ValidationError as error:
    ...     print(explain(error, Push))
    amount: expected a valid number, got 'much'
    """
    problem = _first_error(error)
    loc = problem["loc"]
    key = _key(loc)
    if problem["type"] == "missing":
        return f"key {key!r} is missing"
    if problem["type"] == "extra_forbidden":
        return f"unknown key {key!r}; known here: {', '.join(_known_keys(model, loc))}"
    return _sentence(key, problem)


def explain_value(error: ValidationError, key: str) -> str:
    """Return the error of the single value at `key` in one sentence."""
    problem = error.errors()[0]
    return _sentence(key + _key(problem["loc"]) if problem["loc"] else key, problem)


def _sentence(key: str, problem: ErrorDetails) -> str:
    expected = problem["msg"].removeprefix("Input should be ")
    if problem["type"] == "model_type":  # its message names Python classes
        expected = "a table"
    return f"{key}: expected {expected}, got {_short(problem['input'])}"


def _first_error(error: ValidationError) -> ErrorDetails:
    """Return the first unknown key (often a misspelt one), otherwise the first error."""
    errors = error.errors()
    unknown = [e for e in errors if e["type"] == "extra_forbidden"]
    return (unknown or errors)[0]


class _RepeatedKey(Exception):
    pass


def _unique_keys(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    table: dict[str, Any] = {}
    for key, value in pairs:
        if key in table:
            raise _RepeatedKey(f"key {key!r} is given twice")
        table[key] = value
    return table


def _key(loc: tuple[int | str, ...]) -> str:
    text = ""
    for part in loc:
        text += f"[{part}]" if isinstance(part, int) else f".{part}"
    return text.removeprefix(".") or "the file"


def _known_keys(model: type[BaseModel], loc: tuple[int | str, ...]) -> list[str]:
    for part in loc[:-1]:
        field = model.model_fields.get(str(part))
        annotation = field.annotation if field else None
        # An optional table is a union with None.
        inner = [
            each
            for each in (annotation, *get_args(annotation))
            if isinstance(each, type) and issubclass(each, BaseModel)
        ]
        if not inner:
            break
        model = inner[0]
    return [field.alias or name for name, field in model.model_fields.items()]


def _kind(value: Any) -> str:
    return {list: "a list", str: "text", type(None): "null"}.get(type(value), repr(value))


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
