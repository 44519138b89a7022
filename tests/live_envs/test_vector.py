"""Batches off the grid: the single environment's episodes, all autoreset modes, processes, Stable-Baselines3."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode

import clearway.envs
from clearway.envs.registration import LIVE_ENV_ID
from clearway.errors import EnvError
from clearway.generation.files import notes_of
from clearway.generation.plans import generated_plan
from clearway.generation.request import Request
from clearway.importers.mjcf import read_mjcf
from clearway.live_envs.single import LiveImageGoalEnv
from clearway.live_envs.vector import LiveImageGoalVectorEnv
from clearway.rooms.camera import eye_view, first_person_shot
from clearway.rooms.render import render
from clearway.scenes.floor_plans import GENERATED, FloorPlan
from clearway.scenes.plan_scenes import floor_plan_scene
from clearway.scenes.thor_v1 import write_scene
from helpers.imported import imported_by
from helpers.small_model import AGENT, CHOICE, PLANE, written

SMALL = {"height_px": 12, "width_px": 16}
NOISY = {"distance_noise": 0.05, "angle_noise": 5.0, "light": 0.3}
TARGET, BESIDE, FAR = (0.25, 1.25, 0.0), (0.25, 0.75, 0.0), (1.75, 0.25, 0.0)


@pytest.fixture
def plan_file(tmp_path: Path) -> str:
    scene = floor_plan_scene(FloorPlan.of_map("small", np.ones((3, 2), bool), cell_size_m=0.5), feature_count=4)
    write_scene(scene, tmp_path / "small.h5")
    return str(tmp_path / "small.h5")


@pytest.mark.slow
def test_it_lives_the_episodes_of_single_environments(live) -> None:
    options = {**SMALL, "perturbations": NOISY, "max_episode_steps": 7, "sensors": ("rgb", "clearance")}
    envs = LiveImageGoalVectorEnv(live, num_envs=3, autoreset_mode="SameStep", workers=2, **options)
    single = LiveImageGoalEnv(live, **options)
    seen_together, infos = envs.reset(seed=10)
    seen, info = single.reset(seed=12)
    ended = 0
    for actions in np.random.default_rng(0).integers(4, size=(30, 3)):
        for key in seen:
            np.testing.assert_array_equal(seen[key], seen_together[key][2])
        assert info == {key: infos[key][2] for key in info}
        seen_together, rewards, terminations, truncations, infos = envs.step(actions)
        seen, reward, terminated, truncated, info = single.step(actions[2])
        assert (reward, terminated, truncated) == (rewards[2], terminations[2], truncations[2])
        if terminated or truncated:
            last, told = infos["final_obs"][2], infos["final_info"]
            np.testing.assert_array_equal(last["observation"], seen["observation"])
            assert info == {key: told[key][2] for key in info}
            seen, info = single.reset()
            ended += 1
    assert ended >= 4
    envs.close()
    single.close()


@pytest.mark.parametrize("mode", list(AutoresetMode), ids=lambda mode: mode.value)
def test_every_autoreset_mode(live, mode: AutoresetMode) -> None:
    envs = LiveImageGoalVectorEnv(live, num_envs=2, autoreset_mode=mode, workers=1, **SMALL)
    assert envs.metadata["autoreset_mode"] is mode
    first, _ = envs.reset(seed=0, options={"start": [BESIDE, FAR], "target": TARGET})
    seen, reward, terminated, _, info = envs.step(np.array([0, 3]))
    assert reward.tolist() == [10.0, -0.02] and terminated.tolist() == [True, False]
    assert ("final_info" in info) == (mode is AutoresetMode.SAME_STEP)
    if mode is AutoresetMode.SAME_STEP:
        assert info["final_info"]["success"].tolist() == [True, False] and not info["success"].any()
        np.testing.assert_array_equal(info["final_obs"][0]["target"], first["target"][0])
    if mode is AutoresetMode.DISABLED:
        with pytest.raises(gymnasium.error.ResetNeeded, match=r"\[0\] are over"):
            envs.step(np.array([0, 0]))
        seen, info = envs.reset(options={"reset_mask": terminated})
    if mode is AutoresetMode.NEXT_STEP:
        seen, reward, terminated, _, info = envs.step(np.array([0, 1]))
        assert reward[0] == 0 and not terminated.any() and not info["collision"].any()
    target = [(info["target_x_m"][env], info["target_z_m"][env], info["target_heading_deg"][env]) for env in (0, 1)]
    assert target[0] != TARGET
    assert target[1] == (TARGET if info["_target_x_m"][1] else (0.0, 0.0, 0.0))  # zeros where nothing is told
    assert info["_target_x_m"].tolist() == [True, mode is not AutoresetMode.DISABLED]
    assert not np.array_equal(seen["target"][0], first["target"][0])
    np.testing.assert_array_equal(seen["target"][1], first["target"][1])
    envs.close()


def test_ends_for_all_or_for_each(live) -> None:
    envs = LiveImageGoalVectorEnv(live, num_envs=3, workers=1, **SMALL)
    _, info = envs.reset(seed=0, options={"start": [0, 1, 2], "target": FAR})
    assert info["heading_deg"].tolist() == [0.0, 90.0, 180.0]
    assert info["target_x_m"].tolist() == [1.75] * 3
    _, info = envs.reset(options={"start": np.array([BESIDE, FAR, TARGET]), "target": 5})
    assert info["x_m"].tolist() == [0.25, 1.75, 0.25]
    with pytest.raises(EnvError, match=r"options\['start'\]: expected a state or a pose"):
        envs.reset(options={"start": [0, 1]})
    envs.close()


@pytest.mark.parametrize("workers", [0, "a", 1.5])
def test_workers_that_are_none(live, workers) -> None:
    with pytest.raises(EnvError, match=f"workers={workers!r}: expected a whole number from 1 on"):
        LiveImageGoalVectorEnv(live, workers=workers, **SMALL)


def test_a_reset_that_is_refused_leaves_everything_as_it_was(live) -> None:
    envs, other = (LiveImageGoalVectorEnv(live, num_envs=2, workers=1, **SMALL) for _ in range(2))
    for one in (envs, other):
        one.reset(seed=0)
    for seed in (7, None):
        with pytest.raises(EnvError, match="state 1000 is not in the largest part"):
            envs.reset(seed=seed, options={"target": [5, 1000]})
    for _ in range(3):
        (seen, *rest), (wanted, *expected) = (one.step(np.array([1, 3])) for one in (envs, other))
        np.testing.assert_equal((seen, rest), (wanted, expected))
    (seen, info), (wanted, expected) = (one.reset(options={"start": 5}) for one in (envs, other))
    np.testing.assert_equal((seen, info), (wanted, expected))
    for one in (envs, other):
        one.close()


@pytest.mark.slow
def test_gymnasiums_own_check_makes_it_anew_and_finds_nothing(plan_file: str) -> None:
    env = gymnasium.make(LIVE_ENV_ID, room=plan_file, render_mode="rgb_array", **SMALL)
    check_env(env.unwrapped)
    env.close()


@pytest.mark.slow
def test_make_and_make_vec_know_it(plan_file: str) -> None:
    env = gymnasium.make(LIVE_ENV_ID, room=plan_file, **SMALL)
    assert isinstance(env.unwrapped, LiveImageGoalEnv) and env.spec.max_episode_steps == 500
    assert clearway.envs.registration.LIVE_ENV_ID == "Clearway/LiveImageGoal-v0"
    seen, info = env.reset(seed=0, options={"start": (0.5, 0.5, 90.0)})
    assert (info["x_m"], info["z_m"]) == pytest.approx((0.5, 0.5))  # the plan's coordinates
    assert env.observation_space.contains(seen)
    assert env.step(0)[4]["x_m"] == pytest.approx(1.0)
    env.close()
    envs = gymnasium.make_vec(LIVE_ENV_ID, num_envs=2, room=plan_file, **SMALL)
    assert isinstance(envs, LiveImageGoalVectorEnv) and envs.num_envs == 2
    envs.close()


@pytest.mark.slow
@pytest.mark.parametrize("context", ["fork", "forkserver"])
def test_in_processes_it_lives_the_same_episodes(plan_file: str, context: str) -> None:
    """From a process that has loaded PyTorch and MuJoCo, as this one has."""
    import torch  # noqa: F401

    arguments = {"num_envs": 2, "room": plan_file, "perturbations": NOISY, **SMALL}
    together = gymnasium.make_vec(LIVE_ENV_ID, **arguments)
    apart = gymnasium.make_vec(LIVE_ENV_ID, vectorization_mode="async", vector_kwargs={"context": context}, **arguments)
    try:
        ours, theirs = together.reset(seed=0)[0], apart.reset(seed=0)[0]
        for actions in np.random.default_rng(0).integers(4, size=(10, 2)):
            for key in ours:
                np.testing.assert_array_equal(ours[key], theirs[key])
            ours, reward, *_, info = together.step(actions)
            theirs, same, *_, told = apart.step(actions)
            np.testing.assert_array_equal(reward, same)
            np.testing.assert_array_equal(info["clearance_m"], told["clearance_m"])
    finally:
        apart.close()
        together.close()


@pytest.mark.slow
def test_small_pictures_are_those_of_the_scene_to_the_eye_and_others_to_the_bit(live) -> None:
    pose = (0.25, 0.25, 45.0)
    shots = (first_person_shot(*pose),)
    for height_px, width_px, exact in ((60, 80, False), (61, 81, True), (300, 400, True)):
        view = eye_view(shots, height_px=height_px, width_px=width_px)
        (picture,) = render(live.model, view, workers=1)
        env = LiveImageGoalEnv(live, height_px=height_px, width_px=width_px)
        seen = env.reset(options={"start": pose, "target": TARGET})[0]["observation"]
        apart = np.abs(seen.astype(int) - picture)
        assert (apart.max() == 0) == exact and apart.mean() < 3.0
        env.close()


@pytest.mark.slow
def test_importing_it_is_light() -> None:
    loaded = imported_by("import clearway.live_envs.single, clearway.live.arrangement")
    assert "clearway.live_envs.vector" in loaded
    assert not {"torch", "transformers"} & loaded


@pytest.fixture(scope="module")
def places(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Files of rooms that others have, or have drawn: a generated flat, and a MuJoCo model's scene."""
    folder = tmp_path_factory.mktemp("places")
    request = Request("flat", "test", 0, 0)
    flat = floor_plan_scene(generated_plan(request), feature_count=4)
    made_by = replace(flat.made_by, source=GENERATED, seed=0, notes={**flat.made_by.notes, **notes_of(request)})
    write_scene(replace(flat, made_by=made_by), folder / f"{request.name}.h5")
    write_scene(read_mjcf(written(folder, PLANE), CHOICE, AGENT, workers=1, **SMALL), folder / "hall.h5")
    return {"flat": str(folder / f"{request.name}.h5"), "model": str(folder / "hall.h5")}


@pytest.mark.slow
@pytest.mark.parametrize("place", ["flat", "model"])
def test_a_generated_flat_and_a_model_are_rooms_as_others(places: dict[str, str], place: str) -> None:
    """Gymnasium's check, processes, and an agent of Stable-Baselines3."""
    size = {"height_px": 36, "width_px": 36}
    env = gymnasium.make(LIVE_ENV_ID, room=places[place], render_mode="rgb_array", **size)
    check_env(env.unwrapped)
    env.close()
    arguments = {"num_envs": 2, "room": places[place], "perturbations": NOISY, **size}
    together = gymnasium.make_vec(LIVE_ENV_ID, **arguments)
    apart = gymnasium.make_vec(LIVE_ENV_ID, vectorization_mode="async", **arguments)
    ours, theirs = together.reset(seed=0)[0], apart.reset(seed=0)[0]
    for actions in np.random.default_rng(0).integers(4, size=(10, 2)):
        for key in ours:
            np.testing.assert_array_equal(ours[key], theirs[key])
        (ours, reward, *_), (theirs, same, *_) = together.step(actions), apart.step(actions)
        np.testing.assert_array_equal(reward, same)
    apart.close()
    together.close()
    _assert_sb3_learns(places[place])


@pytest.mark.slow
def test_sb3_learns_from_it(live) -> None:
    _assert_sb3_learns(live)


def _assert_sb3_learns(room) -> None:
    pytest.importorskip("stable_baselines3")
    from stable_baselines3 import PPO

    from clearway.envs.sb3 import SB3VecEnv

    size = {"height_px": 36, "width_px": 36}  # the least that SB3's network takes
    envs = SB3VecEnv(LiveImageGoalVectorEnv(room, num_envs=2, autoreset_mode="SameStep", max_episode_steps=9, **size))
    assert envs.num_envs == 2 and envs.action_space.n == 4
    model = PPO("MultiInputPolicy", envs, n_steps=16, batch_size=16, n_epochs=1, device="cpu", seed=0)
    model.learn(32)
    assert model.num_timesteps == 32
    seen = envs.reset()
    for _ in range(9):
        seen, _, ended, infos = envs.step(model.predict(seen)[0])
        for env in np.flatnonzero(ended):
            assert set(infos[env]["terminal_observation"]) == {"observation", "target"}
    assert ended.any()
    envs.close()
