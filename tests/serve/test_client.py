"""The client in the package."""

import socket
import threading

import numpy as np
import pytest
from PIL import Image

from clearway.errors import ClearwayError, DeployError
from clearway.serve import protocol
from clearway.serve.client import KEEP_ALIVE_S, Client, ServiceError, picture_file
from imported import imported_by
from serving import TOKEN, grey, picture_bytes
from sums import plain


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


def test_connections_are_given_up_before_the_service_does() -> None:
    with Client("http://127.0.0.1:9", TOKEN) as client:
        assert client._http._transport._pool._keepalive_expiry == KEEP_ALIVE_S < protocol.KEEP_ALIVE_S


def test_a_service_that_says_no_more_is_told_in_one_sentence() -> None:
    """What httpx says ends in a full stop itself."""
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


def test_how_pictures_are_sent(tmp_path) -> None:
    for kind, content_type in (("JPEG", "image/jpeg"), ("PNG", "image/png"), ("WEBP", "image/webp")):
        content = picture_bytes(plain(3), kind)
        assert picture_file(content) == (content, content_type)
    path = tmp_path / "view.png"
    path.write_bytes(grey(3))
    assert picture_file(path) == picture_file(str(path)) == (grey(3), "image/png")
    content, content_type = picture_file(plain(3))
    assert content_type == "image/png" and content.startswith(b"\x89PNG")


def test_a_client_needs_nothing_of_the_service_or_the_learner() -> None:
    loaded = imported_by("from clearway.serve.client import Client; Client('http://127.0.0.1:9', 'x').close()")
    assert "httpx" in loaded
    assert not loaded & {"fastapi", "uvicorn", "torch", "onnxruntime", "gymnasium", "prometheus_client"}
