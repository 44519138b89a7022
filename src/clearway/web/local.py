"""A service on this machine's loopback address, from start to a clean end. Needs the extra `view`."""

from __future__ import annotations

import signal
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from clearway.errors import ClearwayError
from clearway.web.guard import Application

try:
    import uvicorn
except ImportError as error:
    raise ClearwayError("a local page needs uvicorn. Install it: pip install 'clearway[view]'") from error

LOOPBACK = "127.0.0.1"
GRACE_S = 5  # for requests under way when the service is told to end
LARGEST_MESSAGE_BYTES = 64 * 1024  # that a WebSocket takes
MOST_PORT = 65_535


def listening(port: int) -> socket.socket:
    """A socket on the loopback address; from here on connections wait in line.

    Args:
        port: 0 for any that is free.

    Raises:
        ClearwayError: the port is none, is taken or is not allowed.
    """
    if not 0 <= port <= MOST_PORT:
        raise ClearwayError(f"--port is {port}, expected 0 to {MOST_PORT}. Give a port in that range")
    try:
        return socket.create_server((LOOPBACK, port))
    except OSError as error:
        raise ClearwayError(f"--port {port}: {error.strerror}. Give another, or leave it out") from error


def port_of(listener: socket.socket) -> int:
    """The port that a socket listens on."""
    return int(listener.getsockname()[1])


def serve(app: Application, listener: socket.socket) -> None:
    """Answer until the process is interrupted or told to end (SIGINT, SIGTERM); what is under way gets a few seconds.

    Args:
        app: what answers.
        listener: from `listening`; closed at the end.
    """
    config = uvicorn.Config(
        app,
        log_level="warning",
        access_log=False,  # its lines would hold the token
        lifespan="off",
        server_header=False,
        timeout_graceful_shutdown=GRACE_S,
        ws_max_size=LARGEST_MESSAGE_BYTES,
    )
    with listener, _ending_quietly():
        uvicorn.Server(config).run(sockets=[listener])


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
