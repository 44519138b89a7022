"""Around the application: the token, the size of bodies, deadlines, figures. Nothing inside sees a refused request."""

from __future__ import annotations

import asyncio
import functools
import logging
import time
from collections.abc import Callable, MutableMapping
from typing import Any

from clearway.serve.access_log import AccessLog
from clearway.serve.faults import Fault
from clearway.serve.metrics import Metrics
from clearway.serve.service import Service
from clearway.serve.tokens import ANSWERED, KNOWN, OWNER
from clearway.web.guard import HEADERS, Application, Receive, Scope, Send

OPEN_PATHS = ("/health", "/ready")  # say nothing but whether the service is up
WATCHED = (*OPEN_PATHS, "/metrics")
UNKNOWN = "unknown"
SWITCHING = 101  # HTTP's status of a handshake that was accepted
FORBIDDEN = 403  # of one that the application has not accepted


def protected(
    app: Application, service: Service, health_port: int | None = None, log: AccessLog | None = None
) -> Application:
    """The application for requests with `Authorization: Bearer TOKEN`, of bounded size and time; all are counted.

    It finds the name of the token in the scope, under `OWNER`. Where there is a `health_port`, what `WATCHED` names is
    answered there, without a token, and nothing else; and nowhere else. `log` is told of every answer over HTTP, and of
    the handshake, the answers and the end of a WebSocket. What answers its messages finds in the scope, under
    `ANSWERED`, a function to be called of each: of when the message came, and of a status.
    """
    limits, metrics = service.limits, service.metrics

    def note(scope: Scope, begun: float, status: int) -> None:
        if log is not None:
            session = scope.get("path_params", {}).get("session_id")
            seconds = time.perf_counter() - begun
            log.note(_address(scope), scope.get(OWNER), session, _route(scope), status, seconds)

    def answered(scope: Scope, begun: float, status: int) -> None:
        metrics.answered(_route(scope), status, time.perf_counter() - begun)
        note(scope, begun, status)

    async def guard_socket(scope: Scope, receive: Receive, send: Send) -> None:
        begun = time.perf_counter()
        partial = functools.partial
        socket = _Socket(receive, send, partial(answered, scope, begun), partial(note, scope, begun))
        scope[ANSWERED] = partial(answered, scope)
        try:
            if scope["server"][1] == health_port:
                raise Fault("not_found", "there is nothing here on this port")
            scope[OWNER] = _owner(scope, service)
        except Fault as fault:
            return await _refuse_socket(socket.send, fault)
        await app(scope, socket.receive, socket.send)

    async def guard(scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "websocket":
            return await guard_socket(scope, receive, send)
        if scope["type"] != "http":
            return await app(scope, receive, send)
        begun, exchange = time.perf_counter(), _Exchange(scope, receive, send, service)
        try:
            if health_port is not None and (scope["path"] in WATCHED) != (scope["server"][1] == health_port):
                raise Fault("not_found", "there is nothing here on this port")
            if scope["path"] not in (OPEN_PATHS if health_port is None else WATCHED):
                scope[OWNER] = _owner(scope, service)
            exchange.check_length()
            async with asyncio.timeout(limits.deadline_s) as exchange.deadline:
                await app(scope, exchange.receive, exchange.send_in_time)
            if exchange.too_large:
                raise exchange.too_large
        except Fault as fault:
            await exchange.refuse(fault, metrics)
        except TimeoutError:
            if exchange.body_complete:
                late = Fault("deadline_passed", f"not answered within {limits.deadline_s:g} s. Try again")
            else:
                late = Fault("too_slow", f"the request did not arrive within {limits.deadline_s:g} s")
            await exchange.refuse(late, metrics)
        except Exception:  # the application has answered; whoever runs the service must know
            logging.getLogger("clearway.serve").exception("a request failed")
        finally:
            exchange.free()
            answered(scope, begun, exchange.status)

    return guard


class _Exchange:
    """A request and its answer: counts the body, notes the status, adds headers.

    Attributes:
        body_complete: all of the request's body has been read.
        status: of the answer; 0 before it begins.
        too_large: set once the body was; the application's own answer is then kept back.
        deadline: until the answer begins.
    """

    deadline: asyncio.Timeout

    def __init__(self, scope: Scope, receive: Receive, send: Send, service: Service) -> None:
        self._scope, self._receive, self._send, self._service = scope, receive, send, service
        self._most_bytes, self._read_bytes, self._held_bytes = service.limits.body_bytes, 0, 0
        self._length = int(_header(scope, b"content-length") or 0)  # the server has checked that it is a number
        self.body_complete = self._length == 0 and _header(scope, b"transfer-encoding") is None
        self.status = 0
        self.too_large: Fault | None = None

    def check_length(self) -> None:
        """Raise Fault where the body is said to be too large."""
        if self._length > self._most_bytes:
            raise self._fault()

    async def receive(self) -> MutableMapping[str, Any]:
        """The next part of the request. Raises Fault where there is too much of it."""
        message = await self._receive()
        if message["type"] == "http.request":
            arrived = len(message.get("body", b""))
            self._read_bytes += arrived
            self.body_complete = not message.get("more_body", False)
            if self._read_bytes > self._most_bytes:
                self.too_large = self._fault()
                raise self.too_large
            if not self._service.bodies.take(self._scope.get(OWNER, ""), arrived):
                raise Fault("overloaded", "too many large requests are under way. Try again")
            self._held_bytes += arrived
        return message

    def free(self) -> None:
        """Its body is held no more."""
        self._service.bodies.free(self._scope.get(OWNER, ""), self._held_bytes)

    def _fault(self) -> Fault:
        return Fault("body_too_large", f"at most {self._most_bytes} bytes are taken")

    async def send_in_time(self, message: MutableMapping[str, Any]) -> None:
        """As `send`, of the application: an answer that has begun is not cut off by the deadline."""
        if message["type"] == "http.response.start" and not self.deadline.expired():
            self.deadline.reschedule(None)
        await self.send(message)

    async def send(self, message: MutableMapping[str, Any]) -> None:
        """Pass a part of the answer on; after it, a connection with an unread body is closed."""
        if self.too_large and not self.status:
            return
        if message["type"] == "http.response.start":
            self.status = message["status"]
            added = HEADERS | {"cache-control": "no-store"} | ({} if self.body_complete else {"connection": "close"})
            pairs = [(name.encode(), value.encode()) for name, value in added.items()]
            message = {**message, "headers": [*message.get("headers", ()), *pairs]}
        await self._send(message)

    async def refuse(self, fault: Fault, metrics: Metrics) -> None:
        """Answer with a fault, unless an answer has begun."""
        self.too_large = None
        if self.status:
            return
        metrics.faults.labels(fault.code).inc()
        body = fault.body()
        headers = fault.headers() | {"content-length": str(len(body))}
        pairs = [(name.encode(), value.encode()) for name, value in headers.items()]
        await self.send({"type": "http.response.start", "status": fault.status, "headers": pairs})
        await self.send({"type": "http.response.body", "body": body})


class _Socket:
    """A WebSocket: tells of the status of its handshake, by HTTP, and of the code by which it is closed."""

    def __init__(
        self, receive: Receive, send: Send, answered: Callable[[int], object], closed: Callable[[int], object]
    ) -> None:
        self._receive, self._send, self._answered, self._closed = receive, send, answered, closed
        self._accepted = False

    async def receive(self) -> MutableMapping[str, Any]:
        """The next message."""
        message = await self._receive()
        if message["type"] == "websocket.disconnect":
            self._closed(message["code"])
        return message

    async def send(self, message: MutableMapping[str, Any]) -> None:
        """Pass a message on."""
        kind = message["type"]
        if kind == "websocket.accept":
            self._accepted = True
            self._answered(SWITCHING)
        elif kind == "websocket.http.response.start":
            self._answered(message["status"])
        elif kind == "websocket.close" and not self._accepted:
            self._answered(FORBIDDEN)
        elif kind == "websocket.close":
            self._closed(message["code"])
        await self._send(message)


def _unauthorised() -> Fault:
    return Fault("unauthorised", "send the header Authorization: Bearer TOKEN with the service's token")


def _header(scope: Scope, wanted: bytes) -> str | None:
    return next((value.decode("latin-1") for name, value in scope["headers"] if name.lower() == wanted), None)


def _route(scope: Scope) -> str:
    return getattr(scope.get("route"), "path", UNKNOWN)


def _address(scope: Scope) -> str:
    return str((scope.get("client") or ("",))[0])


def _owner(scope: Scope, service: Service) -> str:
    """The name of the request's token. Raises Fault where it has none that is right, or had too many wrong ones."""
    scheme, _, given = (_header(scope, b"authorization") or "").partition(" ")
    address, token = _address(scope), given.strip()
    if scheme.lower() != "bearer" or not token:
        raise _unauthorised()
    if not service.attempts.may_try(address, token):
        raise Fault("too_many_attempts", "too many wrong tokens have come from this address. Try again in a minute")
    owner = service.tokens.owner_of(token)
    service.attempts.note(address, token, owner is not None)
    if owner is None:
        raise _unauthorised()
    known = scope.get("state", {}).get(KNOWN)
    if known and not known(owner, token):
        raise Fault("overloaded", "too many connections of this token are open. Close one, or try again later")
    return owner


async def _refuse_socket(send: Send, fault: Fault) -> None:
    pairs = [(name.encode(), value.encode()) for name, value in fault.headers().items()]
    await send({"type": "websocket.http.response.start", "status": fault.status, "headers": pairs})
    await send({"type": "websocket.http.response.body", "body": fault.body()})
