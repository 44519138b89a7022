"""Connections that do not wait for ever: for a request's headers, a whole message, or a client to read what was sent.

Before a right token has come, they are few for each address and stay open for a short time; of WebSockets nothing is
read. What is held of messages counts among the bytes that all owners share.
"""

from __future__ import annotations

import asyncio
import socket
import struct
from collections import deque
from typing import Any, cast

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol

from clearway.serve.faults import AGAIN, POLICY, TOO_BIG
from clearway.serve.limits import Limits
from clearway.serve.shares import Places
from clearway.serve.tokens import KNOWN, OWNER

KEEP_ALIVE_S = 75  # of an idle connection; longer than clients and proxies commonly keep theirs
MOST_FRAGMENTS = 1024  # of a WebSocket message
MESSAGE_BYTES = 512  # that a message takes beside its content


def reset(transport: asyncio.Transport) -> None:
    """Cut a connection off and let the system forget what it still had to send, which it would else keep trying to."""
    plug = transport.get_extra_info("socket")
    if plug is not None and not transport.is_closing():
        plug.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    transport.abort()


class Strangers:
    """Connections on which no right token has come yet, by address.

    Args:
        most: of an address.
        trusted: the address of a proxy, behind which all clients are; None: no such.
    """

    def __init__(self, most: int, trusted: str | None) -> None:
        self._most, self._trusted = most, trusted
        self._open: dict[str, dict[ImpatientHttp, None]] = {}

    def add(self, connection: ImpatientHttp) -> None:
        """Count a new connection; the oldest of its address is cut off where there are too many."""
        if connection.address == self._trusted:
            return
        found = self._open.setdefault(connection.address, {})
        found[connection] = None
        oldest = next((other for other in found if not other.is_known), None)
        if len(found) > self._most and oldest is not None:
            reset(oldest.transport)
            self.remove(oldest)

    def remove(self, connection: ImpatientHttp) -> None:
        """Count it no more: it is closed, or a right token has come."""
        found = self._open.get(connection.address, {})
        found.pop(connection, None)
        if not found:
            self._open.pop(connection.address, None)


class _Impatient(asyncio.Protocol):
    """Cuts a connection off whose client does not read; uvicorn would wait for it."""

    loop: asyncio.AbstractEventLoop
    transport: asyncio.Transport
    patience_s: float
    _unread: asyncio.TimerHandle | None = None

    def connection_made(self, transport: Any) -> None:
        """Be told as soon as the client leaves anything unread that the system does not hold."""
        super().connection_made(transport)
        transport.set_write_buffer_limits(1)  # asyncio's TLS takes 0 for always too much

    def pause_writing(self) -> None:
        super().pause_writing()
        self._unread = self.loop.call_later(self.patience_s, reset, self.transport)

    def resume_writing(self) -> None:
        self._stop_waiting()
        super().resume_writing()

    def connection_lost(self, exc: Exception | None) -> None:
        self._stop_waiting()
        super().connection_lost(exc)

    def _stop_waiting(self) -> None:
        if self._unread is not None:
            self._unread.cancel()
            self._unread = None


class ImpatientHttp(_Impatient, H11Protocol):
    """HTTP/1.1 whose clients send a request's headers, and read its answer, within `patience_s`."""

    strangers: Strangers
    health_port: int | None = None
    address = ""
    is_known = False  # a right token has come on it
    _headers: asyncio.TimerHandle | None = None

    def connection_made(self, transport: Any) -> None:
        """Begin to wait for headers."""
        super().connection_made(transport)
        self.address = self.client[0] if self.client else ""
        if self.health_port is not None and self.server is not None and self.server[1] == self.health_port:
            self.limit_concurrency = None  # whoever watches the service is answered however busy it is
        self.app_state = {**self.app_state, KNOWN: self._become_known}  # every request's scope has it, under "state"
        self.strangers.add(self)
        self._await_headers()

    def data_received(self, data: bytes) -> None:
        """Wait for the rest of headers, where these are not all."""
        super().data_received(data)
        between = self.conn.their_state is h11.IDLE and not self.transport.is_closing()
        if not between:
            self._have_headers()
        elif self._headers is None and self.conn.trailing_data[0]:
            self._await_headers()

    def _become_known(self) -> None:
        self.is_known = True
        self.strangers.remove(self)

    def connection_lost(self, exc: Exception | None) -> None:
        """Wait for nothing any more."""
        self._have_headers()
        self.strangers.remove(self)
        super().connection_lost(exc)

    def handle_websocket_upgrade(self, event: h11.Request) -> None:
        """Leave the connection to the WebSocket's class."""
        self._have_headers()
        self.strangers.remove(self)
        super().handle_websocket_upgrade(event)

    def timeout_keep_alive_handler(self) -> None:
        """Uvicorn calls it `patience_s` after an answer: who has left it unread is cut off, owners may stay idle."""
        if self.transport.get_write_buffer_size():
            reset(self.transport)
        elif not self.is_known:
            super().timeout_keep_alive_handler()
        else:
            end = super().timeout_keep_alive_handler
            self.timeout_keep_alive_task = self.loop.call_later(KEEP_ALIVE_S, end)

    def _await_headers(self) -> None:
        self._headers = self.loop.call_later(self.patience_s, reset, self.transport)

    def _have_headers(self) -> None:
        if self._headers is not None:
            self._headers.cancel()
            self._headers = None


class ImpatientSocket(_Impatient, WebSocketsSansIOProtocol):
    """A WebSocket whose client reads its answers within `patience_s` and sends a message within `message_s`.

    Nothing is read before the application has accepted it. All that is held of messages, from their first byte to their
    answer, takes places of the owner's.
    """

    bodies: Places
    message_s: float
    _held = 0  # bytes that have taken places
    _rest: asyncio.TimerHandle | None = None

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self._unanswered: deque[int] = deque()  # bytes of each whole message that is not answered yet
        self._unanswered_bytes = 0
        self._answering = False  # the first of them has gone to the application

    def handle_connect(self, event: Any) -> None:
        """Leave what follows unread until the application asks for it: it does once the token was right."""
        super().handle_connect(event)
        if not self.transport.is_closing():
            self.read_paused = True
            self.transport.pause_reading()

    def data_received(self, data: bytes) -> None:
        """Count what is held now."""
        super().data_received(data)
        self._hold()

    def handle_cont(self, event: Any) -> None:
        """Take a part of a message, unless there are too many: each takes more than its content."""
        super().handle_cont(event)
        if len(self.frames) > MOST_FRAGMENTS:
            self.frames = []
            self._give_up(TOO_BIG, f"a message comes in more than {MOST_FRAGMENTS} parts")

    def send_receive_event_to_app(self) -> None:
        """Keep a whole message until it is answered."""
        if not self.close_sent:
            self._unanswered.append(sum(map(len, self.frames)) + MESSAGE_BYTES)
            self._unanswered_bytes += self._unanswered[-1]
        super().send_receive_event_to_app()

    async def receive(self) -> Any:
        """The next message; the one before is answered, and held no more."""
        if self._answering:
            self._unanswered_bytes -= self._unanswered.popleft()
            self._answering = False
            self._hold()
        message = await super().receive()
        self._answering = message["type"] == "websocket.receive"
        if not self.writable.is_set():
            self.transport.pause_reading()
        self._hold()
        return message

    async def send(self, message: Any) -> None:
        """Pass a message on; a refusal completes the handshake, of which uvicorn would complain."""
        await super().send(message)
        self.handshake_complete = self.handshake_complete or self.close_sent

    def pause_writing(self) -> None:
        """Read no more meanwhile: who does not read could have answers to pings pile up."""
        super().pause_writing()
        self.transport.pause_reading()

    def resume_writing(self) -> None:
        """Read on, unless a message waits for the application."""
        super().resume_writing()
        if not self.read_paused:
            self.transport.resume_reading()

    def connection_lost(self, exc: Exception | None) -> None:
        """Hold nothing any more."""
        super().connection_lost(exc)
        self._stop_waiting_for_rest()
        self._take(0)

    def _hold(self) -> None:
        """Take places for what is held, and wait for the rest of a message where that is to be read."""
        begun = len(self.conn.reader.buffer) + sum(map(len, self.frames))
        if self.transport.is_closing():
            return
        if not self._take(begun + self._unanswered_bytes):
            return self._give_up(AGAIN, "too many large messages are under way. Try again")
        if not begun or self.read_paused:
            self._stop_waiting_for_rest()
        elif self._rest is None:
            told = f"the message did not arrive within {self.message_s:g} s"
            self._rest = self.loop.call_later(self.message_s, self._give_up, POLICY, told)

    def _take(self, count: int) -> bool:
        """Whether there were places; `count` in all."""
        more = count - self._held
        if not more:
            return True  # also before there is a scope
        scope = cast(dict[str, Any], self.scope)
        if more > 0 and not self.bodies.take(scope[OWNER], more):
            return False
        if more < 0:
            self.bodies.free(scope[OWNER], -more)
        self._held = count
        return True

    def _stop_waiting_for_rest(self) -> None:
        if self._rest is not None:
            self._rest.cancel()
            self._rest = None

    def _give_up(self, code: int, reason: str) -> None:
        """End the connection, and tell the client why."""
        self.conn.fail(code, reason)
        self.close_sent = True
        self.queue.put_nowait({"type": "websocket.disconnect", "code": code, "reason": reason})
        self.transport.write(b"".join(self.conn.data_to_send()))
        self.transport.close()


def impatient(
    limits: Limits, bodies: Places, strangers: Strangers, health_port: int | None = None
) -> tuple[type[asyncio.Protocol], type[asyncio.Protocol]]:
    """The classes for HTTP and for WebSockets with those limits; `bodies` are places for bytes under way."""
    own = {"patience_s": limits.patience_s, "strangers": strangers, "health_port": health_port}
    of_messages = {"patience_s": limits.patience_s, "message_s": limits.deadline_s, "bodies": bodies}
    return type("ImpatientHttp", (ImpatientHttp,), own), type("ImpatientSocket", (ImpatientSocket,), of_messages)
