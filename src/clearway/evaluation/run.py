"""Evaluation of trained agents by their runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from clearway.errors import RunError
from clearway.evaluation.episodes import EPISODES_PER_TARGET, STEP_CAP
from clearway.evaluation.optimum import OPTIMUM, SOFT_FIXED_POINT, optimum_policies, world_yardsticks
from clearway.evaluation.protocol import evaluate_agents
from clearway.evaluation.report import Evaluation, Trained
from clearway.learn.load import Acting, run_world
from clearway.model.policy import Policy
from clearway.reward import Reward
from clearway.scenes.scene import Scene, encoder_names
from clearway.torch_threads import torch_threads
from clearway.world.tables import World


def evaluate_run(
    agent: Acting,
    scenes: Sequence[Scene],
    *,
    episodes_per_target: int = EPISODES_PER_TARGET,
    step_cap: int = STEP_CAP,
    seed: int = 0,
) -> list[Evaluation]:
    """The agent of a run by each way of choosing actions, beside exact optima, random and shortest-path agent.

    The first evaluation is the paper's: sampled actions.
    """
    return evaluate_runs(
        {agent.record.reward.name: agent},
        scenes,
        episodes_per_target=episodes_per_target,
        step_cap=step_cap,
        seed=seed,
    )


def evaluate_runs(
    agents: Mapping[str, Acting],
    scenes: Sequence[Scene],
    *,
    episodes_per_target: int = EPISODES_PER_TARGET,
    step_cap: int = STEP_CAP,
    seed: int = 0,
) -> list[Evaluation]:
    """Agents of several runs on the same scenes and targets, beside exact optima, random and shortest-path agent.

    Torch uses one thread meanwhile: steps are too small for more, which only wait for each other beside a training.

    Raises:
        RunError: the runs have other targets, or networks of another history length.
    """
    records = [agent.record for agent in agents.values()]
    first = records[0]
    for record in records:
        if (record.targets, record.learner.history_length) != (first.targets, first.learner.history_length):
            raise RunError("the runs differ in their targets or history length. Evaluate them one by one")
    world = run_world(first, scenes)
    with torch_threads(1):
        evaluations = evaluate_agents(
            world,
            {name: agent.policy(world) for name, agent in agents.items()},
            references=_optima(world, [record.reward for record in records]),
            encoder=encoder_names(scenes),
            episodes_per_target=episodes_per_target,
            step_cap=step_cap,
            seed=seed,
            history_length=first.learner.history_length,
        )
    trained = {name: _trained(agent) for name, agent in agents.items()}
    return [replace(evaluation, trained=trained.get(evaluation.agent)) for evaluation in evaluations]


def _optima(world: World, rewards: Sequence[Reward]) -> dict[str, Policy]:
    """What would be best under each reward, exactly, and where the published loss comes to rest (see `oracle`)."""
    found: dict[str, Policy] = {}
    for reward in dict.fromkeys(reward for reward in rewards if reward.is_known):
        exact = world_yardsticks(world, reward)
        best, soft = optimum_policies(world, exact)
        if not reward.clip:
            _, soft = optimum_policies(world, world_yardsticks(world, replace(reward, clip=True)))
        found[f"{OPTIMUM} ({reward.name}{'' if reward.clip else ', unclipped'})"] = best
        found[f"{SOFT_FIXED_POINT} ({reward.name})"] = soft
    return found


def _trained(agent: Acting) -> Trained:
    record = agent.record
    return Trained(agent.frames, record.seed, record.reward, record.zone_level)
