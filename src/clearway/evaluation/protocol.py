"""The whole protocol for some agents: each way of choosing actions, with the random and the shortest-path agent."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import get_args

from clearway.agents.agent import Agent
from clearway.agents.by_pose import RandomWalk, shortest_paths
from clearway.agents.selection import ActionSelection, NoProbabilities
from clearway.errors import AgentError
from clearway.evaluation.episodes import EPISODES_PER_TARGET, STEP_LIMIT, run_episodes
from clearway.evaluation.summary import Evaluation, Protocol, summarise
from clearway.progress import work_progress
from clearway.scenes.scene import Scene
from clearway.world.world import World

RANDOM, SHORTEST_PATH = "random", "shortest path"


def evaluate_agents(
    world: World,
    agents: Mapping[str, Agent],
    *,
    references: Mapping[str, Agent] | None = None,
    scenes: Sequence[Scene] = (),
    selections: Sequence[ActionSelection] = get_args(ActionSelection),
    encoder: str,
    episodes_per_target: int = EPISODES_PER_TARGET,
    step_limit: int = STEP_LIMIT,
    seed: int = 0,
    show_progress: bool = False,
) -> list[Evaluation]:
    """Every agent with each way of choosing actions, then the references, random and shortest-path agent.

    All face the same starts. Order: each agent "sampled", "argmax" and "argmax-untried", references, "random",
    "shortest path". An agent that tells no probabilities has "sampled" alone: it chooses by itself.

    Args:
        world: scenes and targets.
        agents: by name.
        references: further agents to compare with, sampled only.
        scenes: the world's, in its order, for agents that see pictures.
        selections: ways of choosing actions that the agents are tried with.
        encoder: name of the encoder whose features the agents see.
        episodes_per_target: how many each.
        step_limit: steps after which an episode has failed.
        seed: of starts, chances and bootstrap.
        show_progress: tell how far it has come.

    Raises:
        AgentError: an agent cannot walk here; it is named. Two have one name.
    """
    check_names([*agents, *(references or {})])
    rows = [(name, selection, agent) for name, agent in agents.items() for selection in selections]
    rows += [(name, "sampled", agent) for name, agent in (references or {}).items()]
    rows += [(RANDOM, "sampled", RandomWalk()), (SHORTEST_PATH, "sampled", shortest_paths(world))]
    evaluations = []
    with work_progress("evaluating", len(rows), show_progress, unit="agents") as show_done:
        for done, (name, selection, agent) in enumerate(rows, 1):
            try:
                table = run_episodes(
                    world,
                    agent,
                    scenes=scenes,
                    selection=selection,
                    episodes_per_target=episodes_per_target,
                    step_limit=step_limit,
                    seed=seed,
                )
            except NoProbabilities:
                continue
            except AgentError as fault:
                raise AgentError(f"{name}: {fault}") from fault
            protocol = Protocol(episodes_per_target, step_limit, seed, selection)
            evaluations.append(summarise(world, table, name, encoder, protocol))
            show_done(done)
    return evaluations


def check_names(names: Sequence[str]) -> None:
    """Raise AgentError where a table would have two agents of one name: of those given and its yardsticks."""
    for name, count in Counter((*names, RANDOM, SHORTEST_PATH)).items():
        if count > 1:
            raise AgentError(f"{name!r:.80}: the name of two agents in the table. Give the function or class another")
