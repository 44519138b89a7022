"""The whole protocol for some agents: each way of choosing actions, with the random and the shortest-path agent."""

from __future__ import annotations

from collections.abc import Mapping
from typing import get_args

from clearway.evaluation.episodes import EPISODES_PER_TARGET, STEP_CAP, run_episodes
from clearway.evaluation.policies import random_policy, shortest_path_policy
from clearway.evaluation.report import Evaluation, Protocol, summarise
from clearway.evaluation.selection import ActionSelection
from clearway.model.policy import Policy
from clearway.world.navigation import HISTORY_LENGTH
from clearway.world.tables import World

RANDOM, SHORTEST_PATH = "random", "shortest path"


def evaluate_agents(
    world: World,
    agents: Mapping[str, Policy],
    *,
    references: Mapping[str, Policy] | None = None,
    encoder: str,
    episodes_per_target: int = EPISODES_PER_TARGET,
    step_cap: int = STEP_CAP,
    seed: int = 0,
    history_length: int = HISTORY_LENGTH,
) -> list[Evaluation]:
    """Every agent with each way of choosing actions, then the references, random and shortest-path agent.

    All face the same starts. Order: each agent "sampled", "argmax" and "argmax-untried", references, "random",
    "shortest path".

    Args:
        world: scenes and targets.
        agents: policies by the agent's name.
        references: further policies to compare with, sampled only.
        encoder: name of the encoder whose features the agents see.
        episodes_per_target: how many each.
        step_cap: steps after which an episode has failed.
        seed: of starts, chances and bootstrap.
        history_length: K, as the policies expect it.
    """
    selections: tuple[ActionSelection, ...] = get_args(ActionSelection)
    rows = [(name, selection, policy) for name, policy in agents.items() for selection in selections]
    rows += [(name, "sampled", policy) for name, policy in (references or {}).items()]
    rows += [(RANDOM, "sampled", random_policy()), (SHORTEST_PATH, "sampled", shortest_path_policy(world))]
    evaluations = []
    for name, selection, policy in rows:
        table = run_episodes(
            world,
            policy,
            selection=selection,
            episodes_per_target=episodes_per_target,
            step_cap=step_cap,
            seed=seed,
            history_length=history_length,
        )
        protocol = Protocol(episodes_per_target, step_cap, seed, selection)
        evaluations.append(summarise(world, table, name, encoder, protocol))
    return evaluations
