"""Agents on the grid, which know their pose: networks computed from tables, shortest paths, tables, the random walk.

Axis letters: B episodes, K poses of history (newest last), A actions, M targets, S states of all scenes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeAlias

import numpy as np
import torch
from torch import Tensor

from clearway.agents import memory
from clearway.agents.agent import POSE, Decisions, Observation, State
from clearway.agents.chance import CHANCE, chance_of, drawn
from clearway.errors import AgentError
from clearway.model.lookup import LookupNetwork
from clearway.model.policy import network_critic, shortest_path_actions
from clearway.scenes.actions import ACTION_COUNT
from clearway.world.world import World

Rule: TypeAlias = Callable[[Tensor, Tensor], tuple[Tensor, Tensor | None]]
"""history (B, K) int64 states, target (B,) int64 index of the world's -> probabilities (B, A), values (B,) or None.

A pure function, on the world's device.
"""


class PoseAgent:
    """Draws its actions by a rule of the last poses and the target.

    Args:
        world: whose targets it knows.
        rule: gives the probabilities.
        history_length: K, poses that the rule looks at.
    """

    sees = (POSE,)

    def __init__(self, world: World, rule: Rule, history_length: int = 1) -> None:
        self._rule, self._device, self._earlier = rule, world.device, history_length - 1
        self._target_at = np.full(world.state_count, -1)
        self._target_at[world.target_state.cpu().numpy()] = np.arange(world.target_count)

    def reset(self, target: Observation, seed: np.ndarray) -> State:
        """Begin B episodes; see `Agent.reset`. Raises AgentError: a target is none of the world's."""
        known = target[POSE] < len(self._target_at)
        index = np.where(known, self._target_at[np.where(known, target[POSE], 0)], -1)
        if (index < 0).any():
            pose = int(target[POSE][index < 0][0])
            problem = f"the agent was made for a world without target {pose}, in the numbering of all scenes"
            raise AgentError(f"{problem}. Give what makes it for a World, or the targets that it knows")
        count = len(index)
        return {
            "target": index,
            "begun": np.zeros(count, bool),
            "earlier": np.zeros((count, self._earlier), np.int64),
            CHANCE: chance_of(seed),
        }

    @torch.no_grad()
    def act(self, observation: Observation, state: State) -> tuple[Decisions, State]:
        """Actions drawn by the rule; see `Agent.act`."""
        poses = memory.history(state["earlier"], state["begun"], observation[POSE])
        given = torch.from_numpy(poses).to(self._device), torch.from_numpy(state["target"]).to(self._device)
        probabilities, value = self._rule(*given)
        told = None if value is None else value.cpu().numpy()
        decisions, chance = drawn(probabilities.cpu().numpy(), state[CHANCE], told)
        after = {"earlier": poses[:, 1:], "begun": np.ones_like(state["begun"]), CHANCE: chance}
        return decisions, {**state, **after}


class RandomWalk:
    """Takes all actions alike, whatever it sees."""

    sees: tuple[str, ...] = ()

    def reset(self, target: Observation, seed: np.ndarray) -> State:
        """Begin B episodes; see `Agent.reset`."""
        return {CHANCE: chance_of(seed)}

    def act(self, observation: Observation, state: State) -> tuple[Decisions, State]:
        """Any actions; see `Agent.act`."""
        alike = np.full((len(state[CHANCE]), ACTION_COUNT), 1 / ACTION_COUNT)
        decisions, chance = drawn(alike, state[CHANCE])
        return decisions, {CHANCE: chance}


def network_on_poses(network: LookupNetwork, world: World, reward_scale: float = 1.0) -> PoseAgent:
    """A network in the world whose states and targets it was made for; its values are divided by the reward's scale."""
    critic = network_critic(network, world)

    def rule(history: Tensor, target: Tensor) -> tuple[Tensor, Tensor]:
        probabilities, value = critic(history, target)
        return probabilities, value / reward_scale

    return PoseAgent(world, rule, network.history_length)


def shortest_paths(world: World) -> PoseAgent:
    """All actions alike that begin a shortest path; it must not be asked where there is none."""
    steps_to_go = world.distance_table()

    def rule(history: Tensor, target: Tensor) -> tuple[Tensor, None]:
        optimal = shortest_path_actions(world, steps_to_go, history[:, -1], target).to(torch.float64)
        return optimal / optimal.sum(1, keepdim=True).clamp(min=1), None

    return PoseAgent(world, rule)


def by_policies(world: World, policies: Sequence[np.ndarray]) -> PoseAgent:
    """By a policy for each target of a world: probabilities (S, A) of its scene; elsewhere it has none."""
    assert [len(policy) for policy in policies] == world.scene_offset.diff()[world.target_scene].tolist()
    table = torch.cat([torch.from_numpy(policy).float() for policy in policies]).to(world.device)
    begins = torch.tensor([0, *map(len, policies[:-1])], device=world.device).cumsum(0)

    def rule(history: Tensor, target: Tensor) -> tuple[Tensor, None]:
        scene, pose = world.target_scene[target], history[:, -1]
        first = world.scene_offset[scene]
        there = (pose >= first) & (pose < world.scene_offset[scene + 1])
        row = begins[target] + torch.where(there, pose - first, 0)
        return torch.where(there[:, None], table[row], 0.0), None

    return PoseAgent(world, rule)
