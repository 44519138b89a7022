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


def test_it_walks_by_perturbed_pictures_of_rooms_built_again(clearway, run, tmp_path):
    words = ("--kind", "room", "--count", 1, "--split", "validation", "--size", 32, 48, "--encoder", "none")
    made = clearway("scenes", "generate", *words, "--workers", 1, "--out", tmp_path)
    assert made.code == 0, made
    words = ("evaluate", run / "run", tmp_path, "--goals", 5, "--step-limit", 60, "--perturb", "all", "--takes", 2)
    found = clearway(*words, "--json").json
    assert found["perturbed"]["takes"] == 2 and found["perturbed"]["perturbations"]["pixel_noise"] == 10
    assert clearway(*words, "--json").json == found
    plain = clearway(*words[:-4], "--json").json
    assert plain["perturbed"] is None and plain["scenes"] != found["scenes"]
    assert [one["scenes"] for one in plain["others"]] == [one["scenes"] for one in found["others"]]
    shown = clearway(*words)
    assert shown.code == 0 and "5 goals in 1 scenes, pictures perturbed: move ± 0.05 m" in shown.out


@pytest.mark.parametrize(
    ("words", "parts"),
    [
        (("--goals", 0), ("--goals 0",)),
        (("--goals", 500), ("500 goals asked for, the largest part has",)),
        (("--goals", 5, "--episodes", 3), ("--episodes", "Leave one of the two out")),
        (("--goals", 5, "--live"), ("--live", "Leave one of the two out")),
        (("--goals", 5, "--light", 0.3), ("--light", "Leave one of the two out")),
        (("--goals", 5, "--perturb", "all"), ("grid", "there is no room to walk in: the scene comes from test")),
        (("--goals", 5, "--perturb", "fog"), ("--perturb", "fog", "Choose among none, geometry, all")),
        (("--goals", 5, "--perturb", "all", "--takes", 0), ("--takes 0",)),
        (("--goals", 5, "--takes", 3), ("--takes", "Add --perturb")),
        (("--perturb", "all"), ("--perturb", "goes with --goals alone")),
        (("--perturb", "all", "--live"), ("--perturb", "goes with --goals alone")),
        (("--takes", 3), ("--takes", "goes with --goals alone")),
    ],
)
def test_bad_input_is_one_line(clearway, run, words, parts):
    assert clearway("evaluate", run / "run", run / "grid.h5", *words).refusal(*parts)


def test_goals_need_scenes(clearway, run):
    assert clearway("evaluate", run / "run", "--goals", 5).refusal("no scenes", "Name scene files")
