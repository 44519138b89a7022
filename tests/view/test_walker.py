"""A walker in a corridor of five cells (states 4 * cell + heading / 90), held against numbers typed in."""

import numpy as np
import pytest
import torch

from clearway.agents.agent import POSE, Agent
from clearway.agents.by_pose import PoseAgent, RandomWalk
from clearway.agents.selection import ActionSelection, selecting
from clearway.errors import AgentError
from clearway.evaluation.episodes import episode_seeds, run_episodes
from clearway.reward import COLLISION_AWARE
from clearway.view.episode import MOST_STEPS
from clearway.view.walker import Walker
from clearway.world.world import World
from helpers.agents import Remembers
from helpers.small_runs import corridor_world

FORWARD, RIGHT, LEFT, BACKWARD = range(4)
FREE, PRECOLLISION, COLLISION = range(3)
TARGET = 1  # of the world: state 8, the third cell, looking along the corridor


def likes(
    world: World, action: int = FORWARD, selection: ActionSelection = "argmax", asked: list | None = None
) -> Agent:
    """An agent that likes one action, and whose value is twice the newest state."""

    def rule(history, target):
        if asked is not None:
            asked.append(history.tolist())
        probabilities = torch.full((len(target), 4), 0.1)
        probabilities[:, action] = 0.7
        return probabilities, 2 * history[:, -1].float()

    return selecting(PoseAgent(world, rule, 3), selection, world)


def walker(start: int, agent: Agent | None = None, **changes) -> Walker:
    return Walker(corridor_world(), TARGET, start, COLLISION_AWARE, seed=0, agent=agent, **changes)


def test_the_user_walks_to_the_target() -> None:
    walk = walker(0)
    assert walk.step() is None  # nobody said where to
    at_start = walk.steps[0]
    assert (at_start.state, at_start.to_go, at_start.zone, at_start.action) == (0, 2, COLLISION, None)
    first, second = walk.step(FORWARD), walk.step(FORWARD)
    assert first is not None and second is not None
    assert (first.state, first.reward, first.zone, first.to_go, first.reached) == (4, -0.011, PRECOLLISION, 1, False)
    assert (second.state, second.reward, second.to_go, second.reached) == (8, 10.0, 0, True)
    assert second.earned == pytest.approx(9.989)
    assert walk.ended and walk.step(FORWARD) is None
    assert len(walk.steps) == 3
    assert second.probabilities is second.value is second.next is None


def test_blocked_moves_are_counted() -> None:
    walk = walker(0)
    bumped, turned, again = walk.step(BACKWARD), walk.step(RIGHT), walk.step(FORWARD)
    assert bumped is not None and turned is not None and again is not None
    assert [(s.state, s.blocked, s.collisions) for s in (bumped, turned, again)] == [
        (0, True, 1),
        (1, False, 1),
        (1, True, 2),
    ]
    assert again.earned == pytest.approx(-0.06)
    assert walk.actions == [BACKWARD, RIGHT, FORWARD]


def test_an_agent_tells_what_it_is_about_to_do_and_does_it() -> None:
    asked: list = []
    walk = walker(0, likes(corridor_world(), asked=asked))
    for _ in range(2):
        assert walk.steps[-1].next == FORWARD
        assert walk.steps[-1].probabilities == pytest.approx((0.7, 0.1, 0.1, 0.1))
        walk.step()
    assert walk.actions == [FORWARD, FORWARD]
    assert asked == [[[0, 0, 0]], [[0, 0, 4]], [[0, 4, 8]]]
    assert [step.value for step in walk.steps] == [0.0, 8.0, 16.0]
    assert walk.steps[-1].next is None and walk.steps[-1].probabilities is None


def test_a_start_at_the_target_is_the_end() -> None:
    walk = walker(8, likes(corridor_world()))
    assert walk.ended and walk.step() is None
    assert walk.steps[0].reached


@pytest.mark.slow
def test_argmax_goes_on_for_ever_and_is_stopped() -> None:
    walk = walker(0, likes(corridor_world(), LEFT))
    while walk.step():
        pass
    assert walk.ended and not walk.steps[-1].reached
    assert len(walk.actions) == MOST_STEPS == 1000


def test_argmax_untried_tries_another_action_in_the_same_pose() -> None:
    agent = likes(corridor_world(), FORWARD, "argmax-untried")
    walk = walker(1, agent)  # looks across the corridor: forward is blocked
    taken = [walk.steps[-1].next]
    walk.step()
    taken.append(walk.steps[-1].next)
    assert taken == [FORWARD, RIGHT]


@pytest.mark.slow
def test_sampled_actions_repeat_with_the_seed_and_follow_the_probabilities() -> None:
    def actions(seed: int) -> list[int]:
        agent = likes(corridor_world(), RIGHT, "sampled")
        walk = Walker(corridor_world(), TARGET, 0, COLLISION_AWARE, seed=seed, agent=agent)
        for _ in range(150):
            walk.step()
        return walk.actions

    first = actions(1)
    assert first == actions(1)
    assert first != actions(2)
    turns = [action for seed in range(10) for action in actions(seed)]
    assert turns.count(RIGHT) / len(turns) == pytest.approx(0.7, abs=0.05)


def test_by_an_episode_s_seed_it_walks_as_in_the_evaluation() -> None:
    world = corridor_world()
    agent = likes(world, FORWARD, "sampled")
    table = run_episodes(world, agent, episodes_per_target=1, step_limit=MOST_STEPS, seed=5, record=True)
    assert table.trajectories is not None
    for target, seed in enumerate(episode_seeds(world, 1, 5).tolist()):
        walk = Walker(world, target, int(table.start[target]), COLLISION_AWARE, seed=seed, agent=agent)
        while walk.step():
            pass
        assert walk.actions == table.trajectories[target].actions.tolist()


def test_recorded_actions_come_first_then_the_agent_chooses() -> None:
    walk = walker(0, likes(corridor_world()), recorded=[RIGHT, LEFT])
    assert walk.steps[0].next == RIGHT
    for _ in range(3):
        walk.step()
    assert walk.actions == [RIGHT, LEFT, FORWARD]
    user = walker(0, recorded=[FORWARD])
    assert user.step() is not None  # the user's own walk is replayed too
    assert user.step() is None


def test_a_replayed_walk_goes_on_as_the_first_one_would_have() -> None:
    def walk(recorded: list[int]) -> list[int]:
        sampled = likes(corridor_world(), RIGHT, "sampled")
        walked = Walker(corridor_world(), TARGET, 0, COLLISION_AWARE, seed=6, agent=sampled, recorded=recorded)
        for _ in range(12):
            walked.step()
        return walked.actions

    assert walk(walk([])[:5]) == walk([])


def test_an_agent_is_told_what_was_done_instead() -> None:
    agent = Remembers()
    walk = walker(0, agent, recorded=[RIGHT, LEFT])
    for _ in range(3):
        walk.step()
    assert walk.actions == [RIGHT, LEFT, FORWARD] and agent.held == [-1, RIGHT, LEFT, FORWARD]


def test_the_map_of_a_mind_asks_for_every_pose_as_a_start() -> None:
    asked: list = []
    walk = walker(0, likes(corridor_world(), asked=asked))
    before = len(walk.steps), walk.steps[-1].next
    held = walk.map_of_mind()
    assert asked[-1] == [[state] * 3 for state in range(20)]
    assert held.probabilities.shape == (20, 4)
    assert held.value.tolist() == [2.0 * state for state in range(20)]
    assert (len(walk.steps), walk.steps[-1].next) == before
    walk.step()
    assert asked[-1] == [[0, 0, 4]]  # the walk's own memory is as it was


def test_an_agent_that_tells_no_value_has_none_to_show() -> None:
    walk = walker(0, RandomWalk())
    assert walk.steps[0].value is None and walk.steps[0].probabilities == (0.25,) * 4
    assert walk.step() is not None


def test_an_agent_that_sees_more_than_poses_is_not_for_the_viewer() -> None:
    class Seeing(RandomWalk):
        sees = (POSE, "rgb")

    with pytest.raises(AgentError, match="sees rgb"):
        walker(0, Seeing())


def test_a_map_of_the_mind_asks_the_agent_itself_not_how_it_chooses() -> None:
    """What remembers the tried actions of every pose would do so for every pose of the map."""
    plain = likes(corridor_world(), selection="sampled")
    walk = walker(0, plain, selection="argmax-untried")
    walk.step()
    held, own = walk.map_of_mind(), walker(0, plain).map_of_mind()
    for name in ("action", "probabilities", "value", "certain"):
        assert np.array_equal(getattr(held, name), getattr(own, name))
