import pickle

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from gymnasium.wrappers import TimeLimit

from clearway.envs.registration import ENV_ID, register_environments
from clearway.envs.single import ImageGoalEnv
from clearway.envs.vector import ImageGoalVectorEnv
from helpers.imported import imported_by
from helpers.made import corridor_scene, grid_scene


def steps_until_truncated(env: gymnasium.Env, most: int = 600) -> int | None:
    """Turn on the spot and count; None if the episode goes on."""
    env.reset(seed=0, options={"start": 4})
    for step in range(1, most + 1):
        if env.step(2)[3]:
            return step
    return None


def test_registering_twice_changes_nothing() -> None:
    before = gymnasium.spec(ENV_ID)
    register_environments()
    assert gymnasium.spec(ENV_ID) is before


def test_make() -> None:
    env = gymnasium.make(ENV_ID, scenes=grid_scene(0), reward="shortest")
    assert isinstance(env.unwrapped, ImageGoalEnv)
    assert isinstance(env, TimeLimit)
    env.reset(seed=0)
    assert env.unwrapped.spec.kwargs["reward"] == "shortest"


def test_the_step_limit_of_make() -> None:
    scene, targets = corridor_scene(5), {"corridor": [16]}
    limits = {
        "default": steps_until_truncated(gymnasium.make(ENV_ID, scenes=scene, targets=targets)),
        "7": steps_until_truncated(gymnasium.make(ENV_ID, scenes=scene, targets=targets, max_episode_steps=7)),
        "none": steps_until_truncated(gymnasium.make(ENV_ID, scenes=scene, targets=targets, max_episode_steps=-1)),
    }
    assert limits == {"default": 500, "7": 7, "none": None}


def test_make_vec_gives_the_native_batch() -> None:
    for mode in (None, "vector_entry_point"):
        envs = gymnasium.make_vec(ENV_ID, num_envs=3, vectorization_mode=mode, scenes=grid_scene(0))
        assert isinstance(envs, ImageGoalVectorEnv)
        assert envs.num_envs == 3
        assert envs.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
        assert str(envs) == "ImageGoalVectorEnv(Clearway/ImageGoal-v0, num_envs=3)"


@pytest.mark.slow
def test_the_step_limit_of_make_vec() -> None:
    def truncated_at(**arguments: int | None) -> int | None:
        envs = gymnasium.make_vec(ENV_ID, num_envs=2, scenes=corridor_scene(5), targets={"corridor": [16]}, **arguments)
        envs.reset(seed=0, options={"start": 4})
        truncated = (envs.step(np.array([2, 2]))[3].all() for _ in range(600))
        return next((step for step, now in enumerate(truncated, start=1) if now), None)

    limits = [truncated_at(), truncated_at(max_episode_steps=7), truncated_at(max_episode_steps=None)]
    assert limits == [500, 7, None]
    assert truncated_at(max_episode_steps=-1) is None


def test_make_vec_sync_lives_the_same_episodes() -> None:
    arguments = {"num_envs": 3, "scenes": grid_scene(0), "max_episode_steps": 9}
    native = gymnasium.make_vec(ENV_ID, **arguments)
    copies = gymnasium.make_vec(ENV_ID, vectorization_mode="sync", **arguments)
    assert isinstance(copies, SyncVectorEnv)
    native.reset(seed=0)
    copies.reset(seed=0)
    for action in np.random.default_rng(0).integers(4, size=(40, 3)):
        left, right = native.step(action), copies.step(action)
        assert np.array_equal(left[1], right[1])
        assert np.array_equal(left[2], right[2])
        assert np.array_equal(left[2] | left[3], right[2] | right[3])  # TimeLimit truncates terminated episodes too
        assert np.array_equal(left[0]["observation"], right[0]["observation"])
        assert np.array_equal(left[4]["state"], right[4]["state"])


@pytest.mark.parametrize("mode", list(AutoresetMode), ids=lambda mode: mode.value)
@pytest.mark.parametrize("vectorization", ["vector_entry_point", "sync"])
def test_make_vec_in_every_autoreset_mode(mode: AutoresetMode, vectorization: str) -> None:
    ours = vectorization == "vector_entry_point"
    modes = {"autoreset_mode": mode} if ours else {"vector_kwargs": {"autoreset_mode": mode}}
    arguments = {"num_envs": 2, "vectorization_mode": vectorization, "scenes": corridor_scene(5)}
    envs = gymnasium.make_vec(ENV_ID, targets={"corridor": [16]}, **arguments, **modes)
    assert envs.metadata["autoreset_mode"] is mode
    envs.reset(seed=0, options={"start": 12})
    _, reward, terminated, _, info = envs.step(np.array([0, 3]))
    assert reward.tolist() == [10.0, -0.01] and terminated.tolist() == [True, False]
    assert ("final_info" in info) == (mode is AutoresetMode.SAME_STEP)
    if mode is AutoresetMode.DISABLED:
        _, info = envs.reset(options={"reset_mask": terminated})
    if mode is AutoresetMode.NEXT_STEP:
        *_, info = envs.step(np.array([0, 0]))
    assert info["state"][0] != 16  # a new episode has begun
    envs.close()


@pytest.mark.slow
def test_make_vec_in_processes_lives_the_same_episodes() -> None:
    arguments = {"num_envs": 2, "scenes": grid_scene(0), "max_episode_steps": 9}
    native = gymnasium.make_vec(ENV_ID, **arguments)
    context = {"context": "forkserver"}
    apart = gymnasium.make_vec(ENV_ID, vectorization_mode="async", vector_kwargs=context, **arguments)
    try:
        native.reset(seed=0)
        apart.reset(seed=0)
        for action in np.random.default_rng(0).integers(4, size=(20, 2)):
            left, right = native.step(action), apart.step(action)
            assert np.array_equal(left[0]["observation"], right[0]["observation"])
            assert np.array_equal(left[4]["cost"], right[4]["cost"])
    finally:
        apart.close()


def test_what_make_gives_goes_on_after_pickling() -> None:
    env = gymnasium.make(ENV_ID, scenes=grid_scene(0))
    env.reset(seed=0)
    copy = pickle.loads(pickle.dumps(env))
    for action in (0, 1, 0, 2, 3):
        left, right = env.step(action), copy.step(action)
        assert left[1:] == right[1:]
        assert left[4]["cost"] == float(left[4]["collision"])


def test_importing_the_environments_is_light() -> None:
    """Registering must not load PyTorch; Gymnasium's `make("module:id")` imports the package by itself."""
    found = imported_by("import gymnasium, clearway.envs; gymnasium.spec('Clearway/ImageGoal-v0')")
    assert "clearway.envs" in found
    assert not {"torch", "PIL"} & found
