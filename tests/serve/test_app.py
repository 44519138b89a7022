"""The service as its clients meet it, in process."""

import asyncio
import json
from dataclasses import replace

import numpy as np
import pytest
from starlette.testclient import WebSocketDenialResponse
from starlette.websockets import WebSocketDisconnect

import clearway
from clearway.agents.agent import LAST_ACTION
from clearway.errors import DeployError
from clearway.scenes.actions import Action
from clearway.serve.app import make_app
from clearway.serve.limits import Limits
from clearway.serve.protection import protected
from clearway.serve.service import Service
from clearway.serve.tokens import ANSWERED
from clearway.serve.tokens import OWNER as OWNER_KEY
from helpers.serving import OWNER, TOKEN, TOKENS, grey, picture_bytes
from helpers.sums import CARD, Sums, plain

PNG = {"content-type": "image/png"}
PATIENT_S = 10  # for what must happen, on a busy machine


def fault(answer) -> str:
    """The code of a refusal, whose structure is checked."""
    assert answer.headers["content-type"] == "application/json"
    error = answer.json()["error"]
    assert answer.json().keys() == {"error"} and error.keys() == {"code", "message"}
    assert error["message"] and "Traceback" not in answer.text and ".py" not in answer.text
    return f"{answer.status_code} {error['code']}"


def opened(client, **settings) -> str:
    answer = client.post("/sessions", json=settings)
    assert answer.status_code == 201
    return f"/sessions/{answer.json()['session_id']}"


def stepped(client, session: str, level: int):
    return client.post(f"{session}/steps", content=grey(level), headers=PNG)


def test_an_episode_is_a_navigator_s(client) -> None:
    navigator = clearway.Navigator(Sums(), seed=7)
    session = opened(client, seed=7)
    for target, levels in ((2, [1, 10, 20, 30, 40]), (3, [5, 6])):
        navigator.set_target(plain(target))
        answer = client.put(f"{session}/target", content=grey(target), headers=PNG)
        assert (answer.status_code, answer.content) == (204, b"")
        for number, level in enumerate(levels, 1):
            expected, found = navigator.act(plain(level)), stepped(client, session, level).json()
            assert (found["value"], found["step"]) == (expected.value, number)
            assert found["action_index"] == expected.action
            assert found["action"] == CARD.actions[expected.action]
            assert np.array_equal(np.float32(found["probabilities"]), expected.probabilities)
    assert client.delete(session).status_code == 204
    assert fault(stepped(client, session, 1)) == "404 no_such_session"


def test_numbered_requests_are_answered_once_and_repeated_ones_again(client) -> None:
    session = opened(client, seed=5)

    def targeted(level: int, episode: int):
        return client.put(f"{session}/target?episode={episode}", content=grey(level), headers=PNG)

    def numbered(level: int, step: int):
        return client.post(f"{session}/steps?step={step}", content=grey(level), headers=PNG)

    assert fault(targeted(1, 2)) == "409 out_of_order"
    assert [targeted(1, 1).status_code for _ in range(2)] == [204, 204]
    assert fault(targeted(2, 1)) == "409 out_of_order"  # the same number, another picture
    first = numbered(10, 1).json()
    assert numbered(10, 1).json() == first and first["step"] == 1
    assert fault(targeted(1, 1)) == "409 out_of_order"  # it has been walked since
    for wrong in (numbered(11, 1), numbered(10, 3)):
        assert fault(wrong) == "409 out_of_order" and "Send number 2" in wrong.json()["error"]["message"]
    assert fault(numbered(10, 0)) == "422 invalid_request"
    second = numbered(10, 2).json()  # the same picture, another number: another step
    assert second["step"] == 2 and numbered(10, 2).json() == second
    assert stepped(client, session, 20).json()["value"] == 1000 + 50  # whoever does not count goes on as ever
    assert targeted(3, 2).status_code == 204
    assert fault(numbered(3, 0)) == "422 invalid_request" and numbered(3, 1).json()["step"] == 1


def test_a_stream_goes_on_where_another_broke(client) -> None:
    session = opened(client, seed=5)
    client.put(f"{session}/target", content=grey(1), headers=PNG)
    lost = stepped(client, session, 10).json()
    with client.websocket_connect(f"{session}/stream?step=1") as socket:
        answers = []
        for content in (grey(10), grey(10)):
            socket.send_bytes(content)
            answers.append(json.loads(socket.receive_text()))
    assert answers[0] == lost and answers[1]["step"] == 2
    with client.websocket_connect(f"{session}/stream?step=7") as socket:
        socket.send_bytes(grey(10))
        assert json.loads(socket.receive_text())["error"]["code"] == "out_of_order"


def test_sessions_do_not_mix(client) -> None:
    sessions = [opened(client, selection="argmax") for _ in range(5)]
    for number, session in enumerate(sessions):
        client.put(f"{session}/target", content=grey(number), headers=PNG)
    for level in (1, 2, 3):
        for number, session in enumerate(sessions):
            found = stepped(client, session, 10 * number + level).json()
            passed = [10 * number + 1] * 4 + [10 * number + step for step in range(2, level + 1)]
            assert found["value"] == 1000 * number + sum(passed[-4:])
            assert found["action"] == "move backward"


class Remembering(Sums):
    """Its value is the number of the action that it is told it took last."""

    def reset(self, target, seed):
        return {**super().reset(target, seed), LAST_ACTION: np.full(len(seed), -1)}

    def act(self, observation, state):
        decisions, after = super().act(observation, state)
        told = state[LAST_ACTION].astype(np.float32)
        return replace(decisions, value=told), {**after, LAST_ACTION: np.zeros_like(decisions.action)}


def test_an_agent_is_told_what_argmax_took(called) -> None:
    client = called(Service(Remembering(), Limits(), TOKENS))
    session = opened(client, selection="argmax")
    client.put(f"{session}/target", content=grey(0), headers=PNG)
    assert [stepped(client, session, 1).json()["value"] for _ in range(2)] == [-1, Action.MOVE_BACKWARD]


@pytest.mark.parametrize(
    ("kind", "content", "expected"),
    [
        ("image/png", b"", "415 unsupported_picture"),
        ("image/png", b"GIF89a", "415 unsupported_picture"),
        ("image/gif", grey(1), "415 unsupported_picture"),
        ("application/json", b"{}", "415 unsupported_picture"),
        (None, grey(1), "415 unsupported_picture"),
        ("image/png", grey(1)[:-28], "422 unreadable_picture"),
        ("image/png", picture_bytes(plain(1, (101, 100))), "413 picture_too_large"),
        ("image/png", bytes(100_001), "413 body_too_large"),
    ],
    ids=["empty", "gif", "said to be gif", "json", "unsaid", "cut off", "pixels", "bytes"],
)
def test_pictures_that_are_refused_leave_the_session_as_it_was(client, kind, content, expected) -> None:
    session = opened(client)
    client.put(f"{session}/target", content=grey(0), headers=PNG)
    assert stepped(client, session, 1).json()["value"] == 4
    headers = {"content-type": kind} if kind else {}
    assert fault(client.post(f"{session}/steps", content=content, headers=headers)) == expected
    assert fault(client.put(f"{session}/target", content=content, headers=headers)) == expected
    again = stepped(client, session, 2).json()
    assert (again["value"], again["step"]) == (5, 2)
    assert f'code="{expected[4:]}"' in client.get("/metrics").text


def test_a_body_that_does_not_say_its_length_is_cut_off_too(client) -> None:
    read = []

    def endless():
        for number in range(1000):
            read.append(number)
            yield bytes(10_000)

    session = opened(client)
    assert fault(client.put(f"{session}/target", content=endless(), headers=PNG)) == "413 body_too_large"


WRONG_TOKENS = (None, "", "x", TOKEN[:-1], TOKEN + "x", TOKEN.upper(), "é" * 10)
RIGHT = {"authorization": f"Bearer {TOKEN}"}


def bearing(token: str | None) -> dict[str, bytes]:
    return {} if token is None else {"authorization": f"Bearer {token}".encode()}


@pytest.mark.parametrize("token", WRONG_TOKENS)
def test_wrong_tokens(called, service, token) -> None:
    client, headers = called(service, None), bearing(token)
    for method, path in (("GET", "/agent"), ("POST", "/sessions"), ("GET", "/metrics"), ("GET", "/openapi.json")):
        answer = client.request(method, path, headers=headers)
        assert fault(answer) == "401 unauthorised"
        assert answer.headers["www-authenticate"] == "Bearer"
    assert len(service.sessions) == 0
    for other in (f"Basic {TOKEN}", TOKEN):
        assert fault(client.get("/agent", headers={"authorization": other})) == "401 unauthorised"
    assert client.get("/health").json() == {"status": "ok"}  # says nothing else
    agent = client.get("/agent", headers={"authorization": f"bearer {TOKEN}"})
    assert agent.status_code == 200
    assert agent.json()["observation"] == CARD.observation
    assert agent.json()["tells_arrival"] is False  # a card without a threshold


@pytest.mark.parametrize("token", WRONG_TOKENS)
def test_a_stream_opens_with_the_token_alone(called, service, token) -> None:
    client = called(service, None)
    path = f"/sessions/{client.post('/sessions', json={}, headers=RIGHT).json()['session_id']}/stream"
    with pytest.raises(WebSocketDenialResponse) as denied, client.websocket_connect(path, headers=bearing(token)):
        pass
    assert fault(denied.value) == "401 unauthorised"
    with client.websocket_connect(path, headers=RIGHT) as socket:
        socket.send_bytes(grey(1))
        assert json.loads(socket.receive_text())["error"]["code"] == "no_target"


@pytest.mark.parametrize(
    "path",
    [
        "/sessions/../../etc/passwd",
        "/sessions/..%2f..%2fetc%2fpasswd/steps",
        "/sessions/%2e%2e/steps",
        "/../etc/passwd",
        "//etc/passwd",
        "/static/../../pyproject.toml",
        "/sessions/%00/steps",
        "/sessions/" + "a" * 5000 + "/steps",
        "/docs",
        "/redoc",
    ],
)
def test_paths_lead_nowhere_else(client, path) -> None:
    answer = client.post(path, content=grey(1), headers=PNG)
    assert fault(answer) in ("404 not_found", "422 invalid_request", "405 method_not_allowed")
    assert fault(client.get(path)) in ("404 not_found", "422 invalid_request", "405 method_not_allowed")


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"{",
        b"[]",
        b'"x"',
        b"\xff\xfe",
        json.dumps({"selection": "best"}).encode(),
        json.dumps({"seed": -1}).encode(),
        json.dumps({"seed": 1.5}).encode(),
        json.dumps({"seed": 1 << 53}).encode(),
        json.dumps({"seed": "1"}).encode(),
        json.dumps({"colour": 1}).encode(),
        b"[" * 50_000,
    ],
    ids=lambda content: content[:30].decode("latin-1"),
)
def test_sessions_that_cannot_be_opened(client, service, content) -> None:
    answer = client.post("/sessions", content=content, headers={"content-type": "application/json"})
    assert fault(answer) == "422 invalid_request"
    assert len(service.sessions) == 0


def test_limits_of_sessions_and_readiness(client) -> None:
    assert client.get("/ready").json() == {"status": "ready"}
    sessions = [opened(client) for _ in range(20)]
    answer = client.post("/sessions", json={})
    assert (fault(answer), answer.headers["retry-after"]) == ("429 too_many_sessions", "60")
    assert fault(client.get("/ready")) == "503 overloaded"
    assert client.get("/health").status_code == 200
    client.delete(sessions[0])
    assert client.get("/ready").status_code == 200


def test_a_session_without_a_target_and_methods_that_are_not_there(client) -> None:
    assert fault(stepped(client, opened(client), 1)) == "409 no_target"
    answer = client.get(f"{opened(client)}/steps")
    assert (fault(answer), answer.headers["allow"]) == ("405 method_not_allowed", "POST")


def test_what_takes_too_long_is_given_up_and_leaves_the_session_as_it_was(called) -> None:
    model = Sums()
    client = called(Service(model, Limits(deadline_s=1.5), TOKENS))
    session = opened(client)
    client.put(f"{session}/target", content=grey(0), headers=PNG)
    assert stepped(client, session, 1).json()["value"] == 4
    model.seconds = 3.0
    assert fault(stepped(client, session, 9)) == "504 deadline_passed"
    with client.websocket_connect(f"{session}/stream") as socket:
        socket.send_bytes(grey(9))
        assert json.loads(socket.receive_text())["error"]["code"] == "deadline_passed"
    model.seconds = 0.0
    while (answer := stepped(client, session, 2)).status_code == 504:
        pass  # the model is still busy with the picture given up
    assert (answer.json()["value"], answer.json()["step"]) == (5, 2)


def test_a_stream_waits_no_longer_for_its_session_than_for_a_step(called, monkeypatch) -> None:
    """Shared sessions are in a table that may be busy."""
    service = Service(Sums(), Limits(deadline_s=0.2), TOKENS)
    client, found = called(service), service.sessions.get
    session = opened(client)

    async def late(session_id: str, owner: str) -> None:
        await asyncio.sleep(PATIENT_S)

    monkeypatch.setattr(service.sessions, "get", late)
    with pytest.raises(WebSocketDenialResponse) as caught, client.websocket_connect(f"{session}/stream"):
        pass
    assert fault(caught.value) == "504 deadline_passed"
    monkeypatch.setattr(service.sessions, "get", found)
    with client.websocket_connect(f"{session}/stream") as socket:
        monkeypatch.setattr(service.sessions, "get", late)
        socket.send_bytes(grey(9))
        assert json.loads(socket.receive_text())["error"]["code"] == "deadline_passed"


def test_a_failing_agent_says_nothing_of_itself(called, caplog) -> None:
    class Broken(Sums):
        def reset(self, target, seed):
            raise RuntimeError("secret")

    client = called(Service(Broken(), Limits(), TOKENS))
    answer = client.put(f"{opened(client)}/target", content=grey(0), headers=PNG)
    assert fault(answer) == "500 internal"
    assert "secret" not in answer.text
    assert "secret" in caplog.text  # the log has it


def test_the_stream_of_a_session(client) -> None:
    session = opened(client, selection="argmax")
    with client.websocket_connect(f"{session}/stream") as socket:
        socket.send_bytes(grey(1))
        assert json.loads(socket.receive_text())["error"]["code"] == "no_target"
        client.put(f"{session}/target", content=grey(2), headers=PNG)
        values = []
        for content in (grey(1), b"nonsense", grey(10), grey(20)[:-28], grey(30)):
            socket.send_bytes(content)
            answer = json.loads(socket.receive_text())
            values.append(answer["error"]["code"] if "error" in answer else answer["value"])
        assert values == [2004, "unsupported_picture", 2013, "unreadable_picture", 2042]
        socket.send_text("hello")
        assert json.loads(socket.receive_text())["error"]["code"] == "invalid_request"
        assert stepped(client, session, 40).json()["step"] == 4  # the same session
        client.delete(session)
        socket.send_bytes(grey(1))
        assert json.loads(socket.receive_text())["error"]["code"] == "no_such_session"
        with pytest.raises(WebSocketDisconnect) as closed:
            socket.receive_text()
        assert closed.value.code == 1008
    with pytest.raises(WebSocketDisconnect), client.websocket_connect(f"{session}/stream"):
        pass


async def listening(service: Service, session_id: str, sent: list[dict]) -> None:
    """A stream whose client says nothing, until the service ends it; what the service sends is added to `sent`."""
    connect = [{"type": "websocket.connect"}]

    async def receive() -> dict:
        if not connect:
            await asyncio.Event().wait()
        return connect.pop()

    async def send(message: dict) -> None:
        sent.append(message)

    path = f"/sessions/{session_id}/stream"
    extensions = {"websocket.http.response": {}}
    scope = {
        "type": "websocket",
        "path": path,
        "headers": [],
        OWNER_KEY: OWNER,
        ANSWERED: lambda begun, status: None,
        "query_string": b"",
        "extensions": extensions,
    }
    await asyncio.wait_for(make_app(service)(scope, receive, send), PATIENT_S)


def test_a_stream_that_nobody_uses_is_closed() -> None:
    service, sent = Service(Sums(), Limits(idle_s=1, deadline_s=0.1), TOKENS), []
    asyncio.run(listening(service, asyncio.run(service.sessions.open(OWNER, "sampled", None)).id, sent))
    assert [message["type"] for message in sent] == ["websocket.accept", "websocket.close"]
    assert (sent[1]["code"], sent[1]["reason"]) == (1008, "unused for too long")


def test_a_stream_too_many_is_refused_and_may_come_again() -> None:
    service = Service(Sums(), Limits(sessions=1), TOKENS)
    session = asyncio.run(service.sessions.open(OWNER, "sampled", None))

    async def two() -> tuple[list[dict], list[dict]]:
        first, second = [], []
        held = asyncio.create_task(listening(service, session.id, first))
        while not first:
            await asyncio.sleep(0.001)
        await listening(service, session.id, second)
        assert not held.done()
        held.cancel()
        return first, second

    first, (refusal, body) = asyncio.run(two())
    assert [message["type"] for message in first] == ["websocket.accept"]
    assert refusal["status"] == 503
    assert json.loads(body["body"])["error"]["code"] == "overloaded"
    assert service.streams.taken == 0


def test_figures_for_prometheus(client) -> None:
    session = opened(client)
    client.put(f"{session}/target", content=grey(0), headers=PNG)
    for level in range(3):
        stepped(client, session, level)
    client.get("/nowhere/at/all")
    lines = client.get("/metrics").text.splitlines()
    assert 'clearway_requests_total{route="/sessions/{session_id}/steps",status="200"} 3.0' in lines
    assert 'clearway_requests_total{route="unknown",status="404"} 1.0' in lines
    assert "clearway_sessions 1.0" in lines
    assert "clearway_batch_pictures_sum 4.0" in lines
    assert "clearway_model_seconds_count 4.0" in lines
    assert session.split("/")[-1] not in "".join(lines)


def test_answers_are_not_kept_nor_guessed_at(client) -> None:
    for path in ("/agent", "/health", "/nowhere"):
        headers = client.get(path).headers
        assert (headers["cache-control"], headers["x-content-type-options"]) == ("no-store", "nosniff")


def test_an_agent_that_takes_features_is_not_served() -> None:
    class Features(Sums):
        card = clearway.deploy.card.Card(**{**vars(CARD), "takes_pictures": False})

    with pytest.raises(DeployError, match="without its encoder"):
        Service(Features(), Limits(), TOKENS)


def test_an_answer_that_has_begun_is_whole_though_the_deadline_passes() -> None:
    """It once ended after its headers."""
    service, sent = Service(Sums(), Limits(deadline_s=0.05), TOKENS), []

    async def app(scope, receive, send) -> None:
        await send({"type": "http.response.start", "status": 200, "headers": []})
        await asyncio.sleep(0.2)
        await send({"type": "http.response.body", "body": b"all of it"})

    async def send(message: dict) -> None:
        sent.append(message)

    scope = {"type": "http", "path": "/health", "headers": [], "server": ("127.0.0.1", 1), "client": ("127.0.0.1", 2)}
    asyncio.run(protected(app, service)(scope, send, send))
    assert sent[-1]["body"] == b"all of it"
