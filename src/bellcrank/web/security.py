"""Access control: loopback or token, same origin, size limits."""

from __future__ import annotations

import ipaddress
import json
import secrets
from dataclasses import dataclass
from http.cookies import CookieError, SimpleCookie
from typing import TYPE_CHECKING
from urllib.parse import parse_qs, urlsplit

from bellcrank.web.limits import BODY

if TYPE_CHECKING:
    from starlette.types import ASGIApp, Message, Receive, Scope, Send

COOKIE = "bellcrank_token"
HEADERS = {
    "content-security-policy": (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; "
        "connect-src 'self'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'"
    ),
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
}
TOO_LARGE = f"the request is larger than {BODY // 1_000_000} MB"
UNSAFE = ("POST", "PUT", "PATCH", "DELETE")


def is_loopback(host: str) -> bool:
    """Return whether an address is reachable from this machine only.

    Examples
    --------
    >>> [is_loopback(host) for host in ("localhost", "127.0.0.1", "::1", "0.0.0.0", "::")]
    [True, True, True, False, False]
    """
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


@dataclass(frozen=True, slots=True)
class AccessControl:
    """Middleware that refuses requests without permission.

    Parameters
    ----------
    app
        Application behind it.
    token
        Required token; None for a server that only this machine can reach.
    """

    app: ASGIApp
    token: str | None = None

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Refuse a request or pass it to the application."""
        if scope["type"] == "lifespan":
            await self.app(scope, receive, send)
            return
        headers = {
            key.decode("latin-1"): value.decode("latin-1") for key, value in scope["headers"]
        }
        refusal = self._refusal(scope, headers)
        if refusal is None and self._has_token_in_address(scope):
            await _redirect(send, self.token or "")
        elif refusal is None:
            await self._forward(scope, receive, send)
        elif scope["type"] == "websocket":
            await send({"type": "websocket.close", "code": 1008, "reason": refusal[1][:120]})
        else:
            await _respond(send, *refusal)

    def _refusal(self, scope: Scope, headers: dict[str, str]) -> tuple[int, str] | None:
        """Return status and message for a request to be refused, else None."""
        if refusal := self._foreign_origin(scope, headers):
            return refusal
        if self.token is not None and not self._has_token(scope, headers):
            return 401, "open the address with the token that bellcrank serve has printed"
        length = headers.get("content-length", "0")
        if not length.isdigit() or int(length) > BODY:
            return 413, TOO_LARGE
        if scope["type"] == "http" and scope["method"] in UNSAFE and int(length) > 0:
            kind = headers.get("content-type", "").partition(";")[0].strip()
            if kind != "application/json":  # an HTML form of another site cannot send this type
                return 415, "expected application/json"
        return None

    def _foreign_origin(self, scope: Scope, headers: dict[str, str]) -> tuple[int, str] | None:
        """Refuse requests that a page of another site makes a browser send."""
        host = headers.get("host", "")
        if self.token is None and not is_loopback(_hostname(host)):
            # Another site can point its own name to the address of this machine.
            return 403, "this server answers only to localhost"
        origin = headers.get("origin")
        foreign = origin is not None and _netloc(origin) != host
        if headers.get("sec-fetch-site") in {"cross-site", "same-site"}:
            # A link on another site may open the page and nothing else.
            followed = scope["type"] == "http" and scope["path"] == "/" and scope["method"] == "GET"
            foreign = foreign or not followed
        return (403, "requests from other pages are refused") if foreign else None

    def _has_token(self, scope: Scope, headers: dict[str, str]) -> bool:
        given = [headers.get("authorization", "").removeprefix("Bearer "), _query_token(scope)]
        try:
            cookie = SimpleCookie(headers.get("cookie", "")).get(COOKIE)
        except CookieError:
            cookie = None
        given.append(cookie.value if cookie is not None else "")
        token = (self.token or "").encode()
        return any(secrets.compare_digest(each.encode(), token) for each in given if each)

    def _has_token_in_address(self, scope: Scope) -> bool:
        """Return whether the token is in the address, from where a redirect removes it."""
        return (
            self.token is not None
            and scope["type"] == "http"
            and scope["method"] == "GET"
            and scope["path"] == "/"
            and bool(_query_token(scope))
        )

    async def _forward(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Forward messages up to the size limit and add headers to the response."""
        read = 0

        async def counted() -> Message:
            nonlocal read
            message = await receive()
            if message["type"] == "http.request":
                read += len(message.get("body", b""))
                if read > BODY:
                    return {"type": "http.disconnect"}
            return message

        async def with_headers(message: Message) -> None:
            if read > BODY:
                return  # the response to a truncated request is replaced below
            if message["type"] == "http.response.start":
                extra = [(key.encode(), value.encode()) for key, value in HEADERS.items()]
                message = {**message, "headers": [*message["headers"], *extra]}
            await send(message)

        try:
            await self.app(scope, counted, with_headers)
        finally:
            if read > BODY:
                await _respond(send, 413, TOO_LARGE)


def _hostname(host: str) -> str:
    try:
        return urlsplit(f"//{host}").hostname or ""
    except ValueError:
        return ""


def _netloc(origin: str) -> str:
    try:
        return urlsplit(origin).netloc
    except ValueError:
        return ""


def _query_token(scope: Scope) -> str:
    query: str = scope.get("query_string", b"").decode("latin-1")
    return parse_qs(query).get("token", [""])[0]


async def _redirect(send: Send, token: str) -> None:
    cookie = f"{COOKIE}={token}; HttpOnly; SameSite=Strict; Path=/"
    headers = [(b"location", b"/"), (b"set-cookie", cookie.encode()), (b"content-length", b"0")]
    await send({"type": "http.response.start", "status": 303, "headers": headers})
    await send({"type": "http.response.body", "body": b""})


async def _respond(send: Send, status: int, message: str) -> None:
    body = json.dumps({"message": message, "key": ""}).encode()
    headers = [
        (b"content-type", b"application/json"),
        (b"content-length", str(len(body)).encode()),
        *((key.encode(), value.encode()) for key, value in HEADERS.items()),
    ]
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": body})
