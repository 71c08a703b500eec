"""Numbers as text for sentences and tables."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable


def number(value: float | None, digits: int = 2) -> str:
    """Format a number with a fixed number of decimals; a dash for None or nan.

    Examples
    --------
    >>> number(1.005, 2), number(None)
    ('1.00', '–')
    """
    if value is None or not math.isfinite(value):
        return "–"
    return f"{value:.{digits}f}"


def percent(value: float | None) -> str:
    """Format a fraction as per cent.

    Examples
    --------
    >>> percent(0.256)
    '26 %'
    """
    return "–" if value is None else f"{100.0 * value:.0f} %"


def count(value: int, what: str) -> str:
    """Format a count with its noun.

    Examples
    --------
    >>> count(1, "chain"), count(20000, "proposal")
    ('1 chain', '20,000 proposals')
    """
    return f"{value:,} {what}{'s' * (value != 1)}"


def span(low: float | None, high: float | None, digits: int = 2) -> str:
    """Format a range."""
    return f"{number(low, digits)} to {number(high, digits)}"


def listed(names: Iterable[str]) -> str:
    """Join names as in a sentence.

    Examples
    --------
    >>> listed(["bellcrank", "pyMOTO"]), listed(["one", "two", "three"])
    ('bellcrank and pyMOTO', 'one, two and three')
    """
    *first, last = names
    return f"{', '.join(first)} and {last}" if first else last
