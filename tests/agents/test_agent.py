"""All agents on the grid keep to one protocol; and what does not is found."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import torch

from clearway.agents.agent import FEATURES, POSE, Agent, Decisions, Observation, joined, rows
from clearway.agents.by_features import FeatureAgent
from clearway.agents.by_pose import RandomWalk, by_policies, network_on_poses, shortest_paths
from clearway.agents.selection import Argmax, ArgmaxUntried
from clearway.evaluation.optimum import world_tasks
from clearway.evaluation.oracle import Task, optimal_policy, soft_policy
from clearway.learn.q_learning import QLearning, TrainedTable
from clearway.learn.run_record import record_of
from clearway.reward import COLLISION_AWARE
from clearway.world.world import World
from helpers.agents import alike, by_rule, check_agent, equal
from helpers.small_eyes import recurrent
from helpers.small_runs import small_learner, small_request, small_world, trained_network

EPISODES, STEPS = 9, 7
WORLD = small_world()


def trained_table() -> TrainedTable:
    request = small_request(learner=small_learner(QLearning()))
    trainer = request.trainer()
    for _ in range(10):
        trainer.update()
    return TrainedTable(record_of(request), trainer.values, trainer.frames)


def network(world: World) -> Agent:
    found = trained_network()
    return network_on_poses(found.lookup(world), world, found.record.learner.reward_scale)


def optimum(world: World, policy: Callable[[Task], np.ndarray]) -> Agent:
    return by_policies(world, [policy(task) for task in world_tasks(world, COLLISION_AWARE)])


AGENTS: dict[str, tuple[Callable[[World], Agent], bool]] = {
    "random walk": (lambda world: RandomWalk(), True),
    "shortest paths": (shortest_paths, True),
    "optimum": (lambda world: optimum(world, optimal_policy), True),
    "soft optimum": (lambda world: optimum(world, soft_policy), True),
    "network": (network, True),
    "trained network": (lambda world: trained_network().on_poses(world), True),
    "trained table": (lambda world: trained_table().on_poses(world), True),
    "argmax of a network": (lambda world: Argmax(network(world)), False),
    "argmax-untried of a network": (lambda world: ArgmaxUntried(network(world), world), False),
    "argmax-untried of the random walk": (lambda world: ArgmaxUntried(RandomWalk(), world), False),
    "argmax of argmax-untried": (lambda world: Argmax(ArgmaxUntried(network(world), world)), False),
    "features": (lambda world: FeatureAgent(trained_network().in_scene(1)), True),
    "recurrent": (recurrent, True),
    "argmax of recurrent": (lambda world: Argmax(recurrent(world)), False),
    "argmax of features": (lambda world: Argmax(FeatureAgent(trained_network().in_scene(1))), False),
}


def seen(world: World, pose: np.ndarray) -> Observation:
    return {POSE: pose, FEATURES: world.features[torch.from_numpy(pose)].numpy()}


def episodes(world: World, one_scene: bool = False) -> tuple[list[Observation], Observation]:
    """What is seen in poses of the targets' scenes, but for the targets themselves; scenes in any order."""
    rng = np.random.default_rng(0)
    index = rng.integers(3, 5, EPISODES) if one_scene else rng.integers(0, 5, EPISODES)
    goal, scene = world.target_state.numpy()[index], world.target_scene.numpy()[index]
    first, last = world.scene_offset.numpy()[scene], world.scene_offset.numpy()[scene + 1]
    poses = []
    for _ in range(STEPS):
        pose = rng.integers(first, last)
        pose[pose == goal] -= 1
        pose = np.where(pose < first, goal + 1, pose)
        poses.append(np.where(rng.random(EPISODES) < 0.3, poses[-1], pose) if poses else pose)  # some stay
    return [seen(world, pose) for pose in poses], seen(world, goal)


@pytest.mark.parametrize("name", AGENTS)
def test_every_agent_keeps_to_the_protocol(name: str) -> None:
    make, draws = AGENTS[name]
    actions = check_agent(make(WORLD), *episodes(WORLD, one_scene="features" in name), draws=draws)
    assert actions.shape[1] == EPISODES


def test_argmax_takes_what_its_agent_holds_most_probable_at_every_step() -> None:
    agent, (observations, target) = network(WORLD), episodes(WORLD)
    actions = check_agent(Argmax(agent), observations, target, draws=False)
    memory = agent.reset(target, np.arange(EPISODES))
    for taken, observation in zip(actions, observations, strict=True):
        decisions, memory = agent.act(observation, memory)
        assert taken.tolist() == decisions.probabilities.argmax(1).tolist()


def test_rows_are_chosen_by_index_or_mask_and_joined_again() -> None:
    state = {"a": np.arange(6).reshape(3, 2), "b": np.array([True, False, True])}
    assert equal(rows(state, np.array([2, 0])), {"a": np.array([[4, 5], [0, 1]]), "b": np.array([True, True])})
    mask = np.array([False, True, False])
    assert equal(rows(state, mask), rows(state, np.array([1])))
    assert equal(joined([rows(state, np.array([0])), rows(state, np.array([1, 2]))]), state)
    told = Decisions(np.array([0, 1, 2]), value=np.array([1.0, 2.0, 3.0]), arrived=np.array([True, False, True]))
    some = told.rows(mask)
    assert (some.action.tolist(), some.value.tolist(), some.arrived.tolist()) == ([1], [2.0], [False])
    assert some.probabilities is None and some.certain is None


class Faulty(RandomWalk):
    """A random walk with something wrong."""

    sees = (POSE,)

    def reset(self, target, seed):
        return {**super().reset(target, seed), "poses": target[POSE].copy()}

    def act(self, observation, state):
        decisions, after = super().act(observation, state)
        return decisions, {**after, "poses": observation[POSE]}


class ChangesItsState(Faulty):
    def act(self, observation, state):
        decisions, _ = super().act(observation, state)
        state["poses"][:] = observation[POSE]
        return decisions, state


class ChangesWhatItSees(Faulty):
    def act(self, observation, state):
        observation[POSE][:] += 1
        return super().act(observation, state)


class KeepsSomething(Faulty):
    calls = 0

    def act(self, observation, state):
        self.calls += 1
        decisions, after = super().act(observation, state)
        return replace(decisions, value=np.full(len(decisions.action), float(self.calls))), after


class LooksAtItsNeighbours(Faulty):
    def act(self, observation, state):
        decisions, after = super().act(observation, state)
        return replace(decisions, value=np.full(len(decisions.action), observation[POSE].mean())), after


class DrawsByThePlaceInTheBatch(Faulty):
    def act(self, observation, state):
        decisions, after = super().act(observation, state)
        return replace(decisions, value=np.arange(len(decisions.action), dtype=float)), after


class ForgetsTheSeed(Faulty):
    def reset(self, target, seed):
        return super().reset(target, np.zeros_like(seed))


class TellsWrongShapes(Faulty):
    def act(self, observation, state):
        decisions, after = super().act(observation, state)
        return replace(decisions, action=decisions.action[:, None]), after


class ActsByInt32(Faulty):
    def act(self, observation, state):
        decisions, after = super().act(observation, state)
        return replace(decisions, action=decisions.action.astype(np.int32)), after


class TakesAFifthAction(Faulty):
    def act(self, observation, state):
        decisions, after = super().act(observation, state)
        return replace(decisions, action=decisions.action + 1, probabilities=None), after


class KeepsALooseArray(Faulty):
    def reset(self, target, seed):
        return {**super().reset(target, seed), "count": np.zeros(1)}


class IsCertainOfWhatItDraws(Faulty):
    def act(self, observation, state):
        decisions, after = super().act(observation, state)
        return replace(decisions, certain=np.ones(len(decisions.action), bool)), after


@pytest.mark.parametrize("agent", [one() for one in Faulty.__subclasses__()], ids=lambda agent: type(agent).__name__)
def test_what_breaks_the_protocol_is_found(agent: Agent) -> None:
    check_agent(Faulty(), *episodes(WORLD))
    with pytest.raises((AssertionError, IndexError)):
        check_agent(agent, *episodes(WORLD))


def test_an_agent_that_never_draws_is_not_taken_for_one_that_does() -> None:
    agent = by_rule(WORLD, alike(0.0, 1.0, 0.0, 0.0))
    check_agent(agent, *episodes(WORLD), draws=False)
    with pytest.raises(AssertionError):
        check_agent(agent, *episodes(WORLD), draws=True)
