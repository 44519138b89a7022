"""Agents by name: ours, another package's (`plugins`), or a user's own as `package.module:name`.

What is named is called with the `World` that the agent is to walk in, and gives an `Agent`: a class whose constructor
takes the world, or a function.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TypeAlias

import numpy as np

from clearway.agents.agent import Agent, Decisions, Observation, State
from clearway.agents.by_pose import RandomWalk, shortest_paths
from clearway.errors import AgentError, PluginError, kind_and_reason
from clearway.plugins import find_plugin, imported, load_plugin, offered
from clearway.spelling import did_you_mean
from clearway.world.world import World

AgentMaker: TypeAlias = Callable[[World], Agent]

AGENTS: dict[str, AgentMaker] = {"random": lambda world: RandomWalk(), "shortest path": shortest_paths}


def agent_maker(name: str) -> AgentMaker:
    """What makes the agent of a name.

    Raises:
        AgentError: there is none.
        PluginError: two packages offer one of this name, or it cannot be imported.
    """
    if name in AGENTS:
        return AGENTS[name]
    if plugin := find_plugin("agents", name):
        return named_maker(str(plugin), load_plugin(plugin))
    if ":" not in name:
        names = (*AGENTS, *offered("agents"))
        told = f"agent {name!r:.80}: unknown.{did_you_mean(name, names)}"
        raise AgentError(f"{told} Use one of {', '.join(names)}, or package.module:name")
    try:
        return named_maker(f"agent {name}", imported(name))
    except PluginError as fault:
        raise AgentError(f"agent {fault}") from fault


def named_maker(source: str, found: object) -> AgentMaker:
    """What was found under a name, behind a check of what it makes. Raises AgentError: nothing can be made with it."""
    if not callable(found):
        raise AgentError(f"{source}: is {found!r:.60}, expected a class or function that takes a World. Correct it")

    def made(world: World) -> Agent:
        try:
            agent = found(world)
        except (Exception, SystemExit) as fault:  # another's code: anything can come of it; the user is told whose
            reason = kind_and_reason(fault)
            raise AgentError(f"{source}: cannot be made ({reason}). Correct it") from fault
        return Foreign(checked_agent(source, agent), source)

    return made


class Foreign:
    """Another's agent. Whatever it raises is told of as its fault, an `AgentError` in one line.

    Attributes:
        agent: the other's own.
    """

    def __init__(self, agent: Agent, source: str) -> None:
        self.agent, self._source = agent, source
        self.sees = agent.sees

    def reset(self, target: Observation, seed: np.ndarray) -> State:
        """See `Agent.reset`."""
        with self._told():
            return self.agent.reset(target, seed)

    def act(self, observation: Observation, state: State) -> tuple[Decisions, State]:
        """See `Agent.act`."""
        with self._told():
            decisions, after = self.agent.act(observation, state)
            return decisions, after

    @contextmanager
    def _told(self) -> Iterator[None]:
        try:
            yield
        except AgentError:  # one of ours, given as it is, tells itself what is wrong
            raise
        except (Exception, SystemExit) as fault:  # another's code: anything can come of it
            reason = kind_and_reason(fault)
            raise AgentError(f"{self._source}: failed ({reason}). Correct it") from fault


def checked_agent(source: str, agent: object) -> Agent:
    """The agent. Raises AgentError where it is none."""
    if not isinstance(agent, Agent) or isinstance(agent, type):
        problem = f"{source}: gives {agent!r:.60}, expected an object with sees, reset and act"
        raise AgentError(f"{problem} (clearway.Agent). Correct it")
    sees = agent.sees
    if not isinstance(sees, tuple) or not all(isinstance(name, str) for name in sees):
        raise AgentError(
            f"{source}: sees {sees!r:.60}, expected a tuple of sensors' names, such as ('rgb',). Correct it"
        )
    return agent
