from __future__ import annotations

import pytest

import clearway
from clearway.agents.by_pose import RandomWalk
from clearway.api.goals import evaluate_goals
from clearway.errors import ArgumentError, ClearwayError
from clearway.scenes.thor_v1 import write_scene
from helpers.made import corridor_scene, grid_scene
from helpers.small_eyes import seen_by_eyes

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


def test_an_agent_of_one_s_own_and_its_maker(run):
    for agent in (RandomWalk(), lambda world: RandomWalk()):
        own, random, _ = evaluate_goals(agent, [corridor_scene(5)], goals=4, step_limit=40)
        assert own.scenes == random.scenes


def test_others_walk_in_the_scenes_of_their_training_alone(tmp_path):
    write_scene(corridor_scene(5, feature_count=12), tmp_path / "corridor.h5")
    trained = clearway.train(tmp_path / "corridor.h5", [16, 8], out=tmp_path / "run", **SMALL)
    told, *_ = evaluate_goals(trained.folder, [tmp_path / "corridor.h5"], goals=6, step_limit=40)
    assert told.average.episodes == 6
    with pytest.raises(ClearwayError, match="corridor"):
        evaluate_goals(trained.folder, [grid_scene(1)], goals=6)


def test_bad_arguments_are_one_line(run):
    with pytest.raises(ArgumentError, match="goals=0"):
        evaluate_goals(run / "run", [corridor_scene(5)], goals=0)
    with pytest.raises(ClearwayError, match="20 goals asked for, the largest part has 20 poses"):
        evaluate_goals(run / "run", [corridor_scene(5)])
    with pytest.raises(ClearwayError, match="no run here"):
        evaluate_goals(run, [corridor_scene(5)])
