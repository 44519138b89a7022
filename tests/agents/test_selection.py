"""Ways of choosing actions: an agent that walks in circles under argmax gets out of them by its untried actions."""

from typing import get_args

import numpy as np
import pytest
import torch

from clearway.agents.agent import POSE, Decisions
from clearway.agents.by_pose import RandomWalk, shortest_paths
from clearway.agents.selection import ActionSelection, Argmax, ArgmaxUntried, most_probable, selecting
from clearway.errors import AgentError
from clearway.evaluation.episodes import run_episodes
from clearway.evaluation.protocol import evaluate_agents
from clearway.scenes.actions import Action
from clearway.world.world import make_world
from helpers.agents import alike, arbitrary, by_rule
from helpers.made import corridor_scene, grid_scene

FORWARD, RIGHT, LEFT, BACKWARD = Action


RULES = [TURNING := alike(0.3, 0.4, 0.2, 0.1), *(arbitrary(seed, greed=9.0) for seed in range(4))]
"""The first likes right above all, then forward, left, backward: argmax turns on the spot for ever."""


def untried_in(length: int, chances) -> ArgmaxUntried:
    """In a corridor, with its last pose as a target."""
    world = make_world([corridor_scene(length)], {"corridor": [4 * length - 1]})
    return ArgmaxUntried(by_rule(world, chances), world)


def test_the_most_probable_untried_action_is_chosen_and_all_tried_begin_anew():
    agent = untried_in(2, TURNING)

    def taken(pose: int, state) -> tuple[int, object]:
        decisions, after = agent.act({POSE: np.array([pose])}, state)
        return int(decisions.action[0]), after

    memory, actions = agent.reset({POSE: np.array([7])}, np.array([0])), []
    for _ in range(6):
        action, memory = taken(2, memory)
        actions.append(action)
    assert actions == [RIGHT, FORWARD, LEFT, BACKWARD, RIGHT, FORWARD]
    assert taken(1, memory)[0] == RIGHT  # another pose
    assert taken(2, memory)[0] == LEFT
    assert taken(2, agent.reset({POSE: np.array([7])}, np.array([0])))[0] == RIGHT  # another episode


def test_what_is_left_is_ordered_by_the_chances_of_now():
    def chances(history, target):
        early, late = torch.tensor([0.3, 0.4, 0.2, 0.1]), torch.tensor([0.0, 0.0, 0.1, 0.9])
        return torch.where(history[:, :1] == history[:, -1:], early, late)

    agent = untried_in(2, chances)
    memory, actions = agent.reset({POSE: np.array([7])}, np.array([0])), []
    for pose in (2, 3, 2, 3, 2):
        decisions, memory = agent.act({POSE: np.array([pose])}, memory)
        actions.append(int(decisions.action[0]))
    # pose 2: right, as all looks alike; then, history 2 2 3 2, alike again; then, history 3 2 3 2, what is late
    assert [actions[index] for index in (0, 2, 4)] == [RIGHT, FORWARD, BACKWARD]


def test_several_episodes_remember_for_themselves():
    def chances(history, target):
        return torch.tensor([[0.3, 0.4, 0.2, 0.1], [0.7, 0.1, 0.1, 0.1]])[: len(history)]

    agent = untried_in(2, chances)
    memory = agent.reset({POSE: np.array([7, 7])}, np.array([0, 1]))
    found = []
    for _ in range(2):
        decisions, memory = agent.act({POSE: np.array([4, 4])}, memory)
        found.append(decisions.action.tolist())
    assert found == [[RIGHT, FORWARD], [FORWARD, RIGHT]]


def test_poses_are_counted_in_the_target_s_own_scene():
    """Of two scenes, the second of which is larger: the same place in each is another pose."""
    scenes = [corridor_scene(2, name="short"), corridor_scene(6, name="long")]
    world = make_world(scenes, {"short": [7], "long": [23]})
    agent = ArgmaxUntried(by_rule(world, TURNING), world)
    goals = world.target_state.numpy()
    last = np.array([7, world.state_count - 1])
    memory, found = agent.reset({POSE: goals}, np.array([0, 1])), []
    for poses in (last, last, last - 1, last):
        decisions, memory = agent.act({POSE: poses}, memory)
        found.append(decisions.action.tolist())
    assert found == [[RIGHT] * 2, [FORWARD] * 2, [RIGHT] * 2, [LEFT] * 2]


def test_argmax_takes_the_first_of_equals_and_is_certain_of_it():
    decisions = Decisions(
        np.array([3, 1]), np.array([[0.1, 0.4, 0.1, 0.4], [0.0, 0.1, 0.9, 0.0]]), np.array([5.0, 6.0])
    )
    taken = most_probable(decisions)
    assert taken.action.tolist() == [1, 2] and taken.certain.all()
    assert taken.value is decisions.value and taken.probabilities is decisions.probabilities


class Strict(RandomWalk):
    """Takes nothing but what it gave."""

    def reset(self, target, seed):
        assert not target
        return super().reset(target, seed)

    def act(self, observation, state):
        assert not observation and set(state) == set(super().reset({}, np.array([0])))
        return super().act(observation, state)


def test_the_other_agent_is_given_what_it_sees_and_its_own_memory_alone(world):
    for selection in get_args(ActionSelection):
        assert len(run_episodes(world, Strict(), selection=selection, episodes_per_target=2, step_limit=9)) == 10


class Silent(RandomWalk):
    """Tells no probabilities."""

    def act(self, observation, state):
        decisions, after = super().act(observation, state)
        return Decisions(decisions.action), after


def test_an_agent_that_tells_no_probabilities_cannot_be_asked_for_the_most_probable(world):
    for selection in ("argmax", "argmax-untried"):
        with pytest.raises(AgentError, match=r"tells no probabilities, which argmax goes by\. Let it choose by itself"):
            run_episodes(world, Silent(), selection=selection, episodes_per_target=1)
    assert len(run_episodes(world, Silent(), episodes_per_target=2, step_limit=9)) == 10


def test_a_selection_sees_what_its_agent_sees_and_the_pose_where_it_needs_it(world):
    walk, known = RandomWalk(), shortest_paths(world)
    assert selecting(walk, "sampled", world) is walk
    assert Argmax(walk).sees == () and Argmax(known).sees == (POSE,)
    assert ArgmaxUntried(walk, world).sees == ArgmaxUntried(known, world).sees == (POSE,)


def test_a_walk_typed_in():
    # Two cells; from cell 0 looking along the corridor (state 0) to the same heading in cell 1 (state 4). Turning right
    # leads through 1, 2, 3 back to 0; there forward is next. Start and target are fixed by leaving nothing else.
    world = make_world([corridor_scene(2)], {"corridor": [4]})
    table = run_episodes(
        world, by_rule(world, TURNING), selection="argmax-untried", episodes_per_target=60, record=True, step_limit=100
    )
    assert table.reached.all()
    walk = next(walk for walk in table.trajectories if walk.states[0] == 0)
    assert walk.states.tolist() == [0, 1, 2, 3, 0, 4]
    assert walk.actions.tolist() == [RIGHT, RIGHT, RIGHT, RIGHT, FORWARD]


@pytest.fixture(scope="module")
def world():
    return make_world([grid_scene(3), corridor_scene(5, feature_count=32)], {"grid": [0, 13, 31], "corridor": [19, 2]})


@pytest.mark.parametrize("chances", RULES)
def test_what_loops_under_argmax_arrives_by_untried_actions(world, chances):
    agent = by_rule(world, chances)
    looping = run_episodes(world, agent, selection="argmax", episodes_per_target=30)
    assert looping.looped.mean() > 0.2
    arriving = run_episodes(world, agent, selection="argmax-untried", episodes_per_target=30)
    assert arriving.reached.all() and not arriving.looped.any()
    assert np.array_equal(looping.reached, ~looping.looped)


def test_it_is_argmax_as_long_as_no_pose_comes_back(world):
    ideal = shortest_paths(world)
    greedy = run_episodes(world, ideal, selection="argmax", episodes_per_target=30)
    untried = run_episodes(world, ideal, selection="argmax-untried", episodes_per_target=30)
    for name in ("start", "steps", "collisions", "zone_steps", "reached"):
        assert np.array_equal(getattr(greedy, name), getattr(untried, name))


def test_it_is_deterministic_and_the_same_whatever_runs_beside_it(world):
    agent, settings = by_rule(world, RULES[1]), {"selection": "argmax-untried", "episodes_per_target": 20}
    whole = run_episodes(world, agent, **settings)
    parts = run_episodes(world, agent, **settings, episodes_at_once=7)
    recorded = run_episodes(world, agent, **settings, record=True)
    for other in (parts, recorded):
        assert np.array_equal(whole.steps, other.steps) and np.array_equal(whole.collisions, other.collisions)
    start_and_target = whole.target * 10_000 + whole.start  # equal starts, equal walks: nothing is drawn
    _, first, place = np.unique(start_and_target, return_index=True, return_inverse=True)
    assert len(first) < len(whole)
    assert np.array_equal(whole.steps, whole.steps[first][place])


def test_argmax_as_a_selection_is_the_argmax_agent(world):
    agent = by_rule(world, RULES[2])
    selected = run_episodes(world, agent, selection="argmax", episodes_per_target=20)
    made = run_episodes(world, Argmax(agent), episodes_per_target=20)
    assert np.array_equal(selected.steps, made.steps) and np.array_equal(selected.looped, made.looped)


def test_sampling_never_counts_as_a_loop_and_a_failure_need_not_be_one(world):
    table = run_episodes(world, RandomWalk(), episodes_per_target=30, step_limit=20)
    assert not table.reached.all() and not table.looped.any()


@pytest.mark.slow
def test_evaluations_report_the_share_that_loops(world):
    found = evaluate_agents(world, {"agent": by_rule(world, TURNING)}, encoder="made-up", episodes_per_target=30)
    looped = {(e.agent, e.protocol.action_selection): e.to_json()["average"]["looped"] for e in found}
    argmax_row = found[1].to_json()["average"]
    assert looped["agent", "argmax"] == pytest.approx(1 - argmax_row["success"]) and argmax_row["looped"] > 0.5
    assert [share for row, share in looped.items() if row != ("agent", "argmax")] == [0.0] * 4
