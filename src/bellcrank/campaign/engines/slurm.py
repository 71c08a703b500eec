"""In SLURM jobs of one core each, which end with this process."""

from __future__ import annotations

import os
import shutil
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from bellcrank.campaign.engines.base import Engine, EngineOptions, engines
from bellcrank.campaign.engines.on_dask import connected, dashboard, first_line, quiet
from bellcrank.errors import ClusterError, StorageError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from bellcrank.campaign.store import Store

ROLES = ("client", "scheduler", "worker")


@engines.register("slurm")
@contextmanager
def slurm(store: Store, options: EngineOptions) -> Iterator[Engine]:
    """Compute in SLURM jobs of one core each, which end with this process.

    The scheduler listens on the network, so all talk is encrypted, with keys made for the
    occasion and kept in the store for as long.

    Raises
    ------
    ClusterError
        If dask-jobqueue is not installed, or SLURM refuses.
    """
    try:
        from dask_jobqueue import SLURMCluster
    except ImportError:
        raise ClusterError(
            "engine 'slurm' needs dask-jobqueue: pip install 'bellcrank[cluster]'"
        ) from None
    with quiet(), _own_keys(store) as security:
        chosen: dict[str, Any] = {
            "cores": 1, "processes": 1, "memory": "2GB", "nanny": True, "death_timeout": 60,
            "protocol": "tls://", "security": security,
            "scheduler_options": {
                "host": options.host, "allowed_failures": 0,
                "dashboard_address": f"{options.host or ''}:0",
            },
            **options.slurm,
        }  # fmt: skip
        try:
            cluster = SLURMCluster(**chosen)
        except (TypeError, ValueError, ImportError, OSError) as error:
            raise ClusterError(f"SLURM cluster: {first_line(error)}") from None
        with cluster:
            count = options.workers or 1
            cluster.scale(jobs=count)
            with connected(
                store,
                cluster,
                timeout=options.timeout,
                note=dashboard(cluster),
                renew=lambda: cluster.scale(jobs=count),
            ) as engine:
                yield engine


@contextmanager
def _own_keys(store: Store) -> Iterator[Any]:
    """Make keys that only we can read, on the file system that all machines share.

    Raises
    ------
    ClusterError
        If what makes keys is not installed.
    StorageError
    """
    from distributed import Security

    try:
        made = Security.temporary()
    except ImportError:
        raise ClusterError(
            "engine 'slurm' needs cryptography: pip install 'bellcrank[cluster]'"
        ) from None
    texts = {
        "ca.pem": made.tls_ca_file, "cert.pem": made.tls_worker_cert, "key.pem": made.tls_worker_key
    }  # fmt: skip
    folder = store.path / f".keys.{os.urandom(4).hex()}"
    try:
        folder.mkdir(mode=0o700)
        for name, text in texts.items():
            (folder / name).write_text(text)
    except OSError as error:
        raise StorageError(f"{folder}: cannot be written ({error.strerror})") from None
    ca, cert, key = (str(folder / name) for name in texts)
    both = {"cert": cert, "key": key}
    try:
        yield Security(
            require_encryption=True,
            tls_ca_file=ca,
            **{f"tls_{who}_{what}": path for who in ROLES for what, path in both.items()},
        )
    finally:
        shutil.rmtree(folder, ignore_errors=True)
