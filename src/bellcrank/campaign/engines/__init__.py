"""Engines: where the runs of a campaign are computed.

Importing this package does not import Dask; entering one of its engines does.
"""

from bellcrank.campaign.engines import cluster, processes, serial
from bellcrank.campaign.engines.base import Engine, EngineOptions, Outcome, WorkerDied, engines

__all__ = [
    "Engine",
    "EngineOptions",
    "Outcome",
    "WorkerDied",
    "cluster",
    "engines",
    "processes",
    "serial",
]
