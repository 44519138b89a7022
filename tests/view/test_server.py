"""The viewer's service as the command starts it, asked over the network, and what its application does alone."""

import io
import json
import re
import time
from concurrent.futures import ThreadPoolExecutor
from http.client import HTTPConnection, HTTPResponse
from pathlib import Path
from urllib.parse import urlsplit

import av
import numpy as np
import pytest
from PIL import Image
from starlette.testclient import TestClient
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from clearway.view import server
from clearway.view.content import grey
from clearway.view.stage import Stage


def get(address: str, path: str = "", **headers: str) -> tuple[HTTPResponse, bytes]:
    """What the service answers; `path` comes after the token."""
    parts = urlsplit(address)
    connection = HTTPConnection(parts.netloc, timeout=60)
    try:
        connection.request("GET", parts.path + path, headers=headers)
        answer = connection.getresponse()
        return answer, answer.read()
    finally:
        connection.close()


def live(address: str, **options):
    return connect(address.replace("http", "ws") + "live", open_timeout=60, **options)


def test_the_address_is_of_this_machine_and_cannot_be_guessed(address: str) -> None:
    assert re.fullmatch(r"http://127\.0\.0\.1:\d+/[\w-]{32}/", address)
    root = address[: address.rindex("/", 0, -1) + 1]
    assert get(root)[0].status == get(root + "wrong/")[0].status == 404
    assert get(address, Host="evil.example")[0].status == 421
    assert get(address, Origin="https://evil.example")[0].status == 403


def test_the_page_and_all_that_it_names_are_there(address: str) -> None:
    answer, page = get(address)
    assert answer.status == 200 and answer.headers["content-type"] == "text/html; charset=utf-8"
    assert answer.headers["cache-control"] == "no-store"
    assert "script-src 'self'" in answer.headers["content-security-policy"]
    names = set(re.findall(r'(?:href|src)="(page/[^"]+)"', page.decode()))
    assert {"page/app.js", "page/style.css", "page/icon.svg"} <= names
    modules = {"page/app.js"}
    while modules:
        answer, script = get(address, name := modules.pop())
        assert (answer.status, answer.headers["content-type"]) == (200, "text/javascript; charset=utf-8"), name
        found = {f"page/{module}" for module in re.findall(r'from "\./([^"]+)"', script.decode())}
        modules |= found - names
        names |= found
    assert {"page/map.js", "page/keys.js", "page/looks.js"} <= names
    assert all(get(address, name)[0].status == 200 for name in names)


@pytest.mark.parametrize(
    "path",
    [
        "page/nothing.js",
        "page/..%2fserver.py",
        "page/../server.py",
        "page/%2e%2e/server.py",
        "page//etc/passwd",
        "docs",
        "openapi.json",
        "scenes/3/map.json",
        "scenes/-1/map.json",
        "scenes/0/views/20.jpg",
        "scenes/0/views/-1.jpg",
        "scenes/2/views/0.jpg",  # no pictures
        "scenes/2/above.jpg",
        "scenes/0/depth/20.jpg",
        "scenes/3/depth/0.jpg",
        "scenes/1/depth/0.jpg",  # no depth
        "scenes/0/rgb/0.jpg",
        "scenes/0/touch/0.jpg",
    ],
)
def test_nothing_else_is_there(address: str, path: str) -> None:
    answer, content = get(address, path)
    assert answer.status in (404, 422)
    assert b"import" not in content and b"root:" not in content


def test_the_stage_and_its_maps(address: str, stage: Stage) -> None:
    whole = json.loads(get(address, "stage.json")[1])
    agents = [{"name": name, "values": True, "map": False} for name in ("aware", "plain")]
    assert whole == {"agents": agents, "scenes": ["corridor", "grid", "bare"]}
    corridor = json.loads(get(address, "scenes/0/map.json")[1])
    assert corridor["extent_m"] == [-0.25, 0.25, -0.25, 2.25]
    assert corridor["zones"][:4] == [2, 2, 2, 2] and corridor["zones"][8] == 0
    assert (corridor["has_pictures"], corridor["picture_shape"], corridor["has_above"]) == (True, [12, 16], True)
    depth = {"name": "depth", "shape": [12, 16], "dtype": "float32", "unit": "m", "low": 0, "high": 20}
    assert corridor["sensors"] == [depth]
    bare = json.loads(get(address, "scenes/2/map.json")[1])
    assert (bare["turn_deg"], bare["has_pictures"], bare["has_above"]) == (30, False, False)
    assert bare["extent_m"] == pytest.approx([-0.35, 1.35, -0.35, 1.35])
    for index, scene in enumerate(stage.scenes):
        content = json.loads(get(address, f"scenes/{index}/map.json")[1])
        np.testing.assert_allclose(content["locations_m"], scene.locations_m, atol=1e-4)


def test_pictures_are_those_of_the_scene(address: str, stage: Stage) -> None:
    scene = stage.scenes[1]
    assert scene.observations is not None and scene.top_view is not None
    for path, expected in {
        "scenes/1/views/7.jpg": scene.observations[7],
        "scenes/1/above.jpg": scene.top_view.image,
    }.items():
        answer, content = get(address, path)
        assert answer.headers["content-type"] == "image/jpeg"
        found = np.asarray(Image.open(io.BytesIO(content)))
        assert found.shape == expected.shape
        assert np.abs(found.astype(int) - expected).mean() < 6


def test_depth_is_shown_in_grey_from_near_to_far(address: str, stage: Stage) -> None:
    answer, content = get(address, "scenes/0/depth/7.jpg")
    assert answer.headers["content-type"] == "image/jpeg"
    found = np.asarray(Image.open(io.BytesIO(content))).astype(int)
    assert found.shape == (12, 16, 3)
    metres = stage.scenes[0].seen_by("depth")[7]
    expected = 255 * (1 - np.log1p(metres) / np.log(21))
    assert np.ptp(expected) > 20
    assert np.abs(found - expected[..., None]).mean() < 6
    sensor = stage.scenes[0].sensors[1]
    assert grey(np.array([0.0, 20.0], np.float32), sensor).tolist() == [255, 0]


def test_an_episode_over_the_socket(address: str) -> None:
    with live(address, origin=address[: address.index("/", 8)]) as socket, live(address) as other:
        for each, scene in ((socket, "corridor"), (other, "grid")):
            each.send(json.dumps({"do": "begin", "episode": f"scene={scene}&seed=1"}))
        socket.send(json.dumps({"do": "step"}))
        assert [json.loads(socket.recv())["kind"] for _ in range(2)] == ["episode", "steps"]
        assert json.loads(other.recv())["scene"] == 1  # each page has its own episode


@pytest.mark.parametrize(
    "text", ["", "{", "[" * 50_000, "null", '"begin"', '{"do": "begin", "episode": "scene=attic"}']
)
def test_the_socket_refuses_what_it_does_not_know_and_stays(address: str, text: str) -> None:
    with live(address) as socket:
        socket.send(text)
        assert json.loads(socket.recv())["kind"] == "refused"
        socket.send('{"do": "begin", "episode": ""}')
        assert json.loads(socket.recv())["kind"] == "episode"


@pytest.mark.parametrize("message", ["x" * 70_000, b"bytes"], ids=["too large", "bytes"])
def test_the_socket_is_closed_on_what_no_page_sends(address: str, message: str | bytes) -> None:
    with live(address) as socket:
        socket.send(message)
        with pytest.raises(ConnectionClosed):
            socket.recv(timeout=60)


def test_other_pages_get_no_socket(address: str) -> None:
    with pytest.raises(InvalidStatus, match="403"), live(address, origin="https://evil.example"):
        pass
    with pytest.raises(InvalidStatus, match="403"), live(address[:-2] + "/"):
        pass


def test_more_pages_than_anyone_opens_are_turned_away(full: str) -> None:
    with live(full) as one_more, pytest.raises(ConnectionClosed) as caught:
        one_more.recv(timeout=60)
    assert caught.value.rcvd is not None
    assert (caught.value.rcvd.code, caught.value.rcvd.reason[:18]) == (4001, "16 pages are open.")


@pytest.mark.slow
def test_a_film_of_the_episode(address: str) -> None:
    answer, content = get(address, "film.mp4?scene=corridor&start=1&target=8&drive=1&walk=FR&walk=L&walk=FFF")
    assert (answer.status, answer.headers["content-type"]) == (200, "video/mp4")
    with av.open(io.BytesIO(content)) as film:
        frames = [frame.to_ndarray(format="rgb24") for frame in film.decode(video=0)]
    assert len(frames) == 1 + 3 + 6  # the longest walk, then the last frame for a while
    height = frames[0].shape[0] // 3
    you = frames[3][2 * height :].astype(int) - frames[2][2 * height :]
    aware = frames[3][:height].astype(int) - frames[2][:height]
    assert np.abs(you).max() > 60 and np.abs(aware).max() < 60  # the others wait


def test_a_film_that_cannot_be_made_says_why(address: str) -> None:
    for query, said in {"scene=attic": "attic", "walk=" + "L" * 301: "at most 300 steps", "walk=X": "walk=X"}.items():
        answer, content = get(address, f"film.mp4?{query}")
        assert answer.status == 400
        assert said in json.loads(content)["text"]


def test_films_are_made_one_at_a_time(stage: Stage, monkeypatch: pytest.MonkeyPatch) -> None:
    making: list[Path] = []
    at_once = []

    def write_film(stage: Stage, episode: object, path: Path, frames_per_s: int) -> None:
        making.append(path)
        time.sleep(0.1)
        at_once.append(len(making))
        making.remove(path)
        path.write_bytes(b"film")

    monkeypatch.setattr(server, "write_film", write_film)
    client = TestClient(server.make_app(stage))
    with ThreadPoolExecutor(3) as pool:
        answers = list(pool.map(client.get, ["/film.mp4"] * 3))
    assert [answer.content for answer in answers] == [b"film"] * 3
    assert at_once == [1, 1, 1]
