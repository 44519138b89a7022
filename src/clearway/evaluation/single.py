"""One episode of an agent to any target of its scenes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import zip_longest

import numpy as np
import torch

from clearway.agents.agent import Agent, Decisions, State
from clearway.agents.selection import ActionSelection, having_taken
from clearway.errors import RunError
from clearway.evaluation.episodes import Trajectory, episode_starts, run_episodes
from clearway.evaluation.goals import GOALS, drawn_goals
from clearway.evaluation.sight import Sight
from clearway.learn.load import TrainedAgent, run_tables
from clearway.scenes.scene import Scene
from clearway.world.world import World, make_world


def single_episode(
    agent: TrainedAgent,
    scenes: Sequence[Scene],
    scene: str | None,
    target: int | None,
    *,
    selection: ActionSelection,
    step_limit: int,
    seed: int,
) -> tuple[World, Trajectory]:
    """The episode, with the world it was walked in, which has its target alone.

    Args:
        agent: who walks.
        scenes: of the agent's run, in its order.
        scene: name of the scene; None: the first.
        target: state in the scene's numbering, trained on or not; None: the first one trained on.
        selection: how actions are chosen.
        step_limit: the episode ends after so many steps.
        seed: of start and actions.

    Raises:
        RunError: the run has no such scene.
        SceneError: the scene has no such state, or it cannot be reached.
    """
    trained = agent.record.targets
    wanted = next(iter(trained)) if scene is None else scene
    if wanted not in trained:
        raise RunError(f"scene {wanted}: not of this run, which has {', '.join(trained)}. Give one of these")
    goal = trained[wanted][0] if target is None else target
    world = run_tables(agent.record, scenes).with_targets({wanted: (goal,)})
    walker = agent.on_poses(world)
    return world, walked_once(world, walker, scenes, selection=selection, step_limit=step_limit, seed=seed)


def episode_in(
    scene: Scene, make: Callable[[World], Agent], target: int | None, *, step_limit: int, seed: int
) -> tuple[World, Trajectory]:
    """An episode in one scene, with the world it was walked in, which has its target alone.

    Args:
        scene: with what the agent sees.
        make: makes the agent, which is bound to no targets.
        target: state; None: of some goals and starts drawn by the seed, the pair that is farthest apart.
        step_limit: the episode ends after so many steps.
        seed: of goals, start and actions.

    Raises:
        SceneError: the scene has no such state, or it cannot be reached.
    """
    if target is None:
        count = min(GOALS, int((scene.components == 0).sum()) - 1)
        drawn = make_world([scene], {scene.name: drawn_goals(scene, count, seed)})
        starts = torch.from_numpy(episode_starts(drawn, 1, seed)[:, 0])
        ways = drawn.distance_table()[torch.arange(drawn.target_count), starts]
        target = drawn.scene_state(int(ways.argmax()))
    world = make_world([scene], {scene.name: [target]})
    return world, walked_once(world, make(world), [scene], selection="sampled", step_limit=step_limit, seed=seed)


def memories(
    world: World, agent: Agent, walk: Trajectory, target: int = 0, scenes: Sequence[Scene] = ()
) -> Iterator[tuple[Decisions, State]]:
    """What an agent decides in each pose of an episode, and its state then.

    What it remembers of its last action is what was done in the episode, whatever it would draw now.

    Args:
        world: with the features that it sees.
        agent: of the episode.
        walk: the episode.
        target: index of the world's.
        scenes: the world's, in its order, for an agent that sees pictures.
    """
    sight = Sight(world, agent, scenes)
    state = agent.reset(sight(world.target_state[[target]]), np.zeros(1, np.int64))
    for pose, action in zip_longest(torch.from_numpy(walk.states), walk.actions):
        decisions, state = agent.act(sight(pose[None]), state)
        yield decisions, state
        if action is not None:
            state = having_taken(np.array([action], np.int64), state)


def walked_once(
    world: World, agent: Agent, scenes: Sequence[Scene], *, selection: ActionSelection, step_limit: int, seed: int
) -> Trajectory:
    """One episode to a world's only target; scenes: the world's, in its order."""
    table = run_episodes(
        world,
        agent,
        scenes=scenes,
        selection=selection,
        episodes_per_target=1,
        step_limit=step_limit,
        seed=seed,
        record=True,
    )
    assert table.trajectories is not None
    return table.trajectories[0]
