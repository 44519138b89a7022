"""Hindsight on a corridor of five cells; targets 0, 1, 2 are the states 0, 8 and 16, all looking ahead."""

from itertools import product

import pytest
import torch
from torch import Tensor

from clearway.learn.hindsight import find_segments, hindsight_batch
from clearway.learn.losses import Batch
from clearway.learn.rollout import Rollout
from clearway.model.lookup import Activations, LookupNetwork
from clearway.reward import BUMP, COLLISION_AWARE, Reward
from clearway.scenes.actions import Action
from clearway.world.navigation import Navigation, TargetChoice
from clearway.world.world import World
from helpers.small_runs import corridor_world, small_learner, small_network, small_trainer

FORWARD, RIGHT, LEFT, BACKWARD = Action
GAMMA, SCALE = 0.9, 0.1


def navigation_of(world: World, envs: int, reward: Reward = COLLISION_AWARE) -> Navigation:
    scene = torch.zeros(envs, dtype=torch.int64)
    return Navigation(world, reward, torch.arange(envs), choice=TargetChoice.by_scene(world, scene))


def acted(world: World, walks: list[tuple[int, int, list[int]]], cut_after: dict[int, int] | None = None) -> Rollout:
    """The rollout of environments that begin at a state, want a target and take the given actions.

    An episode that ends (the target reached, or the step in `cut_after` by environment) begins anew in the
    pose where it ended, facing right, with the same target.
    """
    steps, envs = len(walks[0][2]), len(walks)
    history = torch.zeros(steps, envs, 4, dtype=torch.int64)
    target, action, arrived = (torch.zeros(steps, envs, dtype=torch.int64) for _ in range(3))
    reached, truncated = (torch.zeros(steps, envs, dtype=torch.bool) for _ in range(2))
    for env, (start, wanted, actions) in enumerate(walks):
        poses = torch.full((4,), start)
        for t, chosen in enumerate(actions):
            history[t, env], target[t, env], action[t, env] = poses, wanted, chosen
            there = world.next_state[poses[-1], chosen]
            arrived[t, env] = there
            reached[t, env] = there == world.target_state[wanted]
            truncated[t, env] = (cut_after or {}).get(env) == t
            poses = torch.cat([poses[1:], there[None]])
            if reached[t, env] or truncated[t, env]:
                poses = torch.full((4,), int(world.next_state[there, RIGHT]))
    return Rollout(
        history=history,
        target=target,
        action=action,
        arrived=arrived,
        reward=torch.zeros(steps, envs),
        reached=reached,
        truncated=truncated,
        blocked=torch.zeros_like(reached),
        last_history=history,
        kept=Activations.empty(0, 0, history.device),
        history_after=history[-1],
        target_after=target[-1],
    )


def found(world: World, rollout: Rollout) -> list[tuple[int, int, int, bool]]:
    """(environment, step, target told, arrives) of every row, in order."""
    rows = find_segments(rollout, navigation_of(world, rollout.action.shape[1]))
    columns = rows.env.tolist(), rows.step.tolist(), rows.target.tolist(), rows.hit.tolist()
    return sorted(zip(*columns, strict=True))


def test_the_steps_up_to_a_target_passed_by_are_told_again() -> None:
    world = corridor_world()
    walk = (0, 2, [FORWARD] * 4)  # 0, 4, 8, 12, 16: passes state 8 in step 1, reaches its own target in step 3
    assert found(world, acted(world, [walk])) == [(0, 0, 1, False), (0, 1, 1, True)]


def test_the_row_s_own_target_is_never_told() -> None:
    world = corridor_world()
    walk = (4, 1, [FORWARD, LEFT, LEFT, LEFT])  # reaches its own target, state 8, at once
    assert found(world, acted(world, [walk])) == []


def test_two_targets_passed_by_are_told_apart() -> None:
    world = corridor_world()
    walk = (4, 2, [FORWARD, BACKWARD, BACKWARD, FORWARD])  # 8, then 4, then 0
    expected = [(0, 0, 0, False), (0, 0, 1, True), (0, 1, 0, False), (0, 2, 0, True)]
    assert found(world, acted(world, [walk])) == expected


def test_standing_on_a_target_and_leaving_it_tells_nothing() -> None:
    world = corridor_world()
    leaves = (8, 2, [BACKWARD, BACKWARD, RIGHT, RIGHT])  # from 8 to 4 to 0: only target 0 is arrived at
    bumps = (0, 2, [BACKWARD, BACKWARD, RIGHT, RIGHT])  # blocked in state 0: it stays there and never arrives
    rows = found(world, acted(world, [leaves, bumps]))
    assert rows == [(0, 0, 0, False), (0, 1, 0, True)]


def test_a_target_met_twice_ends_two_stretches() -> None:
    world = corridor_world()
    walk = (4, 2, [FORWARD, BACKWARD, FORWARD, LEFT])  # 8, 4, 8
    # in step 1 the agent stands on state 8: that row is left out, and nothing from step 2 reaches across it
    assert found(world, acted(world, [walk])) == [(0, 0, 1, True), (0, 2, 1, True)]


def test_no_stretch_crosses_the_end_of_an_episode() -> None:
    world = corridor_world()
    # Reaches its target 16 from 12 and begins anew facing right in the last cell; then turns left, which is
    # its own target again, and goes on to state 12, 8: nothing before the ends may count.
    reaches = (12, 2, [FORWARD, LEFT, RIGHT, RIGHT, RIGHT, RIGHT])
    cut = (4, 2, [RIGHT, LEFT, LEFT, FORWARD, RIGHT, RIGHT])  # cut after step 1 in state 4, begins anew in 5
    rows = found(world, acted(world, [reaches, cut], cut_after={1: 1}))
    assert rows == [(1, 2, 1, False), (1, 3, 1, True)]


def test_the_step_that_is_cut_may_itself_arrive() -> None:
    world = corridor_world()
    walk = (0, 2, [FORWARD, FORWARD, RIGHT, RIGHT])
    rows = found(world, acted(world, [walk], cut_after={0: 1}))
    assert rows == [(0, 0, 1, False), (0, 1, 1, True)]


def told_by(world: World, rollout: Rollout, log_prob: Tensor, reward: Reward, trace_lambda: float) -> Batch:
    network = small_network(world, seed=4)
    lookup = LookupNetwork(network, world.features, world.target_state)
    navigation = navigation_of(world, rollout.action.shape[1], reward)
    batch = hindsight_batch(
        rollout, log_prob, navigation, lookup, discount=GAMMA, reward_scale=SCALE, trace_lambda=trace_lambda
    )
    assert batch is not None
    return batch


def test_the_telling_earns_what_the_target_would_have_paid() -> None:
    """With ratios of at least 1 and lambda 1 the value targets are the discounted rewards of the stretch."""
    world = corridor_world()
    rollout = acted(world, [(0, 2, [FORWARD] * 4), (9, 2, [LEFT] * 4)])
    unlikely = torch.full((4, 2), -100.0)  # the actor's, so that every ratio is cut to 1
    batch = told_by(world, rollout, unlikely, COLLISION_AWARE, trace_lambda=1.0)
    assert batch.target.tolist() == [1, 1, 1]
    assert batch.action.tolist() == [FORWARD, FORWARD, LEFT]  # both steps of the first environment, then the other's
    arrives = 10 * SCALE
    # the step into state 4: from there backward leads to the wall's pose 0, so it is a precollision pose
    before = -0.011 * SCALE + GAMMA * arrives
    assert batch.value_target.tolist() == pytest.approx([before, arrives, arrives], rel=1e-6)
    value = told_value(world, batch)
    assert batch.advantage.tolist() == pytest.approx((batch.value_target - value).tolist(), abs=1e-6)
    assert batch.rows_per_scene == (3,)


def told_value(world: World, batch: Batch) -> Tensor:
    network = small_network(world, seed=4)
    states = world.features
    _, value = network(
        states[batch.history], states[world.target_state][batch.target], world.target_scene[batch.target]
    )
    return value.detach()


def test_clipped_and_bump_rewards_are_told_as_they_are() -> None:
    world = corridor_world()
    rollout = acted(world, [(9, 2, [FORWARD, LEFT, RIGHT, RIGHT])])  # blocked, looking across; then onto 8
    reward = BUMP.with_changes(beta=-0.03, gamma=-0.011, clip=True)
    batch = told_by(world, rollout, torch.full((4, 1), -100.0), reward, trace_lambda=1.0)
    arrives = 1 * SCALE
    assert batch.value_target.tolist() == pytest.approx([-0.1 * SCALE + GAMMA * arrives, arrives], rel=1e-6)


def test_what_the_told_policy_would_not_do_counts_less() -> None:
    world = corridor_world()
    rollout = acted(world, [(4, 2, [FORWARD, RIGHT])])
    network = small_network(world, seed=4)
    scores, value = network(world.features[rollout.history[0]], world.features[[8]], torch.zeros(1, dtype=torch.int64))
    log_pi = torch.log_softmax(scores, 1)[0, FORWARD].item()
    acted_as_if_certain = torch.zeros(2, 1)
    batch = told_by(world, rollout, acted_as_if_certain, COLLISION_AWARE, trace_lambda=0.95)
    rho = torch.tensor(log_pi).exp().item()  # pi / 1
    error = 10 * SCALE - value.item()
    assert batch.value_target.tolist() == pytest.approx([value.item() + rho * error], rel=1e-5)
    assert batch.advantage.tolist() == pytest.approx([rho * error], rel=1e-5)
    assert batch.log_prob.tolist() == pytest.approx([log_pi], rel=1e-5)  # ratio 1 on the first pass


def test_nothing_passed_by_is_none() -> None:
    world = corridor_world()
    rollout = acted(world, [(5, 2, [FORWARD, FORWARD])])
    lookup = LookupNetwork(small_network(world), world.features, world.target_state)
    told = hindsight_batch(
        rollout,
        torch.zeros(2, 1),
        navigation_of(world, 1),
        lookup,
        discount=GAMMA,
        reward_scale=SCALE,
        trace_lambda=1.0,
    )
    assert told is None


def test_segments_of_real_rollouts_equal_their_definition() -> None:
    """Step t belongs to target j if the episode arrives at j in some step u >= t and is not at j from t to u."""
    trainer = small_trainer(small_learner(rollout_steps=12, step_limit=9, envs=40))
    world = trainer.world
    trainer.lookup.refresh()
    rollout = trainer.collector.collect()
    target_state, target_scene = world.target_state.tolist(), world.target_scene.tolist()
    own, here, arrived = rollout.target.tolist(), rollout.history[..., -1].tolist(), rollout.arrived.tolist()
    ended = (rollout.reached | rollout.truncated).tolist()
    expected = set()
    for env, j, t in product(range(trainer.env_count), range(world.target_count), range(12)):
        if target_scene[j] != target_scene[own[0][env]]:
            continue
        for u in range(t, 12):
            if own[u][env] == j or here[u][env] == target_state[j]:
                break
            if arrived[u][env] == target_state[j]:
                expected.add((t, env, j, u == t))
                break
            if ended[u][env]:
                break
    rows = find_segments(rollout, trainer.navigation)
    columns = rows.step.tolist(), rows.env.tolist(), rows.target.tolist(), rows.hit.tolist()
    assert set(zip(*columns, strict=True)) == expected
    assert len(rows.step) == len(expected) > 20
    scene = world.target_scene[rows.target].tolist()
    assert scene == sorted(scene)
    assert rows.rows_per_scene == (scene.count(0), scene.count(1))
