"""States along the stroke at which searches evaluate designs."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bellcrank.model import Item

SEARCH_STATES = 4
"""Number of states along the stroke in a search, the full stroke included."""
PATH_STATES = 8
"""The same for cases with a wanted path, or with a wanted motion or force along the stroke."""
VERIFIED_STATES = 16
"""The same for designs that are verified."""


def fractions_of(
    items: Sequence[Item], kinks: Sequence[float] = (), *, verified: bool
) -> NDArray[np.float64]:
    """Return the fractions of the stroke at which items are evaluated.

    Those at which an input starts or stops, the kinks, are among them.

    Examples
    --------
    >>> from bellcrank.model import Item
    >>> fractions_of([Item(quantity="travel", at_most=0.1, start=0.0, stop=0.6)], verified=False)
    array([0.125, 0.25 , 0.375, 0.5  , 0.6  , 0.625, 0.75 , 0.875, 1.   ])
    """
    states = SEARCH_STATES
    if any(item.quantity == "path_error" or _varies(item) for item in items):
        states = PATH_STATES
    if verified:
        states = VERIFIED_STATES
    ends = [end for item in items for end in (item.start, item.stop) if end > 0.0]
    return np.unique(np.concatenate([np.arange(1, states + 1) / states, ends, kinks]))


def _varies(item: Item) -> bool:
    """Whether an item describes how a motion or a force develops along the stroke."""
    return item.quantity in {"gain", "travel", "input_force"} and item.start < 1.0
