import os
import signal
import socket
import subprocess
import sys
from pathlib import Path
from urllib.request import urlopen

import pytest

import clearway as package
from clearway.errors import ClearwayError
from clearway.web.local import listening, port_of

ENVIRONMENT = {**os.environ, "PYTHONPATH": str(Path(package.__file__).parents[1])}
SERVICE = """
from clearway.web.local import listening, port_of, serve

async def app(scope, receive, send):
    await send({"type": "http.response.start", "status": 200, "headers": [(b"content-length", b"2")]})
    await send({"type": "http.response.body", "body": b"ok"})

listener = listening(0)
print(port_of(listener), flush=True)
serve(app, listener)
print("ended", flush=True)
"""


def test_any_free_port_is_on_the_loopback_address() -> None:
    with listening(0) as listener:
        assert listener.getsockname()[0] == "127.0.0.1"
        assert port_of(listener) > 0
        with socket.create_connection(("127.0.0.1", port_of(listener)), timeout=10):
            accepted, _ = listener.accept()  # it waited in line
        with accepted:
            assert accepted.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)  # no answer waits for another's receipt


def test_a_port_that_is_taken_is_refused() -> None:
    with listening(0) as listener:
        with pytest.raises(ClearwayError, match=rf"--port {port_of(listener)}: .*in use"):
            listening(port_of(listener))


@pytest.mark.parametrize("port", [-1, 65_536])
def test_what_is_no_port_is_refused(port: int) -> None:
    with pytest.raises(ClearwayError, match=f"--port is {port}, expected 0 to 65535"):
        listening(port)


def test_a_host_without_a_name_is_refused() -> None:
    """To the system it is every network interface."""
    for host in ("", " "):
        with pytest.raises(ClearwayError, match="--host is empty, expected an address"):
            listening(0, host)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_service_ends_cleanly_when_told_to(number: signal.Signals) -> None:
    command = [sys.executable, "-c", SERVICE]
    with subprocess.Popen(
        command, env=ENVIRONMENT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        port = int(process.stdout.readline())
        with urlopen(f"http://127.0.0.1:{port}/", timeout=30) as answer:
            assert answer.read() == b"ok"
        process.send_signal(number)
        out, err = process.communicate(timeout=30)
    assert (process.returncode, out, err) == (0, "ended\n", "")
