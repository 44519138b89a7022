"""`evaluate_live`: agents that are bound to no room, off the grid, at goals drawn anew in any rooms."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from functools import partial
from numbers import Real
from typing import TYPE_CHECKING

from clearway.api.arguments import as_path, as_seed, as_whole
from clearway.api.goals import MOST_TOUR_STEPS, check_can_tour, goal_agent, named_agent
from clearway.api.perturbations import Perturbed, perturbations_asked
from clearway.api.scenes import Scenes, load_scenes
from clearway.choices import GOAL_STEPS, GOALS
from clearway.errors import ArgumentError
from clearway.live.conditions import REFERENCE, Condition, Perturbations, as_it_was_built, label_of, sweep_settings

if TYPE_CHECKING:
    from clearway.agents.agent import Agent
    from clearway.agents.generalist import Generalist
    from clearway.agents.named import AgentMaker
    from clearway.evaluation.goals import GoalEvaluation
    from clearway.learn.load import TrainedAgent


def evaluate_live(
    agent: str | os.PathLike[str] | Generalist | TrainedAgent | Agent | AgentMaker,
    scenes: Scenes,
    *,
    goals: int = GOALS,
    step_limit: int = GOAL_STEPS,
    seed: int = 0,
    perturb: Perturbed = "none",
    sweep: Sequence[float] = (),
    tour: int = 0,
    show: Callable[[str], None] = lambda text: None,
) -> list[GoalEvaluation]:
    """Walk off the grid to goals drawn in some rooms, one episode a goal: at any place and heading, by live pictures.

    Goals and starts are those of `evaluate_goals`. A goal is reached within 25 cm, or half a cell if that is less, and
    45 degrees of its pose; `collisions` are moves that ended at an obstacle.

    Args:
        agent: "generalist", which comes with clearway, or a `Generalist`; a run folder of the algorithm "recurrent", or
            what `load_agent` gave of it; or an agent of your own that sees "rgb" alone, as of `evaluate`.
        scenes: files, folders of them, or scenes, with pictures, of rooms that can be built again.
        goals: of each scene, distinct poses of its largest part.
        step_limit: steps after which an episode has failed.
        seed: of goals, starts and chances.
        perturb: what is changed, as of `evaluate_goals`.
        sweep: instead of `perturb`, nothing changed, each perturbation alone and all together, at each of these
            strengths, shares of the full ones. Nothing is moved where a scene is a MuJoCo model of others.
        tour: steps in which the generalist looks around in each room first, as it was built, but with what `perturb`
            does to moves and pictures.
        show: is told what goes on, a line each time.

    Returns:
        How it did under each setting, named by `perturbed["label"]`; one where there is no sweep.

    Raises:
        ArgumentError: an argument is of the wrong kind or out of range.
        ClearwayError: a scene has no room that can be built again, no pictures, too few poses, or other steps and turns
            than the agent; or the agent cannot be made, or walk there.
    """
    from clearway.agents.generalist import Generalist
    from clearway.learn.foreign_agent import goes_anywhere
    from clearway.learn.load import TrainedAgent, TrainedNetwork
    from clearway.live.goals import LiveTouring, walk_to_goals
    from clearway.live.live_room import MODEL_SOURCE
    from clearway.torch_threads import torch_threads

    asked = {
        "goals": as_whole("goals", goals, 1),
        "step_limit": as_whole("step_limit", step_limit, 1),
        "seed": as_seed("seed", seed),
    }
    steps = as_whole("tour", tour, 0, MOST_TOUR_STEPS)
    perturbations = perturbations_asked(perturb)
    if isinstance(sweep, str) or not isinstance(sweep, Sequence):
        raise ArgumentError(f"sweep={sweep!r:.80}: expected a sequence of strengths, such as (1.0,)")
    for strength in sweep:
        above_zero = isinstance(strength, Real) and 0 < strength < math.inf
        if not above_zero or REFERENCE.scaled(float(strength)).too_strong:
            problem = f"sweep={sweep!r:.80}: expected shares of the full strengths above 0"
            raise ArgumentError(f"{problem}. Give such numbers, smaller ones")
    if sweep and perturbations != Perturbations():
        raise ArgumentError("sweep sets the perturbations itself. Leave perturb out")
    if isinstance(agent, str | os.PathLike):
        agent = goal_agent(as_path("agent", agent))
    found = load_scenes(scenes)
    check_can_tour(agent, steps)
    walker: Agent | AgentMaker | LiveTouring
    if isinstance(agent, Generalist):
        agent = agent.stepping(found)
        agent.warn_of_aspect(found)
        walker = agent.behind_camera()
        if steps:
            walker = LiveTouring(agent.explorer(steps, camera=True), partial(agent.after, camera=True), steps)
    elif goes_anywhere(agent):
        agent.warn_of_aspect(found)
        walker = agent.behind_camera()
    elif isinstance(agent, TrainedAgent):
        problem = (
            f"{agent.record.learner.algorithm:.80}: bound to its rooms, and off the grid goals are drawn anew in any"
        )
        options = "--live, without --goals" if isinstance(agent, TrainedNetwork) else "without --goals and --live"
        raise ArgumentError(f"{problem}. Evaluate it at its targets: clearway evaluate RUN {options}")
    else:
        walker = named_agent(agent)[1]
    settings = [Condition(label_of(perturbations), perturbations)]
    if sweep:
        fixed = any(scene.made_by.source == MODEL_SOURCE for scene in found)
        settings = sweep_settings(tuple(sweep), as_it_was_built(REFERENCE) if fixed else REFERENCE)
    with torch_threads(1):
        return walk_to_goals(named_agent(agent)[0], walker, found, settings, **asked, show=show)
