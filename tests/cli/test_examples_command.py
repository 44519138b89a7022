"""`clearway examples` and `clearway view --example`, and pages saved by `clearway view --save`."""

from pathlib import Path

import pytest

from clearway.examples.shipped import SHIPPED


@pytest.fixture
def served(monkeypatch) -> list:
    """What would have been served."""
    calls: list = []
    monkeypatch.setattr("clearway.web.local.serve", lambda app, listener: (calls.append(app), listener.close()))
    return calls


def test_the_list_has_a_command_for_each(clearway):
    answer = clearway("examples")
    assert answer.code == 0
    rows = answer.out.splitlines()
    assert [row.split()[0] for row in rows if "clearway view" in row] == ["bathroom", "generalist"]
    content = clearway("examples", "--json").json
    assert list(content["open"].values()) == ["clearway view --example", "clearway view generalist --example"]
    assert content["made_by"] and content["sha256"]


@pytest.mark.slow
def test_the_commands_of_the_list_open_pages(clearway, served):
    for command in clearway("examples", "--json").json["open"].values():
        answer = clearway(*command.split()[1:])
        assert answer.code == 0 and answer.out.startswith("http://127.0.0.1:"), answer
        assert ("#scene=bathroom&" in answer.out) == ("generalist" not in command)
    assert len(served) == 2


def test_an_altered_example_is_refused_in_one_line(clearway, served, monkeypatch, tmp_path):
    for name in ("card.json", "scene.h5"):
        (tmp_path / name).write_bytes((SHIPPED / name).read_bytes()[:-1] + b" ")
    monkeypatch.setattr("clearway.examples.shipped.load_example.__defaults__", (tmp_path,))
    monkeypatch.setattr("clearway.examples.stage.example_stage.__defaults__", (tmp_path,))
    assert clearway("view", "--example").refusal("Install clearway again")
    assert served == []


@pytest.mark.slow
def test_a_page_is_saved(clearway, served, trained, tmp_path):
    words = ("--episode", "#start=3&walk=FR&seed=2", "--save", tmp_path / "page", "--episodes", 1)
    answer = clearway("view", trained.run, *words)
    assert answer.code == 0, answer
    assert served == []
    assert str(tmp_path / "page/index.html") in answer.err and " MB" in answer.err
    assert (tmp_path / "page/index.html").exists()
    assert '"start":3' in (tmp_path / "page/data.js").read_text()


@pytest.mark.parametrize(
    ("words", "parts"),
    [
        (("view", "--example", "run"), ("--example", "a run or scene was given too")),
        (("view", "--example", "--scenes", "a.h5"), ("--example", "--scenes was given too")),
        (("view", "generalist", "a.h5", "--example"), ("--example", "a run or scene was given too")),
        (("view", "generalist", "--room", 3, "--example"), ("--example", "--room was given too")),
        (("view", "--example", "--tour", 5), ("--tour", "keep no map")),
        (("view", "--example", "--save", "full"), ("full", "no empty folder")),
        (("view", "--example", "--save", "new", "--port", 80), ("--port", "not served")),
        (("view", "--example", "--save", "new", "--open"), ("--open", "not served")),
        (("view", "--example", "--save", "new", "--episodes", 0), ("--episodes is 0",)),
        (("view", "--example", "--episodes", 2), ("--episodes", "--save")),
        (("view", "--example", "--save", "new", "--episode", "#scene=attic"), ("attic", "bathroom")),
        (("view", "nowhere", "--save", "new"), ("nowhere: no run here",)),
        (("view", "--save", "new"), ("0 run folders", "clearway view --example")),
        (("examples", "--remake", "full"), ("full", "no empty folder")),
    ],
)
def test_what_cannot_be_opened_or_saved(clearway, served, tmp_path, monkeypatch, words, parts):
    monkeypatch.chdir(tmp_path)
    Path("full").mkdir()
    Path("full/mine").touch()
    assert clearway(*words).refusal(*parts)
    assert served == []
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["full", "mine"]
