"""Where runs are computed: here, on this machine's cores, or on machines elsewhere.

Importing this package does not import Dask; entering one of its engines does.
"""

from bellcrank.campaign.engines import address, local, serial, slurm
from bellcrank.campaign.engines.base import (
    LOOPBACK,
    Engine,
    EngineOptions,
    Outcome,
    WorkerDied,
    engines,
)

__all__ = [
    "LOOPBACK",
    "Engine",
    "EngineOptions",
    "Outcome",
    "WorkerDied",
    "address",
    "engines",
    "local",
    "serial",
    "slurm",
]
