"""Tokens that are taken back while their connections are open."""

from __future__ import annotations

import signal
import time
from contextlib import ExitStack
from pathlib import Path
from unittest.mock import Mock

import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from clearway.serve.admitted import Admitted
from clearway.serve.tokens import Tokens
from helpers.running import PATIENT_S, running
from helpers.serving import OWNER, TOKEN, grey, until_closed

GUEST, OTHER = 20 * "g", 20 * "o"
REQUEST = "GET /agent HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer {}\r\n\r\n"


@pytest.mark.slow
def test_streams_and_idle_connections_end_with_their_token_and_others_go_on(tmp_path: Path) -> None:
    """They went on for as long as they were used. A name's other token keeps its own."""
    path = tmp_path / "tokens"
    path.touch(0o600)
    path.write_text(f"{OWNER} {TOKEN}\n{OWNER} {OTHER}\nguest {GUEST}\n")
    with ExitStack() as held, running(tokens=str(path)) as service:
        session = held.enter_context(service.client()).session().session_id
        address = f"ws://127.0.0.1:{service.port}/sessions/{session}/stream"
        gone, stays = (
            held.enter_context(connect(address, additional_headers={"authorization": f"Bearer {token}"}))
            for token in (TOKEN, OTHER)
        )
        idle = held.enter_context(service.connected())
        idle.sendall(REQUEST.format(GUEST).encode())
        assert idle.recv(65536).startswith(b"HTTP/1.1 200")
        path.write_text(f"{OWNER} {OTHER}\n")
        service.process.send_signal(signal.SIGHUP)
        begun = time.monotonic()
        with pytest.raises(ConnectionClosed) as closed:
            gone.recv(timeout=PATIENT_S)
        assert closed.value.rcvd is not None
        assert (closed.value.rcvd.code, closed.value.rcvd.reason) == (1008, "the token is no longer taken")
        until_closed(idle)
        assert time.monotonic() - begun < PATIENT_S / 2  # not the 75 s of who has shown a token
        stays.send(grey(1))
        assert "no_target" in str(stays.recv(timeout=PATIENT_S))
        service.process.send_signal(signal.SIGTERM)
        assert "Traceback" not in service.process.communicate(timeout=PATIENT_S)[1]


@pytest.mark.slow
def test_an_answer_under_way_to_a_token_that_is_taken_back_is_not_sent(tmp_path: Path) -> None:
    path = tmp_path / "tokens"
    path.touch(0o600)
    path.write_text(f"{OWNER} {TOKEN}\nguest {GUEST}\n")
    with running(tokens=str(path), seconds=4.0) as service, service.client() as client:
        session = client.session()
        session.set_target(grey(1))
        address = f"ws://127.0.0.1:{service.port}/sessions/{session.session_id}/stream"
        with connect(address, additional_headers={"authorization": f"Bearer {TOKEN}"}) as stream:
            stream.send(grey(2))
            time.sleep(0.5)
            path.write_text(f"guest {GUEST}\n")
            service.process.send_signal(signal.SIGHUP)
            with pytest.raises(ConnectionClosed) as closed:
                stream.recv(timeout=PATIENT_S)
            assert closed.value.rcvd is not None and closed.value.rcvd.code == 1008
        time.sleep(4.5)  # until its answer is there
        service.process.send_signal(signal.SIGTERM)
        err = service.process.communicate(timeout=PATIENT_S)[1]
        assert "Traceback" not in err and "a stream failed" not in err


def test_a_token_taken_back_between_its_check_and_its_connection_is_noticed() -> None:
    tokens, connection = Tokens([(OWNER, TOKEN)]), Mock()
    admitted = Admitted(tokens)
    tokens.replace(Tokens([("guest", GUEST)]))
    admitted.add(connection, OWNER, TOKEN)
    (look,) = connection.loop.call_soon_threadsafe.call_args.args
    look()
    connection.revoke.assert_called_once()


def test_a_connection_that_cannot_be_ended_keeps_no_other_open() -> None:
    admitted = Admitted(Mock(has=lambda owner, token: False))
    broken, other = Mock(revoke=Mock(side_effect=OSError("gone"))), Mock()
    for connection in (other, broken):
        admitted.add(connection, OWNER, TOKEN)
    with pytest.raises(OSError, match="gone"):
        admitted._look()
    broken.revoke.assert_called_once_with()
    other.revoke.assert_called_once_with()
