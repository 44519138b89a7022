import numpy as np
import pytest

import clearway
from clearway.envs.single import ImageGoalEnv
from clearway.envs.vector import ImageGoalVectorEnv
from clearway.errors import ArgumentError
from clearway.scenes.thor_v1 import write_scene
from helpers.made import corridor_scene


def test_one_environment_and_many(tmp_path) -> None:
    write_scene(corridor_scene(), tmp_path / "corridor.h5")
    env = clearway.make_env(str(tmp_path / "corridor.h5"), targets={"corridor": [16]}, max_episode_steps=3)
    assert isinstance(env.unwrapped, ImageGoalEnv)
    assert env.reset(seed=0, options={"start": 4})[1]["distance_to_go"] == 3
    assert [env.step(0)[2:4] for _ in range(3)] == [(False, False), (False, False), (True, True)]
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
        ({"reward": ["shortest"]}, r"reward=\['shortest'\] is unknown"),
    ],
)
def test_options_that_do_not_fit_are_refused(options, part) -> None:
    with pytest.raises((ArgumentError, ValueError), match=part) as caught:
        clearway.make_env(corridor_scene(), **options)
    assert isinstance(caught.value, clearway.ClearwayError)
