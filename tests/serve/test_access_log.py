"""A line for every answer, and not too many."""

import json
import logging
import signal

import httpx
import numpy as np
import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from clearway.serve.access_log import AccessLog, Sampled, Sparing
from helpers.running import PATIENT_S, running
from helpers.serving import OWNER, TOKEN, grey


def test_too_many_in_a_second_are_left_out_and_counted() -> None:
    now, lines = [0.0], []
    log = AccessLog(lines.append, Sampled(3, lambda: now[0]))
    for _ in range(10):
        log.note("192.0.2.1", None, None, "unknown", 401, 0.001)
    now[0] = 1.0
    log.note("192.0.2.1", "robot", "a-session-that-nobody-guesses", "/sessions/{session_id}", 204, 0.5)
    said = [json.loads(line) for line in lines]
    assert [each["skipped"] for each in said] == [0, 0, 0, 7]
    assert (said[-1]["owner"], said[-1]["session"], said[-1]["status"]) == ("robot", "a-sessio", 204)


def test_warnings_that_strangers_cause_are_few() -> None:
    sparing = Sparing()
    records = [logging.LogRecord("uvicorn.error", 30, "", 0, "Invalid %s", ("request",), None) for _ in range(5)]
    assert [sparing.filter(record) for record in records] == [True, False, False, False, False]


@pytest.mark.slow
def test_a_service_writes_who_asked_for_what_and_never_the_token() -> None:
    with running(log=True) as service:
        headers = {"authorization": f"Bearer {TOKEN}"}
        for path in ("/agent", "/nowhere"):
            httpx.get(service.url + path, headers=headers, timeout=PATIENT_S)
        httpx.get(f"{service.url}/agent", timeout=PATIENT_S)
        service.process.send_signal(signal.SIGTERM)
        _, err = service.process.communicate(timeout=PATIENT_S)
    said = [json.loads(line) for line in err.splitlines()]
    found = [(each["address"], each["owner"], each["route"], each["status"]) for each in said]
    expected = [("/agent", 200, OWNER), ("unknown", 404, OWNER), ("unknown", 401, None)]
    assert found == [("127.0.0.1", owner, route, status) for route, status, owner in expected]
    assert all(each["time"].startswith("20") and each["seconds"] >= 0 for each in said) and TOKEN not in err


@pytest.mark.slow
def test_handshakes_steps_and_ends_of_streams_have_lines_too() -> None:
    """They once had none: what came by a WebSocket was not to be seen."""
    with running(log=True) as service, service.client() as client:
        session = client.session()
        stream = f"ws://127.0.0.1:{service.port}/sessions/{session.session_id}/stream"
        bearing = {"authorization": f"Bearer {TOKEN}"}
        for address, headers in ((stream, {}), (stream.replace("stream", "x"), bearing)):
            with pytest.raises(InvalidStatus), connect(address, additional_headers=headers):
                pass
        with connect(stream, additional_headers=bearing) as socket:
            for level in (1, 2):
                socket.send(grey(level))
                socket.recv(timeout=PATIENT_S)
                session.set_target(np.zeros((6, 8, 3), np.uint8))
            socket.send("no picture")
            socket.recv(timeout=PATIENT_S)
        metrics = httpx.get(f"{service.url}/metrics", headers=bearing, timeout=PATIENT_S).text
        service.process.send_signal(signal.SIGTERM)
        _, err = service.process.communicate(timeout=PATIENT_S)
    route = "/sessions/{session_id}/stream"
    said = [each for each in map(json.loads, err.splitlines()) if each["route"] in (route, "unknown")]
    found = [(each["status"], each["owner"], each["session"]) for each in said]
    known = (OWNER, session.session_id[:8])
    steps = [(status, *known) for status in (101, 409, 200, 422, 1000)]
    assert found == [(401, None, None), (403, OWNER, None), *steps]
    assert f'clearway_requests_total{{route="{route}",status="200"}} 1.0' in metrics and TOKEN not in err
