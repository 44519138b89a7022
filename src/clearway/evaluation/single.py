"""One episode of an agent to any target of its scenes."""

from __future__ import annotations

from collections.abc import Sequence

from clearway.agents.selection import ActionSelection
from clearway.errors import RunError
from clearway.evaluation.episodes import Trajectory, run_episodes
from clearway.learn.load import TrainedAgent, run_tables
from clearway.scenes.scene import Scene
from clearway.world.world import World


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
    table = run_episodes(
        world,
        agent.on_poses(world),
        selection=selection,
        episodes_per_target=1,
        step_limit=step_limit,
        seed=seed,
        record=True,
    )
    assert table.trajectories is not None
    return world, table.trajectories[0]
