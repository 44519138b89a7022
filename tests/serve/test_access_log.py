"""A line for every answer, and not too many."""

import json
import logging
import signal

import httpx

from clearway.serve.access_log import AccessLog, Sampled, Sparing
from helpers.running import PATIENT_S, running
from helpers.serving import OWNER, TOKEN


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
