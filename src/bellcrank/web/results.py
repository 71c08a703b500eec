"""Results of computations on designs, kept while the server runs; slow ones also in files."""

from __future__ import annotations

import asyncio
import contextlib
import hashlib
import json
from collections import OrderedDict
from typing import TYPE_CHECKING, Any

from bellcrank.errors import BellcrankError
from bellcrank.model.storage import read_text, write_text
from bellcrank.web.pools import Stopped
from bellcrank.web.share_file import progress_of

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine, Hashable
    from pathlib import Path

MOST_RESULTS = 64
"""Number of results in memory, up to two megabytes each."""
MOST_FILES = 256
"""Number of results in files."""


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
        """Return a result, computed if it is not known; failures are not kept.

        Raises
        ------
        Stopped
            If the computation is stopped.
        """
        task = self._known.get(key)
        if task is None:
            task = self._known[key] = asyncio.create_task(compute())
            while len(self._known) > self._most:
                self._known.popitem(last=False)
        self._known.move_to_end(key)
        try:
            # A client that leaves does not end the computation, since others may wait for it.
            return await asyncio.shield(task)
        except asyncio.CancelledError:
            if task.cancelled():
                raise Stopped("stopped on request") from None
            raise
        except Exception:
            self._known.pop(key, None)
            raise

    def stop(self, key: Hashable) -> bool:
        """Stop a computation, for all who wait for its result; return whether it was running."""
        return self.is_running(key) and self._known.pop(key).cancel()

    def is_running(self, key: Hashable) -> bool:
        """Whether a result is being computed."""
        task = self._known.get(key)
        return task is not None and not task.done()


class StoredResults:
    """Results of slow computations in files, which a restarted server finds again.

    Parameters
    ----------
    folder
        Folder of the files; created at the first result.
    most
        Largest number of results; the oldest is deleted.
    """

    def __init__(self, folder: Path, most: int = MOST_FILES) -> None:
        self._folder, self._most = folder, most
        self._results = Results()

    async def get(
        self, key: str, compute: Callable[[Path], Coroutine[Any, Any, dict[str, Any]]]
    ) -> dict[str, Any]:
        """Return a result, computed if it is not known; failures are not kept.

        Parameters
        ----------
        key
            Text that the result follows from.
        compute
            Function of a file into which the computation writes the fraction that is done.

        Raises
        ------
        Stopped
            If the computation is stopped.
        """
        return await self._results.get(key, lambda: self._computed(key, compute))

    def state(self, key: str, *, running: bool = False) -> dict[str, Any] | None:
        """Return what is known of a computation: ``result``, or ``share`` while it runs.

        None if it was not begun, or if it does not run and only that is asked for. The share is
        None if it is not known; ``seconds`` are those since the computation began, ``left`` those
        that it still takes by the estimate of `ShareFile`, None if that is not known or has passed.
        """
        if self._results.is_running(key):
            return progress_of(self._path(key, "share"))
        found = None if running else self._stored(key)
        return None if found is None else {"result": found}

    def stop(self, key: str) -> bool:
        """Stop a computation, for all who wait for its result; return whether it was running."""
        return self._results.stop(key)

    async def _computed(
        self, key: str, compute: Callable[[Path], Coroutine[Any, Any, dict[str, Any]]]
    ) -> dict[str, Any]:
        found = self._stored(key)
        if found is not None:
            return found
        share = self._path(key, "share")
        self._folder.mkdir(parents=True, exist_ok=True)
        share.unlink(missing_ok=True)  # that of a server that was killed
        try:
            found = await compute(share)
        finally:
            share.unlink(missing_ok=True)
        with contextlib.suppress(BellcrankError):  # on a full disk the result is not kept
            write_text(self._path(key, "json"), json.dumps(found), overwrite=True)
            self._drop_oldest()
        return found

    def _stored(self, key: str) -> dict[str, Any] | None:
        """Return the result in its file; None without a file, or if it is damaged."""
        path = self._path(key, "json")
        try:
            found: dict[str, Any] = json.loads(read_text(path)) if path.exists() else {}
        except (BellcrankError, ValueError):
            return None
        return found or None

    def _path(self, key: str, suffix: str) -> Path:
        return self._folder / f"{hashlib.sha256(key.encode()).hexdigest()[:24]}.{suffix}"

    def _drop_oldest(self) -> None:
        files = sorted(self._folder.glob("*.json"), key=lambda path: path.stat().st_mtime)
        for path in files[: -self._most]:
            path.unlink(missing_ok=True)
