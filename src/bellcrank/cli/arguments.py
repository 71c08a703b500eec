"""What several commands read from their words in the same way."""

from __future__ import annotations

import json
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from bellcrank.errors import InvalidSettings

if TYPE_CHECKING:
    from collections.abc import Iterable


def settings_of(option: str, texts: Iterable[str] | None) -> dict[str, Any]:
    """Read each ``KEY=VALUE`` that an option was given; values as JSON, or else as text.

    Raises
    ------
    InvalidSettings
        If one is not of that form.

    Examples
    --------
    >>> settings_of("--set", ["depth=12", "moves=[1]", "schedule=linear"])
    {'depth': 12, 'moves': [1], 'schedule': 'linear'}
    """
    found: dict[str, Any] = {}
    for text in texts or ():
        key, equals, value = text.partition("=")
        if not (key and equals):
            raise InvalidSettings(f"{option} {text}: expected KEY=VALUE")
        found[key] = value
        with suppress(ValueError):
            found[key] = json.loads(value)
    return found
