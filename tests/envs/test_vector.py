import pickle
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.spaces import Box
from gymnasium.vector import AutoresetMode, SyncVectorEnv

from clearway.envs.single import ImageGoalEnv
from clearway.envs.vector import ImageGoalVectorEnv
from clearway.errors import ClearwayError, EnvError, SceneError
from clearway.reward import Arrival, Reward, RewardError, Time
from clearway.scenes.scene import Scene
from clearway.scenes.thor_v1 import write_scene
from helpers.made import corridor_scene, grid_scene, with_depth

INFO_KEYS = {"collision", "cost", "zone", "distance_to_go", "scene", "state", "target"}
MODES = list(AutoresetMode)


def two_scenes() -> list[Scene]:
    return [grid_scene(1, width=4, depth=4, name="first"), grid_scene(2, width=5, depth=3, name="second")]


def random_actions(steps: int, env_count: int, seed: int = 0) -> np.ndarray:
    """(steps, env_count), with more forward moves than turns so that targets are reached."""
    return np.random.default_rng(seed).choice(4, size=(steps, env_count), p=[0.5, 0.2, 0.2, 0.1])


def assert_same(left: Any, right: Any, where: str = "result") -> None:
    """Equal in structure, type, dtype and every value."""
    assert type(left) is type(right), where
    if isinstance(left, dict):
        assert left.keys() == right.keys(), where
        for key in left:
            assert_same(left[key], right[key], f"{where}[{key!r}]")
    elif isinstance(left, (tuple, list)):
        assert len(left) == len(right), where
        for number, (one, other) in enumerate(zip(left, right, strict=True)):
            assert_same(one, other, f"{where}[{number}]")
    elif isinstance(left, np.ndarray) and left.dtype == object:
        assert_same(list(left), list(right), where)
    elif isinstance(left, np.ndarray):
        assert left.dtype == right.dtype and np.array_equal(left, right), where
    else:
        assert left == right, where


@pytest.mark.slow
@pytest.mark.parametrize("observations", ["features", "pictures"])
@pytest.mark.parametrize("mode", MODES, ids=lambda mode: mode.value)
def test_it_equals_gymnasiums_vector_of_single_environments(mode: AutoresetMode, observations: str) -> None:
    arguments = {"observations": observations, "max_episode_steps": 12}
    scenes, count = two_scenes(), 4
    native = ImageGoalVectorEnv(scenes, num_envs=count, autoreset_mode=mode, **arguments)
    copies = SyncVectorEnv([lambda: ImageGoalEnv(scenes, **arguments)] * count, autoreset_mode=mode)
    assert native.metadata["autoreset_mode"] == copies.metadata["autoreset_mode"] == mode
    assert native.observation_space == copies.observation_space
    assert native.action_space == copies.action_space
    assert_same(native.reset(seed=3), copies.reset(seed=3))
    ends = {"terminated": 0, "truncated": 0}
    for action in random_actions(150, count):
        result = native.step(action)
        assert_same(result, copies.step(action))
        assert result[0] in native.observation_space
        ended = result[2] | result[3]
        ends["terminated"] += int(result[2].sum())
        ends["truncated"] += int(result[3].sum())
        if mode is AutoresetMode.DISABLED and ended.any():
            begun = native.reset(options={"reset_mask": ended})
            assert_same(begun, copies.reset(options={"reset_mask": ended.copy()}))
    assert min(ends.values()) > 5, ends  # the comparison has seen both kinds of end


@pytest.mark.parametrize("mode", MODES, ids=lambda mode: mode.value)
def test_an_environment_does_not_depend_on_its_batch(mode: AutoresetMode) -> None:
    scene = grid_scene(3)
    many = ImageGoalVectorEnv(scene, num_envs=9, max_episode_steps=10, autoreset_mode=mode)
    few = ImageGoalVectorEnv(scene, num_envs=2, max_episode_steps=10, autoreset_mode=mode)
    many.reset(seed=0)
    few.reset(seed=5)
    for action in random_actions(100, 9):
        left, right = many.step(action), few.step(action[5:7])
        assert np.array_equal(left[0]["observation"][5:7], right[0]["observation"])
        assert np.array_equal(left[1][5:7], right[1])
        assert np.array_equal(left[4]["state"][5:7], right[4]["state"])
        if mode is AutoresetMode.DISABLED:
            for env, result in ((many, left), (few, right)):
                ended = result[2] | result[3]
                if ended.any():
                    env.reset(options={"reset_mask": ended})


def test_a_corridor_by_hand() -> None:
    """Target: state 16, the last cell, looking along. Start: state 4, the second cell."""
    scene = corridor_scene(5)
    envs = ImageGoalVectorEnv(scene, targets={"corridor": [16]}, num_envs=2, autoreset_mode="SameStep")
    observation, info = envs.reset(options={"start": np.array([4, 12])})
    assert np.array_equal(observation["observation"][0], np.repeat(scene.features[4:5], 4, axis=0))
    assert np.array_equal(observation["target"], np.repeat(scene.features[16:17], 2, axis=0))
    assert info["distance_to_go"].tolist() == [3, 1]
    assert info["collision"].tolist() == [False, False]

    observation, reward, terminated, truncated, info = envs.step(np.array([3, 1]))  # back, and a right turn
    assert reward.tolist() == [-0.02, -0.02]
    assert info["state"].tolist() == [0, 13]
    assert np.array_equal(observation["observation"][0], scene.features[[4, 4, 4, 0]])

    _, reward, _, _, info = envs.step(np.array([3, 2]))  # back into the wall, and the left turn home
    assert reward.tolist() == [-0.02, -0.011]
    assert info["collision"].tolist() == [True, False]
    assert info["cost"].tolist() == [1.0, 0.0]
    assert info["zone"].tolist() == [2, 1]
    assert info["distance_to_go"].tolist() == [4, 1]

    observation, reward, terminated, truncated, info = envs.step(np.array([0, 0]))
    assert reward.tolist() == [-0.011, 10.0]
    assert terminated.tolist() == [False, True]
    assert truncated.tolist() == [False, False]
    assert info["_final_info"].tolist() == [False, True]
    assert info["final_info"]["state"].tolist() == [0, 16]
    assert info["final_info"]["distance_to_go"].tolist() == [0, 0]
    assert info["final_obs"][0] is None
    assert np.array_equal(info["final_obs"][1]["observation"], scene.features[[12, 13, 12, 16]])
    assert info["state"][1] != 16 and info["distance_to_go"][1] > 0
    assert np.array_equal(observation["observation"][1], np.repeat(scene.features[info["state"][1:]], 4, axis=0))


def test_next_step_ignores_the_action_of_the_resetting_step() -> None:
    envs = ImageGoalVectorEnv(corridor_scene(5), targets={"corridor": [16]}, num_envs=2)
    envs.reset(seed=0, options={"start": 12})
    _, _, terminated, _, info = envs.step(np.array([0, 3]))
    assert terminated.tolist() == [True, False]
    assert info["state"].tolist() == [16, 8]
    observation, reward, terminated, _, info = envs.step(np.array([0, 0]))
    assert reward.tolist() == [0.0, -0.011]
    assert terminated.tolist() == [False, False]
    assert info["collision"].tolist() == [False, False]
    assert (observation["observation"][0] == observation["observation"][0, 0]).all()  # a new, tiled history


def test_every_key_of_info_has_its_mask() -> None:
    envs = ImageGoalVectorEnv(grid_scene(0), num_envs=3)
    _, info = envs.reset(seed=0)
    assert set(info) == INFO_KEYS | {f"_{key}" for key in INFO_KEYS}
    assert all(info[f"_{key}"].tolist() == [True] * 3 for key in INFO_KEYS)
    _, info = envs.reset(options={"reset_mask": np.array([False, True, False])})
    assert all(info[f"_{key}"].tolist() == [False, True, False] for key in INFO_KEYS)
    assert info["target"][[0, 2]].tolist() == [0, 0]


def test_observations_are_the_callers_to_keep() -> None:
    envs = ImageGoalVectorEnv(grid_scene(0), num_envs=3)
    first, _ = envs.reset(seed=0)
    kept = first["observation"].copy()
    second, *_ = envs.step(np.array([1, 1, 1]))
    assert np.array_equal(first["observation"], kept)
    assert not np.shares_memory(first["observation"], second["observation"])


def episode_starts(envs: ImageGoalVectorEnv, resets: int = 5, **first: Any) -> list[list[int]]:
    infos = [envs.reset(**first)[1], *(envs.reset()[1] for _ in range(resets))]
    return [info["state"].tolist() for info in infos]


def test_a_seed_repeats_and_resets_without_one_go_on() -> None:
    envs = ImageGoalVectorEnv(grid_scene(0, width=9), num_envs=4)
    starts = episode_starts(envs, seed=7)
    assert episode_starts(envs, seed=7) == starts
    assert episode_starts(envs) != starts
    assert episode_starts(envs, seed=8) != starts
    assert len({tuple(row) for row in starts}) > 1


def test_seeds_by_environment() -> None:
    scene = grid_scene(0, width=9)
    envs = ImageGoalVectorEnv(scene, num_envs=3)
    counted = episode_starts(envs, seed=7)
    assert episode_starts(envs, seed=[7, 8, 9]) == counted
    assert episode_starts(envs, seed=np.uint8(255)) == episode_starts(envs, seed=255)
    assert episode_starts(envs, seed=np.array([7, 8, 9])) == counted
    assert [row[::-1] for row in episode_starts(envs, seed=[9, 8, 7])] == counted
    envs.reset(seed=[7, 8, 9])
    mixed = episode_starts(envs, seed=[7, None, None], resets=4)
    assert [row[0] for row in mixed] == [row[0] for row in counted[:5]]
    assert [row[1:] for row in mixed] == [row[1:] for row in counted[1:]]


def test_a_seed_is_for_the_environments_of_the_mask_alone() -> None:
    envs = ImageGoalVectorEnv(grid_scene(0, width=9), num_envs=3)
    counted = episode_starts(envs, seed=7)
    episode_starts(envs, seed=7, resets=1)
    envs.reset(seed=7, options={"reset_mask": np.array([True, False, False])})
    mixed = episode_starts(envs, resets=3)
    assert [row[0] for row in mixed] == [row[0] for row in counted[1:5]]
    assert [row[1:] for row in mixed] == [row[1:] for row in counted[2:]]


def test_seeds_beyond_64_bits_wrap() -> None:
    envs = ImageGoalVectorEnv(grid_scene(0), num_envs=2)
    assert episode_starts(envs, seed=2**64 - 1) == episode_starts(envs, seed=[2**64 - 1, 0])


def test_unseeded_environments_differ() -> None:
    starts = [episode_starts(ImageGoalVectorEnv(grid_scene(0, width=9), num_envs=8)) for _ in range(2)]
    assert starts[0] != starts[1]


def far_and_near() -> list[Scene]:
    """Two scenes whose depth cameras reach differently far."""
    far, near = with_depth(grid_scene(0)), with_depth(grid_scene(1, name="near"))
    shorter = replace(near.further[0], sensor=replace(near.further[0].sensor, high=9.0))
    return [far, replace(near, further=(shorter,))]


def test_depth_is_seen_beside_colour(tmp_path: Path) -> None:
    scenes = [with_depth(scene) for scene in two_scenes()]
    for scene in scenes:
        write_scene(scene, tmp_path / f"{scene.name}.h5")
    paths = [tmp_path / f"{scene.name}.h5" for scene in scenes]
    asked = {"num_envs": 3, "observations": "pictures", "max_episode_steps": 9}
    colour = ImageGoalVectorEnv(scenes, **asked)
    envs = ImageGoalVectorEnv(paths, sensors=("rgb", "depth"), **asked)
    assert envs.single_observation_space["depth"] == Box(0, 20, (4, 12, 16), np.float32)
    assert envs.single_observation_space["target_depth"] == Box(0, 20, (12, 16), np.float32)
    (observation, info), (without, _) = envs.reset(seed=0), colour.reset(seed=0)
    for action in random_actions(30, 3):
        assert observation in envs.observation_space
        assert without.keys() == {"observation", "target"}
        assert all(np.array_equal(observation[key], without[key]) for key in without)
        for env, (index, state, target) in enumerate(zip(info["scene"], info["state"], info["target"], strict=True)):
            depth_m = scenes[index].seen_by("depth")
            assert np.array_equal(observation["depth"][env, -1], depth_m[int(state)])
            assert np.array_equal(observation["target_depth"][env], depth_m[int(target)])
        (observation, *_, info), (without, *_) = envs.step(action), colour.step(action)


@pytest.mark.parametrize("observations", ["features", "pictures"])
def test_it_goes_on_after_pickling(observations: str) -> None:
    envs = ImageGoalVectorEnv(two_scenes(), num_envs=3, observations=observations, max_episode_steps=9)
    envs.reset(seed=0)
    actions = random_actions(60, 3)
    for action in actions[:20]:
        envs.step(action)
    copy = pickle.loads(pickle.dumps(envs))
    for action in actions[20:]:
        assert_same(envs.step(action), copy.step(action))


def test_options_choose_scene_target_and_start() -> None:
    scenes = two_scenes()
    targets = {"first": [3, 8], "second": [0, 5]}
    envs = ImageGoalVectorEnv(scenes, targets=targets, num_envs=3)
    for _ in range(10):
        _, info = envs.reset(options={"scene": "second"})
        assert info["scene"].tolist() == [1, 1, 1] and set(info["target"].tolist()) <= {0, 5}
        _, info = envs.reset(options={"scene": "second", "start": 5})
        assert info["target"].tolist() == [0, 0, 0]  # the start itself cannot be the target
        assert info["state"].tolist() == [5, 5, 5]
        _, info = envs.reset(options={"scene": ["first", "second", "first"], "target": [3, 5, 8]})
        assert info["scene"].tolist() == [0, 1, 0]
        assert info["target"].tolist() == [3, 5, 8]
        mask = np.array([False, False, True])
        _, info = envs.reset(options={"scene": "second", "target": 0, "start": 9, "reset_mask": mask})
        assert [info[key][2] for key in ("scene", "target", "state")] == [1, 0, 9]


def test_a_target_that_the_options_leave_open_is_drawn() -> None:
    envs = ImageGoalVectorEnv(corridor_scene(5), targets={"corridor": [0, 8, 16]}, num_envs=60)
    _, info = envs.reset(seed=0, options={"start": 4})
    states, counts = np.unique(info["target"], return_counts=True)
    assert states.tolist() == [0, 8, 16]
    assert counts.min() > 10


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"goal": 3}, "'goal'.* is unknown. Known options: scene, target, start, reset_mask"),
        ({"scene": "attic"}, "'attic' is not in this environment. Its scenes: first, second"),
        ({"scene": ["first"]}, "one for each of the 2, got 1"),
        ({"target": 3}, "several scenes. Add 'scene', one of first, second"),
        ({"scene": "first", "target": 4}, "state 4 is not a target of first. Its targets: 3, 8"),
        ({"scene": "first", "target": 3.0}, "expected a state id"),
        ({"scene": "first", "start": 10_000}, "state 10000 is not in first. Its states are 0 to"),
        ({"scene": "first", "start": 2**63}, r"options\['start'\]: expected a state id, .* got 9223372036854775808"),
        ({"scene": "first", "target": [[1], [2, 3]]}, r"options\['target'\]: expected a state id"),
        ({"scene": "first", "start": -1}, "state -1 is not in first"),
        ({"scene": "first", "target": 3, "start": 3}, "state 3 as start reaches no .other. target of first"),
        ({"reset_mask": [True, False]}, r"expected a bool array of shape \(2,\)"),
        ({"reset_mask": np.array([1, 0])}, "expected a bool array"),
        ({"reset_mask": np.array([False, False])}, "at least one True"),
    ],
)
def test_options_that_do_not_fit(options: dict[str, Any], message: str) -> None:
    envs = ImageGoalVectorEnv(two_scenes(), targets={"first": [3, 8], "second": [0, 5]}, num_envs=2)
    envs.reset(seed=0)
    with pytest.raises(EnvError, match=message):
        envs.reset(options=options)


@pytest.mark.parametrize(
    ("actions", "message"),
    [
        (np.array([0, 4]), "action 4 is out of range. Actions are 0 to 3"),
        (np.array([-1, 0]), "action -1 is out of range"),
        (np.array([0]), r"expected integers of shape \(2,\), found int64 of shape \(1,\)"),
        (np.array([0.0, 1.0]), "found float64"),
    ],
)
def test_actions_that_do_not_fit(actions: np.ndarray, message: str) -> None:
    envs = ImageGoalVectorEnv(grid_scene(0), num_envs=2)
    envs.reset(seed=0)
    with pytest.raises(EnvError, match=message):
        envs.step(actions)


@pytest.mark.parametrize(
    ("seed", "message"), [(-1, "got -1"), ([1, 2, 3], "each of the 2 environments, got 3"), ([0.5, 1], "got 0.5")]
)
def test_seeds_that_do_not_fit(seed: Any, message: str) -> None:
    with pytest.raises(EnvError, match=message):
        ImageGoalVectorEnv(grid_scene(0), num_envs=2).reset(seed=seed)


def test_resets_that_are_missing() -> None:
    envs = ImageGoalVectorEnv(corridor_scene(5), targets={"corridor": [16]}, num_envs=2, autoreset_mode="Disabled")
    with pytest.raises(ResetNeeded, match="before the first reset"):
        envs.step(np.array([0, 0]))
    with pytest.raises(ResetNeeded, match="has to begin all"):
        envs.reset(options={"reset_mask": np.array([True, False])})
    envs.reset(options={"start": np.array([12, 4])})
    envs.step(np.array([0, 0]))
    with pytest.raises(ResetNeeded, match=r"environments \[0\] are over"):
        envs.step(np.array([0, 0]))


def test_episodes_that_a_reset_left_out_stay_over() -> None:
    envs = ImageGoalVectorEnv(corridor_scene(5), targets={"corridor": [16]}, num_envs=2, autoreset_mode="Disabled")
    envs.reset(options={"start": 12})
    _, _, terminated, *_ = envs.step(np.array([0, 0]))
    assert terminated.tolist() == [True, True]
    envs.reset(options={"reset_mask": np.array([True, False])})
    with pytest.raises(ResetNeeded, match=r"environments \[1\] are over"):
        envs.step(np.array([0, 0]))


BAD_ARGUMENTS: list[tuple[Callable[[], dict[str, Any]], type[Exception], str]] = [
    (lambda: {"scenes": []}, EnvError, "scenes is empty"),
    (lambda: {"reward": "generous"}, RewardError, "'collision-aware', 'shortest', 'bump'"),
    (lambda: {"observations": "sounds"}, EnvError, "'features', 'pictures'"),
    (lambda: {"render_mode": "human"}, EnvError, "rgb_array, ansi"),
    (lambda: {"num_envs": 0}, EnvError, "at least 1 environment"),
    (lambda: {"history_length": 0}, EnvError, "at least 1 pose"),
    (lambda: {"max_episode_steps": 0}, EnvError, "at least 1 step"),
    (lambda: {"num_envs": 2.0}, EnvError, "num_envs=2.0: expected a whole number"),
    (lambda: {"history_length": 2.5}, EnvError, "history_length=2.5: expected a whole number"),
    (lambda: {"max_episode_steps": 2.5}, EnvError, "max_episode_steps=2.5: expected a whole number"),
    (lambda: {"autoreset_mode": "never"}, EnvError, "autoreset_mode='never' is unknown. Use one of NextStep"),
    (lambda: {"scenes": 5}, EnvError, "scenes: 5 is neither a scene nor"),
    (lambda: {"scenes": [grid_scene(0), None]}, EnvError, "scenes: None is neither a scene nor"),
    (lambda: {"reward": Reward("mine", (Time(float("nan")), Arrival()))}, RewardError, "alpha is nan"),
    (lambda: {"targets": [999]}, SceneError, "grid: target 999 is out of range"),
    (lambda: {"targets": 5}, EnvError, r"targets=5: expected state ids by scene name.*of one scene a list will do"),
    (lambda: {"targets": [5], "scenes": far_and_near()}, EnvError, r"targets=\[5\]: expected state ids by scene name"),
    (lambda: {"targets": {"grid": 5}}, EnvError, r"targets\['grid'\]=5: expected state ids"),
    (lambda: {"targets": {"grid": [True]}}, SceneError, "target True is no state id"),
    (lambda: {"targets": {}}, SceneError, "the scene has no target"),
    (lambda: {"targets": {"other": [0]}}, SceneError, "other: targets are given for this scene"),
    (lambda: {"scenes": replace(corridor_scene(3), features=None)}, EnvError, "observations='pictures'"),
    (
        lambda: {"scenes": replace(corridor_scene(3), observations=None), "observations": "pictures"},
        EnvError,
        "observations='features'",
    ),
    (lambda: {"observations": "pictures", "sensors": "rgb"}, EnvError, "sensors='rgb': expected names, each once"),
    (lambda: {"observations": "pictures", "sensors": ()}, EnvError, "expected names, each once"),
    (lambda: {"sensors": ("rgb", "depth")}, EnvError, "features are of one encoder. Ask for observations='pictures'"),
    (
        lambda: {"observations": "pictures", "sensors": ("rgb", "depth")},
        EnvError,
        "grid: has rgb, but no depth. Build or import it again with --sensors rgb depth",
    ),
    (
        lambda: {"scenes": far_and_near(), "observations": "pictures", "sensors": ("depth",)},
        EnvError,
        "near: its sensor is depth .* 0 to 9 m.*that of grid is depth .* 0 to 20 m",
    ),
    (
        lambda: {"scenes": [grid_scene(0), grid_scene(1, name="b", picture_size=(8, 8))], "observations": "pictures"},
        EnvError,
        r"b: pictures of \(8, 8, 3\), those of grid are \(12, 16, 3\)",
    ),
]


@pytest.mark.parametrize(("arguments", "error", "message"), BAD_ARGUMENTS)
def test_arguments_that_do_not_fit(
    arguments: Callable[[], dict[str, Any]], error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        ImageGoalVectorEnv(**{"scenes": grid_scene(0), **arguments()})


def test_scenes_from_files(tmp_path: Path) -> None:
    scenes = two_scenes()
    paths = [tmp_path / f"{scene.name}.h5" for scene in scenes]
    for scene, path in zip(scenes, paths, strict=True):
        write_scene(scene, path)
    in_memory = ImageGoalVectorEnv(scenes, num_envs=3, observations="pictures")
    from_files = ImageGoalVectorEnv([paths[0], str(paths[1])], num_envs=3, observations="pictures")
    assert_same(from_files.reset(seed=0), in_memory.reset(seed=0))
    copy = pickle.loads(pickle.dumps(from_files))
    for action in random_actions(20, 3):
        result = in_memory.step(action)
        assert_same(from_files.step(action), result)
        assert_same(copy.step(action), result)


class CountedPictures:
    """Pictures that note which of them were read."""

    def __init__(self, pictures: np.ndarray) -> None:
        self.pictures, self.shape = pictures, pictures.shape
        self.read: list[list[int]] = []

    def __getitem__(self, index: int | slice | np.ndarray) -> np.ndarray:
        self.read.append(np.atleast_1d(np.arange(len(self.pictures))[index]).tolist())
        return self.pictures[index]


def test_pictures_are_read_when_they_are_seen_first() -> None:
    scene = corridor_scene(5)
    pictures = CountedPictures(np.asarray(scene.observations))
    counted = replace(scene, observations=pictures)
    envs = ImageGoalVectorEnv(counted, targets={"corridor": [16]}, num_envs=2, observations="pictures")
    assert pictures.read == []
    observation, _ = envs.reset(options={"start": np.array([0, 4])})
    assert pictures.read == [[0, 4, 16]]
    assert np.array_equal(observation["observation"][1, 2], scene.observations[4])
    observation, *_ = envs.step(np.array([0, 0]))
    assert pictures.read == [[0, 4, 16], [8]]
    assert np.array_equal(observation["observation"][1, 3], scene.observations[8])
    assert np.array_equal(observation["target"][0], scene.observations[16])


def test_zones_of_cells_are_paid_where_they_are_asked_for() -> None:
    zones = {}
    for level in ("pose", "cell"):
        envs = ImageGoalVectorEnv(grid_scene(1), num_envs=40, zone_level=level)
        _, info = envs.reset(seed=0)
        zones[level] = info["zone"].tolist()
    assert zones["pose"] != zones["cell"]
    with pytest.raises(ClearwayError, match=r"zone_level='cells' is unknown\. Use one of 'pose', 'cell'"):
        ImageGoalVectorEnv(grid_scene(1), zone_level="cells")


def test_features_are_held_once_and_not_at_all_where_pictures_are_seen() -> None:
    scene = grid_scene(1)
    envs = ImageGoalVectorEnv(scene)
    assert np.shares_memory(envs._sources["observation", "target"]._table, envs._world.features.numpy())
    assert ImageGoalVectorEnv(scene, observations="pictures")._world.features is None


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        ({"options": {"scene": 0}}, r"options\['scene'\]: expected a name, or one for each of the 2, got 0"),
        ({"seed": 1.5}, "seed: expected an integer, or one for each of the 2 environments, got 1.5"),
    ],
)
def test_a_reset_that_makes_no_sense_is_refused(arguments: dict, problem: str) -> None:
    with pytest.raises(EnvError, match=problem):
        ImageGoalVectorEnv(grid_scene(1), num_envs=2).reset(**arguments)
