"""`clearway view` and `clearway scenes view`: what they refuse; the page itself is tested in tests/view."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager

import av
import pytest

from clearway.agents.generalist import GENERALIST
from clearway.scenes.thor_v1 import read_scene, write_scene
from clearway.web.local import listening, port_of
from helpers.made import grid_scene


@pytest.fixture
def served(monkeypatch) -> list:
    """What would have been served."""
    calls: list = []
    monkeypatch.setattr("clearway.web.local.serve", lambda app, listener: (calls.append(app), listener.close()))
    return calls


def test_it_says_where_the_page_is(clearway, trained, served):
    answer = clearway("view", trained.run, "--episode", "http://127.0.0.1:1/token/#start=3&walk=FR&seed=2")
    assert answer.code == 0 and len(served) == 1
    address, fragment = answer.out.strip().split("#")
    assert address.startswith("http://127.0.0.1:") and address.endswith("/")
    assert fragment == "start=3&selection=sampled&seed=2&walk=FR"
    answer = clearway("scenes", "view", trained.scene)
    assert answer.code == 0 and answer.out.startswith("http://127.0.0.1:")


def test_it_opens_the_browser_only_when_asked_to(clearway, trained, served, monkeypatch):
    opened: list[str] = []

    @contextmanager
    def note(address: str) -> Iterator[None]:
        assert not served[1:]  # before it serves
        opened.append(address)
        yield

    monkeypatch.setattr("clearway.web.browser.opened_in_browser", note)
    clearway("scenes", "view", trained.scene)
    assert opened == []
    answer = clearway("scenes", "view", trained.scene, "--open")
    assert opened == [answer.out.strip()]


@pytest.mark.parametrize(
    ("words", "parts"),
    [
        ((), ("0 run folders", "one or two")),
        (("a", "b", "c"), ("3 run folders", "one or two")),
        (("nowhere",), ("nowhere: no run here",)),
    ],
)
def test_runs_that_cannot_be_shown(clearway, served, words, parts):
    assert clearway("view", *words).refusal(*parts)
    assert served == []


@pytest.mark.parametrize(
    ("words", "parts"),
    [
        (("--episode", "#walk=X"), ("walk=X", "letters FRLB")),
        (("--episode", "#scene=attic"), ("attic", "bathroom_02")),
        (("--episode", "#start=999"), ("start 999", "0 to 75")),
        (("--port", "65536"), ("--port is 65536",)),
        (("--port", "-1"), ("--port is -1",)),
    ],
)
def test_words_that_do_not_fit_the_run(clearway, trained, served, words, parts):
    assert clearway("view", trained.run, *words).refusal(*parts)
    assert served == []


def test_a_port_that_is_taken(clearway, trained, served):
    with listening(0) as listener:
        assert clearway("scenes", "view", trained.scene, "--port", port_of(listener)).refusal(
            f"--port {port_of(listener)}", "in use"
        )


def test_files_that_are_no_scene(clearway, trained, served, tmp_path):
    assert clearway("scenes", "view", tmp_path / "none.h5").refusal("none.h5", "no such file")
    for name in ("a.h5", "b.h5"):
        (tmp_path / name).write_bytes(trained.scene.read_bytes())
    assert clearway("scenes", "view", tmp_path).refusal("a folder of 2 scene files")


@pytest.mark.parametrize(
    ("package", "module"), [("fastapi", "clearway.view.server"), ("uvicorn", "clearway.web.local")]
)
def test_a_missing_package_names_the_extra(clearway, trained, monkeypatch, package, module):
    monkeypatch.delitem(sys.modules, module, raising=False)
    monkeypatch.setitem(sys.modules, package, None)
    assert clearway("scenes", "view", trained.scene).refusal("pip install '", "[view]'")


@pytest.fixture
def pictured(tmp_path):
    """A scene with pictures, which no agent was trained on."""
    write_scene(grid_scene(2), tmp_path / "grid.h5")
    return tmp_path / "grid.h5"


def test_the_generalist_walks_in_any_scene(clearway, served, pictured, monkeypatch):
    chosen = []
    monkeypatch.setattr(
        "clearway.generation.cached.room_of_seed", lambda seed, done: chosen.append(seed) or read_scene(pictured)
    )
    for words in ((GENERALIST, pictured), ("--agent", GENERALIST, "--room", 7), (GENERALIST, "--room", 8, "--tour", 3)):
        answer = clearway("view", *words)
        assert answer.code == 0 and answer.out.startswith("http://127.0.0.1:"), answer
    assert len(served) == 3 and chosen == [7, 8]


@pytest.mark.parametrize(
    ("words", "parts"),
    [
        ((GENERALIST,), ("walks in a scene", "--room SEED")),
        (("--agent", GENERALIST), ("walks in a scene", "--room SEED")),
        ((GENERALIST, "a.h5", "--room", 3), ("walks in a scene",)),
        ((GENERALIST, "none.h5"), ("none.h5", "no such file")),
        ((GENERALIST, "--room", -1), ("--room -1", "from 0 to")),
        ((GENERALIST, "--room", "x"), ("--room", "x")),
        ((GENERALIST, "--room", 1, "--tour", -5), ("--tour is -5",)),
        (("run", "--tour", 5), ("--tour", "keep no map")),
        (("run", "--room", 5), ("--room", "goes with the generalist")),
        (("--agent", "wizard", "--room", 5), ("--agent", "generalist")),
    ],
)
def test_a_generalist_that_cannot_be_shown(clearway, served, words, parts):
    assert clearway("view", *words).refusal(*parts)
    assert served == []


@pytest.mark.slow
def test_the_generalist_is_filmed_with_what_it_holds(clearway, pictured, tmp_path):
    answer = clearway("video", GENERALIST, "--scene", pictured, "--most-steps", 4, "--out", tmp_path / "film.mp4")
    assert answer.code == 0, answer
    with av.open(str(tmp_path / "film.mp4")) as film:
        frames = [frame.to_ndarray(format="rgb24") for frame in film.decode(video=0)]
    assert frames[0].shape[1] > 1600  # a column more than other agents'
    assert (frames[0][:, 1500:] != frames[1][:, 1500:]).mean() > 0.01  # the belief, which changes


@pytest.mark.parametrize(
    ("words", "parts"),
    [
        ((GENERALIST,), ("walks in a scene", "--room SEED")),
        ((GENERALIST, "--scene", "none.h5"), ("none.h5", "no such file")),
        ((GENERALIST, "--scene", "a.h5", "--room", 3), ("Leave one of the two out",)),
        ((GENERALIST, "--room", 3, "--selection", "argmax"), ("--selection",)),
        ((GENERALIST, "--room", -3), ("--room -3",)),
        (("run", "--room", 3), ("--room", "goes with the generalist")),
    ],
)
def test_a_film_that_cannot_be_made(clearway, tmp_path, words, parts):
    assert clearway("video", *words, "--out", tmp_path / "film.mp4").refusal(*parts)
    assert not (tmp_path / "film.mp4").exists()
