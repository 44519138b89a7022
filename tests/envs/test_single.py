import pickle
from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import check_env

import clearway.envs  # noqa: F401 (registers the environment)
from clearway.envs.registration import ENV_ID
from clearway.envs.single import ImageGoalEnv
from clearway.envs.vector import ImageGoalVectorEnv
from clearway.errors import EnvError
from clearway.reward import BUMP, Moves, Reward, Term
from clearway.scenes.actions import STOP, Action
from helpers.made import corridor_scene, grid_scene, with_depth


@pytest.mark.parametrize("observations", ["features", "pictures"])
@pytest.mark.parametrize("render_mode", [None, "rgb_array", "ansi"])
def test_gymnasiums_own_check_finds_nothing(observations: str, render_mode: str | None) -> None:
    env = gymnasium.make(ENV_ID, scenes=grid_scene(0), observations=observations, render_mode=render_mode)
    check_env(env.unwrapped)  # warnings are errors here


def test_gymnasiums_own_check_finds_nothing_where_depth_is_seen() -> None:
    asked = {"observations": "pictures", "sensors": ("rgb", "depth")}
    env = gymnasium.make(ENV_ID, scenes=with_depth(grid_scene(0)), **asked)
    check_env(env.unwrapped)
    assert list(env.observation_space.spaces) == ["depth", "observation", "target", "target_depth"]
    envs = gymnasium.make_vec(ENV_ID, num_envs=2, scenes=with_depth(grid_scene(0)), **asked)
    assert envs.observation_space["depth"].shape == (2, 4, 12, 16)


def test_spaces_and_values() -> None:
    scene = grid_scene(0)
    env = ImageGoalEnv(scene, history_length=3)
    assert env.observation_space["observation"].shape == (3, 32)
    assert env.observation_space["target"].shape == (32,)
    bound = env.observation_space["target"].high.max()
    assert bound / 2 < np.abs(scene.features).max() <= bound
    assert env.action_space.n == 4
    observation, info = env.reset(seed=0)
    assert np.array_equal(observation["observation"], np.repeat(scene.features[[info["state"]]], 3, axis=0))
    assert np.array_equal(observation["target"], scene.features[info["target"]])
    observation, reward, terminated, truncated, info = env.step(np.int64(Action.TURN_LEFT))
    assert {key: type(value) for key, value in info.items()} == {
        "collision": bool,
        "cost": float,
        "zone": int,
        "distance_to_go": int,
        "scene": int,
        "state": int,
        "target": int,
    }
    assert [type(value) for value in (reward, terminated, truncated)] == [float, bool, bool]
    assert info["distance_to_go"] == scene.distances[info["state"], info["target"]]


def test_pictures_are_those_of_the_scene() -> None:
    scene = grid_scene(0)
    env = ImageGoalEnv(scene, observations="pictures")
    assert env.observation_space["observation"] == gymnasium.spaces.Box(0, 255, (4, 12, 16, 3), np.uint8)
    observation, info = env.reset(seed=0)
    assert observation["observation"].dtype == np.uint8
    assert np.array_equal(observation["observation"][0], scene.observations[info["state"]])
    assert np.array_equal(observation["target"], scene.observations[info["target"]])


def test_the_shortest_path_earns_what_it_should() -> None:
    """Three steps along the corridor: precollision, free, and so on up to the target in the last cell."""
    env = ImageGoalEnv(corridor_scene(5), targets={"corridor": [16]})
    env.reset(options={"target": 16, "start": 0, "scene": "corridor"})
    rewards, ends = [], []
    for _ in range(4):
        _, reward, terminated, truncated, _ = env.step(Action.MOVE_FORWARD)
        rewards.append(reward)
        ends.append((terminated, truncated))
    assert rewards == [-0.011, -0.01, -0.011, 10.0]
    assert ends == [(False, False)] * 3 + [(True, False)]
    with pytest.raises(ResetNeeded, match="are over: call reset"):
        env.step(0)


def test_with_stop_the_agent_says_where_the_episode_ends() -> None:
    """In a corridor of five cells: on to the last but one, whose pose is the target, past it and back."""
    env = ImageGoalEnv(corridor_scene(5), targets={"corridor": [12]}, stop=True)
    assert env.action_space.n == 5
    env.reset(options={"start": 8})
    _, reward, *ends, info = env.step(Action.MOVE_FORWARD)
    assert (reward, ends, info["distance_to_go"]) == (-0.011, [False, False], 0)  # in the target, and on its way
    _, reward, *ends, info = env.step(STOP)
    assert (reward, ends, info["distance_to_go"], info["collision"]) == (10.0, [True, False], 0, False)
    with pytest.raises(ResetNeeded):
        env.step(STOP)
    for start, ordinary in ((8, -0.01), (4, -0.011), (0, -0.02)):
        env.reset(options={"start": start})
        _, reward, *ends, info = env.step(STOP)
        assert (reward, ends, info["state"], info["collision"]) == (ordinary, [True, False], start, False)
    check_env(env, skip_render_check=True)


def test_stopping_costs_no_bump_and_fits_terms_for_four_actions() -> None:
    @dataclass(frozen=True)
    class Turning(Term):
        def __call__(self, earned: np.ndarray, moves: Moves) -> np.ndarray:
            return earned - 0.5 * np.isin(np.arange(4), (1, 2))

    reward = Reward("turning", (*BUMP.terms[:2], Turning(), BUMP.terms[2]))
    env = ImageGoalEnv(corridor_scene(5), targets={"corridor": [4]}, reward=reward, stop=True)
    earned = []
    for action in (Action.MOVE_FORWARD, Action.TURN_LEFT, STOP):
        env.reset(options={"start": 16})
        earned.append(env.step(action)[1])
    assert earned == [-0.1, -0.51, -0.01]


def test_in_a_batch_each_stops_for_itself() -> None:
    envs = ImageGoalVectorEnv(corridor_scene(5), targets={"corridor": [12]}, num_envs=3, stop=True, max_episode_steps=1)
    envs.reset(seed=0, options={"start": [8, 8, 0]})
    _, reward, terminated, truncated, _ = envs.step(np.array([Action.MOVE_FORWARD, STOP, STOP]))
    assert terminated.tolist() == [False, True, True] and truncated.tolist() == [True, False, False]
    assert reward.tolist() == [-0.011, -0.01, -0.02]


def test_stop_is_yes_or_no() -> None:
    with pytest.raises(EnvError, match="stop=2: expected True or False"):
        ImageGoalEnv(corridor_scene(5), stop=2)


def test_it_lives_the_episodes_of_the_batch() -> None:
    scene = grid_scene(2)
    single, batch = (
        ImageGoalEnv(scene, max_episode_steps=8),
        ImageGoalVectorEnv(scene, max_episode_steps=8, num_envs=4, autoreset_mode="SameStep"),
    )
    _, info = single.reset(seed=12)
    _, infos = batch.reset(seed=10)
    assert info["state"] == infos["state"][2]
    for action in np.random.default_rng(0).choice(4, size=(300, 4), p=[0.5, 0.2, 0.2, 0.1]):
        observation, reward, terminated, truncated, info = single.step(action[2])
        observations, rewards, terminations, truncations, infos = batch.step(action)
        assert (reward, terminated, truncated) == (rewards[2], terminations[2], truncations[2])
        if terminated or truncated:
            observation, info = single.reset()
        assert np.array_equal(observation["observation"], observations["observation"][2])
        assert info == {key: infos[key][2] for key in info}


def test_the_reward_can_be_chosen() -> None:
    scene = corridor_scene(5)
    paid = {}
    for reward in ("collision-aware", "shortest", "bump"):
        env = ImageGoalEnv(scene, reward=reward, targets={"corridor": [16]})
        env.reset(options={"start": 0})
        paid[reward] = env.step(Action.MOVE_BACKWARD)[1]
    assert paid == {"collision-aware": -0.02, "shortest": -0.01, "bump": -0.1}


def test_a_seed_repeats() -> None:
    def episode(env: ImageGoalEnv, seed: int) -> list[Any]:
        states = [env.reset(seed=seed)[1]["state"]]
        env.action_space.seed(int(seed))  # it takes no integer of NumPy's
        for _ in range(10):
            *_, terminated, _, info = env.step(env.action_space.sample())
            states.append(info["state"])
            if terminated:
                break
        return [*states, env.reset()[1]]

    env, other = ImageGoalEnv(grid_scene(1)), ImageGoalEnv(grid_scene(1))
    assert episode(env, 5) == episode(env, 5) == episode(other, 5)
    assert episode(env, 5) != episode(env, 6)
    assert episode(env, np.int64(5)) == episode(other, 5)
    assert env.reset(seed=[5])[1] == other.reset(seed=5)[1]


def test_it_goes_on_after_pickling() -> None:
    env = ImageGoalEnv(grid_scene(1), render_mode="ansi")
    env.reset(seed=0)
    env.step(0)
    copy = pickle.loads(pickle.dumps(env))
    for action in (1, 0, 0, 2, 3):
        assert env.step(action)[4] == copy.step(action)[4]
        assert env.render() == copy.render()


@pytest.mark.parametrize("action", [4, -1, 1.0, None, "forward", [0]])
def test_actions_that_do_not_fit(action: Any) -> None:
    env = ImageGoalEnv(grid_scene(0))
    env.reset(seed=0)
    with pytest.raises(EnvError, match="action"):
        env.step(action)


def test_resets_that_do_not_fit() -> None:
    env = ImageGoalEnv(grid_scene(0))
    with pytest.raises(ResetNeeded):
        env.step(0)
    for seed in (-1, 1.5, np.array(3)):
        with pytest.raises(EnvError, match="seed"):
            env.reset(seed=seed)
    with pytest.raises(EnvError, match="is for vector environments"):
        env.reset(options={"reset_mask": np.array([True])})
    with pytest.raises(EnvError, match=r"not a target of grid\. Its targets: "):
        env.reset(options={"target": 10_000})
