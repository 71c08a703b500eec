"""Who may ask: from this machine or with the token, from our own page, and not too much at once."""

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
TOO_LARGE = f"more than {BODY // 1_000_000} MB cannot be taken"
UNSAFE = ("POST", "PUT", "PATCH", "DELETE")


def is_loopback(host: str) -> bool:
    """Whether an address leads to this machine only.

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
class Guard:
    """Lets through what may pass.

    Parameters
    ----------
    app
        What answers.
    token
        That must be known; None for a server that only this machine can reach.
    """

    app: ASGIApp
    token: str | None = None

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Refuse, or pass on."""
        if scope["type"] == "lifespan":
            await self.app(scope, receive, send)
            return
        headers = {
            key.decode("latin-1"): value.decode("latin-1") for key, value in scope["headers"]
        }
        refusal = self._refusal(scope, headers)
        if refusal is None and self._has_login(scope):
            await _redirect(send, self.token or "")
        elif refusal is None:
            await self._pass(scope, receive, send)
        elif scope["type"] == "websocket":
            await send({"type": "websocket.close", "code": 1008, "reason": refusal[1][:120]})
        else:
            await _answer(send, *refusal)

    def _refusal(self, scope: Scope, headers: dict[str, str]) -> tuple[int, str] | None:
        """Return status and sentence for what may not pass."""
        if refusal := self._stranger(scope, headers):
            return refusal
        if self.token is not None and not self._knows_token(scope, headers):
            return 401, "open the address with the token that bellcrank serve has printed"
        length = headers.get("content-length", "0")
        if not length.isdigit() or int(length) > BODY:
            return 413, TOO_LARGE
        if scope["type"] == "http" and scope["method"] in UNSAFE and int(length) > 0:
            kind = headers.get("content-type", "").partition(";")[0].strip()
            if kind != "application/json":  # what a form elsewhere could send is not this
                return 415, "expected application/json"
        return None

    def _stranger(self, scope: Scope, headers: dict[str, str]) -> tuple[int, str] | None:
        """Refuse what a page from elsewhere has made a browser send."""
        host = headers.get("host", "")
        if self.token is None and not is_loopback(_hostname(host)):
            # A page elsewhere can give its own name the address of this machine.
            return 403, "this server answers only to localhost"
        origin = headers.get("origin")
        foreign = origin is not None and _netloc(origin) != host
        if headers.get("sec-fetch-site") in {"cross-site", "same-site"}:
            # A link elsewhere may lead to the page, and to nothing else.
            followed = scope["type"] == "http" and scope["path"] == "/" and scope["method"] == "GET"
            foreign = foreign or not followed
        return (403, "requests from other pages are refused") if foreign else None

    def _knows_token(self, scope: Scope, headers: dict[str, str]) -> bool:
        given = [headers.get("authorization", "").removeprefix("Bearer "), _query_token(scope)]
        try:
            cookie = SimpleCookie(headers.get("cookie", "")).get(COOKIE)
        except CookieError:
            cookie = None
        given.append(cookie.value if cookie is not None else "")
        token = (self.token or "").encode()
        return any(secrets.compare_digest(each.encode(), token) for each in given if each)

    def _has_login(self, scope: Scope) -> bool:
        """Whether the token is in the address, from where it should vanish."""
        return (
            self.token is not None
            and scope["type"] == "http"
            and scope["method"] == "GET"
            and scope["path"] == "/"
            and bool(_query_token(scope))
        )

    async def _pass(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass on what comes as long as it is not too much, and dress what goes."""
        read = 0

        async def counted() -> Message:
            nonlocal read
            message = await receive()
            if message["type"] == "http.request":
                read += len(message.get("body", b""))
                if read > BODY:
                    return {"type": "http.disconnect"}
            return message

        async def dressed(message: Message) -> None:
            if read > BODY:
                return  # whatever is made of half a request, the answer is another
            if message["type"] == "http.response.start":
                extra = [(key.encode(), value.encode()) for key, value in HEADERS.items()]
                message = {**message, "headers": [*message["headers"], *extra]}
            await send(message)

        try:
            await self.app(scope, counted, dressed)
        finally:
            if read > BODY:
                await _answer(send, 413, TOO_LARGE)


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


async def _answer(send: Send, status: int, message: str) -> None:
    body = json.dumps({"message": message, "key": ""}).encode()
    headers = [
        (b"content-type", b"application/json"),
        (b"content-length", str(len(body)).encode()),
        *((key.encode(), value.encode()) for key, value in HEADERS.items()),
    ]
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": body})
