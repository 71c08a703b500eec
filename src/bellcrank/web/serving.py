"""Start of the server."""

from __future__ import annotations

import contextlib
import os
import secrets
import signal
import socket
import threading
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from bellcrank.errors import InvalidSettings
from bellcrank.storage.files import make_folder
from bellcrank.storage.locking import locked
from bellcrank.web.security import is_loopback

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from types import FrameType


EVERY_ADDRESS = {
    "0.0.0.0": (socket.AF_INET, "192.0.2.1"),
    "::": (socket.AF_INET6, "2001:db8::1"),
}
"""Names of all addresses of a machine, with an address of documentation to find the usual one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ServerSettings:
    """Address and data of a server.

    Parameters
    ----------
    folder
        Folder of runs and saved designs.
    host, port
        Address; port 0 for any free port.
    token
        Required from every client. Generated if the address is reachable from other machines.
    searches
        Number of searches at the same time; None for the number of processors.
    """

    folder: Path
    host: str = "127.0.0.1"
    port: int = 8642
    token: str | None = None
    searches: int | None = None

    def __post_init__(self) -> None:
        if not 0 <= self.port < 65536:
            raise InvalidSettings(f"port: expected 0 to 65535, got {self.port}")
        if self.searches is not None and self.searches < 1:
            raise InvalidSettings(f"searches: expected at least 1, got {self.searches}")
        if self.token is not None and len(self.token) < 8:
            raise InvalidSettings("token: expected at least 8 letters or digits")
        if self.token is not None and not self.token.replace("-", "").replace("_", "").isalnum():
            raise InvalidSettings("token: expected letters, digits, - and _ only")

    @property
    def needed_token(self) -> str | None:
        """The given token, or a new one if the address needs one."""
        if self.token is None and not is_loopback(self.host):
            return secrets.token_urlsafe(18)
        return self.token


def default_folder() -> Path:
    """Return the default folder, in the data folder of the user."""
    base = os.environ.get("XDG_DATA_HOME")
    return (Path(base) if base else Path.home() / ".local" / "share") / "bellcrank" / "web"


def serve(settings: ServerSettings, announce: Callable[[str], None]) -> None:
    """Run the server until it is interrupted or terminated; its processes end with it.

    Parameters
    ----------
    announce
        Called with the address once it is open.

    Raises
    ------
    InvalidSettings
        If the address cannot be had.
    StorageError
        If the folder cannot be used, or another server uses it.
    """
    import uvicorn

    from bellcrank.web.app import make_app
    from bellcrank.web.limits import MESSAGE

    token = settings.needed_token
    make_folder(settings.folder)
    lock = locked(settings.folder / "server.lock", wait=False, option="--folder")
    with _exit_on_sigterm(), lock, _listening(settings) as listener:
        app = make_app(settings.folder, token=token, searches=settings.searches)
        config = uvicorn.Config(
            app, log_level="warning", ws_max_size=MESSAGE, ws="websockets-sansio",
            server_header=False, timeout_graceful_shutdown=3, limit_concurrency=400,
        )  # fmt: skip

        class Server(uvicorn.Server):
            """A server that ends its computations first, so that requests do not wait for them."""

            async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
                app.state.bellcrank.pools.end()
                await super().shutdown(sockets)

        server = Server(config)
        port = listener.getsockname()[1]
        host = address_of(settings.host)
        announce(f"http://{host}:{port}/" + (f"?token={token}" if token else ""))
        try:
            server.run(sockets=[listener])
        finally:  # after a second Ctrl-C the server skips its own shutdown
            app.state.bellcrank.pools.end()


def address_of(host: str) -> str:
    """Return a host as part of an address that a browser can open.

    For all addresses of this machine (``0.0.0.0``, ``::``), the one by which other machines reach
    it; its name if it has no network.

    Examples
    --------
    >>> address_of("127.0.0.1"), address_of("::1")
    ('127.0.0.1', '[::1]')
    """
    if host in EVERY_ADDRESS:
        family, elsewhere = EVERY_ADDRESS[host]
        try:
            with socket.socket(family, socket.SOCK_DGRAM) as probe:
                probe.connect((elsewhere, 9))  # sends nothing
                host = str(probe.getsockname()[0])
        except OSError:
            host = socket.gethostname()
    return f"[{host}]" if ":" in host else host


@contextlib.contextmanager
def _exit_on_sigterm() -> Iterator[None]:
    """Make SIGTERM a regular exit: uvicorn raises it again, which would skip the cleanup."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def exit_process(_number: int, _frame: FrameType | None) -> None:
        raise SystemExit(0)

    before = signal.signal(signal.SIGTERM, exit_process)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


@contextlib.contextmanager
def _listening(settings: ServerSettings) -> Iterator[socket.socket]:
    """Open the address before anything else."""
    try:
        found = socket.getaddrinfo(settings.host, settings.port, type=socket.SOCK_STREAM)
        family, kind, protocol, _, address = found[0]
        listener = socket.socket(family, kind, protocol)
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind(address)
        listener.listen(128)  # clients that connect early wait
    except OSError as error:
        raise InvalidSettings(
            f"{settings.host}:{settings.port} cannot be opened ({error.strerror}); "
            "choose another with --port"
        ) from None
    with listener:
        yield listener
