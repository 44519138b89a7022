"""Connections that do not wait for ever: for a request's headers, or for a client to read what was sent to it."""

from __future__ import annotations

import asyncio
import socket
import struct
from typing import Any

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol

KEEP_ALIVE_S = 75  # of an idle connection; longer than clients and proxies commonly keep theirs


def reset(transport: asyncio.Transport) -> None:
    """Cut a connection off and let the system forget what it still had to send, which it would else keep trying to."""
    plug = transport.get_extra_info("socket")
    if plug is not None and not transport.is_closing():
        plug.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    transport.abort()


class _Impatient(asyncio.Protocol):
    """Cuts a connection off whose client does not read; uvicorn would wait for it."""

    loop: asyncio.AbstractEventLoop
    transport: asyncio.Transport
    patience_s: float
    _unread: asyncio.TimerHandle | None = None

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

    _headers: asyncio.TimerHandle | None = None

    def connection_made(self, transport: Any) -> None:
        """Begin to wait for headers."""
        super().connection_made(transport)
        self._await_headers()

    def data_received(self, data: bytes) -> None:
        """Wait for the rest of headers, where these are not all."""
        super().data_received(data)
        between = self.conn.their_state is h11.IDLE and not self.transport.is_closing()
        if not between:
            self._have_headers()
        elif self._headers is None and self.conn.trailing_data[0]:
            self._await_headers()

    def connection_lost(self, exc: Exception | None) -> None:
        """Wait for nothing any more."""
        self._have_headers()
        super().connection_lost(exc)

    def handle_websocket_upgrade(self, event: h11.Request) -> None:
        """Leave the connection to the WebSocket's class."""
        self._have_headers()
        super().handle_websocket_upgrade(event)

    def timeout_keep_alive_handler(self) -> None:
        """Uvicorn calls it `patience_s` after an answer: who has left it unread is cut off, others may stay idle."""
        if self.transport.get_write_buffer_size():
            reset(self.transport)
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
    """A WebSocket whose client reads its answers within `patience_s`."""


def impatient(patience_s: float) -> tuple[type[asyncio.Protocol], type[asyncio.Protocol]]:
    """The classes for HTTP and for WebSockets with that patience."""
    return (
        type("ImpatientHttp", (ImpatientHttp,), {"patience_s": patience_s}),
        type("ImpatientSocket", (ImpatientSocket,), {"patience_s": patience_s}),
    )
