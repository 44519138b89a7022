"""Who answers for health while no replica does: their parent, at the port for health and metrics.

The service's own port answers nothing then: what comes there waits in line for the next replica.
"""

from __future__ import annotations

import logging
import math
import socket
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext, suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from multiprocessing.connection import wait

from clearway.serve.faults import Fault
from clearway.serve.hangup import on_hangup
from clearway.serve.run import Network

LOOKS_EVERY_S = 0.2
PATIENCE_S = 2.0  # with whoever asks, from the connection to its end
MOST_CONNECTIONS = 32  # at a time; what comes beyond is closed
NOBODY = "no replica answers. They are started, or started again where they have ended: see what the service prints"


@contextmanager
def standing_in(network: Network, anyone_answers: Callable[[], bool]) -> Iterator[None]:
    """Meanwhile, answer at the port for health with a refusal whenever nobody else answers.

    Its certificate is read again whenever that begins, and by SIGHUP.

    Args:
        network: how the service is reached; without a port for health nothing is done.
        anyone_answers: asked again and again.
    """
    if network.health is None:
        yield
        return
    ended = threading.Event()
    with _Server(network) as server:
        thread = threading.Thread(target=_stand_in, args=(server, anyone_answers, ended), daemon=True)
        thread.start()
        try:
            with nullcontext() if network.certificate is None else on_hangup(server.load_certificate):
                yield
        finally:
            ended.set()
            thread.join()


def _stand_in(server: _Server, anyone_answers: Callable[[], bool], ended: threading.Event) -> None:
    stands_in = False
    while not ended.is_set():
        if anyone_answers():
            stands_in = False
            ended.wait(LOOKS_EVERY_S)
        else:
            if not stands_in:
                server.load_certificate()
            stands_in = True
            wait([server.socket], LOOKS_EVERY_S)
            server.handle_request()
        server.hang_up(before_s=time.monotonic())
    server.hang_up()


class _Server(ThreadingHTTPServer):
    """Accepts from a listening socket that others accept from, too; at most `MOST_CONNECTIONS` at a time."""

    def __init__(self, network: Network) -> None:
        assert network.health is not None
        super().__init__(network.health.getsockname()[:2], _Refusal, bind_and_activate=False)
        self.socket.close()
        self.socket = network.health.dup()
        self.socket.setblocking(
            False
        )  # a replica may have taken what was to be accepted: `handle_request` waits for none
        self._network = network
        self._tls = network.tls()
        self._open: dict[socket.socket, float] = {}  # second handles of connections, and when each is to be over
        self._held = threading.Lock()  # of what is open

    def load_certificate(self) -> None:
        """Read it anew: it may have been renewed since."""
        try:
            self._tls = self._network.tls()
        except OSError as fault:  # ssl.SSLError is one
            log = logging.getLogger("clearway.serve")
            log.error("%s: %s; the one before is used on", self._network.certificate, fault.strerror or fault)

    def hang_up(self, before_s: float = math.inf) -> None:
        """End connections that are to be over by then, whatever their threads wait for."""
        with self._held:
            late = [connection for connection, over_s in self._open.items() if over_s <= before_s]
            for connection in late:
                with suppress(OSError):  # the other side has ended it
                    connection.shutdown(socket.SHUT_RDWR)

    def verify_request(self, request: socket.socket | tuple[bytes, socket.socket], client_address: object) -> bool:
        """Whether there is a place for it."""
        return len(self._open) < MOST_CONNECTIONS

    def process_request(self, request: socket.socket | tuple[bytes, socket.socket], client_address: object) -> None:
        """Answer in a thread of its own."""
        assert isinstance(request, socket.socket)
        connection = request.dup()  # TLS takes the first handle
        with self._held:
            self._open[connection] = time.monotonic() + PATIENCE_S
        thread = threading.Thread(target=self._answer, args=(request, client_address, connection), daemon=True)
        try:
            thread.start()
        except RuntimeError:  # the system has no more of them
            self._forget(connection)
            raise

    def _answer(self, request: socket.socket, client_address: object, connection: socket.socket) -> None:
        try:
            self.process_request_thread(request, client_address)
        finally:
            self._forget(connection)

    def _forget(self, connection: socket.socket) -> None:
        with self._held:
            del self._open[connection]
            connection.close()

    def finish_request(self, request: socket.socket | tuple[bytes, socket.socket], client_address: object) -> None:
        """Answer."""
        assert isinstance(request, socket.socket)
        request.settimeout(PATIENCE_S)
        if self._tls is None:
            return super().finish_request(request, client_address)
        with self._tls.wrap_socket(request, server_side=True) as encrypted:
            super().finish_request(encrypted, client_address)

    def handle_error(self, request: object, client_address: object) -> None:
        """Whoever asks may leave, be slow, or speak another protocol; all else is told."""
        if not isinstance(sys.exc_info()[1], OSError):
            super().handle_error(request, client_address)  # type: ignore[arg-type]


class _Refusal(BaseHTTPRequestHandler):
    """Refuses every request."""

    timeout = PATIENCE_S
    server_version, sys_version = "clearway", ""

    def do_GET(self) -> None:
        """Say that nobody answers."""
        fault = Fault("overloaded", NOBODY)
        body = fault.body()
        self.send_response(fault.status)
        for name, value in {**fault.headers(), "content-length": str(len(body)), "connection": "close"}.items():
            self.send_header(name, value)
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(body)

    do_HEAD = do_POST = do_GET

    def log_message(self, format: str, *words: object) -> None:
        """Nothing: health is asked for every few seconds."""
