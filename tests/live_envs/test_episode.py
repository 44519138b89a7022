"""Episodes off the grid without pictures: what steps earn and when episodes end, held against the grid."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from clearway.envs.single import ImageGoalEnv
from clearway.errors import EnvError
from clearway.live.arrangement import as_built
from clearway.live.conditions import Perturbations
from clearway.live_envs.episode import Episodes, LiveEpisode, Rules
from clearway.reward import CLEARANCE, COLLISION_AWARE, REWARDS, Moves, Reward, Term
from clearway.scenes.actions import BLOCKED, STOP, Action
from clearway.zones import Zone
from helpers.small_live import state_at

RULES = Rules(
    COLLISION_AWARE,
    step_m=0.5,
    turn_deg=90.0,
    success_m=0.25,
    success_deg=30.0,
    stop=False,
    perturbations=Perturbations(),
)


def begun(episodes: Episodes, seed: int, *, last: LiveEpisode | None = None, **ends) -> LiveEpisode:
    return episodes.begin(episodes.planned(seed, **ends), last)


def episode(live, start, target, **changes) -> LiveEpisode:
    return begun(Episodes(live, replace(RULES, **changes)), 0, start=start, target=target)


def at(walk: LiveEpisode, pose) -> LiveEpisode:
    """An episode whose body stands and looks so."""
    *place_m, walk.walker.heading_deg = pose
    walk.walker.body.stand_at(np.array(place_m))
    return walk


@pytest.mark.slow
@pytest.mark.parametrize("name", ["collision-aware", "shortest", "bump"])
def test_in_every_pose_of_the_grid_every_action_earns_what_it_earns_on_the_grid(live, name):
    scene, target = live.scene, state_at(live.scene, 0.25, 2.25, 0)
    grid = ImageGoalEnv(scene, reward=name, targets={scene.name: [target]})
    episodes = Episodes(live, replace(RULES, reward=REWARDS[name]))
    body, earned = None, set()
    for start in np.flatnonzero(np.arange(scene.state_count) != target).tolist():
        for action in Action:
            grid.reset(options={"start": start})
            _, reward, reached, _, info = grid.step(action)
            body = begun(episodes, 0, start=start, target=target, last=body)
            step = body.step(int(action))
            assert (step.reward, step.ended, step.contact) == (reward, reached, info["collision"]), (start, action)
            assert body.zone == info["zone"]
            if scene.graph[start, action] != BLOCKED:
                assert body.walker.pose == pytest.approx(live.pose_of(info["state"]))
            earned.add(reward)
    assert 10.0 in earned and len(earned) == {"collision-aware": 4, "shortest": 2, "bump": 3}[name]


def test_a_contact_ends_the_move_and_counts(live):
    walk = episode(live, (0.25, 0.25, 200.0), (1.75, 0.25, 0.0))
    step = walk.step(Action.MOVE_FORWARD)
    assert step.contact and not step.ended and step.reward == -0.02
    _, z_m, heading_deg = walk.walker.pose
    assert heading_deg == 200.0 and z_m == pytest.approx(0.2, abs=0.002)  # the body's radius from the wall
    assert walk.zone is Zone.COLLISION and walk.clearance_m < 0.002


def test_the_reward_goes_by_the_measured_clearance(live):
    walk = episode(live, (1.25, 1.25, 90.0), (0.25, 0.25, 0.0), reward=CLEARANCE)
    step = walk.step(Action.TURN_RIGHT)
    assert 0.0 < walk.clearance_m < 0.5
    assert step.reward == pytest.approx(-0.01 - 0.02 * (1 - walk.clearance_m / 0.5))


def test_a_term_sees_the_pose_left_and_the_pose_arrived_in_and_the_action(live):
    seen = []

    @dataclass(frozen=True)
    class Watching(Term):
        def __call__(self, earned: np.ndarray, moves: Moves) -> np.ndarray:
            seen.append(moves)
            return earned + np.arange(4.0)

    reward = Reward("watching", (Watching(), *[term for term in COLLISION_AWARE.terms if hasattr(term, "terminal")]))
    walk = episode(live, (1.25, 1.25, 0.0), (0.25, 0.25, 0.0), reward=reward)
    before = walk.clearance_m
    assert [walk.step(action).reward for action in (2, 3, 0)] == [2.0, 3.0, 0.0]
    assert seen[0].clearance_m[0] == before and seen[1].clearance_m[1] == seen[2].clearance_m[0]
    assert (seen[0].next_state == 1).all()


@pytest.mark.parametrize(
    ("start", "reached"),
    [
        ((0.25, 1.51, 30.0), True),
        ((0.25, 1.49, 30.0), False),
        ((0.25, 1.51, 31.0), False),
        ((0.25, 1.75, 329.0), False),
    ],
)
def test_the_target_is_reached_within_success_m_and_success_deg(live, start, reached):
    walk = at(episode(live, (0.25, 0.25, 0.0), (0.25, 1.75, 0.0), step_m=1e-6), start)
    step = walk.step(Action.MOVE_BACKWARD)
    assert (step.success, step.ended, step.reward == 10.0) == (reached, reached, reached)


def test_what_counts_as_reached_can_be_set(live):
    for within, reached in ((0.1, False), (0.4, True)):
        tolerances = {"success_m": within, "success_deg": 45.0}
        walk = at(episode(live, (0.25, 0.25, 0.0), (0.25, 1.75, 0.0), step_m=1e-6, **tolerances), (0.25, 1.5, 40.0))
        assert walk.step(Action.MOVE_FORWARD).success == reached


def test_with_stop_an_episode_ends_where_the_agent_says_so(live):
    target = (0.25, 1.75, 0.0)
    walk = episode(live, (0.25, 1.25, 0.0), target, stop=True)
    on_the_way = walk.step(Action.MOVE_FORWARD)
    assert walk.walker.is_at(target, 0.01, 1.0)
    assert (on_the_way.success, on_the_way.ended) == (False, False) and on_the_way.reward < 0
    there = walk.step(STOP)
    assert (there.success, there.ended, there.contact, there.reward) == (True, True, False, 10.0)
    astray = episode(live, (0.25, 1.25, 0.0), target, stop=True)
    pose = astray.walker.pose
    given_up = astray.step(STOP)
    assert (given_up.success, given_up.ended) == (False, True)
    assert given_up.reward == {Zone.FREE: -0.01, Zone.PRECOLLISION: -0.011, Zone.COLLISION: -0.02}[astray.zone]
    assert astray.walker.pose == pose


def test_continuous_actions_move_the_body(live):
    walk = episode(live, (0.25, 0.25, 0.0), (1.75, 0.25, 0.0))
    step = walk.step(np.array([0.5, 0.5]))
    assert walk.walker.pose[2] == 45.0 and not step.contact
    assert walk.step(np.array([-1.0, 0.0])).contact


@pytest.mark.slow
def test_ends_are_drawn_from_all_poses_and_are_apart(live):
    episodes = Episodes(live, RULES)
    drawn = [begun(episodes, seed) for seed in range(600)]
    starts, targets = (set(ends) for ends in zip(*((e.walker.pose, e.target) for e in drawn), strict=True))
    every = {live.pose_of(state) for state in range(live.scene.state_count)}
    assert starts == targets == every
    wide = replace(RULES, success_m=0.6, success_deg=180.0)
    for seed in range(100):
        one = begun(Episodes(live, wide), seed)
        assert one.distance_m > 0.6


def test_targets_can_be_named(live):
    some = [state_at(live.scene, 0.25, 0.25, 0), state_at(live.scene, 1.75, 0.25, 90)]
    episodes = Episodes(live, RULES, np.array(some))
    assert {begun(episodes, seed).target for seed in range(30)} == {live.pose_of(state) for state in some}
    with pytest.raises(EnvError, match=r"targets: 1000 is not among the 72 states"):
        Episodes(live, RULES, np.array([0, 1000]))


def test_a_seed_repeats_an_episode_with_its_perturbations(live):
    strong = Perturbations(distance_noise=0.05, angle_noise=5.0, move_furniture=0.3, new_obstacle=True, light=0.5)

    def walked(seed: int) -> list:
        one = begun(Episodes(live, replace(RULES, perturbations=strong)), seed)
        actions = np.random.default_rng(0).integers(4, size=12).tolist()
        return [one.layout, one.target, one.draws.brightness, *((one.step(a), one.walker.pose) for a in actions)]

    assert walked(4) == walked(4)
    assert walked(4)[:3] != walked(5)[:3]


def test_no_furniture_is_moved_to_where_a_target_between_two_cells_is(live):
    episodes, target = Episodes(live, replace(RULES, perturbations=Perturbations(move_furniture=0.3))), (1.1, 0.75, 0.0)
    walks = [begun(episodes, seed, target=target) for seed in range(12)]
    assert {one.layout == episodes.as_built for one in walks} == {True, False}
    for one in walks:
        body = live.body(one.layout)
        body.stand_at(np.array(target[:2]))
        assert not body.touches


def test_the_furniture_of_an_episode_is_moved_and_the_body_meets_it_there(live):
    moved = Perturbations(move_furniture=0.3)
    episodes = Episodes(live, replace(RULES, perturbations=moved))
    assert episodes.moving and not Episodes(live, RULES).moving
    others = [begun(episodes, seed) for seed in range(5)]
    assert any(one.layout != as_built(live.room) for one in others)
    kept = begun(Episodes(live, RULES), 0)
    assert kept.layout == as_built(live.room)
    again = begun(Episodes(live, RULES), 1, last=kept)
    assert again.walker.body is kept.walker.body
    different = next(one for one in others if one.layout != kept.layout)
    assert begun(episodes, 9, last=different).walker.body is not different.walker.body


@pytest.mark.parametrize(
    ("ends", "problem"),
    [
        ({"start": (0.75, 0.75, 0.0)}, r"options\['start'\]: the body does not fit at \(0.75, 0.75\) in walkable"),
        ({"target": (9.0, 0.75, 0.0)}, r"options\['target'\]: the body does not fit at \(9, 0.75\)"),
        ({"start": 5, "target": 5}, r"options\['start'\]: the start is within success_m and success_deg of the target"),
        ({"target": 1000}, r"options\['target'\]: state 1000 is not in the largest part of walkable"),
    ],
)
def test_ends_that_are_none(live, ends, problem):
    with pytest.raises(EnvError, match=problem):
        Episodes(live, RULES).planned(0, **ends)


def test_a_room_without_two_ends_apart_is_refused(live):
    everywhere = replace(RULES, success_m=10.0, success_deg=180.0)
    with pytest.raises(EnvError, match="every start in walkable is within success_m and success_deg"):
        Episodes(live, everywhere).planned(0)
