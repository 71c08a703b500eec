"""In processes of this machine, which end with this one."""

from __future__ import annotations

import logging
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from bellcrank.campaign.engines.base import LOOPBACK, Engine, EngineOptions, engines
from bellcrank.campaign.engines.on_dask import connected, dashboard, first_line, quiet
from bellcrank.errors import ClusterError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from bellcrank.campaign.store import Store

LOST = "10s"
"""After which a worker that does not come back is replaced."""
MOST_STARTS = 5
"""Attempts at starting the workers, should one be killed just then."""


@engines.register("local")
@contextmanager
def local(store: Store, options: EngineOptions) -> Iterator[Engine]:
    """Compute in processes of this machine."""
    import dask

    from bellcrank.search import default_workers

    count = options.workers or default_workers()
    with (
        quiet(),
        dask.config.set({"distributed.deploy.lost-worker-timeout": LOST}),
        _cluster(count, options.host or LOOPBACK) as cluster,
        connected(
            store,
            cluster,
            timeout=options.timeout,
            note=dashboard(cluster),
            renew=lambda: cluster.scale(count),
        ) as engine,
    ):
        yield engine


def _cluster(count: int, host: str) -> Any:
    """Start scheduler and workers; once more if a worker dies while it starts.

    Raises
    ------
    ClusterError
        If they do not start.
    """
    from distributed import LocalCluster

    error: Exception | None = None
    for _ in range(MOST_STARTS):
        try:
            return LocalCluster(
                n_workers=count,
                threads_per_worker=1,
                processes=True,
                host=host,
                dashboard_address=f"{host}:0",
                memory_limit=0,  # a run holds little, and a worker must not be paused
                silence_logs=logging.CRITICAL + 1,
                preload=["bellcrank.campaign.engines.preload"],
                scheduler_kwargs={"allowed_failures": 0},  # `drive` counts deaths itself
            )
        except (RuntimeError, OSError) as failed:
            error = failed
    raise ClusterError(f"the workers do not start: {first_line(error)}")
