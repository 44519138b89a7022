"""The service on an open network: TLS, strangers, wrong tokens, a port for health, tokens that change, its end."""

from __future__ import annotations

import signal
import ssl
import time
from contextlib import ExitStack, nullcontext
from pathlib import Path

import httpx
import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from clearway.errors import ClearwayError
from clearway.serve.attempts import Attempts
from clearway.serve.limits import Limits
from clearway.serve.run import check_tls
from clearway.serve.service import Service
from helpers.certificates import certified
from helpers.running import PATIENT_S, Running, running
from helpers.serving import OWNER, TOKEN, TOKENS, grey, until_closed
from helpers.sums import Sums, plain

AUTHORISED = {"authorization": f"Bearer {TOKEN}"}


def test_over_tls_an_episode_is_walked_and_plain_http_is_not_answered(tmp_path) -> None:
    certificate, key = certified(tmp_path)
    check_tls(certificate, key)
    with running(tls=(str(certificate), str(key))) as service:
        trusting = ssl.create_default_context(cafile=str(certificate))
        url = f"https://127.0.0.1:{service.port}"
        with httpx.Client(base_url=url, headers=AUTHORISED, verify=trusting, timeout=PATIENT_S) as http:
            session = http.post("/sessions", json={"selection": "argmax"}).json()["session_id"]
            kind = {"content-type": "image/png"}
            assert http.put(f"/sessions/{session}/target", content=grey(1), headers=kind).status_code == 204
            assert http.post(f"/sessions/{session}/steps", content=grey(2), headers=kind).json()["value"] == 1008
        with service.connected() as connection:
            connection.sendall(b"GET /health HTTP/1.1\r\nHost: x\r\n\r\n")
            assert b"200" not in until_closed(connection)
        with pytest.raises(httpx.ConnectError):
            httpx.get(f"{url}/health", timeout=PATIENT_S)  # an authority that nobody knows


@pytest.mark.slow
def test_handshakes_that_do_not_end_are_few_and_short(tmp_path) -> None:
    """Nobody was told of them: they stayed for a minute, as many as there were files."""
    files = tuple(map(str, certified(tmp_path)))
    for patience_s, gone in ((3.0, 30), (40.0, 20)):
        with running(tls=files, strangers=10, patience_s=patience_s) as service:
            held = [service.connected() for _ in range(30)]
            try:
                trusting = ssl.create_default_context(cafile=files[0])
                url = f"https://127.0.0.1:{service.port}/health"
                assert httpx.get(url, verify=trusting, timeout=PATIENT_S).status_code == 200
                begun = time.monotonic()
                for connection in held[:gone]:
                    until_closed(connection)
                assert time.monotonic() - begun < 20
                held[-1].setblocking(False)
                with pytest.raises(BlockingIOError) if gone < 30 else nullcontext():
                    held[-1].recv(1)
            finally:
                for connection in held:
                    connection.close()


def test_certificates_that_are_none(tmp_path) -> None:
    certificate, key = certified(tmp_path)
    (tmp_path / "other").mkdir()
    _, other = certified(tmp_path / "other")
    for first, second, part in (
        (certificate, None, "go together"),
        (None, key, "go together"),
        (certificate, tmp_path / "x", "no regular file"),
        (Path("/dev/zero"), key, "no regular file"),
        (key, key, "in PEM"),
        (certificate, other, "in PEM"),
    ):
        with pytest.raises(ClearwayError, match=part):
            check_tls(first, second)


@pytest.mark.slow
def test_strangers_keep_no_connection_and_not_many() -> None:
    """Idle ones after `GET /health`, as many as the service has, once kept everybody else out."""
    with running(patience_s=1.0, connections=40, strangers=10) as service:
        held = [service.connected() for _ in range(60)]
        try:
            for connection in held[-10:]:
                connection.sendall(b"GET /health HTTP/1.1\r\nHost: x\r\n\r\n")
                assert connection.recv(65536).startswith(b"HTTP/1.1 200")
            with service.client() as client:
                assert client.agent()["scene"] == "attic"
            for connection in held:
                until_closed(connection)  # within the patience, not the 75 s of those who have shown a token
        finally:
            for connection in held:
                connection.close()


@pytest.mark.slow
def test_one_name_leaves_connections_for_another(tmp_path) -> None:
    """Once its token was right, a client could keep as many as there were."""
    path, guest = tmp_path / "tokens", {"authorization": f"Bearer {20 * 'g'}"}
    path.write_text(f"{OWNER} {TOKEN}\nguest {20 * 'g'}\n")
    path.chmod(0o600)
    with ExitStack() as held, running(tokens=str(path), connections=8) as service:
        session = httpx.post(f"{service.url}/sessions", json={}, headers=AUTHORISED, timeout=PATIENT_S).json()
        stream = f"ws://127.0.0.1:{service.port}/sessions/{session['session_id']}/stream"
        held.enter_context(connect(stream, additional_headers=AUTHORISED, close_timeout=0.1))
        greedy = [held.enter_context(httpx.Client(headers=AUTHORISED, timeout=PATIENT_S)) for _ in range(4)]
        answers = [client.get(f"{service.url}/agent") for client in greedy]
        assert [answer.status_code for answer in answers] == [200, 200, 200, 503]
        assert "connections of this token" in answers[-1].text
        assert httpx.get(f"{service.url}/agent", headers=guest, timeout=PATIENT_S).status_code == 200
        greedy[0].close()
        until = time.monotonic() + PATIENT_S
        while greedy[3].get(f"{service.url}/agent").status_code != 200 and time.monotonic() < until:
            time.sleep(0.05)
        assert greedy[3].get(f"{service.url}/agent").status_code == 200


@pytest.mark.slow
def test_health_and_metrics_on_a_port_of_their_own() -> None:
    with running(health=True) as service:
        own = f"http://127.0.0.1:{service.health_port}"
        for path in ("/health", "/ready", "/metrics"):
            assert httpx.get(own + path, timeout=PATIENT_S).status_code == 200
            assert httpx.get(service.url + path, headers=AUTHORISED, timeout=PATIENT_S).status_code == 404
        assert httpx.get(f"{own}/agent", headers=AUTHORISED, timeout=PATIENT_S).status_code == 404
        assert httpx.get(f"{service.url}/agent", headers=AUTHORISED, timeout=PATIENT_S).status_code == 200
        session = httpx.post(f"{service.url}/sessions", json={}, headers=AUTHORISED, timeout=PATIENT_S).json()[
            "session_id"
        ]
        stream = f"ws://127.0.0.1:{{}}/sessions/{session}/stream"
        with connect(stream.format(service.port), additional_headers=AUTHORISED):
            pass
        with pytest.raises(InvalidStatus), connect(stream.format(service.health_port), additional_headers=AUTHORISED):
            pass


@pytest.mark.slow
@pytest.mark.parametrize("proxy", [None, "127.0.0.1"])
def test_who_asks_is_told_by_a_trusted_proxy_alone(proxy) -> None:
    """The fourth wrong token of an address is too many; a header makes it another address where it is believed."""
    with running(proxy=proxy, wrong_tokens=3) as service:
        codes = []
        for number in range(4):
            headers = {"authorization": "Bearer wrong", "x-forwarded-for": f"192.0.2.{number}"}
            codes.append(httpx.get(f"{service.url}/agent", headers=headers, timeout=PATIENT_S).status_code)
        assert codes == [401, 401, 401, 401 if proxy else 429]


def test_wrong_tokens_keep_out_nobody_whose_token_was_right_there(called) -> None:
    client = called(Service(Sums(), Limits(wrong_tokens=3), TOKENS), None)
    assert client.get("/agent", headers=AUTHORISED).status_code == 200
    wrong = {"authorization": "Bearer wrong"}
    answers = [client.get("/agent", headers=wrong) for _ in range(5)]
    assert [answer.status_code for answer in answers] == [401, 401, 401, 429, 429]
    assert answers[-1].json()["error"]["code"] == "too_many_attempts" and answers[-1].headers["retry-after"] == "60"
    assert client.get("/agent", headers=AUTHORISED).status_code == 200


def test_a_minute_forgives_wrong_tokens() -> None:
    now = [0.0]
    attempts = Attempts(2, lambda: now[0])
    for token in ("a", "b"):
        assert attempts.may_try("here", token)
        attempts.note("here", token, False)
    assert not attempts.may_try("here", "right") and attempts.may_try("there", "right")
    now[0] = 31.0
    assert attempts.may_try("here", "right")


@pytest.mark.slow
def test_hangup_reads_the_tokens_again_and_keeps_the_old_where_it_cannot(tmp_path) -> None:
    """Also where nohup has told the process to ignore it."""
    path, new = tmp_path / "tokens", 20 * "n"
    path.write_text(f"{OWNER} {TOKEN}\n")
    path.chmod(0o600)

    def status(service, token: str) -> int:
        headers = {"authorization": f"Bearer {token}"}
        return httpx.get(f"{service.url}/agent", headers=headers, timeout=PATIENT_S).status_code

    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with running(tokens=str(path), wrong_tokens=10_000) as service:
            assert (status(service, TOKEN), status(service, new)) == (200, 401)
            path.write_text(f"{OWNER} {new}\n")
            service.process.send_signal(signal.SIGHUP)
            until = time.monotonic() + PATIENT_S
            while status(service, new) != 200 and time.monotonic() < until:
                time.sleep(0.05)
            assert (status(service, TOKEN), status(service, new)) == (401, 200)
            path.write_text("nonsense\n")
            service.process.send_signal(signal.SIGHUP)
            assert status(service, new) == 200
            service.process.send_signal(signal.SIGTERM)
            _, err = service.process.communicate(timeout=PATIENT_S)
            assert "tokens were read again" in err and "the tokens stay as they were" in err and new not in err
    finally:
        signal.signal(signal.SIGHUP, before)


@pytest.mark.parametrize("replicas", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_hangup_reads_the_certificate_again_and_keeps_the_old_where_it_cannot(replicas: int, tmp_path: Path) -> None:
    """The new one has a key of another kind."""
    certificate, key = certified(tmp_path)

    def seen(service: Running) -> set[str]:
        """Of whichever replicas answer: of so many connections none meets one of two in 1 of 10 million cases."""
        looks = 24 * (replicas - 1) + 1
        return {ssl.get_server_certificate(("127.0.0.1", service.port), timeout=PATIENT_S) for _ in range(looks)}

    with running(tls=(str(certificate), str(key)), replicas=replicas) as service:
        first = seen(service)
        certified(tmp_path, ("rsa:2048",))
        service.process.send_signal(signal.SIGHUP)
        until = time.monotonic() + PATIENT_S
        while (second := seen(service)) & first and time.monotonic() < until:
            time.sleep(0.05)
        assert len(second) == 1 and second != first
        certificate.write_text("nothing")
        service.process.send_signal(signal.SIGHUP)
        time.sleep(0.2)
        assert seen(service) == second
        service.process.send_signal(signal.SIGTERM)
        _, err = service.process.communicate(timeout=PATIENT_S)
        assert "the certificate was read again" in err and "the one before is used on" in err


def test_a_body_is_counted_while_it_is_held_and_no_longer(called) -> None:
    service = Service(Sums(), Limits(bodies_bytes=1000), TOKENS)
    client = called(service)
    path = f"/sessions/{client.post('/sessions', json={}).json()['session_id']}/target"
    kind = {"content-type": "image/png"}
    for _ in range(3):
        assert client.put(path, content=bytes(2000), headers=kind).json()["error"]["code"] == "overloaded"
        assert client.put(path, content=grey(1), headers=kind).status_code == 204
    assert service.bodies.taken == 0


@pytest.mark.slow
def test_it_ends_in_time_whatever_is_under_way_and_tells_who_waits() -> None:
    with running(seconds=300, deadline_s=5.0, idle_s=60) as service, service.client() as client:
        session = client.session()
        with pytest.raises(Exception, match="deadline_passed"):
            session.set_target(plain(1))
        begun = time.monotonic()
        service.process.send_signal(signal.SIGTERM)
        service.process.wait(timeout=PATIENT_S)
        assert time.monotonic() - begun < PATIENT_S  # 5 s for a request, 4 s more; the rest is for a busy machine
