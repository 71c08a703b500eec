"""On the workers of a Dask scheduler that is running, and stays so afterwards."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING

from bellcrank.campaign.engines.base import Engine, EngineOptions, engines
from bellcrank.campaign.engines.on_dask import connected, quiet
from bellcrank.errors import InvalidSettings

if TYPE_CHECKING:
    from collections.abc import Iterator

    from distributed import Security

    from bellcrank.campaign.store import Store


@engines.register("address")
@contextmanager
def address(store: Store, options: EngineOptions) -> Iterator[Engine]:
    """Compute on the workers of a scheduler that is running, and stays so afterwards.

    Raises
    ------
    InvalidSettings
        If its address is none.
    """
    where = options.scheduler or ""
    if not where.startswith(("tcp://", "tls://")):
        raise InvalidSettings(
            f"scheduler: expected an address like tcp://host:8786 or tls://host:8786, got {where!r}"
        )
    with (
        quiet(),
        connected(
            store,
            where,
            timeout=options.timeout,
            security=_security(options),
            note=f"scheduler: {where}",
        ) as engine,
    ):
        yield engine


def _security(options: EngineOptions) -> Security | None:
    """Return what proves who we are, for ``tls://``.

    Raises
    ------
    InvalidSettings
        If a file is missing, or given without need.
    """
    from distributed import Security

    files = {
        "--tls-ca": options.tls_ca,
        "--tls-cert": options.tls_cert,
        "--tls-key": options.tls_key,
    }
    encrypted = (options.scheduler or "").startswith("tls://")
    if not encrypted:
        if given := [name for name, path in files.items() if path is not None]:
            raise InvalidSettings(f"{given[0]}: only for a scheduler at tls://")
        return None
    for name, path in files.items():
        if path is None or not path.is_file():
            raise InvalidSettings(f"{name}: expected a file, as tls:// needs it; got {path}")
    return Security(
        require_encryption=True,
        tls_ca_file=str(options.tls_ca),
        tls_client_cert=str(options.tls_cert),
        tls_client_key=str(options.tls_key),
    )
