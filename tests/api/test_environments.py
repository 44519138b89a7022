import numpy as np
import pytest

import clearway
from clearway.envs.single import ImageGoalEnv
from clearway.envs.vector import ImageGoalVectorEnv
from clearway.errors import ArgumentError
from clearway.live_envs.single import LiveImageGoalEnv
from clearway.live_envs.vector import LiveImageGoalVectorEnv
from clearway.scenes.floor_plans import FloorPlan
from clearway.scenes.plan_scenes import floor_plan_scene
from clearway.scenes.thor_v1 import write_scene
from helpers.made import corridor_scene


def test_one_environment_and_many(tmp_path) -> None:
    write_scene(corridor_scene(), tmp_path / "corridor.h5")
    env = clearway.make_env(str(tmp_path / "corridor.h5"), targets={"corridor": [16]}, max_episode_steps=3)
    assert isinstance(env.unwrapped, ImageGoalEnv)
    assert env.reset(seed=0, options={"start": 4})[1]["distance_to_go"] == 3
    assert [env.step(0)[2:4] for _ in range(3)] == [(False, False), (False, False), (True, True)]
    assert clearway.make_env(corridor_scene(), max_episode_steps=np.int64(3)).spec.max_episode_steps == 3
    for none in (-1, np.int64(-1)):
        assert clearway.make_env(corridor_scene(), max_episode_steps=none).spec.max_episode_steps is None
    envs = clearway.make_env(corridor_scene(), num_envs=np.int64(3), reward="shortest")
    assert isinstance(envs, ImageGoalVectorEnv)
    assert envs.reset(seed=0)[0]["observation"].shape[:2] == (3, 4)


def test_pictures_of_a_file(tmp_path) -> None:
    write_scene(corridor_scene(), tmp_path / "corridor.h5")
    env = clearway.make_env(tmp_path, observations="pictures", render_mode="rgb_array")
    assert env.reset(seed=0)[0]["target"].shape == (12, 16, 3)
    assert env.render().ndim == 3


@pytest.mark.parametrize(
    ("options", "part"),
    [
        ({"max_steps": 3}, "max_steps: no such option of this environment. Use one of targets, reward"),
        ({"autoreset_mode": "SameStep"}, "no such option"),
        ({"num_envs": 0}, "num_envs=0: expected a whole number from 1 on"),
        ({"num_envs": "3"}, "num_envs='3': expected a whole number"),
        ({"max_episode_steps": 0}, "max_episode_steps=0: expected a whole number from 1 on"),
        ({"max_episode_steps": "5"}, "max_episode_steps='5': expected a whole number"),
        ({"max_episode_steps": -1.0}, "max_episode_steps=-1.0: expected a whole number"),
        ({"max_episode_steps": np.array([5, 6])}, "max_episode_steps=array.*: expected a whole number"),
        ({"render_mode": 5}, "render_mode=5: expected a word"),
        ({"sensors": 5}, "sensors=5: expected names"),
        ({"sensors": [["rgb"]]}, "expected names"),
        ({"reward": ["shortest"]}, r"reward=\['shortest'\] is unknown"),
    ],
)
def test_options_that_do_not_fit_are_refused(options, part) -> None:
    with pytest.raises((ArgumentError, ValueError), match=part) as caught:
        clearway.make_env(corridor_scene(), **options)
    assert isinstance(caught.value, clearway.ClearwayError)


@pytest.mark.slow
def test_a_live_one_and_many(tmp_path) -> None:
    plan = floor_plan_scene(FloorPlan.of_map("small", np.ones((3, 2), bool), cell_size_m=0.5), feature_count=4)
    write_scene(plan, tmp_path / "small.h5")
    env = clearway.make_env(tmp_path / "small.h5", live=True, stop=True, height_px=12, width_px=16)
    assert isinstance(env.unwrapped, LiveImageGoalEnv) and env.action_space.n == 5
    assert env.reset(seed=0)[0]["observation"].shape == (12, 16, 3)
    envs = clearway.make_env(plan, num_envs=2, live=True, height_px=12, width_px=16)
    assert isinstance(envs, LiveImageGoalVectorEnv) and envs.num_envs == 2
    env.close()
    envs.close()


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        ({"scenes": "bathroom", "live": 1}, "live=1: expected True or False"),
        (
            {"scenes": "bathroom", "observations": "pictures"},
            "observations: no such option.* room_seed, targets, reward",
        ),
        ({"scenes": [corridor_scene(), corridor_scene()]}, "a live environment is one room, found 2 scenes"),
        ({"scenes": corridor_scene()}, "there is no room to walk in: the scene comes from"),
    ],
)
def test_live_ones_that_do_not_fit_are_refused(arguments, part) -> None:
    with pytest.raises(clearway.ClearwayError, match=part):
        clearway.make_env(**{"live": True, **arguments})
