"""Results of computations on designs, which are kept while the server runs."""

from __future__ import annotations

import asyncio
from collections import OrderedDict
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine, Hashable

MOST_RESULTS = 64
"""Number of results, up to two megabytes each."""


class Results:
    """Results by what they follow from; equal requests are computed once.

    Parameters
    ----------
    most
        Largest number of results; the one that was not used for the longest time is dropped.

    Examples
    --------
    >>> import asyncio
    >>> async def twice():
    ...     results, calls = Results(), []
    ...     async def compute():
    ...         calls.append(1)
    ...         return {"mass": 17.0}
    ...     return await results.get("crane", compute), await results.get("crane", compute), calls
    >>> asyncio.run(twice())
    ({'mass': 17.0}, {'mass': 17.0}, [1])
    """

    def __init__(self, most: int = MOST_RESULTS) -> None:
        self._most = most
        self._known: OrderedDict[Hashable, asyncio.Task[dict[str, Any]]] = OrderedDict()

    async def get(
        self, key: Hashable, compute: Callable[[], Coroutine[Any, Any, dict[str, Any]]]
    ) -> dict[str, Any]:
        """Return a result, computed if it is not known; failures are not kept."""
        task = self._known.get(key)
        if task is None:
            task = self._known[key] = asyncio.create_task(compute())
            while len(self._known) > self._most:
                self._known.popitem(last=False)
        self._known.move_to_end(key)
        try:
            # A client that leaves does not end the computation, since others may wait for it.
            return await asyncio.shield(task)
        except Exception:
            self._known.pop(key, None)
            raise
