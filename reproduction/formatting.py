"""Numbers as they stand in sentences and tables."""

from __future__ import annotations

import math


def number(value: float | None, digits: int = 2) -> str:
    """Write a number with so many decimals; a dash where there is none.

    Examples
    --------
    >>> number(1.005, 2), number(None)
    ('1.00', '–')
    """
    if value is None or not math.isfinite(value):
        return "–"
    return f"{value:.{digits}f}"


def share(value: float | None) -> str:
    """Write a part as per cent.

    Examples
    --------
    >>> share(0.256)
    '26 %'
    """
    return "–" if value is None else f"{100.0 * value:.0f} %"


def count(value: int, what: str) -> str:
    """Write how many there are.

    Examples
    --------
    >>> count(1, "chain"), count(20000, "proposal")
    ('1 chain', '20,000 proposals')
    """
    return f"{value:,} {what}{'s' * (value != 1)}"


def span(low: float | None, high: float | None, digits: int = 2) -> str:
    """Write a range."""
    return f"{number(low, digits)} to {number(high, digits)}"
