from dataclasses import replace

import numpy as np
import pytest
import torch

from clearway.reward import BUMP, COLLISION_AWARE, SHORTEST, Reward
from clearway.scenes.actions import Action
from clearway.world.navigation import Navigation, TargetChoice
from clearway.world.world import World, make_world
from helpers.made import corridor_scene, graph_of_cells, grid_scene

FORWARD, RIGHT, LEFT, BACKWARD = (int(action) for action in Action)


def corridor_world(length: int = 5, targets: tuple[int, ...] = (16,)) -> World:
    scene = corridor_scene(length)
    return make_world([scene], {scene.name: list(targets)})


def one_agent(start: int, reward: Reward = COLLISION_AWARE, *, target: int = 16, step_limit: int | None = None):
    """One episode in a corridor of five cells; states are 4 * cell + heading / 90."""
    navigation = Navigation(
        corridor_world(targets=(target,)),
        reward,
        torch.tensor([0]),
        step_limit=step_limit,
        reward_dtype=torch.float64,
    )
    navigation.reset(start=torch.tensor([start]))
    return navigation


@pytest.mark.parametrize(
    ("start", "action", "arrived", "blocked", "reward", "why"),
    [
        (0, FORWARD, 4, False, -0.011, "into the precollision zone"),
        (4, FORWARD, 8, False, -0.01, "into the free zone"),
        (8, BACKWARD, 4, False, -0.011, "backwards"),
        (4, BACKWARD, 0, False, -0.02, "into the collision zone"),
        (0, BACKWARD, 0, True, -0.02, "a blocked move stays in the collision zone and is charged for it"),
        (4, RIGHT, 5, False, -0.02, "a turn to face the wall"),
        (5, LEFT, 4, False, -0.011, "a turn away from the wall"),
        (9, FORWARD, 9, True, -0.02, "blocked looking across the corridor"),
        (12, FORWARD, 16, False, 10.0, "the target comes before its collision zone"),
        (17, LEFT, 16, False, 10.0, "position and heading both count"),
    ],
)
def test_one_step_in_the_corridor(start: int, action: int, arrived: int, blocked: bool, reward: float, why: str):
    step = one_agent(start).step(torch.tensor([action]))
    assert step.state.tolist() == [arrived], why
    assert step.blocked.tolist() == [blocked], why
    assert step.reward.tolist() == [reward], why
    assert step.reached.tolist() == [arrived == 16]
    assert step.truncated.tolist() == [False]


@pytest.mark.parametrize(("reward", "paid"), [(COLLISION_AWARE, -0.02), (SHORTEST, -0.01), (BUMP, -0.1)])
def test_a_blocked_move_by_reward(reward: Reward, paid: float) -> None:
    assert one_agent(0, reward).step(torch.tensor([BACKWARD])).reward.tolist() == [paid]


def test_clipping_makes_the_target_worth_one() -> None:
    clipped = COLLISION_AWARE.with_changes(clip=True)
    assert one_agent(12, clipped).step(torch.tensor([FORWARD])).reward.tolist() == [1.0]
    assert one_agent(12, clipped).step(torch.tensor([BACKWARD])).reward.tolist() == [-0.01]


def test_history_begins_tiled_and_a_blocked_pose_enters_it() -> None:
    navigation = one_agent(4)
    assert navigation.history.tolist() == [[4, 4, 4, 4]]
    navigation.step(torch.tensor([BACKWARD]))
    navigation.step(torch.tensor([BACKWARD]))  # blocked
    assert navigation.history.tolist() == [[4, 4, 0, 0]]
    navigation.step(torch.tensor([RIGHT]))
    assert navigation.history.tolist() == [[4, 0, 0, 1]]
    navigation.reset(start=torch.tensor([8]))
    assert navigation.history.tolist() == [[8, 8, 8, 8]]


def test_the_step_limit_truncates_and_the_target_on_the_last_step_does_not() -> None:
    navigation = one_agent(4, step_limit=3)
    truncated = [navigation.step(torch.tensor([FORWARD])).truncated.item() for _ in range(2)]
    last = navigation.step(torch.tensor([FORWARD]))
    assert truncated == [False, False]
    assert (last.reached.item(), last.truncated.item(), last.ended.item()) == (True, False, True)
    navigation.reset(start=torch.tensor([4]))
    limited = [navigation.step(torch.tensor([LEFT])) for _ in range(3)]
    assert [step.truncated.item() for step in limited] == [False, False, True]
    assert [step.ended.item() for step in limited] == [False, False, True]


def test_starts_are_uniform_over_the_states_that_reach_the_target() -> None:
    graph = graph_of_cells(np.array([[0, 0], [0, 1], [1, 1], [9, 9]]))
    base = corridor_scene(4)
    scene = replace(base, graph=graph)
    world = make_world([scene], {scene.name: [5]})
    draws = 22_000
    navigation = Navigation(world, SHORTEST, torch.arange(draws))
    navigation.reset()
    counts = np.bincount(navigation.state.numpy(), minlength=16)
    reachable = [state for state in range(12) if state != 5]  # the cell apart and the target itself are no starts
    assert np.flatnonzero(counts).tolist() == reachable
    expected = draws / len(reachable)
    assert ((counts[reachable] - expected) ** 2 / expected).sum() < 35.0  # chi-square, 10 degrees: p = 1e-4


def test_targets_are_drawn_uniformly_and_scenes_keep_to_their_own() -> None:
    scenes = [corridor_scene(3, name="first"), corridor_scene(4, name="second")]
    world = make_world(scenes, {"first": [0, 4, 8], "second": [2]})
    count = 8_000
    everywhere = Navigation(world, SHORTEST, torch.arange(count))
    everywhere.reset()
    assert np.bincount(everywhere.target).tolist() == pytest.approx([count / 4] * 4, rel=0.1)
    env_scene = torch.arange(count) % 2
    by_scene = Navigation(world, SHORTEST, torch.arange(count), choice=TargetChoice.by_scene(world, env_scene))
    by_scene.reset()
    assert torch.equal(world.target_scene[by_scene.target], env_scene)
    assert np.bincount(by_scene.target).tolist() == pytest.approx([count / 6] * 3 + [count / 2], rel=0.1)
    for navigation in (everywhere, by_scene):
        start_scene = torch.bucketize(navigation.state.contiguous(), world.scene_offset[1:], right=True)
        assert torch.equal(start_scene, world.target_scene[navigation.target])


def test_target_choice_by_hand() -> None:
    groups, members = torch.tensor([0, 1]), torch.tensor([[7, 8, 9], [5, 5, 5]])
    choice = TargetChoice(groups, members, torch.tensor([[1.0, 0.0, 3.0], [2.0, 0.0, 0.0]], dtype=torch.float64))
    uniform = torch.tensor([0.0, 0.2499, 0.25, 0.9999, 0.0, 0.9999], dtype=torch.float64)
    assert choice.draw(uniform, torch.tensor([0, 0, 0, 0, 1, 1])).tolist() == [7, 7, 9, 9, 5, 5]
    choice.reweigh(torch.tensor([[0.0, 1.0, 1.0], [1.0, 0.0, 0.0]], dtype=torch.float64))
    assert choice.draw(uniform[:4], torch.zeros(4, dtype=torch.int64)).tolist() == [8, 8, 8, 9]


def test_the_largest_uniform_number_still_draws_a_target() -> None:
    """Sum and cumulative sum round differently; the last bound must not fall below 1."""
    weights = 1 + 3 * torch.rand(500, 45, dtype=torch.float64, generator=torch.Generator().manual_seed(0))
    weights[:, -5:] = 0.0
    choice = TargetChoice(torch.arange(500), torch.arange(45).expand(500, 45), weights)
    drawn = choice.draw(torch.full((500,), 1 - 2.0**-53, dtype=torch.float64), torch.arange(500))
    assert drawn.tolist() == [39] * 500


def test_an_environment_lives_the_same_in_any_batch() -> None:
    scene = grid_scene(1)
    world = make_world([scene], {scene.name: [3, 20]})
    together = Navigation(world, COLLISION_AWARE, torch.arange(100, 130), step_limit=15)
    alone = Navigation(world, COLLISION_AWARE, torch.tensor([117]), step_limit=15)
    actions = np.random.default_rng(0).integers(4, size=(200, 30))
    together.reset()
    alone.reset()
    for action in torch.from_numpy(actions):
        many, one = together.step(action), alone.step(action[17:18])
        for name in ("state", "reward", "reached", "truncated", "blocked", "zone"):
            assert getattr(many, name)[17] == getattr(one, name)[0], name
        together.reset(many.ended.nonzero()[:, 0])
        alone.reset(one.ended.nonzero()[:, 0])
        assert torch.equal(together.history[17], alone.history[0])
        assert together.target[17] == alone.target[0]


def test_restart_begins_the_episodes_that_reset_would_begin() -> None:
    world = corridor_world(targets=(0, 8, 16))
    one, other = (Navigation(world, COLLISION_AWARE, torch.arange(20), step_limit=9) for _ in range(2))
    for navigation in (one, other):
        navigation.reset()
    ended_in_all = 0
    for step in range(40):
        action = torch.arange(20).add(step) % 4
        ended = one.step(action).ended
        other.step(action)
        ended_in_all += int(ended.sum())
        one.reset(ended.nonzero()[:, 0])
        other.restart(ended)
        for name, tensor in one.tensors().items():
            assert torch.equal(tensor, other.tensors()[name]), name
    assert ended_in_all > 40


def test_it_goes_on_from_its_tensors() -> None:
    world = corridor_world(targets=(16, 2))
    going, other = (Navigation(world, COLLISION_AWARE, torch.arange(8), step_limit=4) for _ in range(2))
    going.reset()
    going.step(torch.zeros(8, dtype=torch.int64))
    other.load_tensors(going.tensors())
    for action in torch.from_numpy(np.random.default_rng(0).integers(4, size=(20, 8))):
        left, right = going.step(action), other.step(action)
        assert torch.equal(left.state, right.state) and torch.equal(left.truncated, right.truncated)
        going.reset(left.ended.nonzero()[:, 0])
        other.reset(right.ended.nonzero()[:, 0])
        assert torch.equal(going.history, other.history) and torch.equal(going.target, other.target)


def test_episodes_that_begin_staggered_share_a_group_s_targets_and_spread_their_clocks() -> None:
    scenes = [corridor_scene(5), corridor_scene(4, name="short")]
    world = make_world(scenes, {"corridor": (0, 8, 16), "short": (4,)})
    choice = TargetChoice.by_scene(world, torch.tensor([0] * 7 + [1] * 20))
    navigation = Navigation(world, SHORTEST, torch.arange(27), choice=choice, step_limit=40)
    navigation.begin_staggered()
    assert navigation.target.tolist() == [0, 1, 2, 0, 1, 2, 0] + [3] * 20
    assert int(navigation.elapsed.min()) >= 0 and int(navigation.elapsed.max()) < 40
    assert len(set(navigation.elapsed.tolist())) > 10
