"""`clearway evaluate RUN FILES --goals`: an agent in scenes that it has never entered."""

from __future__ import annotations

from pathlib import Path

import pytest

from clearway.scenes.thor_v1 import write_scene
from helpers.made import corridor_scene, grid_scene
from helpers.small_eyes import seen_by_eyes


@pytest.fixture(scope="module")
def run(clearway, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("goals")
    write_scene(seen_by_eyes(folder / "eyes", corridor_scene(5))[0], folder / "corridor.h5")
    write_scene(grid_scene(2), folder / "grid.h5")
    settings = ("--frames", 200, "--threads", 1, "--set", "envs=10", "rollout_steps=5", "width=8")
    words = ("train", folder / "corridor.h5", "--algorithm", "recurrent", "--out", folder / "run", *settings)
    answer = clearway(*words)
    assert answer.code == 0, answer
    return folder


def test_it_walks_in_scenes_that_it_was_not_trained_in(clearway, run):
    words = ("evaluate", run / "run", run / "grid.h5", run / "corridor.h5", "--goals", 5, "--step-limit", 20)
    found = clearway(*words, "--json").json
    assert [scene["scene"] for scene in found["scenes"]] == ["grid", "corridor"]
    wanted = {"scene", "success", "success_4x", "spl", "collisions", "steps", "episodes"}
    assert all(set(scene) == wanted and scene["episodes"] == 5 for scene in found["scenes"])
    assert found["average"]["episodes"] == 10 and set(found["average"]) == wanted - {"scene"}
    assert [other["agent"] for other in found["others"]] == ["random", "shortest path"]
    assert clearway(*words, "--json").json == found != clearway(*words, "--seed", 1, "--json").json
    shown = clearway(*words)
    assert shown.code == 0 and "10 goals in 2 scenes" in shown.out and "shortest path" in shown.out


@pytest.mark.parametrize(
    ("words", "parts"),
    [
        (("--goals", 0), ("--goals 0",)),
        (("--goals", 500), ("500 goals asked for, the largest part has",)),
        (("--goals", 5, "--episodes", 3), ("--episodes", "Leave one of the two out")),
        (("--goals", 5, "--live"), ("--live", "Leave one of the two out")),
    ],
)
def test_bad_input_is_one_line(clearway, run, words, parts):
    assert clearway("evaluate", run / "run", run / "grid.h5", *words).refusal(*parts)


def test_goals_need_scenes(clearway, run):
    assert clearway("evaluate", run / "run", "--goals", 5).refusal("no scenes", "Name scene files")
