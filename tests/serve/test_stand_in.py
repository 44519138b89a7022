"""Who answers for health while no replica does."""

from __future__ import annotations

import os
import signal
import socket
import ssl
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

import httpx
import pytest

from clearway.serve import stand_in
from clearway.serve.replica import Beats
from clearway.serve.run import Network
from clearway.serve.stand_in import LOOKS_EVERY_S, MOST_CONNECTIONS, standing_in
from clearway.web.local import listening, port_of
from helpers.certificates import certified
from helpers.running import PATIENT_S

LATE_S = 1.0  # beyond what is promised, on a machine that has other things to do


@contextmanager
def nobody_answers(certificate: tuple[Path | None, Path | None] = (None, None)) -> Iterator[tuple[str, int]]:
    """Address at which the stand-in answers."""
    with listening(0) as listener, listening(0) as health:
        with standing_in(Network(listener, health, *certificate), lambda: False):
            yield "127.0.0.1", port_of(health)


def is_closed(connection: socket.socket, within_s: float) -> bool:
    connection.settimeout(within_s)
    try:
        return connection.recv(1) == b""
    except ConnectionResetError:
        return True
    except TimeoutError:
        return False


@pytest.mark.parametrize("encrypted", [False, True], ids=["http", "https"])
def test_their_parent_says_at_the_port_for_health_that_none_answers(tmp_path: Path, encrypted: bool) -> None:
    certificate = certified(tmp_path) if encrypted else (None, None)
    beats, scheme = Beats([0.0, 0.0, 0.0, 0.0]), "https" if encrypted else "http"
    with listening(0) as listener, listening(0) as health, httpx.Client(verify=False, timeout=PATIENT_S) as client:
        url = f"{scheme}://127.0.0.1:{port_of(health)}"
        with standing_in(Network(listener, health, *certificate), beats.any_fresh):
            for path in ("/ready", "/health", "/metrics"):
                answer = client.get(url + path)
                assert (answer.status_code, answer.json()["error"]["code"]) == (503, "overloaded")
                assert "no replica answers" in answer.json()["error"]["message"]
            with socket.create_connection(("127.0.0.1", port_of(health))):  # says nothing, and holds up nobody
                assert client.get(url + "/ready").status_code == 503
            beats.beat(1, False)  # from now on a replica answers for itself
            time.sleep(2 * LOOKS_EVERY_S)
            with pytest.raises(httpx.ReadTimeout):
                httpx.get(f"http://127.0.0.1:{port_of(health)}/ready", timeout=0.5)


def test_so_many_connections_have_a_thread_and_others_are_closed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stand_in, "PATIENCE_S", 1.5)
    before = threading.active_count()
    with nobody_answers() as address, ExitStack() as connections:
        idle = [connections.enter_context(socket.create_connection(address)) for _ in range(MOST_CONNECTIONS + 8)]
        assert all(is_closed(connection, PATIENT_S) for connection in idle[MOST_CONNECTIONS:])
        assert threading.active_count() <= before + 1 + MOST_CONNECTIONS
        assert not is_closed(idle[0], 0.01)
        assert all(is_closed(connection, PATIENT_S) for connection in idle[:MOST_CONNECTIONS])
        answer = httpx.get(f"http://{address[0]}:{address[1]}/ready", timeout=PATIENT_S)
        assert answer.status_code == 503


@pytest.mark.parametrize("encrypted", [False, True], ids=["http", "https"])
def test_who_says_a_little_now_and_then_is_not_listened_to_for_ever(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, encrypted: bool
) -> None:
    monkeypatch.setattr(stand_in, "PATIENCE_S", 0.5)
    with nobody_answers(certified(tmp_path) if encrypted else (None, None)) as address:
        with socket.create_connection(address) as plain:
            connection = trusting().wrap_socket(plain) if encrypted else plain
            begun = time.monotonic()
            while not is_closed(connection, 0.1):
                with suppress(BrokenPipeError, ConnectionResetError):  # the next look finds it closed
                    connection.sendall(b"G")
                assert time.monotonic() - begun < 0.5 + LOOKS_EVERY_S + LATE_S
            connection.close()


def trusting() -> ssl.SSLContext:
    """Of a client that takes any certificate."""
    context = ssl.create_default_context()
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    return context


def test_a_certificate_that_was_renewed_is_used_and_one_that_is_damaged_is_not(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    certificate, key = certified(tmp_path)
    beats, seen = Beats([0.0, 0.0]), []
    with listening(0) as listener, listening(0) as health:
        with standing_in(Network(listener, health, certificate, key), beats.any_fresh):
            for change in (lambda: None, lambda: certified(tmp_path), lambda: certificate.write_text("nothing")):
                beats.beat(0, True)
                time.sleep(2 * LOOKS_EVERY_S)
                change()
                beats.forget(0)
                seen.append(ssl.get_server_certificate(("127.0.0.1", port_of(health)), timeout=PATIENT_S))
    assert seen[0] != seen[1] == seen[2]
    assert [record.levelname for record in caplog.records] == ["ERROR"]
    assert "cert.pem" in caplog.text and "the one before is used on" in caplog.text


def test_hangup_reads_the_certificate_again_while_it_stands_in(tmp_path: Path) -> None:
    with nobody_answers(certified(tmp_path)) as address:
        first = ssl.get_server_certificate(address, timeout=PATIENT_S)
        certified(tmp_path)
        os.kill(os.getpid(), signal.SIGHUP)
        assert ssl.get_server_certificate(address, timeout=PATIENT_S) != first


def test_waiting_takes_no_processor() -> None:
    with nobody_answers():
        before = time.process_time()
        time.sleep(0.5)
        assert time.process_time() - before < 0.25
