"""Agents by name: ours, another package's (`plugins`), or a user's own as `package.module:name`.

What is named is called with the `World` that the agent is to walk in, and gives an `Agent`: a class whose constructor
takes the world, or a function.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

from clearway.agents.agent import Agent
from clearway.agents.by_pose import RandomWalk, shortest_paths
from clearway.errors import AgentError, PluginError
from clearway.plugins import find_plugin, imported, load_plugin
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
        raise AgentError(f"agent {name!r:.80}: unknown. Use one of {', '.join(AGENTS)}, or package.module:name")
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
        except Exception as fault:  # another's code: anything can come of it, and the user has to be told whose it is
            reason = f"{type(fault).__name__}: {' '.join(str(fault).split())[:200]}"
            raise AgentError(f"{source}: cannot be made ({reason}). Correct it") from fault
        return checked_agent(source, agent)

    return made


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
