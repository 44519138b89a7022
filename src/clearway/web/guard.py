"""Who may talk to a local service: the right host name, no foreign page, and the token of the address.

Other web pages that the user has open can send requests to this machine too. They are told apart by the Host header
(DNS rebinding), the Origin header (cross-site requests and WebSockets), and by not knowing the token.
"""

from __future__ import annotations

import hmac
import secrets
from collections.abc import Awaitable, Callable, Iterable, MutableMapping
from typing import Any

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]
Application = Callable[[Scope, Receive, Send], Awaitable[None]]
"""As ASGI defines them."""

TOKEN_BYTES = 24
LOOPBACK_NAMES = ("127.0.0.1", "localhost")
HTTP_PORT = 80
POLICY_VIOLATION = 1008  # WebSocket close code
HEADERS = {
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cross-origin-resource-policy": "same-origin",
    "cross-origin-opener-policy": "same-origin",
}


def new_token() -> str:
    """A random token of 192 bits, safe in an address."""
    return secrets.token_urlsafe(TOKEN_BYTES)


def same_token(given: str, token: str) -> bool:
    """Whether both are the same, in a time that does not tell how much of it was right."""
    return hmac.compare_digest(given.encode(), token.encode())


def content_security_policy(port: int) -> str:
    """The page may load from this service alone: no inline script or style, no frame around it, no form."""
    sockets = " ".join(f"ws://{name}:{port}" for name in LOOPBACK_NAMES)
    return (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; "
        f"connect-src 'self' {sockets}; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    )


def guarded(app: Application, token: str, port: int) -> Application:
    """The application, for requests to `/TOKEN/...` from this machine's own page; it sees the path after the token.

    `/TOKEN` itself is redirected to `/TOKEN/`, from where the page finds its files.
    Refused are another Host (421), another Origin (403) and a wrong token (404), without a word about which part of it.
    Every answer carries headers that keep the page to itself.

    Args:
        app: what is guarded.
        token: first part of every path.
        port: the port that the service listens on.
    """
    hosts = {f"{name}:{port}" for name in LOOPBACK_NAMES}
    if port == HTTP_PORT:  # clients leave it out
        hosts |= set(LOOPBACK_NAMES)
    origins = {f"http://{host}" for host in hosts}
    headers = HEADERS | {"content-security-policy": content_security_policy(port)}

    async def guard(scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] not in ("http", "websocket"):
            return await app(scope, receive, send)
        status, rest = _judged(scope, hosts, origins, token)
        if status is not None:
            return await _refuse(scope["type"], status, send)
        if scope["type"] == "http" and scope["path"] == f"/{token}":
            return await _answer(308, _with_headers(send, headers), location=f"/{token}/")
        return await app({**scope, "path": rest, "raw_path": rest.encode()}, receive, _with_headers(send, headers))

    return guard


def _judged(scope: Scope, hosts: set[str], origins: set[str], token: str) -> tuple[int | None, str]:
    """The status of a refusal or None, and the path after the token."""
    given: Iterable[tuple[bytes, bytes]] = scope["headers"]
    values: dict[str, list[str]] = {"host": [], "origin": []}
    for name, value in given:
        if (key := name.decode("latin-1").lower()) in values:
            values[key].append(value.decode("latin-1").lower())
    if len(values["host"]) != 1 or values["host"][0] not in hosts:
        return 421, ""
    if any(origin not in origins for origin in values["origin"]):
        return 403, ""
    first, _, rest = scope["path"].removeprefix("/").partition("/")
    return (None, f"/{rest}") if same_token(first, token) else (404, "")


async def _refuse(kind: str, status: int, send: Send) -> None:
    if kind == "websocket":
        return await send({"type": "websocket.close", "code": POLICY_VIOLATION})
    await _answer(status, send)


async def _answer(status: int, send: Send, **more: str) -> None:
    """Answer without content; more: headers."""
    given = {"content-length": "0", "cache-control": "no-store"} | more
    headers = [(name.encode(), value.encode()) for name, value in given.items()]
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": b""})


def _with_headers(send: Send, headers: dict[str, str]) -> Send:
    added = [(name.encode(), value.encode()) for name, value in headers.items()]

    async def sending(message: MutableMapping[str, Any]) -> None:
        if message["type"] == "http.response.start":
            message = {**message, "headers": [*message.get("headers", ()), *added]}
        await send(message)

    return sending
