"""`evaluate_goals`: agents that are bound to no room, at goals drawn anew in any scenes."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from clearway.api.arguments import as_path, as_seed, as_whole
from clearway.api.scenes import Scenes, load_scenes

if TYPE_CHECKING:
    from clearway.agents.agent import Agent
    from clearway.agents.named import AgentMaker
    from clearway.evaluation.goals import GoalEvaluation
    from clearway.learn.load import TrainedAgent

GOALS, STEP_LIMIT = 20, 500


def evaluate_goals(
    agent: str | os.PathLike[str] | TrainedAgent | Agent | AgentMaker,
    scenes: Scenes,
    *,
    goals: int = GOALS,
    step_limit: int = STEP_LIMIT,
    seed: int = 0,
) -> list[GoalEvaluation]:
    """Walk to goals drawn in some scenes: the agent, then a random walk and shortest paths, one episode a goal.

    Args:
        agent: a run folder or what `load_agent` gave, or an agent of your own, as of `evaluate`. One of the algorithm
            "recurrent" sees any scenes with pictures by its own eyes; others walk, to any goals, in the scenes of their
            training alone.
        scenes: files, folders of them, or scenes.
        goals: of each scene, distinct poses of its largest part.
        step_limit: steps after which an episode has failed.
        seed: of goals, starts and chances.

    Raises:
        ArgumentError: an argument is of the wrong kind or out of range.
        ClearwayError: the run cannot be read, a scene is not one that the agent can walk in, or has too few poses.
    """
    from clearway.evaluation import goals as walked
    from clearway.learn import load
    from clearway.learn.load import TrainedAgent
    from clearway.learn.recurrent import TrainedRecurrent
    from clearway.torch_threads import torch_threads

    settings = {
        "goals": as_whole("goals", goals, 1),
        "step_limit": as_whole("step_limit", step_limit, 1),
        "seed": as_seed("seed", seed),
    }
    found = load_scenes(scenes)
    if isinstance(agent, str | os.PathLike):
        agent = load.load_agent(as_path("agent", agent))
    if isinstance(agent, TrainedRecurrent):
        found = agent.seen(found)
    elif isinstance(agent, TrainedAgent):
        found = load.run_scenes(agent.record, found)
    name, make = _named(agent)
    with torch_threads(1):
        return walked.evaluate_goals({name: make}, found, **settings)


def _named(agent: object) -> tuple[str, AgentMaker]:
    """What an agent is called, and what makes it for a world."""
    from clearway.agents.agent import Agent
    from clearway.agents.named import named_maker
    from clearway.learn.load import TrainedAgent

    if isinstance(agent, TrainedAgent):
        return agent.record.learner.algorithm, agent.on_poses
    name = getattr(agent, "__name__", type(agent).__name__)
    made = isinstance(agent, Agent) and not isinstance(agent, type)
    return name, named_maker("agent", (lambda world: agent) if made else agent)
