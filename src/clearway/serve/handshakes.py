"""Connections whose TLS is not agreed on yet: asyncio tells no protocol of them, and lets them be for a minute."""

from __future__ import annotations

import asyncio
import socket
from contextlib import suppress
from typing import Any

from clearway.serve.addresses import counted_as


class Handshakes:
    """Keeps those connections few for each address, see `counted_as`, and short.

    Args:
        most: of an address; the oldest makes room for the next.
        patience_s: for a handshake.
        trusted: the address of a proxy, behind which all clients are; None: no such.
    """

    def __init__(self, most: int, patience_s: float, trusted: str | None) -> None:
        self._most, self._patience_s, self._trusted = most, patience_s, trusted
        self._open: dict[str, list[socket.socket]] = {}

    def begin(self, plug: socket.socket, address: str) -> None:
        """Count a connection that was just taken; call it from the event loop."""
        is_trusted, address = address == self._trusted, counted_as(address)
        open_ones = [other for other in self._open.get(address, []) if other.fileno() >= 0]
        self._open[address] = [*open_ones, plug]
        if len(open_ones) >= self._most and not is_trusted:
            self._end(open_ones[0], address)
        asyncio.get_running_loop().call_later(self._patience_s, self._end, plug, address)

    def done(self, number: int, address: str) -> None:
        """Count a connection no more, by the number of its file."""
        address = counted_as(address)
        self._keep(address, [plug for plug in self._open.get(address, []) if plug.fileno() not in (number, -1)])

    def _end(self, plug: socket.socket, address: str) -> None:
        """Let the handshake fail, if it is under way."""
        waiting = self._open.get(address, [])
        if plug not in waiting:
            return
        with suppress(OSError):  # the other side was faster
            plug.shutdown(socket.SHUT_RDWR)
        self._keep(address, [other for other in waiting if other is not plug])

    def _keep(self, address: str, waiting: list[socket.socket]) -> None:
        self._open[address] = waiting
        if not waiting:
            del self._open[address]


class Door(socket.socket):
    """A listener that tells `handshakes` of every connection.

    Args:
        listener: is taken over.
        handshakes: is told.
    """

    def __init__(self, listener: socket.socket, handshakes: Handshakes) -> None:
        super().__init__(listener.family, listener.type, listener.proto, listener.detach())
        self._handshakes = handshakes

    def accept(self) -> tuple[socket.socket, Any]:
        """The next connection, and its address."""
        plug, address = super().accept()
        self._handshakes.begin(plug, address[0])
        return plug, address
