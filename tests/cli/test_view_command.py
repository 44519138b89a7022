"""`clearway view` and `clearway scenes view`: what they refuse; the page itself is tested in tests/view."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from clearway.web.local import listening, port_of


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
    assert clearway("scenes", "view", trained.scene).refusal("pip install 'clearway[view]'")
