"""How an agent chooses among the actions that it gives probabilities for.

sampled         drawn with their probabilities, as in the paper; so every agent does by itself
argmax          always the most probable one; an agent whose history repeats walks in a circle for ever
argmax-untried  the most probable of those that the episode has not tried in this pose yet; once all are tried, all
                count as untried again

The last is as deterministic as argmax and the same until the agent comes back to a pose, but no circle lasts: in a pose
visited without end every action is taken without end, so every neighbour is visited without end too, and by induction
the target, if it can be reached from there. (A rotor walk whose order of actions is the policy's: Priezzhev, Dhar, Dhar
& Krishnamurthy 1996; Yanovski, Wagner & Bruckstein 2003.) The agent has to recognise a view that it has had before in
the episode, which the paper's agent does not.

Axis letters: B episodes, S states of the largest scene, A actions.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from clearway.agents.agent import LAST_ACTION, POSE, Agent, Decisions, Observation, State
from clearway.errors import AgentError
from clearway.scenes.actions import ACTION_COUNT

if TYPE_CHECKING:
    from clearway.world.world import World

ActionSelection = Literal["sampled", "argmax", "argmax-untried"]
_FIRST, _TRIED = "argmax-untried first", "argmax-untried tried"  # in a state, beside the names of the other agent
_BIT = np.arange(ACTION_COUNT)
_ALL_TRIED = (1 << ACTION_COUNT) - 1


class NoProbabilities(AgentError):
    """An agent tells none, so that nobody can choose by them."""


def selecting(agent: Agent, selection: ActionSelection, world: World) -> Agent:
    """The agent, choosing its actions in that way, in a world."""
    if selection == "sampled":
        return agent
    return Argmax(agent) if selection == "argmax" else ArgmaxUntried(agent, world)


class Argmax:
    """Takes the most probable action of another agent, the first among equals."""

    def __init__(self, agent: Agent) -> None:
        self._agent = agent
        self.sees = agent.sees

    def reset(self, target: Observation, seed: np.ndarray) -> State:
        """See `Agent.reset`."""
        return self._agent.reset(target, seed)

    def act(self, observation: Observation, state: State) -> tuple[Decisions, State]:
        """See `Agent.act`."""
        decisions, after = self._agent.act(observation, state)
        decisions = most_probable(decisions)
        return decisions, having_taken(decisions.action, after)


class ArgmaxUntried:
    """Takes the most probable action of another agent that the episode has not tried in this pose yet.

    Args:
        agent: the other one.
        world: whose poses are recognised.
    """

    def __init__(self, agent: Agent, world: World) -> None:
        self._agent = agent
        self.sees = (*agent.sees, *((POSE,) if POSE not in agent.sees else ()))
        self._first = world.scene_offset.cpu().numpy()

    def reset(self, target: Observation, seed: np.ndarray) -> State:
        """See `Agent.reset`."""
        scene = np.searchsorted(self._first, target[POSE], side="right") - 1
        tried = np.zeros((len(seed), np.diff(self._first).max()), np.uint8)  # a bit an action
        return {**self._agent.reset(self._its_own(target), seed), _FIRST: self._first[scene], _TRIED: tried}

    def act(self, observation: Observation, state: State) -> tuple[Decisions, State]:
        """See `Agent.act`."""
        others = {name: values for name, values in state.items() if name not in (_FIRST, _TRIED)}
        decisions, after = self._agent.act(self._its_own(observation), others)
        place = np.arange(len(state[_TRIED])), observation[POSE] - state[_FIRST]
        before = state[_TRIED][place]
        was_tried = (before[:, None] >> _BIT & 1).astype(bool)
        action = np.where(was_tried, -1.0, _probabilities(decisions)).argmax(1)
        now = before | (1 << action).astype(np.uint8)
        tried = state[_TRIED].copy()
        tried[place] = np.where(now == _ALL_TRIED, 0, now)
        return replace(decisions, action=action, certain=None), {
            **having_taken(action, after),
            _FIRST: state[_FIRST],
            _TRIED: tried,
        }

    def _its_own(self, seen: Observation) -> Observation:
        """What the other agent sees of it."""
        return {name: values for name, values in seen.items() if name != POSE or POSE in self._agent.sees}


def most_probable(decisions: Decisions) -> Decisions:
    """The same with the most probable actions, the first among equals. Raises NoProbabilities."""
    action = _probabilities(decisions).argmax(1)
    return replace(decisions, action=action, certain=np.ones(len(action), bool))


def having_taken(action: np.ndarray, state: State) -> State:
    """The state of an agent that would have taken others; where it remembers its last action, these (B,) are it."""
    return {**state, LAST_ACTION: action} if LAST_ACTION in state else state


def _probabilities(decisions: Decisions) -> np.ndarray:
    if decisions.probabilities is None:
        raise NoProbabilities(
            "the agent tells no probabilities, which argmax goes by. Let it choose by itself: sampled"
        )
    return decisions.probabilities
