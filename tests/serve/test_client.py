"""The client in the package."""

import io
import json
import os
import shutil
import socket
import subprocess
import threading
import time
from collections import Counter

import httpx
import numpy as np
import pytest
from PIL import Image

import clearway
from clearway.errors import ClearwayError, DeployError
from clearway.serve import connections
from clearway.serve.client import KEEP_ALIVE_S, Client, ClientSession, ServiceError, picture_file
from helpers.documents import ROOT, code_blocks, shortened
from helpers.imported import imported_by
from helpers.running import PATIENT_S, running
from helpers.serving import TOKEN, grey, picture_bytes
from helpers.sums import Sums, plain


def with_service(client, made: Client) -> Client:
    """The client, with the service called in process instead of over a connection."""
    made._http.close()
    made._http = client
    return made


def test_refusals_become_errors_with_the_service_s_code(client, service) -> None:
    agent = with_service(client, Client("http://testserver", TOKEN))
    assert agent.agent()["scene"] == "attic"
    with agent.session(selection="argmax") as session:
        with pytest.raises(ServiceError, match="no_target: the session has no target yet") as caught:
            session.act(plain(1))
        assert caught.value.code == "no_target"
        session.set_target(Image.fromarray(plain(2)))
        action, probabilities, value = session.act(plain(1))
        assert (action.name, value) == ("MOVE_BACKWARD", 2004.0)
        np.testing.assert_array_equal(probabilities, np.float32([0.1, 0.2, 0.3, 0.4]))
        with pytest.raises(ServiceError, match="unsupported_picture"):
            session.act(b"nonsense")
        with pytest.raises(DeployError, match="expected uint8"):
            session.act(np.zeros((3, 4)))
    assert len(service.sessions) == 0
    with pytest.raises(ServiceError, match="no_such_session"):
        session.close()
    with pytest.raises(ServiceError, match="invalid_request"):
        agent.session(selection="best")
    with agent.session(seed=np.int64(3)), pytest.raises(DeployError, match="seed is -1, expected a whole number"):
        agent.session(seed=-1)


def test_a_wrong_token_and_an_address_where_nobody_answers(called, service) -> None:
    with pytest.raises(ServiceError, match="unauthorised"):
        with_service(called(service, None), Client("http://testserver", "x")).agent()
    with Client("http://127.0.0.1:9", TOKEN) as nobody, pytest.raises(ServiceError, match=r"unreachable: .*:9"):
        nobody.agent()
    assert issubclass(ServiceError, ClearwayError)


@pytest.mark.skipif(shutil.which("curl") is None, reason="needs curl")
def test_an_episode_by_curl_as_the_page_shows_it(tmp_path) -> None:
    (commands,) = (block.text for block in code_blocks(ROOT / "docs/deploy.md") if "curl" in block.text)
    for name, level in (("target", 1), ("camera", 2)):
        (tmp_path / f"{name}.jpg").write_bytes(picture_bytes(plain(level), "JPEG"))
    with running() as service:
        script = shortened(commands, {"http://127.0.0.1:8000": service.url})
        told = {"PATH": os.environ["PATH"], "TOKEN": TOKEN, "no_proxy": "*"}
        done = subprocess.run(["sh", "-euc", script], cwd=tmp_path, env=told, capture_output=True, text=True)
        assert (done.returncode, done.stderr) == (0, "")
        answer = json.loads(done.stdout)
        assert answer["action"] == "move backward" and answer["step"] == 1 and answer["value"] // 1000 == 1
        left = httpx.get(f"{service.url}/metrics", headers={"authorization": f"Bearer {TOKEN}"}, timeout=PATIENT_S)
        assert "clearway_sessions 0.0" in left.text


@pytest.mark.parametrize("url", ["http://127.0.0.1:notaport", "http://[::1", "http://a\nb"])
def test_addresses_that_cannot_be(url) -> None:
    with pytest.raises(ServiceError, match=r"unreachable: .* is no address .* Give one such as http") as caught:
        Client(url, TOKEN)
    assert caught.value.code == "unreachable"


def test_a_host_s_name_that_cannot_be_looked_up() -> None:
    with Client(f"http://{'x' * 70}", TOKEN) as client, pytest.raises(ServiceError, match=r"unreachable: .*address"):
        client.agent()


@pytest.mark.parametrize("token", ["", "tökenx", "secret token", "secret\n"])
def test_tokens_that_cannot_be_sent(token) -> None:
    with pytest.raises(ServiceError, match=r"unauthorised: the token is .* Give the one that the service") as caught:
        Client("http://127.0.0.1:9", token)
    assert "secret" not in str(caught.value)


@pytest.mark.parametrize("status", [200, 400])
@pytest.mark.parametrize("content", [b"<html>", b"", b"[]", b"{}", b"\xff\xfe", b"[" * 100_000])
def test_another_service_that_answers_every_request(content: bytes, status: int) -> None:
    def answer(request: httpx.Request) -> httpx.Response:
        return httpx.Response(status, content=content)

    stranger = httpx.Client(base_url="http://stranger", transport=httpx.MockTransport(answer))
    client = with_service(stranger, Client("http://stranger", TOKEN))
    session = ClientSession(client, "x")
    for ask in (client.agent, client.session, lambda: session.act(plain(1))):
        with pytest.raises(ServiceError, match=f"status {status}: http://stranger: no clearway service answers there"):
            ask()


@pytest.mark.parametrize(
    "wrong",
    [
        {"action_index": 9},
        {"probabilities": ["x"] * 4},
        {"probabilities": [0.5, 0.5]},
        {"probabilities": 0.5},
        {"value": [1]},
        {"arrived": "no"},
        {"arrived": 1},
    ],
)
def test_an_answer_that_is_no_decision_is_nobody_s_step(wrong: dict[str, object]) -> None:
    answer = {"action_index": 0, "probabilities": None, "value": None, "arrived": False, **wrong}
    stranger = httpx.Client(
        base_url="http://stranger", transport=httpx.MockTransport(lambda request: httpx.Response(203, json=answer))
    )
    session = ClientSession(with_service(stranger, Client("http://stranger", TOKEN)), "x")
    with pytest.raises(ServiceError, match="status 203: http://stranger: no clearway service answers there"):
        session.act(plain(1))
    assert session._answered["step"] is None  # nobody knows


def test_connections_are_given_up_before_the_service_does() -> None:
    with Client("http://127.0.0.1:9", TOKEN) as client:
        assert client._http._transport._pool._keepalive_expiry == KEEP_ALIVE_S < connections.KEEP_ALIVE_S


def test_a_service_that_says_no_more_is_told_in_one_sentence(monkeypatch) -> None:
    """What httpx says ends in a full stop itself."""
    monkeypatch.setattr("clearway.serve.client.AGAIN_S", 0.0)
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]

        def hang_up() -> None:
            with listener.accept()[0] as connection:
                connection.recv(65536)

        hanging_up = threading.Thread(target=hang_up)
        hanging_up.start()
        with Client(f"http://127.0.0.1:{port}", TOKEN) as client, pytest.raises(ServiceError) as caught:
            client.agent()
        hanging_up.join()
    assert caught.value.message.endswith(". Check the address") and ".." not in caught.value.message


class Flaky(httpx.BaseTransport):
    """A way to a service on which answers are lost: `lost` of each, before it is asked for or after.

    Where a proxy `tells`, it answers instead of a connection that breaks.
    """

    def __init__(self, way: httpx.Client, lost: int, asked_before: bool, tells: bool = False) -> None:
        self.way, self.lost, self.asked_before, self.tells, self.seen = way, lost, asked_before, tells, Counter[str]()

    def handle_request(self, request: httpx.Request) -> httpx.Response:
        line = f"{request.method} {request.url.raw_path.decode()}"
        self.seen[line] += 1
        lose = self.seen[line] % (self.lost + 1) != 0
        if lose and not self.asked_before:
            raise httpx.WriteError("cut off")
        path, headers = request.url.raw_path.decode(), dict(request.headers)
        answer = self.way.request(request.method, path, content=request.read(), headers=headers)
        if lose and self.tells:
            return httpx.Response(500, text="the replica has died")
        if lose:
            raise httpx.ReadError("cut off")
        return httpx.Response(answer.status_code, content=answer.content)


@pytest.mark.parametrize(
    ("asked_before", "tells"),
    [(False, False), (True, False), (True, True)],
    ids=["request lost", "answer lost", "a proxy says so"],
)
def test_lost_answers_are_asked_for_again_and_no_step_is_walked_twice(client, monkeypatch, asked_before, tells) -> None:
    monkeypatch.setattr("clearway.serve.client.FIRST_PAUSE_S", 0.001)
    way, navigator = Flaky(client, 2, asked_before, tells), clearway.Navigator(Sums(), seed=3)
    http = httpx.Client(base_url="http://testserver", transport=way, headers=client.headers)
    with with_service(http, Client("http://testserver", TOKEN)).session(seed=3) as session:
        for target in (2, 3):
            for walker in (session, navigator):
                walker.set_target(plain(target))
            for level in (7, 7, 9):
                assert session.act(plain(level))[::2] == navigator.act(plain(level))[::2]
    assert all(times % 3 == 0 for times in way.seen.values())  # each came three times, the session's end too


def test_a_session_goes_on_uncounted_once_an_answer_is_lost_for_good(client, service, monkeypatch) -> None:
    monkeypatch.setattr("clearway.serve.client.AGAIN_S", 0.0)
    session = with_service(client, Client("http://testserver", TOKEN)).session(selection="argmax")
    for lost in (session.set_target, session.act):
        session._client._http = httpx.Client(
            base_url="http://testserver", transport=Flaky(client, 1, True), headers=client.headers
        )
        with pytest.raises(ServiceError, match="unreachable"):
            lost(plain(1))
        session._client._http = client
        lost(plain(2))
    assert session.act(plain(3)).value == 2000 + 1 + 1 + 2 + 3  # what was lost had been walked
    monkeypatch.setattr("clearway.serve.client.AGAIN_S", 10.0)
    way = Flaky(client, 1, True)
    session._client._http = httpx.Client(base_url="http://testserver", transport=way, headers=client.headers)
    for lost in (session.act, session.set_target):
        with pytest.raises(ServiceError, match="unreachable"):
            lost(plain(4))
    assert set(way.seen.values()) == {1}  # without a number, it is not sent again and walked twice


def test_a_session_goes_on_uncounted_after_ctrl_c(client, service) -> None:
    session = with_service(client, Client("http://testserver", TOKEN)).session(selection="argmax")
    session.set_target(plain(1))

    def answered_and_interrupted(*given, **also):
        type(session._client).ask_json(session._client, *given, **also)
        raise KeyboardInterrupt

    session._client.ask_json = answered_and_interrupted
    with pytest.raises(KeyboardInterrupt):
        session.act(plain(2))
    del session._client.ask_json
    with pytest.raises(DeployError):
        session.act("no picture")
    assert session.act(plain(3)).value == 1000 + 2 + 2 + 2 + 3  # the first had been walked


def test_a_request_that_breaks_after_the_time_for_asking_again_is_asked_once(monkeypatch) -> None:
    monkeypatch.setattr("clearway.serve.client.FIRST_PAUSE_S", 0.001)
    monkeypatch.setattr("clearway.serve.client.AGAIN_S", 0.1)
    seen = []

    def hang(request: httpx.Request) -> httpx.Response:
        seen.append(request)
        time.sleep(0.15)
        raise httpx.ReadError("cut off")

    http = httpx.Client(base_url="http://hanging", transport=httpx.MockTransport(hang))
    with pytest.raises(ServiceError, match="unreachable"):
        with_service(http, Client("http://hanging", TOKEN)).agent()
    assert len(seen) == 1


def test_how_pictures_are_sent(tmp_path) -> None:
    for kind, content_type in (("JPEG", "image/jpeg"), ("PNG", "image/png"), ("WEBP", "image/webp")):
        content = picture_bytes(plain(3), kind)
        assert picture_file(content) == (content, content_type)
    path = tmp_path / "view.png"
    path.write_bytes(grey(3))
    assert picture_file(path) == picture_file(str(path)) == (grey(3), "image/png")
    content, content_type = picture_file(plain(3))
    assert content_type == "image/png" and content.startswith(b"\x89PNG")


@pytest.mark.parametrize("name", ["nofile.png", ".", "a\0b.png"])
def test_pictures_that_cannot_be_read(client, tmp_path, name) -> None:
    session = with_service(client, Client("http://testserver", TOKEN)).session()
    for give in (session.set_target, session.act):
        with pytest.raises(DeployError, match=r"cannot be read \(.*\)\. Name a JPEG, PNG or WebP file"):
            give(tmp_path / name)
        with pytest.raises(DeployError, match="cannot be read"):
            give(str(tmp_path / name))


def test_pictures_that_are_none_leave_the_count_as_it_is(client) -> None:
    session = with_service(client, Client("http://testserver", TOKEN)).session()
    content = picture_bytes(np.random.default_rng(0).integers(0, 256, (64, 64, 3), np.uint8), "JPEG")
    for picture in (Image.open(io.BytesIO(content[: len(content) // 2])), [[1, 2], [3]]):
        for give in (session.set_target, session.act):
            with pytest.raises(DeployError, match="what is seen is no picture"):
                give(picture)
    assert session._answered == {"episode": 0, "step": 0}  # nothing was sent


def test_a_client_needs_nothing_of_the_service_or_the_learner() -> None:
    loaded = imported_by("from clearway.serve.client import Client; Client('http://127.0.0.1:9', 'x').close()")
    assert "httpx" in loaded
    assert not loaded & {"fastapi", "uvicorn", "torch", "onnxruntime", "gymnasium", "prometheus_client"}
