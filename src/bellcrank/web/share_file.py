"""The share of a computation that is done, written by its process and read by the server."""

from __future__ import annotations

import contextlib
import math
import time
from pathlib import Path

LEAST_SHARE = 0.01
"""Smallest change of the fraction of a computation that is written."""


class ShareFile:
    """A file with the fraction of a computation that is done, its seconds so far, and those left.

    It is for another process, and written when the computation begins. The time left follows from
    that between the first fraction above 0 and the present one, since what comes before, such as
    a mesh, may take longer than the rest; it is nan until then.

    Parameters
    ----------
    path
        Path of the file; empty for none.
    """

    def __init__(self, path: str) -> None:
        self._path = path
        self._written = -LEAST_SHARE
        self._began = time.monotonic()
        self._first: tuple[float, float] | None = None
        self(0.0)

    def __call__(self, share: float) -> None:
        """Write the fraction, unless it has hardly changed."""
        if self._path and share - self._written >= LEAST_SHARE:
            self._written = share
            seconds, left = time.monotonic() - self._began, math.nan
            if self._first is not None:
                done, before = self._first
                left = (1.0 - share) * (seconds - before) / (share - done)
            elif share > 0.0:
                self._first = share, seconds
            with contextlib.suppress(OSError):
                Path(self._path).write_text(
                    f"{share:.3f} {seconds:.1f} {left:.1f}", encoding="ascii"
                )


def progress_of(path: Path) -> dict[str, float | None]:
    """Return the fraction that a computation has written, the seconds so far, and those left."""
    try:
        share, seconds, left = map(float, path.read_text(encoding="ascii").split())
        since = max(time.time() - path.stat().st_mtime, 0.0)
    except (OSError, ValueError):
        return {"share": None, "seconds": None, "left": None}
    return {
        "share": share,
        "seconds": round(seconds + since),
        "left": round(left - since) if left > since else None,
    }
