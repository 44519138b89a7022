"""`Walker`: one agent, or the user, on its way through an episode, step by step."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import torch

from clearway.agents.agent import POSE, Agent, Decisions, State
from clearway.agents.answers import check_decisions
from clearway.agents.selection import ActionSelection, having_taken, selecting
from clearway.evaluation.sight import Sight
from clearway.mapping.held import Held
from clearway.reward import Reward
from clearway.view.episode import MOST_STEPS
from clearway.world.navigation import Navigation
from clearway.world.world import World


@dataclass(frozen=True)
class Standing:
    """Where a walker stands after a step, or at the start.

    Attributes:
        state: in the scene's own numbering.
        action: that led here; None at the start.
        blocked: it was a blocked move.
        reward: for it; 0 at the start.
        earned: sum of all rewards so far.
        collisions: blocked moves so far.
        zone: of the pose (`zones.Zone`).
        reached: this is the target.
        to_go: steps of a shortest path from here, -1 where there is none.
        probabilities: of the actions from here; None for the user and at the target.
        value: discounted sum of the rewards that the agent expects from here; None for the user.
        next: the action that the agent is about to take; None at the target and for the user.
        held: what an agent with a map holds to be so; None of others.
    """

    state: int
    action: int | None
    blocked: bool
    reward: float
    earned: float
    collisions: int
    zone: int
    reached: bool
    to_go: int
    probabilities: tuple[float, ...] | None
    value: float | None
    next: int | None
    held: Held | None = None


class Walker:
    """An episode of one walker.

    Args:
        world: its tables.
        target: index of the world's target.
        start: state in the scene's own numbering.
        reward: what it earns.
        seed: of sampled actions.
        agent: who chooses, by its pose or by what it sees; None for the user.
        holds: tells what the agent holds by its state; None where it has no map.
        selection: how its actions are chosen.
        recorded: actions that it takes before it chooses by itself.

    Raises:
        AgentError: the agent fails, then or at a step; the walk is to be stopped then.
    """

    def __init__(
        self,
        world: World,
        target: int,
        start: int,
        reward: Reward,
        *,
        seed: int,
        agent: Agent | None,
        holds: Callable[[State], Held] | None = None,
        selection: ActionSelection = "sampled",
        recorded: Sequence[int] = (),
    ) -> None:
        seeds = torch.tensor([seed])
        self.world, self.target, self.agent, self.holds = world, target, agent, holds
        self.chooser = agent and selecting(agent, selection, world)
        self.sight = self.chooser and Sight(world, self.chooser)
        self.offset = int(world.scene_offset[world.target_scene[target]])
        self.states_here = int(world.scene_offset[world.target_scene[target] + 1]) - self.offset
        self.to_go = world.distance_table()
        self.env = Navigation(world, reward, seeds, history_length=1, reward_dtype=torch.float64)
        self.env.reset(target=torch.tensor([target]), start=torch.tensor([start + self.offset]))
        self.memory: State = {}
        if self.chooser and self.sight:
            self.memory = self.chooser.reset(self.sight(world.target_state[[target]]), seeds.numpy())
        self.recorded, self.stopped = list(recorded), False
        reached = int(self.env.state) == int(world.target_state[target])
        zone = int(world.zone[self.env.state])
        self.steps = [self._arrived(None, blocked=False, reward=0.0, zone=zone, reached=reached)]

    @property
    def actions(self) -> list[int]:
        """Taken so far."""
        return [step.action for step in self.steps if step.action is not None]

    @property
    def ended(self) -> bool:
        """The target is reached, or the walk is as long as a walk may be, or was stopped."""
        return self.stopped or self.steps[-1].reached or len(self.steps) > MOST_STEPS

    def step(self, action: int | None = None) -> Standing | None:
        """Take the recorded action, else the one given, else the one that the agent has chosen.

        Gives back None, and nothing happens, where the walk has ended or there is no action: the user's turn.
        """
        if self.ended:
            return None
        if self.recorded:
            action = self.recorded.pop(0)
        elif action is None:
            action = self.steps[-1].next
        if action is None:
            return None
        self.memory = having_taken(np.array([action]), self.memory)
        happened = self.env.step(torch.tensor([action]))
        self.steps.append(
            self._arrived(
                action,
                blocked=bool(happened.blocked),
                reward=float(happened.reward),
                zone=int(happened.zone),
                reached=bool(happened.reached),
            )
        )
        return self.steps[-1]

    def stop(self, count: int) -> None:
        """End the walk, and keep so many of its steps."""
        del self.steps[count:]
        self.stopped = True

    def map_of_mind(self) -> Decisions:
        """What the agent holds in all poses of the scene (S), each as at the start of an episode.

        Raises:
            AgentError: its answer is none.
        """
        assert self.agent is not None
        poses = np.arange(self.states_here) + self.offset
        target = np.full_like(poses, int(self.world.target_state[self.target]))
        decisions, _ = self.agent.act({POSE: poses}, self.agent.reset({POSE: target}, np.zeros_like(poses)))
        check_decisions(decisions, len(poses))
        return decisions

    def _arrived(self, action: int | None, *, blocked: bool, reward: float, zone: int, reached: bool) -> Standing:
        before = self.steps[-1] if action is not None else None
        probabilities = value = following = held = None
        if self.chooser and self.sight:
            decisions, self.memory = self.chooser.act(self.sight(self.env.state), self.memory)
            check_decisions(decisions, 1)
            held = None if self.holds is None else self.holds(self.memory)
            value = None if decisions.value is None else float(decisions.value[0])
            if not reached:
                told = decisions.probabilities
                probabilities = None if told is None else tuple(told[0].tolist())
                following = self.recorded[0] if self.recorded else int(decisions.action[0])
        return Standing(
            state=int(self.env.state) - self.offset,
            action=action,
            blocked=blocked,
            reward=reward,
            earned=reward + (before.earned if before else 0.0),
            collisions=int(blocked) + (before.collisions if before else 0),
            zone=zone,
            reached=reached,
            to_go=int(self.to_go[self.target, self.env.state]),
            probabilities=probabilities,
            value=value,
            next=following,
            held=held,
        )
