"""A service on this machine's loopback address, from start to a clean end. Needs the extra `view` or `serve`."""

from __future__ import annotations

import ipaddress
import os
import signal
import socket
import ssl
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from types import FrameType
from typing import Any

from clearway.errors import ClearwayError, install_hint
from clearway.web.guard import Application

try:
    import uvicorn
except ImportError as error:
    raise ClearwayError(f"a local service needs uvicorn. {install_hint('view')}, or with serve") from error

LOOPBACK = "127.0.0.1"
GRACE_S = 5  # for requests under way when the service is told to end
LARGEST_MESSAGE_BYTES = 64 * 1024  # that a WebSocket takes
MOST_PORT = 65_535
ENDED_LATE = 70  # exit code where something under way did not end (EX_SOFTWARE of sysexits.h)
LATE_S = 3  # after the grace


def listening(port: int, host: str = LOOPBACK, which: str = "") -> socket.socket:
    """A socket on the loopback address, or on another one; from here on connections wait in line.

    Args:
        port: 0 for any that is free.
        host: address or name of a network interface of this machine.
        which: stands before `port` and `host` in the names of their options.

    Raises:
        ClearwayError: the port is none, is taken or is not allowed, or the address is not this machine's.
    """
    if not 0 <= port <= MOST_PORT:
        raise ClearwayError(f"--{which}port is {port}, expected 0 to {MOST_PORT}. Give a port in that range")
    if not host.strip():  # to the system: every network interface
        raise ClearwayError(f"--{which}host is empty, expected an address. Leave it out, for this machine alone")
    where = f"--{which}port {port}" if host == LOOPBACK else f"--{which}host {host} --{which}port {port}"
    try:
        listener = socket.create_server((host, port), family=socket.AF_INET6 if ":" in host else socket.AF_INET)
    except (OSError, UnicodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "no name of a host"
        raise ClearwayError(f"{where}: {reason}. Give another, or leave it out") from error
    # Connections inherit it; asyncio sets it where it makes the socket. Without it, answers wait 40 ms for each other.
    listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return listener


def port_of(listener: socket.socket) -> int:
    """The port that a socket listens on."""
    return int(listener.getsockname()[1])


def address_of(listener: socket.socket, host: str = LOOPBACK, scheme: str = "http") -> str:
    """The address of a service by the host that it was asked to listen on, as a browser takes it, without a path."""
    name = f"[{host}]" if ":" in host else host
    return f"{scheme}://{name}:{port_of(listener)}"


def is_loopback(listener: socket.socket) -> bool:
    """Whether only this machine reaches a socket."""
    return ipaddress.ip_address(listener.getsockname()[0]).is_loopback


class _Server(uvicorn.Server):
    """Ends for certain once it is told to: `LATE_S` after the grace the process ends, whatever is under way."""

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        super().handle_exit(sig, frame)
        grace = self.config.timeout_graceful_shutdown or 0
        late = threading.Timer(grace + LATE_S, os._exit, (ENDED_LATE,))
        late.daemon = True
        late.start()


def serve(app: Application, *listeners: socket.socket, tls: ssl.SSLContext | None = None, **settings: Any) -> None:
    """Answer until the process is interrupted or told to end (SIGINT, SIGTERM); what is under way gets a few seconds.

    Args:
        app: what answers.
        listeners: from `listening`; closed at the end.
        tls: encrypts connections; None: nothing does.
        settings: of `uvicorn.Config`, where a service needs others.
    """
    ours: dict[str, Any] = {
        "log_level": "warning",
        "access_log": False,  # its lines would hold the token
        "lifespan": "off",
        "server_header": False,
        "timeout_graceful_shutdown": GRACE_S,
        "ws_max_size": LARGEST_MESSAGE_BYTES,
    }
    config = uvicorn.Config(app, **(ours | settings))
    config.load()
    config.ssl = tls
    with ExitStack() as open_ones, _ending_quietly():
        for listener in listeners:
            open_ones.enter_context(listener)
        _Server(config).run(sockets=list(listeners))


@contextmanager
def _ending_quietly() -> Iterator[None]:
    """Uvicorn raises the signal that ended it once more; here that is the end that was asked for, not a failure."""

    def ignore(number: int, frame: FrameType | None) -> None:
        pass

    before = {number: signal.signal(number, ignore) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
