"""Call a registered function with the keys of a table in a file."""

from __future__ import annotations

import inspect
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import ConfigDict, TypeAdapter, ValidationError

from bellcrank.errors import InvalidFile
from bellcrank.model.parsing import explain_value

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

# Types of parameters that can be set from a file, by the text of their annotation: the signature
# of a generator is its only description.
_STRICT = ConfigDict(strict=True, allow_inf_nan=False)
_KINDS: dict[str, TypeAdapter[Any]] = {
    "int": TypeAdapter(int, config=_STRICT),
    "int | None": TypeAdapter(int, config=_STRICT),
    "float": TypeAdapter(float, config=_STRICT),
    "str": TypeAdapter(str, config=_STRICT),
    "Sequence[int]": TypeAdapter(list[int], config=_STRICT),
    "Sequence[float]": TypeAdapter(list[float], config=_STRICT),
    "Sequence[Sequence[int]]": TypeAdapter(list[list[int]], config=_STRICT),
    "Sequence[Sequence[float]]": TypeAdapter(list[list[float]], config=_STRICT),
}


def call_with_keys(
    function: Callable[..., Any],
    table: Mapping[str, Any],
    key: str,
    *leading: Any,
) -> Any:
    """Call `function` with the entries of `table` as its parameters.

    Parameters
    ----------
    function
        A registered function. A parameter ``rng`` is set from the key ``seed``.
    table
        Keys and values of the file.
    key
        Key of the table in the file, for errors.
    leading
        Positional arguments that are not read from the file.

    Raises
    ------
    InvalidFile
        If a key is unknown or missing, or a value has the wrong type.

    Examples
    --------
    >>> def repeat(word: str, times: int = 2) -> str:
    ...     return word * times
    >>> call_with_keys(repeat, {"word": "ab"}, "here")
    'abab'
    >>> call_with_keys(repeat, {"word": "ab", "time": 3}, "here")
    Traceback (most recent call last):
        ...
    bellcrank.errors.InvalidFile: unknown key 'here.time'; known here: word, times
    """
    parameters = dict(list(inspect.signature(function).parameters.items())[len(leading) :])
    takes_rng = parameters.pop("rng", None) is not None
    known = [*parameters, *(["seed"] if takes_rng else [])]
    for name in table:
        if name not in known:
            raise InvalidFile(f"unknown key '{key}.{name}'; known here: {', '.join(known)}")
    arguments = {}
    for name, parameter in parameters.items():
        if name in table:
            arguments[name] = _value(table[name], str(parameter.annotation), f"{key}.{name}")
        elif parameter.default is parameter.empty:
            raise InvalidFile(f"key '{key}.{name}' is missing")
    if takes_rng:
        seed = _value(table.get("seed", 0), "int", f"{key}.seed")
        if seed < 0:
            raise InvalidFile(f"{key}.seed: expected 0 or more, got {seed}")
        arguments["rng"] = np.random.default_rng(seed)
    return function(*leading, **arguments)


def _value(value: Any, kind: str, key: str) -> Any:
    try:
        return _KINDS[kind].validate_python(value)
    except ValidationError as error:
        raise InvalidFile(explain_value(error, key)) from None
