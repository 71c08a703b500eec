"""Numbers as they stand on axes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.ticker import NullLocator

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MANY = 1.0e5
"""From here on numbers on an axis are written as powers of ten."""


def plain_number(value: float, _place: int = 0) -> str:
    r"""Write a number as it stands on an axis.

    Examples
    --------
    >>> plain_number(20000.0), plain_number(0.05), plain_number(1e6)
    ('20\u202f000', '0.05', '10⁶')
    """
    size = abs(value)
    if size >= MANY or 0.0 < size < 1e-3:
        power = round(float(np.log10(size)))
        return "10" + str(power).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
    return f"{value:,.0f}".replace(",", "\u202f") if size >= 1000 else f"{value:g}"


def spell_out(axes: Axes) -> None:
    """Put numbers at 1, 2 and 5 times powers of ten where an axis spans less than 1.5 decades."""
    low, high = axes.get_xlim()
    if high > 32.0 * low:
        return
    powers = np.arange(np.floor(np.log10(low)), np.ceil(np.log10(high)) + 1.0)
    places = [k * 10.0**p for p in powers for k in (1, 2, 5) if low <= k * 10.0**p <= high]
    axes.set_xticks(places, [plain_number(place) for place in places])
    axes.xaxis.set_minor_locator(NullLocator())
