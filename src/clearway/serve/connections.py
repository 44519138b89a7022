"""Connections that do not wait for ever: for a request's headers, or for a client to read what was sent to it.

Before a right token has come, they are few for each address and stay open for a short time. After it they take places
of its owner's.
"""

from __future__ import annotations

import asyncio
import socket
import struct
from typing import Any

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

from clearway.serve.addresses import counted_as
from clearway.serve.admitted import Admitted
from clearway.serve.handshakes import Handshakes
from clearway.serve.shares import Places
from clearway.serve.tokens import KNOWN

KEEP_ALIVE_S = 75  # of an idle connection; longer than clients and proxies commonly keep theirs


def reset(transport: asyncio.Transport) -> None:
    """Cut a connection off and let the system forget what it still had to send, which it would else keep trying to."""
    plug = None if transport.is_closing() else transport.get_extra_info("socket")  # of TLS, closed twice, knows nothing
    if plug is not None:
        plug.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    if getattr(transport, "_ssl_protocol", transport) is not None:  # closed twice: early 3.11 cannot abort what is gone
        transport.abort()


class Strangers:
    """Connections on which no right token has come yet, by address, see `counted_as`.

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
        found = self._open.setdefault(counted_as(connection.address), {})
        found[connection] = None
        oldest = next((other for other in found if other.owner is None), None)
        if len(found) > self._most and oldest is not None:
            reset(oldest.transport)
            self.remove(oldest)

    def remove(self, connection: ImpatientHttp) -> None:
        """Count it no more: it is closed, or a right token has come."""
        address = counted_as(connection.address)
        found = self._open.get(address, {})
        found.pop(connection, None)
        if not found:
            self._open.pop(address, None)


class Impatient(asyncio.Protocol):
    """Cuts a connection off whose client does not read; uvicorn would wait for it.

    Every request's scope has `become_known` in its state, under `KNOWN`.
    """

    loop: asyncio.AbstractEventLoop
    transport: asyncio.Transport
    app_state: dict[str, Any]
    patience_s: float
    places: Places
    admitted: Admitted
    owner: str | None = None  # once a right token has come
    _unread: asyncio.TimerHandle | None = None

    def connection_made(self, transport: Any) -> None:
        """Be told as soon as the client leaves anything unread that the system does not hold."""
        super().connection_made(transport)
        transport.set_write_buffer_limits(1)  # asyncio's TLS takes 0 for always too much
        self.app_state = {**self.app_state, KNOWN: self.become_known}

    def become_known(self, owner: str, token: str) -> bool:
        """Take a place for the connection once a right token has come; False where its owner has too many."""
        if self.owner is None and self.places.take(owner):
            self.owner = owner
        if self.owner is not None:
            self.admitted.add(self, owner, token)
        return self.owner is not None

    def revoke(self) -> None:
        """End the connection, whose token is taken back."""
        raise NotImplementedError

    def pause_writing(self) -> None:
        """Begin to wait for the client to read."""
        super().pause_writing()
        self._unread = self.loop.call_later(self.patience_s, reset, self.transport)

    def resume_writing(self) -> None:
        """The client has read."""
        self._stop_waiting()
        super().resume_writing()

    def connection_lost(self, exc: Exception | None) -> None:
        """Wait for nothing, and hold no place any more."""
        self._stop_waiting()
        self._give_place_back()
        super().connection_lost(exc)

    def _give_place_back(self) -> None:
        self.admitted.remove(self)
        if self.owner is not None:
            self.places.free(self.owner)
            self.owner = None

    def _stop_waiting(self) -> None:
        if self._unread is not None:
            self._unread.cancel()
            self._unread = None


class ImpatientHttp(Impatient, H11Protocol):
    """HTTP/1.1 whose clients send a request's headers, and read its answer, within `patience_s`."""

    strangers: Strangers
    handshakes: Handshakes
    health_port: int | None = None
    address = ""
    _headers: asyncio.TimerHandle | None = None

    def connection_made(self, transport: Any) -> None:
        """Begin to wait for headers."""
        super().connection_made(transport)
        self.address = self.client[0] if self.client else ""
        self.handshakes.done(transport.get_extra_info("socket").fileno(), self.address)
        if self.health_port is not None and self.server is not None and self.server[1] == self.health_port:
            self.limit_concurrency = None  # whoever watches the service is answered however busy it is
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

    def become_known(self, owner: str, token: str) -> bool:
        """Be no stranger any more, where there is a place."""
        known = super().become_known(owner, token)
        if known:
            self.strangers.remove(self)
        return known

    def revoke(self) -> None:
        """End the connection; a request that is under way is answered before."""
        if not self.transport.is_closing():
            self.shutdown()

    def connection_lost(self, exc: Exception | None) -> None:
        """Wait for nothing any more."""
        self._have_headers()
        self.strangers.remove(self)
        super().connection_lost(exc)

    def handle_websocket_upgrade(self, event: h11.Request) -> None:
        """Leave the connection to the WebSocket's class."""
        self._have_headers()
        self.strangers.remove(self)
        self._give_place_back()
        super().handle_websocket_upgrade(event)

    def timeout_keep_alive_handler(self) -> None:
        """Uvicorn calls it `patience_s` after an answer: who has left it unread is cut off, owners may stay idle."""
        if self.transport.is_closing() or self.transport.get_write_buffer_size():
            reset(self.transport)
        elif self.owner is None:
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
