"""Evaluation of trained agents by their runs."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Any

from clearway.agents.agent import Agent
from clearway.agents.by_pose import by_policies
from clearway.agents.named import AgentMaker
from clearway.errors import RunError, SceneError
from clearway.evaluation.episodes import EPISODES_PER_TARGET, STEP_LIMIT
from clearway.evaluation.optimum import OPTIMUM, SOFT_FIXED_POINT, world_tasks
from clearway.evaluation.oracle import optimal_policy, soft_policy
from clearway.evaluation.protocol import RANDOM, SHORTEST_PATH, evaluate_agents
from clearway.evaluation.summary import Evaluation, Trained
from clearway.learn.load import TrainedAgent, run_world
from clearway.reward import Reward
from clearway.scenes.scene import Scene, encoder_names
from clearway.torch_threads import torch_threads
from clearway.world.world import World


def evaluate_run(agent: TrainedAgent, scenes: Sequence[Scene], **how: Any) -> list[Evaluation]:
    """The agent of one run, as `evaluate_runs` has it. The first evaluation is the paper's: sampled actions."""
    return evaluate_runs({agent.record.reward.name: agent}, scenes, **how)


def evaluate_runs(
    agents: Mapping[str, TrainedAgent],
    scenes: Sequence[Scene],
    *,
    beside: Mapping[str, AgentMaker] = MappingProxyType({}),
    targets: Mapping[str, Sequence[int]] | None = None,
    episodes_per_target: int = EPISODES_PER_TARGET,
    step_limit: int = STEP_LIMIT,
    seed: int = 0,
    show_progress: bool = False,
) -> list[Evaluation]:
    """Agents of several runs on the same scenes and targets, by each way of choosing actions.

    Targets are those of the training, unless others are given by scene name. Beside the agents walk the exact optima,
    the agents of `beside`, a random and a shortest-path agent. Torch uses one thread meanwhile: steps are too small for
    more, which only wait for each other beside a training.

    Raises:
        RunError: the runs have other targets or zones, an agent can walk to its own alone, or a name is given twice.
        AgentError: one of `beside` cannot walk here.
    """
    records = [agent.record for agent in agents.values()]
    first = records[0]
    for record in records:
        if record.targets != first.targets:
            raise RunError("the runs differ in their targets. Evaluate them one by one")
        if record.zone_level != first.zone_level:
            raise RunError("the runs differ in the level of their zones. Evaluate them one by one")
    world = run_world(first, scenes, targets)
    with torch_threads(1):
        optima = _optima(world, [record.reward for record in records])
        for name in agents:
            if name in (*optima, RANDOM, SHORTEST_PATH):
                problem = f"the reward {name!r:.80} has the name of a yardstick in the table"
                raise RunError(f"{problem}. Name it otherwise, of a trained run in its run.json")
        for name in beside:
            if name in (*agents, *optima, RANDOM, SHORTEST_PATH):
                raise RunError(f"beside: {name!r:.80} is the name of another agent in the table. Choose another")
        evaluations = evaluate_agents(
            world,
            {name: agent.on_poses(world) for name, agent in agents.items()},
            references={
                **optima,
                **{name: make(world) for name, make in beside.items()},
            },
            scenes=scenes,
            encoder=encoder_names(scenes),
            episodes_per_target=episodes_per_target,
            step_limit=step_limit,
            seed=seed,
            show_progress=show_progress,
        )
    trained = {name: _trained(agent) for name, agent in agents.items()}
    return [replace(evaluation, trained=trained.get(evaluation.agent)) for evaluation in evaluations]


def _optima(world: World, rewards: Sequence[Reward]) -> dict[str, Agent]:
    """What would be best under each reward, exactly, and where the published loss comes to rest (see `oracle`).

    Warns:
        UserWarning: it comes to rest nowhere under some reward, whose row is left out.
    """
    found: dict[str, Agent | None] = {}
    for reward in dict.fromkeys(reward for reward in rewards if reward.is_known):
        best = [optimal_policy(task) for task in world_tasks(world, reward)]
        found[f"{OPTIMUM} ({reward.name}{'' if reward.clip else ', unclipped'})"] = by_policies(world, best)
        name = f"{SOFT_FIXED_POINT} ({reward.name})"
        if name not in found:  # a reward may come clipped and unclipped
            found[name] = _soft_fixed_point(world, replace(reward, clip=True), name)
    return {name: agent for name, agent in found.items() if agent is not None}


def _soft_fixed_point(world: World, reward: Reward, name: str) -> Agent | None:
    """Where the loss comes to rest; None, and a warning, where it does nowhere."""
    policies = []
    for scene, task in zip(world.target_scene.tolist(), world_tasks(world, reward), strict=True):
        try:
            policies.append(soft_policy(task))
        except SceneError as fault:
            where = f"{world.scene_names[scene]}, {fault.source}"
            warnings.warn(f"no row {name!r}: {where}: {fault.problem}", stacklevel=4)
            return None
    return by_policies(world, policies)


def _trained(agent: TrainedAgent) -> Trained:
    record = agent.record
    return Trained(agent.frames, record.seed, record.reward, record.zone_level)
