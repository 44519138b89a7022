"""Who answers for health while no replica does: their parent, at the port for health and metrics.

The service's own port answers nothing then: what comes there waits in line for the next replica.
"""

from __future__ import annotations

import socket
import ssl
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

from clearway.serve.faults import Fault
from clearway.serve.run import Network

LOOKS_EVERY_S = 0.2
PATIENCE_S = 2.0  # with whoever asks
NOBODY = "no replica answers. They are started, or started again where they have ended: see what the service prints"


@contextmanager
def standing_in(network: Network, anyone_answers: Callable[[], bool]) -> Iterator[None]:
    """Meanwhile, answer at the port for health with a refusal whenever nobody else answers.

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
            yield
        finally:
            ended.set()
            thread.join()


def _stand_in(server: _Server, anyone_answers: Callable[[], bool], ended: threading.Event) -> None:
    while not ended.is_set():
        if anyone_answers():
            ended.wait(LOOKS_EVERY_S)
        else:
            server.handle_request()


class _Server(ThreadingHTTPServer):
    """Accepts from a listening socket that others accept from, too."""

    daemon_threads = True
    timeout = LOOKS_EVERY_S  # of `handle_request`

    def __init__(self, network: Network) -> None:
        assert network.health is not None
        super().__init__(network.health.getsockname()[:2], _Refusal, bind_and_activate=False)
        self.socket.close()
        self.socket = network.health.dup()
        self.socket.setblocking(False)  # a replica may have taken what was to be accepted
        self._tls = None
        if network.certificate is not None:
            self._tls = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
            self._tls.load_cert_chain(network.certificate, network.key)

    def finish_request(self, request: socket.socket | tuple[bytes, socket.socket], client_address: object) -> None:
        """Answer, in a thread of its own."""
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
