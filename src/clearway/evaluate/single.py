"""One episode of an agent to any target of its scenes."""

from __future__ import annotations

from collections.abc import Sequence

from clearway.envs.world import World, make_world
from clearway.errors import RunError
from clearway.evaluate.episodes import Trajectory, run_episodes
from clearway.evaluate.selection import ActionSelection
from clearway.learn.load import Agent
from clearway.scenes.scene import Scene


def single_episode(
    agent: Agent,
    scenes: Sequence[Scene],
    scene: str | None,
    target: int | None,
    *,
    selection: ActionSelection,
    step_cap: int,
    seed: int,
) -> tuple[World, int, Trajectory]:
    """The episode, with the world it was walked in and the index of its target there.

    Args:
        agent: who walks.
        scenes: of the agent's run, in its order.
        scene: name of the scene; None: the first.
        target: state in the scene's numbering, trained on or not; None: the first one trained on.
        selection: how actions are chosen.
        step_cap: the episode ends after so many steps.
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
    targets = {name: (goal,) if name == wanted else own[:1] for name, own in trained.items()}
    world = make_world(scenes, targets, agent.record.zone_level)
    table = run_episodes(
        world,
        agent.policy(world),
        selection=selection,
        episodes_per_target=1,
        step_cap=step_cap,
        seed=seed,
        record=True,
        history_length=agent.record.learner.history_length,
    )
    index = list(trained).index(wanted)  # one target a scene, in the scenes' order
    assert table.trajectories is not None
    return world, index, table.trajectories[index]
