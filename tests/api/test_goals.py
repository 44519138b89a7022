from __future__ import annotations

import json
import runpy
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import clearway
from clearway import evaluate_goals
from clearway.agents.agent import FEATURES
from clearway.agents.by_pose import RandomWalk
from clearway.errors import AgentError, ArgumentError, ClearwayError, EncoderError, SceneError
from clearway.live import live_room
from clearway.live.conditions import Perturbations
from clearway.perception import encoder_from_record, eyes
from clearway.perception.eyes import write_eyes
from clearway.scenes.scene import Scene
from clearway.scenes.sensors import RGB
from clearway.scenes.thor_v1 import write_scene
from clearway.scenes.validate import SceneWarning
from clearway.views import grid
from helpers.agents import Spy
from helpers.made import corridor_scene, grid_scene, scene_of_cells, with_depth
from helpers.small_eyes import seen_by_eyes, small_eyes

SMALL = {"frames": 800, "envs": 10, "rollout_steps": 8, "step_limit": 30, "width": 16}


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A recurrent agent of a corridor."""
    folder = tmp_path_factory.mktemp("run")
    scene = seen_by_eyes(folder / "eyes", corridor_scene(5))[0]
    write_scene(scene, folder / "corridor.h5")
    settings = clearway.Recurrent(**SMALL)
    clearway.train(folder / "corridor.h5", [16, 8], algorithm=settings, out=folder / "run")
    return folder


def test_a_recurrent_agent_walks_in_rooms_that_it_has_never_entered(run):
    known = seen_by_eyes(run / "eyes", grid_scene(3))[0]
    told, random, shortest = evaluate_goals(run / "run", [known], goals=7, step_limit=40, seed=2)
    assert (told.agent, random.agent, shortest.agent) == ("recurrent", "random", "shortest path")
    assert list(told.scenes) == ["grid"] and told.average.episodes == 7
    # whatever features the scene has, or none: the agent sees the pictures by its own eyes
    again = evaluate_goals(clearway.load_agent(run / "run"), [grid_scene(3)], goals=7, step_limit=40, seed=2)
    assert again[0].to_json() == told.to_json()


def test_the_benchmark_of_walkers_keeps_how_they_were_trained_and_who_may_try_again(run, tmp_path, monkeypatch):
    benchmarks = Path(__file__).parents[2] / "benchmarks"
    (tmp_path / "rooms").mkdir()
    write_scene(grid_scene(3), tmp_path / "rooms" / "grid.h5")
    shutil.copytree(run / "run", tmp_path / "aware-0")
    words = ["rooms", "aware-0", "--goals", "5", "--trying-again", "aware", "--json", "record.json"]
    monkeypatch.syspath_prepend(benchmarks)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.argv", ["walkers", *words])
    runpy.run_path(str(benchmarks / "walkers.py"), run_name="__main__")
    record = json.loads((tmp_path / "record.json").read_text())
    trained = record["runs"]["aware-0"]
    assert (trained["seed"], trained["reward"]["name"], trained["frames"]) == (0, "collision-aware", SMALL["frames"])
    walks = [record[name]["average"] for name in ("aware-0", "aware-again-0")]
    assert walks[0]["episodes"] == 5 and walks[0]["collisions"] < walks[1]["collisions"]
    (tmp_path / "aware-0").rename(tmp_path / "aware-1")
    monkeypatch.setattr("sys.argv", ["walkers", "rooms", "aware-1"])
    with pytest.raises(SystemExit):
        runpy.run_path(str(benchmarks / "walkers.py"), run_name="__main__")


def test_an_agent_of_one_s_own_and_its_maker(run):
    for agent in (RandomWalk(), lambda world: RandomWalk()):
        own, random, _ = evaluate_goals(agent, [corridor_scene(5)], goals=4, step_limit=40)
        assert own.scenes == random.scenes


def test_agents_of_one_s_own_cannot_tour():
    for agent in (RandomWalk, RandomWalk()):
        with pytest.raises(ArgumentError, match=r"tour=10: RandomWalk is an agent of your own, and none .* can tour"):
            evaluate_goals(agent, [corridor_scene(5)], tour=10)
        with pytest.raises(ArgumentError, match=r"tour=10: RandomWalk is an agent of your own, and none .* can tour"):
            clearway.evaluate_live(agent, [corridor_scene(5)], tour=10)


def test_an_agent_called_as_a_yardstick_is_refused(run):
    def random(world):
        return RandomWalk()

    with pytest.raises(AgentError, match=r"'random': the name of two agents in the table\. Give the function or class"):
        evaluate_goals(random, [corridor_scene(5)], goals=4)
    with pytest.raises(AgentError, match="'random': the name of two agents in the table"):
        clearway.evaluate(random, [corridor_scene(5)], episodes=1)


@pytest.mark.slow
def test_others_walk_in_the_scenes_of_their_training_alone(tmp_path):
    write_scene(corridor_scene(5, feature_count=12), tmp_path / "corridor.h5")
    trained = clearway.train(tmp_path / "corridor.h5", [16, 8], out=tmp_path / "run", **SMALL)
    told, *_ = evaluate_goals(trained.folder, [tmp_path / "corridor.h5"], goals=6, step_limit=40)
    assert told.average.episodes == 6
    with pytest.raises(ClearwayError, match="corridor"):
        evaluate_goals(trained.folder, [grid_scene(1)], goals=6)
    with pytest.warns(SceneWarning, match=r"grid: left out, as the run was not trained there\. .* walks generalist"):
        both, *_ = evaluate_goals(trained.folder, [grid_scene(1), tmp_path / "corridor.h5"], goals=6, step_limit=40)
    assert both.scenes == told.scenes


@pytest.fixture
def taken(monkeypatch):
    """Takes are the scenes' own pictures, but darker by the light asked for; each scene passes for a room."""
    asked = []

    def grid_takes(scenes, perturbations, *, takes, seed, workers, done):
        asked.append((perturbations, takes, seed))
        for number, scene in enumerate(scenes, 1):
            pictures = np.repeat(scene.observations[:][:, None], takes, axis=1)
            yield (pictures * (1 - perturbations.light)).astype(np.uint8)
            done(number)

    monkeypatch.setattr(grid, "grid_takes", grid_takes)
    monkeypatch.setattr(live_room, "check_is_room", lambda scene: None)
    return asked


@pytest.mark.slow
def test_perturbed_takes_are_seen_by_the_agent_s_own_eyes(run, taken):
    # takes never come again to the bit, so that nothing is held for blocked: here neither among the scenes' own
    agent = replace(clearway.load_agent(run / "run"), tries_again=True)
    scenes, settings = [grid_scene(3), corridor_scene(5)], {"goals": 7, "step_limit": 60, "seed": 2}
    plain = evaluate_goals(agent, scenes, **settings)
    assert not taken and plain[0].perturbed is None
    # takes that are the scenes' own pictures lead the same way
    moved = Perturbations(distance_noise=0.1)
    same = evaluate_goals(agent, scenes, perturb=moved, **settings)
    assert same[0].scenes == plain[0].scenes
    assert same[0].perturbed == {"label": "move ± 0.1 m", "perturbations": moved.to_json(), "takes": 4}
    dark = evaluate_goals(agent, scenes, perturb="none light=0.9", takes=2, **settings)
    assert dark[0].scenes != plain[0].scenes and dark[1].scenes == plain[1].scenes
    assert taken == [(moved, 4, 2), (Perturbations(light=0.9), 2, 2)]
    again = evaluate_goals(agent, scenes, perturb="none", **settings)
    assert again[0].to_json() == plain[0].to_json() and len(taken) == 2


def test_agents_of_one_s_own_see_takes_of_what_they_see(run, taken):
    scene = seen_by_eyes(run / "eyes", grid_scene(3))[0]
    settings = {"goals": 4, "step_limit": 20, "perturb": "light=0.5"}
    spy = Spy(RGB, FEATURES)
    evaluate_goals(spy, [scene], **settings)
    eyes = encoder_from_record(scene.encoder)
    seen = spy.seen[3]
    assert seen[RGB].max() < 128 < spy.targets[0][RGB].max()
    np.testing.assert_allclose(seen[FEATURES], eyes.encode(seen[RGB]), atol=1e-2)  # but for their last bits
    made = []
    evaluate_goals(lambda world: made.append(Spy(RGB)) or made[-1], [scene], **settings)
    assert made[-1].seen[0][RGB].max() < 128
    unknown = replace(scene, encoder=None)
    evaluate_goals(lambda world: made.append(Spy(RGB)) or made[-1], [unknown], **settings)
    assert made[-1].seen[0][RGB].max() < 128
    evaluate_goals(RandomWalk(), [corridor_scene(5)], **settings)
    assert len(taken) == 3, "nothing is taken for who sees no pictures"
    with pytest.raises(AgentError, match="sees depth, and there are perturbed takes of rgb and features alone"):
        evaluate_goals(Spy("depth"), [with_depth(scene)], **settings)


def test_perturbations_that_cannot_be_had_are_one_line(run, taken, tmp_path, monkeypatch):
    with pytest.raises(ArgumentError, match="perturb='foggy': there is none of that name"):
        evaluate_goals(run / "run", [corridor_scene(5)], goals=4, perturb="foggy")
    with pytest.raises(ArgumentError, match="light=2, expected a number from 0 to 1"):
        evaluate_goals(run / "run", [corridor_scene(5)], goals=4, perturb=Perturbations(light=2))
    with pytest.raises(ArgumentError, match="takes=0"):
        evaluate_goals(run / "run", [corridor_scene(5)], goals=4, perturb="all", takes=0)
    with pytest.raises(ClearwayError, match="20 goals asked for"):
        evaluate_goals(run / "run", [corridor_scene(5)], perturb="all")
    with pytest.raises(EncoderError, match="corridor has no features by a known encoder"):
        evaluate_goals(Spy(FEATURES), [replace(corridor_scene(5), encoder=None)], goals=4, perturb="all")
    write_scene(corridor_scene(5, feature_count=12), tmp_path / "corridor.h5")
    by_pose = clearway.train(tmp_path / "corridor.h5", [16, 8], out=tmp_path / "run", **SMALL)
    with pytest.raises(ArgumentError, match=r"the algorithm ppo goes by poses on the grid.*evaluate --live"):
        evaluate_goals(by_pose.folder, [tmp_path / "corridor.h5"], goals=4, perturb="all")
    table = clearway.train(corridor_scene(5), frames=80, envs=10, rollout_steps=8, algorithm="q-learning").agent
    with pytest.raises(ArgumentError, match=r"algorithm q-learning goes by poses on the grid.*Leave it out"):
        evaluate_goals(table, [corridor_scene(5)], goals=4, perturb="all")
    monkeypatch.undo()
    with pytest.raises(SceneError, match="there is no room to walk in: the scene comes from test"):
        evaluate_goals(run / "run", [corridor_scene(5)], goals=4, perturb="all")
    assert not taken


def test_bad_arguments_are_one_line(run):
    with pytest.raises(ArgumentError, match="goals=0"):
        evaluate_goals(run / "run", [corridor_scene(5)], goals=0)
    with pytest.raises(ClearwayError, match="20 goals asked for, the largest part has 20 poses"):
        evaluate_goals(run / "run", [corridor_scene(5)])
    with pytest.raises(ClearwayError, match="no run here"):
        evaluate_goals(run, [corridor_scene(5)])


@pytest.fixture
def shipped(monkeypatch, tmp_path):
    """Small eyes instead of those that come with clearway."""
    write_eyes(tmp_path / "shipped", small_eyes().eval(), {})
    monkeypatch.setattr(eyes, "SHIPPED", tmp_path / "shipped")
    return tmp_path / "shipped"


def test_the_generalist_walks_anywhere_and_says_where_it_has_arrived(shipped):
    told, random, _ = evaluate_goals("generalist", [grid_scene(3)], goals=5, step_limit=30, seed=2)
    assert told.agent == "generalist" and told.average.episodes == 5 and told.tour is None
    assert 0 <= told.average.false_arrivals <= 1 and random.average.false_arrivals is None
    assert evaluate_goals("generalist", [grid_scene(3)], goals=5, step_limit=30, seed=2)[0] == told


@pytest.mark.slow
def test_it_looks_around_first_where_it_may(shipped):
    scenes = [grid_scene(3), corridor_scene(5)]
    toured, random, _ = evaluate_goals("generalist", scenes, goals=5, step_limit=30, tour=40)
    assert toured.tour["steps"] == 40 and 0 < toured.tour["poses"] <= 1 and random.tour is None
    assert list(toured.scenes) == ["grid", "corridor"] and toured.average.episodes == 10
    alone, *_ = evaluate_goals("generalist", scenes[1:], goals=5, step_limit=30, tour=40)
    assert alone.scenes["corridor"] == toured.scenes["corridor"]


def test_a_tour_of_a_room_without_ways_out_is_one_line(shipped):
    cell = scene_of_cells(np.zeros((1, 2), int))
    told, *_ = evaluate_goals("generalist", cell, goals=2, step_limit=9)
    assert told.average.success == 1
    with pytest.raises(SceneError, match=r"cells: every move is blocked .* Leave the tour out, or"):
        evaluate_goals("generalist", cell, goals=2, tour=10)


@pytest.mark.slow
def test_it_walks_by_steps_of_other_lengths_but_by_one_at_a_time(shipped):
    scene = grid_scene(3)
    about, exact = (
        evaluate_goals("generalist", stretched(scene, by), goals=3, step_limit=9)[0] for by in (1 + 1e-7, 1)
    )
    assert about == exact  # a size that was rounded once
    for step_m in (0.25, 0.6):
        told, *_ = evaluate_goals("generalist", [stretched(scene, step_m / scene.cell_size_m)], goals=3, step_limit=9)
        assert told.average.episodes == 3
    with pytest.raises(SceneError, match=r"b: moves of 0.25 m, and in grid they are of 0.5 m\. Walk in each by"):
        evaluate_goals("generalist", [scene, replace(stretched(scene, 0.5), name="b")], goals=3)
    with pytest.raises(SceneError, match=r"moves of 0.1 m, and the generalist walks by 0.2 to 1 m\. Build or import"):
        evaluate_goals("generalist", [stretched(scene, 0.2)], goals=3)


def stretched(scene: Scene, by: float) -> Scene:
    """The scene with cells of another size."""
    return replace(scene, locations_m=scene.locations_m * by, cell_size_m=scene.cell_size_m * by)


def test_a_tour_is_nothing_for_an_agent_without_a_map(run):
    with pytest.raises(ArgumentError, match=r"tour=40: recurrent keeps no map\. Leave it out"):
        evaluate_goals(run / "run", [corridor_scene(5)], goals=4, tour=40)


def test_altered_eyes_are_refused(shipped):
    weights = shipped / "eyes.safetensors"
    content = bytearray(weights.read_bytes())
    content[-1] ^= 1
    weights.write_bytes(content)
    with pytest.raises(EncoderError, match="altered, its SHA-256"):
        evaluate_goals("generalist", [corridor_scene(5)], goals=4)
