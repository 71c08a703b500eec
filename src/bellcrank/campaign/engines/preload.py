"""What a worker of the local engine does before anything else."""

from __future__ import annotations

import signal
from typing import Any


def dask_setup(_worker: Any) -> None:
    """Leave Ctrl-C to the process that started us: it asks us to stop, in its own time."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
