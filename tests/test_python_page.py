"""Every block of docs/python.md, from top to bottom in one namespace."""

import warnings
from functools import partial
from pathlib import Path

import pytest

from clearway.perception import encode
from clearway.perception.random_resnet import ResNetShape
from clearway.rooms import library
from helpers.documents import ROOT, Block, code_blocks, shortened
from helpers.made import grid_scene

PAGE = ROOT / "docs/python.md"
FEWER = {"frames=600_000": "frames=4_000", "frames=200_000": "frames=4_000", "episodes=100": "episodes=2"}
SMALLER = {**FEWER, "episodes=100": "episodes=1", "episodes=20": "episodes=1, step_limit=100"}
TWICE = {"step_limit=100, step_limit=500": "step_limit=100"}


def run_page(changes: dict[str, str]) -> dict[str, object]:
    """Run the blocks; what they leave in their namespace."""
    found: dict[str, object] = {"__name__": "page"}
    for block in python_blocks():
        here = {old: new for old, new in changes.items() if old in block.text}
        text = shortened(block.text, here)
        for old, new in TWICE.items():
            text = text.replace(old, new)
        exec(compile(text, str(PAGE), "exec"), found)
    return found


def python_blocks() -> list[Block]:
    blocks = code_blocks(PAGE)
    assert {block.language for block in blocks} == {"python", "toml"}
    return [block for block in blocks if block.language == "python"]


def test_what_is_to_be_shortened_stands_there() -> None:
    whole = "\n".join(block.text for block in python_blocks())
    assert all(old in whole for old in SMALLER)


@pytest.mark.slow
def test_the_blocks_run_on_a_small_room(tmp_path: Path, monkeypatch, capsys) -> None:
    def stand_in(name, seed, **_):
        return grid_scene(3, width=6, depth=5, obstacle_share=0.1, picture_size=(32, 32), name=name)

    small = ResNetShape(8, (8, 16), (1, 1))
    monkeypatch.setattr(library, "cached_room_scene", stand_in)
    monkeypatch.setattr(encode, "find_record", partial(encode.find_record, shape=small))
    monkeypatch.setenv("CLEARWAY_CACHE", str(tmp_path / "cache"))
    monkeypatch.chdir(tmp_path)
    left = run_page(SMALLER)
    said = capsys.readouterr().out
    assert "learning_rate: no such setting" in said
    assert "quarters" in said and "beta -0.05" in said and "few-turns" in said
    assert left["run"].folder is None
    assert {path.name for path in (tmp_path / "runs/bathroom").glob("evaluation.*")} == {
        "evaluation.json",
        "evaluation.md",
    }
    graph_steps = left["scene"].distances_to([left["target"]])[0]
    assert max(left["lengths"]) <= graph_steps.max()  # the page's Q-learning has found the shortest paths
    assert [left["run"].record.reward.name, left["short"].record.learner.algorithm] == ["collision-aware", "a2c"]


@pytest.mark.slow
def test_the_blocks_run_on_the_room_itself(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    with warnings.catch_warnings():
        warnings.simplefilter("default")
        left = run_page(FEWER)
    assert left["room"].cell_count == 45
