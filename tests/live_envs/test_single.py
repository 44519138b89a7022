"""The single environment off the grid: Gymnasium's contracts, what is seen, what is refused."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing
from typing import Any

import numpy as np
import pytest
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import check_env

from clearway.errors import EnvError, SceneError
from clearway.live.conditions import Perturbations
from clearway.live_envs.single import LiveImageGoalEnv
from clearway.reward import RewardError
from clearway.scenes.actions import BLOCKED, Action
from helpers.made import corridor_scene
from helpers.small_live import state_at

SMALL = {"height_px": 12, "width_px": 16}
STRONG = Perturbations(
    distance_noise=0.05, angle_noise=5.0, camera_height_jitter=0.1, camera_pitch_jitter=3.0, light=0.5, pixel_noise=9.0,
    move_furniture=0.3, new_obstacle=True,
)  # fmt: skip

Make = Callable[..., LiveImageGoalEnv]


@pytest.fixture
def make(live) -> Iterator[Make]:
    """Environments in the small room, closed at the end."""
    with ExitStack() as opened:

        def made(room: Any = live, **options: Any) -> LiveImageGoalEnv:
            env = LiveImageGoalEnv(room, **{**SMALL, **options})
            opened.callback(env.close)
            return env

        yield made


@pytest.fixture(scope="module")
def plain(live) -> Iterator[LiveImageGoalEnv]:
    """One for tests that begin an episode of their own, or cannot."""
    with closing(LiveImageGoalEnv(live, **SMALL)) as env:
        yield env


@pytest.fixture(scope="module")
def driven(live) -> Iterator[LiveImageGoalEnv]:
    """The same with continuous actions."""
    with closing(LiveImageGoalEnv(live, continuous=True, **SMALL)) as env:
        yield env


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"stop": True, "render_mode": "rgb_array"},
        {"continuous": True, "history_length": 3, "sensors": ("clearance", "depth", "rgb")},
        {"sensors": ("depth",), "perturbations": STRONG},
    ],
)
def test_gymnasiums_own_check_finds_nothing(make: Make, options: dict) -> None:
    check_env(make(**options), skip_render_check=True)  # warnings are errors here


def test_on_the_grid_the_pictures_are_those_of_the_scene(live, make: Make) -> None:
    scene = live.scene
    env = make(height_px=300, width_px=400)
    start, target = state_at(scene, 0.25, 0.25, 90), state_at(scene, 1.75, 1.25, 0)
    seen, info = env.reset(seed=0, options={"start": start, "target": target})
    np.testing.assert_array_equal(seen["observation"], scene.observations[start])
    np.testing.assert_array_equal(seen["target"], scene.observations[target])
    assert (info["x_m"], info["z_m"], info["heading_deg"]) == (0.25, 0.25, 90.0)
    assert (info["target_x_m"], info["target_z_m"], info["target_heading_deg"]) == (1.75, 1.25, 0.0)
    assert info["distance_m"] == pytest.approx(np.hypot(1.5, 1.0))
    state = start
    for action in (Action.MOVE_FORWARD, Action.TURN_LEFT, Action.TURN_RIGHT, Action.MOVE_BACKWARD):
        assert scene.graph[state, action] != BLOCKED
        state = scene.graph[state, action]
        seen, *_ = env.step(action)
        np.testing.assert_array_equal(seen["observation"], scene.observations[state])


@pytest.mark.slow
def test_spaces_and_what_is_told(make: Make) -> None:
    env = make(sensors=("rgb", "depth", "clearance"), stop=True)
    assert env.observation_space == spaces.Dict(
        {
            "clearance": spaces.Box(0, 5, (1,), np.float32),
            "depth": spaces.Box(0, 20, (12, 16), np.float32),
            "observation": spaces.Box(0, 255, (12, 16, 3), np.uint8),
            "target": spaces.Box(0, 255, (12, 16, 3), np.uint8),
            "target_depth": spaces.Box(0, 20, (12, 16), np.float32),
        }
    )
    assert env.action_space == spaces.Discrete(5)
    assert make(continuous=True).action_space == spaces.Box(-1, 1, (2,), np.float32)
    env.reset(seed=0)
    seen, reward, terminated, truncated, info = env.step(Action.TURN_LEFT)
    assert {key: type(value) for key, value in info.items()} == {
        "collision": bool,
        "cost": float,
        "success": bool,
        "zone": int,
        "clearance_m": float,
        "distance_m": float,
        "scene": int,
        **{f"{whose}{part}": float for whose in ("", "target_") for part in ("x_m", "z_m", "heading_deg")},
    }
    assert [type(value) for value in (reward, terminated, truncated)] == [float, bool, bool]
    assert seen["clearance"].tolist() == [np.float32(info["clearance_m"])]


def test_depth_and_clearance_are_metres(make: Make) -> None:
    env = make(sensors=("rgb", "depth", "clearance"), height_px=300, width_px=400)
    ends = {"start": (0.25, 0.75, 90.0), "target": (0.25, 1.25, 90.0)}
    seen, _ = env.reset(seed=0, options=ends)
    below_deg = np.degrees(np.arctan(0.1 / 0.4))  # the furniture's edge 0.4 m ahead is 0.1 m below the camera
    row = 150 + round(150 * np.tan(np.radians(below_deg)) / np.tan(np.radians(30)))
    assert seen["depth"][row + 3, 200] == pytest.approx(0.4, abs=0.01)
    assert seen["target_depth"][row + 3, 200] > 0.5 and seen["depth"][149, 200] > 1.0
    seen, _ = env.reset(seed=0, options={**ends, "start": (0.25, 0.25, 0.0)})
    assert seen["clearance"][0] == pytest.approx(0.05)  # of the body, 0.2 m thick, from the walls
    seen, _, _, _, info = env.step(Action.MOVE_BACKWARD)
    assert info["collision"] and info["cost"] == 1.0
    assert seen["clearance"][0] == pytest.approx(0.001, abs=5e-4)


@pytest.mark.slow
def test_a_history_holds_the_last_poses(plain: LiveImageGoalEnv, make: Make) -> None:
    short, long = plain, make(history_length=3)
    ends = {"start": (0.25, 0.25, 0.0), "target": (1.75, 0.25, 0.0)}
    seen = [short.reset(options=ends)[0]["observation"]]
    history = long.reset(options=ends)[0]
    assert history["observation"].shape == (3, 12, 16, 3) and history["target"].shape == (12, 16, 3)
    np.testing.assert_array_equal(history["observation"], np.stack(seen * 3))
    for action in (0, 1, 1, 0):
        seen.append(short.step(action)[0]["observation"])
        np.testing.assert_array_equal(long.step(action)[0]["observation"], np.stack((seen[:1] * 2 + seen)[-3:]))


def walked(env: LiveImageGoalEnv, seed: int, steps: int = 12) -> list:
    seen, info = env.reset(seed=seed)
    found = [seen["observation"].tobytes(), seen["target"].tobytes(), info]
    for action in np.random.default_rng(0).integers(4, size=steps).tolist():
        seen, reward, terminated, truncated, info = env.step(action)
        found += [seen["observation"].tobytes(), reward, terminated, truncated, info]
        if terminated:
            seen, info = env.reset()
            found += [seen["observation"].tobytes(), info]
    return found


@pytest.mark.slow
def test_a_seed_repeats_pictures_and_all(make: Make) -> None:
    env, other = make(perturbations=STRONG), make(perturbations=STRONG.to_json())
    assert walked(env, 3) == walked(env, 3) == walked(other, 3)
    assert walked(env, 3) != walked(env, 4)


def test_a_seed_may_be_an_integer_of_numpy_s_or_one_in_a_list(make: Make) -> None:
    env = make()
    plain = env.reset(seed=3)[1]
    assert env.reset(seed=np.int64(3))[1] == env.reset(seed=[3])[1] == plain


@pytest.mark.slow
def test_perturbations_change_what_is_seen_and_not_the_target(plain: LiveImageGoalEnv, make: Make) -> None:
    ends = {"start": (0.25, 0.25, 0.0), "target": (0.25, 2.25, 180.0)}  # from where furniture is seen
    unchanged, _ = plain.reset(seed=0, options=ends)
    for changed in ({"light": 0.9}, {"pixel_noise": 20.0}, {"camera_pitch_jitter": 9.0}):
        seen, _ = make(perturbations=changed).reset(seed=1, options=ends)
        assert (seen["observation"] != unchanged["observation"]).any(), changed
        np.testing.assert_array_equal(seen["target"], unchanged["target"])
    for changed in ({"new_obstacle": True}, {"move_furniture": 0.3}):
        env = make(perturbations=changed)
        rearranged = [env.reset(seed=seed, options={**ends, "start": (1.25, 0.25, 0.0)})[0] for seed in range(6)]
        assert len({seen["observation"].tobytes() for seen in rearranged}) > 1, changed
        assert {seen["target"].tobytes() for seen in rearranged} == {unchanged["target"].tobytes()}


def test_step_and_turn_can_be_set(make: Make) -> None:
    env = make(step_m=0.2, turn_deg=30.0)
    env.reset(options={"start": (0.25, 0.25, 0.0), "target": (1.75, 0.25, 0.0)})
    assert env.step(Action.TURN_RIGHT)[4]["heading_deg"] == 30.0
    info = env.step(Action.MOVE_FORWARD)[4]
    assert (info["x_m"], info["z_m"]) == pytest.approx((0.25 + 0.1, 0.25 + 0.2 * np.cos(np.pi / 6)))


def test_the_way_to_the_target_ends_the_episode(make: Make) -> None:
    env = make(max_episode_steps=2)
    ends = {"start": (0.25, 0.75, 0.0), "target": (0.25, 1.25, 0.0)}
    env.reset(options=ends)
    _, reward, terminated, truncated, info = env.step(Action.MOVE_FORWARD)
    assert (reward, terminated, truncated, info["success"]) == (10.0, True, False, True)
    with pytest.raises(ResetNeeded, match="are over: call reset"):
        env.step(0)
    env.reset(options=ends)
    ends_of_steps = [env.step(Action.TURN_LEFT)[2:4] for _ in range(2)]
    assert ends_of_steps == [(False, False), (False, True)]


def test_render_shows_view_and_target(make: Make) -> None:
    env = make(render_mode="rgb_array")
    with pytest.raises(ResetNeeded):
        env.render()
    seen, _ = env.reset(seed=0)
    np.testing.assert_array_equal(env.render(), np.concatenate([seen["observation"], seen["target"]], axis=1))


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        ({"room": "bathrom"}, "room='bathrom' is unknown. Did you mean bathroom? Use one of bathroom, bedroom"),
        ({"room": 3}, "room=3: expected a room's name, a scene file or a scene"),
        ({"room": "bathroom", "room_seed": -1}, "room_seed=-1: expected a whole number from 0 on"),
        ({"perturbations": {"wind": 1.0}}, "perturbations: there is no 'wind'. Choose among angle_noise"),
        ({"perturbations": {"light": 2}}, "perturbations: light=2, expected a number from 0 to 1"),
        ({"perturbations": {"light": "dim"}}, "perturbations: light='dim', expected a number"),
        ({"perturbations": {"angle_noise": float("nan")}}, "angle_noise=nan, expected a number"),
        ({"perturbations": {"new_obstacle": 1}}, "new_obstacle=1, expected True or False"),
        ({"perturbations": "strong"}, "perturbations='strong': expected strengths by name"),
        ({"sensors": ("rgb", "sonar")}, "sensors: there is no 'sonar'. Choose among rgb, depth, clearance"),
        ({"sensors": ("clearance",)}, "a camera among them"),
        ({"sensors": ("rgb", "rgb")}, "expected each once"),
        ({"sensors": "rgb"}, "sensors='rgb': expected names"),
        ({"height_px": 0}, "height_px=0: expected a whole number from 8"),
        ({"continuous": True, "stop": True}, "stop=True is a fifth discrete action"),
        ({"stop": "yes"}, "stop='yes': expected True or False"),
        ({"step_m": 0}, "step_m=0: expected a number above 0"),
        ({"turn_deg": 400}, "turn_deg=400: expected a number above 0, at most 360"),
        ({"success_m": -1}, "success_m=-1: expected a number above 0"),
        ({"success_deg": None}, "success_deg=None: expected a number"),
        ({"targets": [1000]}, "targets: 1000 is not among"),
        ({"targets": "all"}, "targets='all': expected state ids"),
        ({"targets": [[1], [1, 2]]}, r"targets=[[1], [1, 2]]: expected state ids"),
        ({"history_length": 0}, "history_length=0: expected at least 1"),
        ({"render_mode": "human"}, "render_mode='human' is unknown"),
        ({"render_mode": "rgb_array", "sensors": ("depth",)}, "shows colour pictures"),
        ({"reward": "joy"}, "reward='joy' is unknown"),
    ],
)
def test_arguments_that_do_not_fit_are_refused_in_one_line(live, options: dict, problem: str) -> None:
    with pytest.raises((EnvError, RewardError)) as caught:
        LiveImageGoalEnv(**{"room": live, **options})
    assert problem in str(caught.value) and "\n" not in str(caught.value)


def test_scenes_without_a_room_are_refused(tmp_path) -> None:
    with pytest.raises(SceneError, match="there is no room to walk in"):
        LiveImageGoalEnv(corridor_scene())
    with pytest.raises(SceneError, match=r"none\.h5"):
        LiveImageGoalEnv(tmp_path / "none.h5")
    with pytest.raises(SceneError, match=r"is a folder\. Name a scene file in it$"):
        LiveImageGoalEnv(str(tmp_path))
    with pytest.raises(EnvError, match=r"flat\.txt.: a floor plan, no scene yet. .*clearway scenes import floor-plan"):
        LiveImageGoalEnv(str(tmp_path / "flat.txt"))


@pytest.mark.parametrize("action", [4, -1, 1.0, None, "forward", [0]])
def test_actions_that_do_not_fit(plain: LiveImageGoalEnv, action: Any) -> None:
    plain.reset(seed=0)
    with pytest.raises(EnvError, match="action"):
        plain.step(action)


def test_no_step_comes_before_the_first_reset(make: Make) -> None:
    with pytest.raises(ResetNeeded):
        make().step(0)


@pytest.mark.parametrize("action", [0, [0.5], [0.5, np.nan], ["fast", "left"]])
def test_drives_that_do_not_fit(driven: LiveImageGoalEnv, action: Any) -> None:
    driven.reset(seed=0)
    with pytest.raises(EnvError, match="actions: expected"):
        driven.step(action)


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        ({"goal": 3}, "is unknown. Known options: target, start"),
        ({"target": "sink"}, r"options\['target'\]: expected a state or a pose"),
        ({"start": (0.25, 0.25)}, r"options\['start'\]: expected a state or a pose"),
        ({"start": (0.25, 0.25, np.inf)}, r"options\['start'\]: expected a state or a pose"),
        ({"start": (0.75, 0.75, 0.0)}, "the body does not fit"),
        ({"reset_mask": np.array([True])}, "is for vector environments"),
    ],
)
def test_options_that_do_not_fit(plain: LiveImageGoalEnv, options: dict, problem: str) -> None:
    with pytest.raises(EnvError, match=problem):
        plain.reset(options=options)


@pytest.mark.parametrize("seed", [-1, 1.5])
def test_seeds_that_do_not_fit(plain: LiveImageGoalEnv, seed: Any) -> None:
    with pytest.raises(EnvError, match="seed"):
        plain.reset(seed=seed)
