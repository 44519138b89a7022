"""On the way an agent sees one take a step, by its episode's seed; targets stay as they are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from clearway.agents.agent import FEATURES, POSE, Decisions, Observation, State
from clearway.agents.by_pose import RandomWalk, shortest_paths
from clearway.errors import AgentError
from clearway.evaluation.episodes import episode_seeds, run_episodes
from clearway.evaluation.goals import evaluate_goals
from clearway.evaluation.sight import Sight
from clearway.evaluation.takes import SMALL, Takes, never_again, take_at
from clearway.mapping.again import marks_of
from clearway.scenes.actions import Action
from clearway.scenes.sensors import DEPTH, RGB
from clearway.world.world import make_world
from helpers.agents import Spy
from helpers.made import with_depth
from helpers.small_runs import small_scenes, small_targets

SCENES = [with_depth(scene) for scene in small_scenes()]
WORLD = make_world(SCENES, small_targets())
K = 3
LIMIT = 12
COUNTS = ("target", "start", "steps", "collisions", "reached", "zone_steps", "looped")


def marked(scene: int, state: int, take: int) -> np.ndarray:
    """A take that says which it is."""
    return np.array([scene, state, take], np.float32)


def marked_takes() -> Takes:
    """Features (S, K, 3) that say which they are, and pictures of two pixels that do by all but their lowest bit."""
    features = [
        np.array([[marked(number, state, take) for take in range(K)] for state in range(scene.state_count)])
        for number, scene in enumerate(SCENES)
    ]
    pictures = [2 * one[:, :, None, None].repeat(2, 2).astype(np.uint8) for one in features]
    return Takes(K, {FEATURES: features, RGB: pictures})


TAKES = marked_takes()


def test_takes_are_equally_likely_and_follow_from_seed_and_step_alone() -> None:
    seed, step = np.repeat(np.arange(300), 40), np.tile(np.arange(40), 300)
    drawn = take_at(seed, step, K)
    assert np.abs(np.bincount(drawn, minlength=K) / len(drawn) - 1 / K).max() < 0.02
    chosen = np.random.default_rng(0).permutation(len(drawn))[:50]
    assert np.array_equal(take_at(seed[chosen], step[chosen], K), drawn[chosen])
    by_step = drawn.reshape(300, 40)
    assert 0.25 < (by_step[:, 1:] == by_step[:, :-1]).mean() < 0.42
    assert 0.25 < (by_step[1:] == by_step[:-1]).mean() < 0.42


def test_every_step_shows_the_take_of_its_pose_and_targets_are_seen_as_they_are() -> None:
    spy = Spy(FEATURES, POSE, RGB)
    table = run_episodes(WORLD, spy, scenes=SCENES, takes=TAKES, episodes_per_target=3, step_limit=LIMIT, record=True)
    (target,) = spy.targets
    seeds, first = episode_seeds(WORLD, 3, 0).numpy(), WORLD.scene_offset.numpy()
    for episode, goal in enumerate(WORLD.target_state.numpy()[table.target].tolist()):
        scene = int(goal >= first[1])
        assert np.array_equal(target[FEATURES][episode], SCENES[scene].features[goal - first[scene]])
        assert np.array_equal(target[RGB][episode], SCENES[scene].observations[goal - first[scene]])
    for step, observation in enumerate(spy.seen):
        walking = [number for number, walk in enumerate(table.trajectories) if len(walk.actions) > step]
        for row, episode in enumerate(walking):
            pose = int(table.trajectories[episode].states[step])
            scene = int(pose >= first[1])
            take = int(take_at(seeds[[episode]], np.array([step]), K)[0])
            wanted = marked(scene, pose - int(first[scene]), take)
            assert observation[POSE][row] == pose
            assert observation[FEATURES].dtype == np.float32 and observation[RGB].dtype == np.uint8
            assert np.allclose(observation[FEATURES][row], wanted, rtol=SMALL)
            assert np.array_equal(observation[RGB][row, 1, 0] >> 1, wanted)


def test_no_take_is_seen_twice_to_the_bit() -> None:
    seed, step = np.repeat(np.arange(20), 30), np.tile(np.arange(30), 20)
    picture = np.random.default_rng(0).integers(256, size=(8, 8, 3), dtype=np.uint8)
    features = np.linspace(-1, 1, 64, dtype=np.float32)
    for seen, apart in ((picture, 1), (features, SMALL)):
        shown = never_again(np.stack([seen] * len(seed)), seed, step)
        assert shown.dtype == seen.dtype and len(np.unique(shown.reshape(len(seed), -1), axis=0)) == len(seed)
        assert 0 < np.abs(shown.astype(float) - seen).max() <= apart
        assert np.array_equal(never_again(seen[None], seed[41:42], step[41:42])[0], shown[41])
    assert len(set(marks_of(never_again(np.stack([features] * len(seed)), seed, step)).tolist())) == len(seed)


class ByTake:
    """Walks ahead at the takes 1 and 2, turns at take 0; certain of it."""

    sees = (FEATURES,)

    def reset(self, target: Observation, seed: np.ndarray) -> State:
        return {}

    def act(self, observation: Observation, state: State) -> tuple[Decisions, State]:
        action = np.where(observation[FEATURES][:, 2] > 0, int(Action.MOVE_FORWARD), int(Action.TURN_RIGHT))
        return Decisions(action, certain=np.ones(len(action), bool)), {}


def test_walks_do_not_depend_on_what_runs_beside_them() -> None:
    settings = {"takes": TAKES, "episodes_per_target": 6, "step_limit": 60}
    one, other, recorded = (
        run_episodes(WORLD, ByTake(), **settings, **more) for more in ({}, {"episodes_at_once": 7}, {"record": True})
    )
    for name in COUNTS:
        assert np.array_equal(getattr(one, name), getattr(other, name)), name
        assert np.array_equal(getattr(one, name), getattr(recorded, name)), name
    assert not one.looped.any() and 0.2 < one.reached.mean() <= 1


def test_who_sees_no_pictures_walks_as_without_takes() -> None:
    for agent in (RandomWalk(), shortest_paths(WORLD), Spy(POSE)):
        settings = {"episodes_per_target": 3, "step_limit": 60}
        plain = run_episodes(WORLD, agent, **settings)
        perturbed = run_episodes(WORLD, agent, takes=TAKES, **settings)
        for name in COUNTS:
            assert np.array_equal(getattr(plain, name), getattr(perturbed, name)), name


def test_what_there_are_no_takes_of_is_refused() -> None:
    with pytest.raises(AgentError, match=r"sees depth, and there are perturbed takes of features, rgb alone\. Leave"):
        Sight(WORLD, Spy(RGB, DEPTH), SCENES, TAKES)


def test_without_takes_the_way_is_seen_as_targets_are() -> None:
    sight, state = Sight(WORLD, Spy(FEATURES, RGB), SCENES), torch.tensor([3, 25, 0])
    assert not sight.varies
    seen = sight.on_the_way(state, torch.tensor([1, 2, 3]), torch.tensor([0, 4, 9]))
    for name, values in sight(state).items():
        assert np.array_equal(seen[name], values)


def test_goals_are_walked_to_by_takes_and_say_so() -> None:
    takes = replace(TAKES, made={"label": "all"})
    told, *_ = evaluate_goals({"own": lambda world: ByTake()}, SCENES, goals=5, step_limit=40, takes=takes)
    assert told.perturbed == {"label": "all"} == told.to_json()["perturbed"]
    plain, *_ = evaluate_goals({"own": lambda world: ByTake()}, SCENES, goals=5, step_limit=40)
    assert plain.to_json()["perturbed"] is None and plain.scenes != told.scenes
