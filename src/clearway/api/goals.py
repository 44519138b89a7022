"""`evaluate_goals`: agents that are bound to no room, at goals drawn anew in any scenes."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, TypeGuard

from clearway.agents.agent import FEATURES
from clearway.api.arguments import as_path, as_seed, as_whole
from clearway.api.perturbations import Perturbed, perturbations_asked
from clearway.api.scenes import Scenes, load_scenes
from clearway.choices import GENERALIST, GOAL_STEPS, GOALS, is_generalist
from clearway.errors import ArgumentError
from clearway.live.conditions import Perturbations
from clearway.scenes.sensors import RGB
from clearway.views.seen import TAKES, takes_seen

if TYPE_CHECKING:
    from clearway.agents.agent import Agent
    from clearway.agents.generalist import Generalist
    from clearway.agents.named import AgentMaker
    from clearway.evaluation.goals import GoalEvaluation
    from clearway.evaluation.takes import Takes
    from clearway.learn.load import TrainedAgent
    from clearway.perception.encoder import Encoder
    from clearway.scenes.scene import Scene

MOST_TOUR_STEPS = 10_000


def evaluate_goals(
    agent: str | os.PathLike[str] | TrainedAgent | Generalist | Agent | AgentMaker,
    scenes: Scenes,
    *,
    goals: int = GOALS,
    step_limit: int = GOAL_STEPS,
    seed: int = 0,
    perturb: Perturbed = "none",
    takes: int = TAKES,
    tour: int = 0,
    show_progress: bool = False,
) -> list[GoalEvaluation]:
    """Walk to goals drawn in some scenes: the agent, then a random walk and shortest paths, one episode a goal.

    Args:
        agent: "generalist", which comes with clearway, or a file that it was exported to; a run folder or what
            `load_agent` gave; or an agent of your own, as of `evaluate`. The generalist and agents of the algorithm
            "recurrent" see any scenes with pictures by their own eyes; others walk, to any goals, in the scenes of
            their training alone.
        scenes: files, folders of them, or scenes.
        goals: of each scene, distinct poses of its largest part.
        step_limit: steps after which an episode has failed.
        seed: of goals, starts and chances.
        perturb: how what is seen on the way differs from the scenes' own pictures; the goals' stay as they are. "all",
            "geometry", names such as "light", or "light=0.2", as of `take_views`; or `Perturbations`. Each step shows
            one of several takes of its pose, which are kept in the user's cache folder once they are rendered.
        takes: of each pose, each perturbed in its own way.
        tour: steps in which the generalist may look around in each scene before the episodes; no other agent can.
        show_progress: draw a progress bar while rendering, if standard error is a terminal.

    Raises:
        ArgumentError: an argument is of the wrong kind or out of range.
        ClearwayError: the run cannot be read, a scene is not one that the agent can walk in, or has too few poses; or,
            perturbed, no room that can be built again.
    """
    from clearway.agents.generalist import Generalist
    from clearway.evaluation import goals as walked
    from clearway.evaluation.tours import Touring
    from clearway.learn import load
    from clearway.learn.foreign_agent import goes_anywhere
    from clearway.learn.load import TrainedAgent
    from clearway.live.live_room import check_is_room
    from clearway.torch_threads import torch_threads

    goals, step_limit = as_whole("goals", goals, 1), as_whole("step_limit", step_limit, 1)
    seed = as_seed("seed", seed)
    perturbations, takes = perturbations_asked(perturb), as_whole("takes", takes, 1)
    tour_steps = as_whole("tour", tour, 0, MOST_TOUR_STEPS)
    found = load_scenes(scenes)
    if isinstance(agent, str | os.PathLike):
        path = as_path("agent", agent)
        agent = goal_agent(path)
    check_can_tour(agent, tour_steps)
    if isinstance(agent, Generalist):
        agent = agent.stepping(found)
    if perturbed := perturbations != Perturbations():
        _check_sees(agent)
        for scene in found:  # before what takes long
            check_is_room(scene)
            walked.drawn_goals(scene, goals, seed)
    if isinstance(agent, Generalist) or goes_anywhere(agent):
        found = agent.seen(found)
    elif isinstance(agent, TrainedAgent):
        found = load.run_scenes(agent.record, found)
    make: AgentMaker | Touring
    name, make = named_agent(agent)
    if tour_steps and isinstance(agent, Generalist):
        make = Touring(agent.explorer, agent.after, tour_steps)
    with torch_threads(1):
        seen = _takes(agent, found, perturbations, takes, seed, show_progress) if perturbed else None
        return walked.evaluate_goals({name: make}, found, goals=goals, step_limit=step_limit, seed=seed, takes=seen)


def goal_agent(path: Path, checkpoint: Path | None = None) -> TrainedAgent | Generalist:
    """The agent that comes with clearway, that of an exported file, or a run's, from one of its checkpoints.

    Raises:
        ArgumentError: the file holds an agent for one scene.
        ClearwayError: it cannot be read.
    """
    from clearway.agents.generalist import Generalist
    from clearway.api.evaluation import is_exported, load_agent
    from clearway.deploy.generalist import GeneralistAgent
    from clearway.deploy.navigator import open_agent

    named = is_generalist(path)
    if not named and not is_exported(path):
        return load_agent(path, checkpoint)
    if checkpoint is not None:
        raise ArgumentError(f"checkpoint={checkpoint}: {path} has none. Leave it out")
    if named:
        return Generalist.shipped()
    agent = open_agent(path)
    if not isinstance(agent, GeneralistAgent):
        problem = f"{path}: holds the agent for scene {agent.card.scene}, and goals are for agents of any room"
        raise ArgumentError(f"{problem}. Evaluate it without goals")
    return agent.generalist


def check_can_tour(agent: object, steps: int) -> None:
    """Raise ArgumentError where an agent that keeps no map is given steps to look around."""
    from clearway.agents.generalist import Generalist
    from clearway.learn.load import TrainedAgent

    if steps and not isinstance(agent, Generalist):
        name, _ = named_agent(agent)
        why = (
            "keeps no map" if isinstance(agent, TrainedAgent) else "is an agent of your own, and none of these can tour"
        )
        raise ArgumentError(f"tour={steps}: {name} {why}. Leave it out, or evaluate {GENERALIST}")


def _check_sees(agent: object) -> None:
    """Raise ArgumentError where an agent knows the poses that it is in, whatever it is shown."""
    from clearway.learn.foreign_agent import goes_anywhere
    from clearway.learn.load import TrainedAgent, TrainedNetwork

    if isinstance(agent, TrainedAgent) and not goes_anywhere(agent):
        problem = f"an agent of the algorithm {agent.record.learner.algorithm} goes by poses on the grid"
        instead = "Walk off the grid: evaluate --live" if isinstance(agent, TrainedNetwork) else "Leave it out"
        raise ArgumentError(f"perturb: {problem}, and would see nothing of it. {instead}")


def _takes(
    agent: object, scenes: Sequence[Scene], perturbations: Perturbations, takes: int, seed: int, show_progress: bool
) -> Takes:
    """The perturbed takes of what an agent sees; of one that is yet to be made, of all it may see."""
    from clearway.agents.generalist import Generalist
    from clearway.learn.foreign_agent import goes_anywhere

    encoder: Encoder | None = None
    sees: tuple[str, ...] = (RGB,) if scenes[0].features is None or scenes[0].encoder is None else (RGB, FEATURES)
    if isinstance(agent, Generalist) or goes_anywhere(agent):
        encoder, sees = agent.encoder, (FEATURES,)
    elif _is_made(agent):
        sees = agent.sees
    return takes_seen(scenes, perturbations, sees, encoder, takes=takes, seed=seed, show_progress=show_progress)


def named_agent(agent: object) -> tuple[str, AgentMaker]:
    """What an agent is called in tables, and what makes it for a world. Raises AgentError where it is none."""
    from clearway.agents.generalist import Generalist
    from clearway.agents.named import named_maker
    from clearway.learn.load import TrainedAgent

    if isinstance(agent, TrainedAgent):
        return agent.record.learner.algorithm, agent.on_poses
    if isinstance(agent, Generalist):
        return GENERALIST, agent.on_poses
    name = getattr(agent, "__name__", type(agent).__name__)
    return name, named_maker("agent", (lambda world: agent) if _is_made(agent) else agent)


def _is_made(agent: object) -> TypeGuard[Agent]:
    """Whether it is an agent, rather than what makes one for a world."""
    from clearway.agents.agent import Agent

    return isinstance(agent, Agent) and not isinstance(agent, type)
