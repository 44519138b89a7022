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


def test_it_walks_in_scenes_that_it_was_not_trained_in(clearway, run, monkeypatch):
    words = ("evaluate", run / "run", run / "grid.h5", run / "corridor.h5", "--goals", 5, "--step-limit", 20)
    found = clearway(*words, "--json").json
    assert [scene["scene"] for scene in found["scenes"]] == ["grid", "corridor"]
    wanted = {"scene", "success", "success_4x", "spl", "collisions", "steps", "episodes", "false_arrivals"}
    wanted |= {"success_stopped"}
    assert all(set(scene) - {"missed_arrivals"} == wanted and scene["episodes"] == 5 for scene in found["scenes"])
    assert found["average"]["episodes"] == 10 and set(found["average"]) == wanted - {"scene"} | {"missed_arrivals"}
    assert [other["agent"] for other in found["others"]] == ["random", "shortest path"]
    assert clearway(*words, "--json").json == found != clearway(*words, "--seed", 1, "--json").json
    shown = clearway(*words)
    assert shown.code == 0 and "10 goals in 2 scenes" in shown.out and "shortest path" in shown.out
    monkeypatch.setenv("COLUMNS", "80")
    shown = clearway(*words).out
    assert "at most 20 steps, seed 0" in shown and "SPL: success weighted by path length" in " ".join(shown.split())
    assert "…" not in shown and max(len(line.rstrip()) for line in shown.splitlines()) <= 80
    assert shown.split().count("arrivals") == 2  # both whole


def test_a_long_name_of_an_agent_is_folded_not_cut():
    from rich.console import Console

    from clearway.cli.goals import _empty

    table = _empty("goals", "agent", ["success"], {})
    table.add_row("MyRecurrentPlannerAgent", "100.0 %")
    console = Console(width=80)
    with console.capture() as shown:
        console.print(table)
    assert "…" not in shown.get()
    assert "".join(line[:16].strip() for line in shown.get().splitlines()[2:]) == "MyRecurrentPlannerAgent"


@pytest.fixture(scope="module")
def rooms(clearway, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of one generated room."""
    folder = tmp_path_factory.mktemp("rooms")
    words = ("--kind", "room", "--count", 1, "--split", "validation", "--size", 32, 48, "--encoder", "none")
    made = clearway("scenes", "generate", *words, "--workers", 1, "--out", folder)
    assert made.code == 0, made
    return folder


@pytest.mark.slow
def test_it_walks_by_perturbed_pictures_of_rooms_built_again(clearway, run, rooms):
    words = ("evaluate", run / "run", rooms, "--goals", 5, "--step-limit", 60, "--perturb", "all", "--takes", 1)
    found = clearway(*words, "--json").json
    assert found["perturbed"]["takes"] == 1 and found["perturbed"]["perturbations"]["pixel_noise"] == 10
    plain = clearway(*words[:-4], "--json").json
    assert plain["perturbed"] is None and plain["scenes"] != found["scenes"]
    assert [one["scenes"] for one in plain["others"]] == [one["scenes"] for one in found["others"]]
    shown = clearway(*words)
    assert shown.code == 0 and "5 goals in 1 scene, pictures perturbed: move ± 0.05 m" in shown.out
    words = ("evaluate", run / "run", rooms, "--goals", 1, "--step-limit", 30, "--live", "--json")
    (live,) = clearway(*words).json["results"]
    assert live["agent"] == "recurrent" and live["average"]["episodes"] == 1 and live["average"]["steps"] > 1


@pytest.mark.parametrize(
    ("words", "parts"),
    [
        (("--goals", 0), ("--goals 0",)),
        (("--goals", 500), ("500 goals asked for, the largest part has",)),
        (("--goals", 5, "--episodes", 3), ("--episodes", "Leave one of the two out")),
        (("--goals", 5, "--live"), ("grid", "there is no room to walk in: the scene comes from test")),
        (("--goals", 5, "--live", "--tour", 9), ("--tour 9: recurrent keeps no map", "Leave it out")),
        (("--goals", 5, "--live", "--against", "x"), ("--against", "Leave one of the two out")),
        (("--goals", 5, "--live", "--selection", "argmax"), ("--selection", "Leave one of the two out")),
        (("--goals", 5, "--live", "--light", 2), ("--light is 2, expected at most 1",)),
        (("--goals", 5, "--live", "--takes", 3), ("--takes", "walks on the grid")),
        (("--goals", 5, "--light", 0.3), ("--light", "Leave one of the two out")),
        (("--goals", 5, "--perturb", "all"), ("grid", "there is no room to walk in: the scene comes from test")),
        (("--goals", 5, "--perturb", "fog"), ("--perturb", "fog", "Choose among none, geometry, all")),
        (("--goals", 5, "--perturb", "all", "--takes", 0), ("--takes 0",)),
        (("--goals", 5, "--takes", 3), ("--takes", "Add --perturb")),
        (("--perturb", "all"), ("--perturb", "goes with --goals alone")),
        (("--perturb", "all", "--live"), ("--perturb", "goes with --goals alone")),
        (("--goals", 5, "--perturb", "all", "--live"), ("--perturb", "--live has a flag for each")),
        (("--takes", 3), ("--takes", "goes with --goals alone")),
    ],
)
def test_bad_input_is_one_line(clearway, run, words, parts):
    assert clearway("evaluate", run / "run", run / "grid.h5", *words).refusal(*parts)


def test_goals_need_scenes(clearway, run):
    assert clearway("evaluate", run / "run", "--goals", 5).refusal("no scenes", "Name scene files")


@pytest.fixture
def asked(monkeypatch, tmp_path) -> list:
    """Which generated rooms were asked for; a made-up one stands in for them."""
    calls = []

    def generate(kind, count, **rest):
        calls.append((kind, count, rest["split"], rest["encoder"]))
        write_scene(grid_scene(2), tmp_path / "grid.h5")
        return [tmp_path / "grid.h5"]

    monkeypatch.setattr("clearway.api.generation.generate", generate)
    return calls


def test_generated_rooms_of_a_split_are_walked_in(clearway, run, asked):
    found = clearway("evaluate", run / "run", "--rooms", "validation", "--step-limit", 5, "--json").json
    assert found["average"]["episodes"] == 20  # goals where nothing else is said
    words = ("--rooms", "train", "--kind", "flat", "--count", 3, "--goals", 2, "--step-limit", 5, "--json")
    assert clearway("evaluate", run / "run", *words).json["average"]["episodes"] == 2
    words = ("--live", "--rooms", "validation", "--count", 1)
    assert clearway("evaluate", run / "run", *words).refusal("grid", "there is no room to walk in")
    assert asked == [
        ("room", 10, "validation", "none"),
        ("flat", 3, "train", "none"),
        ("room", 1, "validation", "none"),
    ]


@pytest.mark.parametrize(
    ("words", "parts"),
    [
        (("--rooms", "dev"), ("--rooms", "train", "validation", "test")),
        (("--rooms", "validation", "--kind", "house"), ("--kind", "room", "flat")),
        (("--rooms", "validation", "--count", 0), ("--count 0", "from 1 to 1000000")),
        (("--rooms", "validation", "--count", 1_000_001), ("--count 1000001",)),
        (("--rooms", "validation", "--goals", 0), ("--goals 0",)),
        (("--rooms", "validation", "--episodes", 3), ("--episodes: not with --rooms", "Leave one of the two out")),
        (("--kind", "flat"), ("--kind: goes with --rooms alone",)),
        (("--kind", "flat", "--goals", 2), ("--kind: goes with --rooms alone",)),
        (("--rooms", "validation", "--perturb", "fog"), ("--perturb 'fog': there is none of that name",)),
        (("--rooms", "validation", "--selection", "argmax"), ("--selection: not with --rooms",)),
        (("--count", 2), ("--count: goes with --rooms alone",)),
    ],
)
def test_rooms_that_cannot_be_made_are_one_line(clearway, run, monkeypatch, words, parts):
    monkeypatch.setattr("clearway.generation.cached.generate_scenes", lambda *_, **__: pytest.fail("rendered"))
    assert clearway("evaluate", run / "run", *words).refusal(*parts)


def test_rooms_and_scene_files_are_not_mixed(clearway, run):
    words = ("evaluate", run / "run", run / "grid.h5", "--rooms", "validation")
    assert clearway(*words).refusal("--rooms", "grid.h5 is given too")


def test_the_generalist_walks_to_goals_where_nothing_is_said_of_them(clearway, run):
    found = clearway("evaluate", "generalist", run / "grid.h5", "--step-limit", 2, "--json").json
    assert found["agent"] == "generalist" and found["average"]["episodes"] == 20
    refused = clearway("evaluate", "generalist", run / "grid.h5", "--light", 0.3)
    assert refused.refusal("--light: not with generalist, which walks once to each goal")
    assert clearway("evaluate", "nobody", "--rooms", "validation").refusal("nobody: no run here")


@pytest.mark.slow
def test_the_generalist_walks_off_the_grid(clearway, rooms):
    words = ("evaluate", "generalist", rooms, "--live", "--goals", 2, "--step-limit", 2)
    (found,) = clearway(*words, "--angle-noise", 5, "--json").json["results"]
    assert found["agent"] == "generalist" and found["perturbed"]["perturbations"]["angle_noise"] == 5
    wanted = {"success", "success_4x", "spl", "collisions", "steps", "episodes"}
    assert wanted <= set(found["average"]) and len(found["scenes"]) == 1 and found["average"]["episodes"] == 2
    shown = clearway(*words, "--light", 0.3)
    assert shown.code == 0 and "2 goals in 1 scene" in shown.out and "light ± 30%" in shown.out, shown
    assert max(map(len, shown.out.splitlines())) <= 80


def test_off_the_grid_the_generalist_needs_rooms_to_walk_in(clearway, run):
    assert clearway("evaluate", "generalist", "--live").refusal("no scenes", "Name scene files")
    refused = clearway("evaluate", "generalist", run / "grid.h5", "--live", "--goals", 5)
    assert refused.refusal("grid", "there is no room to walk in: the scene comes from test")
