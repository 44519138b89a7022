"""Several replicas of the service at one address: they die, sessions go on."""

from __future__ import annotations

import os
import random
import signal
import threading
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import httpx
import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from clearway.children import ChildProcess
from clearway.deploy.navigator import open_agent
from clearway.errors import DeployError
from clearway.serve import replicas
from clearway.serve.hangup import on_hangup, rotating
from clearway.serve.limits import Limits
from clearway.serve.replica import Beats
from clearway.serve.run import Network
from clearway.serve.tokens import ALONE, Tokens, read_tokens
from clearway.web.local import listening
from helpers.running import PATIENT_S, Running, running
from helpers.serving import TOKEN, grey
from helpers.sums import Sums, plain
from helpers.walking import LEAST_STEPS, until, walk

AUTHORISED = {"authorization": f"Bearer {TOKEN}"}


@pytest.fixture(autouse=True)
def _own_folder(tmp_path, monkeypatch) -> Iterator[None]:
    monkeypatch.setitem(__import__("helpers.running").running.ENVIRONMENT, "CLEARWAY_CACHE", str(tmp_path))
    yield
    assert not list(tmp_path.glob("replicas/*"))  # nothing is left of the sessions


def walk_while_replicas_die(service: Running, sessions: int, kills: int, pause_s: float) -> int:
    told: list[object] = []
    opened, ends, dice = threading.Barrier(sessions + 1), threading.Event(), random.Random(5)
    walkers = [
        threading.Thread(target=walk, args=(service.client, number, opened, ends, told)) for number in range(sessions)
    ]
    for walker in walkers:
        walker.start()
    opened.wait(PATIENT_S)  # a session whose opening is cut off is opened twice, and one of the two is left
    for _ in range(kills):
        time.sleep(pause_s * (0.5 + dice.random()))
        until(lambda: service.process.poll() is not None or service.replicas())
        os.kill(dice.choice(service.replicas()), signal.SIGKILL)
    ends.set()
    for walker in walkers:
        walker.join()
    assert len(told) == sessions and all(isinstance(steps, int) for steps in told), told
    return sum(steps for steps in told if isinstance(steps, int))


@pytest.mark.slow
def test_replicas_die_under_load_and_no_session_is_lost_nor_a_step_walked_twice() -> None:
    with running(replicas=2, seconds=0.002, health=True) as service:
        steps = walk_while_replicas_die(service, sessions=6, kills=3, pause_s=0.5)
        assert steps >= 6 * LEAST_STEPS
        until(lambda: len(service.replicas()) == 2)
        own = f"http://127.0.0.1:{service.health_port}"
        until(lambda: httpx.get(f"{own}/ready", timeout=PATIENT_S).status_code == 200)  # both may just have begun
        until(lambda: "clearway_sessions 0.0" in httpx.get(f"{own}/metrics", timeout=PATIENT_S).text)
        lines = httpx.get(f"{own}/metrics", timeout=PATIENT_S).text.splitlines()
        route = 'clearway_requests_total{route="/sessions/{session_id}/steps",status="200"} '
        counted = [float(line.removeprefix(route)) for line in lines if line.startswith(route)]
        died = 6 * 3  # answers at most: of every session, with every kill
        assert counted and steps - died <= counted[0] <= steps + died  # of all replicas
        replicas = service.replicas()
        service.process.send_signal(signal.SIGTERM)
        assert service.process.wait(PATIENT_S) == 0
        for replica in replicas:
            with pytest.raises(ProcessLookupError):
                os.kill(replica, 0)


@pytest.mark.slow
def test_many_replicas_die_under_load() -> None:
    with running(replicas=3, seconds=0.005) as service:
        print(walk_while_replicas_die(service, sessions=20, kills=20, pause_s=2.0), "steps")
        service.process.send_signal(signal.SIGTERM)
        assert service.process.wait(PATIENT_S) == 0


@pytest.mark.slow
def test_a_stream_goes_on_in_another_replica_and_limits_hold_over_all(tmp_path: Path) -> None:
    with running(replicas=2, sessions=2) as service, service.client() as client:
        session = client.session(selection="argmax")
        session.set_target(plain(1))
        address = f"ws://127.0.0.1:{service.port}/sessions/{session.session_id}/stream"
        with connect(address, additional_headers=AUTHORISED) as stream:
            stream.send(grey(2))
            lost = stream.recv(timeout=PATIENT_S)
            for replica in service.replicas():
                os.kill(replica, signal.SIGKILL)
            with pytest.raises(ConnectionClosed):
                stream.recv(timeout=PATIENT_S)
        with connect(address + "?step=1", additional_headers=AUTHORISED, open_timeout=PATIENT_S) as stream:
            stream.send(grey(2))
            assert stream.recv(timeout=PATIENT_S) == lost
            stream.send(grey(3))
            assert '"step":2' in stream.recv(timeout=PATIENT_S)
        codes = []
        for _ in range(4):  # each on a connection of its own, to whichever replica takes it
            answer = httpx.post(f"{service.url}/sessions", json={}, headers=AUTHORISED, timeout=PATIENT_S)
            codes.append(answer.status_code)
        assert codes == [201, 429, 429, 429]
        service.process.send_signal(signal.SIGTERM)
        assert service.process.wait(PATIENT_S) == 0


@pytest.mark.slow
def test_a_service_whose_replicas_are_all_dead_is_not_ready_until_the_next_are() -> None:
    with running(replicas=2, health=True) as service:
        url = f"http://127.0.0.1:{service.health_port}"

        def status() -> int:
            return httpx.get(f"{url}/ready", timeout=PATIENT_S).status_code

        assert status() == 503  # none has begun
        until(lambda: status() == 200)
        for process in service.replicas():
            os.kill(process, signal.SIGKILL)
        until(lambda: status() == 503)
        until(lambda: status() == 200)
        service.process.send_signal(signal.SIGTERM)
        assert service.process.wait(PATIENT_S) == 0


def common_of(folder: Path, network: Network, tokens: Tokens, opened=Sums) -> replicas.Common:
    return replicas.Common(opened, network, tokens, None, Limits(), 1, folder, b"", Beats([0.0, 0.0]))


@pytest.mark.parametrize("at_once", [False, True], ids=["in time", "told twice"])
def test_a_replica_that_does_not_end_is_killed(tmp_path: Path, monkeypatch, at_once: bool) -> None:
    monkeypatch.setattr(replicas, "serve_replica", _sleep)
    with listening(0) as listener:
        place = replicas._Place(common_of(tmp_path, Network(listener), Tokens([(ALONE, TOKEN)])), 0)
        place.look()
        assert place._process is not None and place._process.pid is not None
        os.kill(place._process.pid, signal.SIGSTOP)
        os.waitpid(place._process.pid, os.WUNTRACED)  # it has stopped
        begun = time.monotonic()
        replicas._end([place], PATIENT_S if at_once else 0.3, lambda: at_once)
    assert (time.monotonic() - begun >= 0.3) is not at_once
    assert place._process.exitcode == -signal.SIGKILL


def _sleep(common: replicas.Common, number: int) -> None:
    time.sleep(10 * PATIENT_S)


def test_tokens_that_change_while_a_replica_starts_reach_it(tmp_path: Path, monkeypatch) -> None:
    path = tmp_path / "tokens"
    path.write_text(f"{ALONE} {TOKEN}\n")
    path.chmod(0o600)
    tokens, start = read_tokens(path), ChildProcess.start

    def start_then_change(process: ChildProcess) -> None:
        start(process)
        path.write_text(f"{ALONE} another-{TOKEN}\n")
        os.kill(os.getpid(), signal.SIGHUP)

    monkeypatch.setattr(ChildProcess, "start", start_then_change)
    monkeypatch.setattr(replicas, "serve_replica", _sleep)
    with listening(0) as listener:
        place = replicas._Place(common_of(tmp_path, Network(listener), tokens), 0)
        with on_hangup(lambda: place.tell(signal.SIGHUP)), rotating(tokens, path):
            place.look()
        assert tokens.owner_of(TOKEN) is None and place._process is not None
        place._process.join(PATIENT_S)  # it takes no SIGHUP yet: another one starts with the new tokens
        code = place._process.exitcode
        place.kill()
    assert code == -signal.SIGHUP


@pytest.mark.slow
def test_a_service_ends_where_no_replica_can_begin(monkeypatch, capfd) -> None:
    monkeypatch.setattr(replicas, "MOST_FAILED", 2)
    monkeypatch.setattr(replicas, "PAUSES_S", (0.0, 0.0))
    with listening(0) as listener:
        network, tokens = Network(listener), Tokens([(ALONE, TOKEN)])
        with pytest.raises(DeployError, match="no replica begins to answer, 2 tries"):
            replicas.run_replicas(partial(open_agent, "no-such-agent.onnx"), network, tokens, None, Limits(), 1)
    said = capfd.readouterr().err
    assert said.count("replica 1: no-such-agent.onnx: cannot be read") == 2 and "Traceback" not in said


def test_a_replica_that_has_answered_is_started_again_for_ever(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(replicas, "MOST_FAILED", 0)
    with listening(0) as listener:
        common = common_of(tmp_path, Network(listener), Tokens([(ALONE, TOKEN)]))
        place = replicas._Place(common, 0)
        with pytest.raises(DeployError):
            replicas._check_begun([place])
        place.look()
        common.beats.beat(0, True)
        place.look()
        place.kill()
        place.look()
        assert not place.is_alive and place.failed == 0
        replicas._check_begun([place])
