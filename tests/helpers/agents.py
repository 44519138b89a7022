"""Agents made of a rule in a line, what an agent does after given poses, and `check_agent`, what all agents keep to."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import torch
from torch import Tensor

from clearway.agents.agent import LAST_ACTION, POSE, Agent, Decisions, Observation, State, joined, rows
from clearway.agents.by_pose import PoseAgent, RandomWalk
from clearway.scenes.actions import ACTION_COUNT, Action
from clearway.world.world import World

Chances = Callable[[Tensor, Tensor], Tensor]
"""history (B, K) int64 states, target (B,) int64 index of the world's -> probabilities (B, A)."""


def by_rule(world: World, chances: Chances, history_length: int = 4) -> PoseAgent:
    """An agent that draws by these probabilities and tells no value."""
    return PoseAgent(world, lambda history, target: (chances(history, target), None), history_length)


def alike(*weights: float) -> Chances:
    """These probabilities (A,), whatever is seen."""
    return lambda history, target: torch.tensor(weights).expand(len(target), ACTION_COUNT)


def only(action: Action) -> Chances:
    """One action for ever."""
    return alike(*(float(other is action) for other in Action))


def arbitrary(seed: int, greed: float = 3.0) -> Chances:
    """Probabilities that depend on the whole history and the target in no sensible way."""
    weights = torch.randn(5, ACTION_COUNT, generator=torch.Generator().manual_seed(seed), dtype=torch.float64)

    def chances(history: Tensor, target: Tensor) -> Tensor:
        seen = torch.cat([history, target[:, None]], 1).double()
        return (greed * torch.sin(seen @ weights)).softmax(1)

    return chances


def after_poses(agent: Agent, world: World, history: Tensor, target: Tensor) -> Decisions:
    """What an agent does after poses (B, K), the first of which begins the episode, to targets (B,) of the world's."""
    memory = agent.reset({POSE: world.target_state[target].numpy()}, np.arange(len(target)))
    for pose in history.T:
        decisions, memory = agent.act({POSE: pose.numpy()}, memory)
    return decisions


def told_after(agent: Agent, world: World, history: Tensor, target: Tensor) -> Tensor:
    """The probabilities (B, A) of `after_poses`."""
    told = after_poses(agent, world, history, target).probabilities
    assert told is not None
    return torch.from_numpy(told)


def check_agent(
    agent: Agent, observations: Sequence[Observation], target: Observation, *, draws: bool = True
) -> np.ndarray:
    """Hold an agent against its protocol.

    Args:
        agent: any.
        observations: of B episodes, step after step; it is given what it sees of them.
        target: of the same; B of at least 2.
        draws: another seed gives other actions.

    Returns:
        (T, B) int64, its actions.
    """
    assert isinstance(agent, Agent)
    assert isinstance(agent.sees, tuple) and all(isinstance(name, str) for name in agent.sees)
    count = len(next(iter(target.values())))
    assert count >= 2 and len(observations) >= 2, "this shows nothing"
    target = {name: target[name] for name in agent.sees}
    seen = [{name: observation[name] for name in agent.sees} for observation in observations]
    seed = np.arange(100, 100 + count)

    before = copied(target)
    begin = agent.reset(target, seed)
    assert equal(target, before) and np.array_equal(seed, np.arange(100, 100 + count)), "reset changes what it is given"
    _check_state(begin, count)
    taken, states = [], [begin]
    for observation in seen:
        decisions, after = _pure_act(agent, observation, states[-1])
        _check_decisions(decisions, count)
        _check_state(after, count)
        assert _kinds(after) == _kinds(begin), "a state changes its arrays' names, kinds or shapes"
        taken.append(decisions)
        states.append(after)

    _check_rows(agent, seen, target, seed, taken, states)
    actions = np.stack([decisions.action for decisions in taken])
    again = _actions(agent, seen, target, seed)
    assert np.array_equal(again, actions), "the same seed repeats"
    others = np.stack([_actions(agent, seen, target, seed + 1000 * further) for further in range(1, 9)])
    assert (others != actions).any() == draws
    for step, decisions in enumerate(taken):
        if decisions.certain is not None:
            assert (others[:, step] == actions[step])[:, decisions.certain].all(), "what is certain needs no draw"
    return actions


def copied(arrays: Observation | State) -> dict[str, np.ndarray]:
    """Names and copies."""
    return {name: values.copy() for name, values in arrays.items()}


def equal(one: Observation | State, other: Observation | State) -> bool:
    """The same names, kinds and numbers, bit for bit."""
    return _kinds(one) == _kinds(other) and all(np.array_equal(one[name], other[name]) for name in one)


def _kinds(arrays: Observation | State) -> dict[str, tuple[np.dtype, tuple[int, ...]]]:
    return {name: (values.dtype, values.shape) for name, values in arrays.items()}


def _check_state(state: State, count: int) -> None:
    for name, values in state.items():
        assert isinstance(name, str) and isinstance(values, np.ndarray)
        assert len(values) == count, f"{name}: an array of a state has a row an episode"


def _check_decisions(decisions: Decisions, count: int) -> None:
    action, told = decisions.action, decisions.probabilities
    assert (action.shape, action.dtype) == ((count,), np.int64)
    assert ((action >= 0) & (action < ACTION_COUNT)).all()
    if told is not None:
        assert told.shape == (count, ACTION_COUNT) and told.dtype.kind == "f"
        assert np.isfinite(told).all() and (told >= 0).all()
        assert (told[np.arange(count), action] > 0).all(), "an impossible action is taken"
    if decisions.value is not None:
        assert decisions.value.shape == (count,) and decisions.value.dtype.kind == "f"
        assert np.isfinite(decisions.value).all()
    for flags in (decisions.arrived, decisions.certain):
        assert flags is None or (flags.shape, flags.dtype) == ((count,), np.bool_)


def _pure_act(agent: Agent, observation: Observation, state: State) -> tuple[Decisions, State]:
    """`act`, which changes nothing that it is given and keeps nothing: asked again it gives the same."""
    given = copied(observation), copied(state)
    decisions, after = agent.act(observation, state)
    first = copied(_told(decisions)), copied(after)
    assert equal(observation, given[0]) and equal(state, given[1]), "act changes what it is given"
    second, later = agent.act(observation, state)
    assert equal(first[0], _told(second)) and equal(first[1], later), "act keeps something"
    assert equal(first[0], _told(decisions)) and equal(first[1], after), "act changes what it gave before"
    return decisions, after


def _check_rows(
    agent: Agent,
    seen: Sequence[Observation],
    target: Observation,
    seed: np.ndarray,
    taken: Sequence[Decisions],
    states: Sequence[State],
) -> None:
    """A batch is its rows: each episode alone, and in another order, is the same."""
    singles = [agent.reset(rows(target, own), seed[own]) for own in _each(len(seed))]
    _check_close(joined(singles), states[0])
    for step, observation in enumerate(seen):
        answers = [
            agent.act(rows(observation, own), single) for own, single in zip(_each(len(seed)), singles, strict=True)
        ]
        singles = [single for _, single in answers]
        whole = _told(taken[step])
        _check_close(joined([_told(decisions) for decisions, _ in answers]), whole)
        _check_close(joined(singles), states[step + 1])
        turned = np.arange(len(seed))[::-1]
        decisions, after = agent.act(rows(observation, turned), rows(states[step], turned))
        _check_close(_told(decisions), rows(whole, turned))
        _check_close(after, rows(states[step + 1], turned))
        _check_close(_told(taken[step].rows(turned)), rows(whole, turned))


def _each(count: int) -> list[np.ndarray]:
    return [np.array([row]) for row in range(count)]


def _told(decisions: Decisions) -> dict[str, np.ndarray]:
    return {name: values for name, values in vars(decisions).items() if values is not None}


def _check_close(found: State, expected: State) -> None:
    """Equal, but for the last digits of what a network computes."""
    assert _kinds(found) == _kinds(expected)
    for name, values in expected.items():
        if values.dtype.kind == "f":
            np.testing.assert_allclose(found[name], values, rtol=1e-4, atol=1e-5, err_msg=name)
        else:
            np.testing.assert_array_equal(found[name], values, err_msg=name)


def _actions(agent: Agent, seen: Sequence[Observation], target: Observation, seed: np.ndarray) -> np.ndarray:
    state, actions = agent.reset(target, seed), []
    for observation in seen:
        decisions, state = agent.act(observation, state)
        actions.append(decisions.action)
    return np.stack(actions)


class Spy(RandomWalk):
    """Walks at random and notes what it is given."""

    def __init__(self, *sees: str) -> None:
        self.sees = sees
        self.targets: list[Observation] = []
        self.seen: list[Observation] = []

    def reset(self, target: Observation, seed: np.ndarray) -> State:
        self.targets.append(target)
        return super().reset(target, seed)

    def act(self, observation: Observation, state: State) -> tuple[Decisions, State]:
        self.seen.append(observation)
        return super().act(observation, state)


class Remembers:
    """It would always move forward, and writes down what it holds to have done last."""

    sees = (POSE,)

    def __init__(self) -> None:
        self.held: list[int] = []

    def reset(self, target: Observation, seed: np.ndarray) -> State:
        return {LAST_ACTION: np.full(len(seed), -1)}

    def act(self, observation: Observation, state: State) -> tuple[Decisions, State]:
        self.held += state[LAST_ACTION].tolist()
        action = np.zeros(len(observation[POSE]), np.int64)
        return Decisions(action), {LAST_ACTION: action}
