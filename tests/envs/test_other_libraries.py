"""Adapters to Stable-Baselines3, Safety-Gymnasium's interface and Ray's registry."""

import importlib.util
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from clearway.envs.registration import ENV_ID
from clearway.envs.rllib import register_rllib
from clearway.envs.safety import SafetyWrapper
from clearway.envs.vector import ImageGoalVectorEnv
from clearway.errors import EnvError
from clearway.scenes.scene import Scene
from clearway.scenes.thor_v1 import write_scene
from helpers.made import corridor_scene, grid_scene

EXAMPLES = Path(__file__).parents[2] / "examples"


def two_scenes() -> list[Scene]:
    return [grid_scene(1, width=4, depth=4, name="first"), grid_scene(2, width=5, depth=3, name="second")]


@pytest.fixture
def sb3() -> ModuleType:
    pytest.importorskip("stable_baselines3")
    import clearway.envs.sb3

    return clearway.envs.sb3


def test_sb3_gets_what_the_vector_environment_gives(sb3) -> None:
    count, steps = 5, 60
    ours = ImageGoalVectorEnv(two_scenes(), num_envs=count, autoreset_mode=AutoresetMode.SAME_STEP, max_episode_steps=9)
    theirs = sb3.SB3VecEnv(two_scenes(), num_envs=count, scene_in_observation=True, max_episode_steps=9)
    theirs.seed(3)
    seen, info = ours.reset(seed=3)
    found = theirs.reset()
    np.testing.assert_array_equal(found["observation"], seen["observation"])
    cut = reached = bumps = 0
    for actions in np.random.default_rng(0).choice(4, size=(steps, count), p=[0.5, 0.2, 0.2, 0.1]):
        seen, reward, terminated, truncated, info = ours.step(actions)
        found, found_reward, ended, infos = theirs.step(actions)
        np.testing.assert_array_equal(found["observation"], seen["observation"])
        np.testing.assert_array_equal(found["target"], seen["target"])
        np.testing.assert_array_equal(found["scene"][:, 0], info["scene"])
        np.testing.assert_allclose(found_reward, reward, rtol=1e-6)
        np.testing.assert_array_equal(ended, terminated | truncated)
        for env in range(count):
            if not ended[env]:
                assert infos[env] == {"collision": info["collision"][env], "cost": info["cost"][env]}
                continue
            last = info["final_info"]
            assert infos[env]["cost"] == last["cost"][env]
            assert infos[env]["TimeLimit.truncated"] == (truncated[env] and not terminated[env])
            np.testing.assert_array_equal(
                infos[env]["terminal_observation"]["observation"], info["final_obs"][env]["observation"]
            )
            assert infos[env]["terminal_observation"]["scene"].shape == (1,)
            assert theirs.observation_space.contains(infos[env]["terminal_observation"])
        cut += int((truncated & ~terminated).sum())
        reached += int(terminated.sum())
        bumps += sum(entry["collision"] for entry in infos)
    assert cut and reached and bumps
    theirs.close()


def test_sb3_s_spaces_are_a_single_environment_s(sb3) -> None:
    made = ImageGoalVectorEnv(corridor_scene(4), num_envs=2, max_episode_steps=1)
    with pytest.raises(EnvError, match=r"a step of their own\. Make them with autoreset_mode='SameStep'"):
        sb3.SB3VecEnv(made)
    made = ImageGoalVectorEnv(corridor_scene(4), num_envs=2, autoreset_mode="SameStep")
    for settings, told in (({"num_envs": 7}, "num_envs=7"), ({"reward": "nonsense"}, "reward")):
        with pytest.raises(EnvError, match=f"{told}: these environments are made already"):
            sb3.SB3VecEnv(made, **settings)
    envs = sb3.SB3VecEnv(corridor_scene(4), num_envs=3)
    assert envs.observation_space == envs.envs.single_observation_space
    assert envs.num_envs == 3 and envs.action_space.n == 4
    assert envs.get_attr("scene_names", [0, 2]) == [("corridor",)] * 2
    assert set(envs.reset()) == {"observation", "target"}


def test_sb3_s_options_hold_for_the_next_reset_alone(sb3) -> None:
    envs = sb3.SB3VecEnv(two_scenes(), num_envs=3)
    target = envs.envs._world.scene_state(0)
    envs.seed(5)
    envs.set_options([{"scene": "first", "target": target, "start": start} for start in (1, 2, 3)])
    envs.reset()
    assert [(info["scene"], info["target"], info["state"]) for info in envs.reset_infos] == [
        (0, target, start) for start in (1, 2, 3)
    ]
    scenes = {info["scene"] for _ in range(20) for info in (envs.reset(), envs.reset_infos)[1]}
    assert scenes == {0, 1}
    envs.set_options([{"scene": "first"}, {}, {}])
    with pytest.raises(EnvError, match="Give all environments the same options"):
        envs.reset()
    assert envs.env_method("close", indices=[0, 2]) == [None, None]


@pytest.mark.slow
def test_the_example_trains_sb3_s_ppo(sb3, tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    write_scene(corridor_scene(4), tmp_path / "corridor.h5")
    spec = importlib.util.spec_from_file_location("train_sb3_ppo", EXAMPLES / "train_sb3_ppo.py")
    example = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(example)
    words = [str(tmp_path / "corridor.h5"), "--steps", "20000", "--envs", "16", "--out", str(tmp_path / "model.zip")]
    assert example.main(words) > 8  # the target is worth 10: it learns the corridor
    assert "mean reward of an episode" in capsys.readouterr().out
    assert (tmp_path / "model.zip").exists()


def test_without_sb3_its_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "stable_baselines3.common.vec_env", None)
    monkeypatch.delitem(sys.modules, "clearway.envs.sb3", raising=False)
    with pytest.raises(EnvError, match=r"-m pip install '/.*\[sb3\]'"):
        importlib.import_module("clearway.envs.sb3")


def walked(env: gymnasium.Env, steps: int = 40) -> list[tuple]:
    env.reset(seed=0)
    found = []
    for action in np.random.default_rng(0).integers(4, size=steps).tolist():
        found.append(env.step(action))
        if found[-1][-3] or found[-1][-2]:
            env.reset()
    return found


def test_safety_style_steps_have_the_cost_in_third_place() -> None:
    def new() -> gymnasium.Env:
        return gymnasium.make(ENV_ID, scenes=grid_scene(1), disable_env_checker=True)

    for plain, safe in zip(walked(new()), walked(SafetyWrapper(new())), strict=True):
        assert safe[1] == plain[1] and safe[3:5] == plain[2:4]
        assert safe[2] == plain[4]["cost"] == float(plain[4]["collision"])
    assert sum(step[2] for step in walked(SafetyWrapper(new()))) > 0


def test_ray_s_registry_gets_what_makes_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ray itself is played: its registry needs RLlib, which brings an older Gymnasium."""
    registered: dict[str, Callable] = {}
    registry = ModuleType("ray.tune.registry")
    registry.register_env = registered.__setitem__
    monkeypatch.setitem(sys.modules, "ray.tune.registry", registry)
    monkeypatch.setitem(sys.modules, "ray.tune", ModuleType("ray.tune"))
    name = register_rllib()
    scene = corridor_scene(4)
    env = registered[name]({"scenes": scene, "reward": "shortest", "targets": {"corridor": [8]}})
    seen, info = env.reset(seed=0)
    assert info["target"] == 8
    assert env.observation_space.contains(seen)
    np.testing.assert_array_equal(seen, np.concatenate([*[scene.features[info["state"]]] * 4, scene.features[8]]))
    pictures = registered[name]({"scenes": scene, "observations": "pictures"})
    assert pictures.observation_space["observation"].shape == (4, 12, 16, 3)


def test_without_rllib_its_package_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "ray.tune.registry", None)
    with pytest.raises(EnvError, match=r"-m pip install 'ray\[rllib\]'"):
        register_rllib()
