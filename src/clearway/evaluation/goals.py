"""Evaluation of agents that are bound to no room: goals drawn anew in any scenes, an episode to each.

Goals are poses of a scene's largest part, without repeats; every episode begins in a random pose. All agents face the
same goals and starts.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace

import numpy as np

from clearway.agents.agent import Agent
from clearway.agents.by_pose import RandomWalk, shortest_paths
from clearway.errors import AgentError, SceneError
from clearway.evaluation import metrics
from clearway.evaluation.episodes import EpisodeTable, run_episodes
from clearway.evaluation.protocol import RANDOM, SHORTEST_PATH
from clearway.evaluation.takes import Takes
from clearway.scenes.scene import Scene
from clearway.world.world import World, make_world

GOALS, GOAL_STEPS = 20, 500


@dataclass(frozen=True)
class GoalFigures:
    """What came of the episodes of a scene, or of all: means over episodes, over scenes for all.

    Attributes:
        success: share that reached the goal within the limit.
        success_4x: share that did within four times the shortest path.
        spl: success weighted by path length (Anderson et al., 2018).
        collisions: blocked moves.
        steps: failed episodes count with the limit.
        episodes: number of them.
    """

    success: float
    success_4x: float
    spl: float
    collisions: float
    steps: float
    episodes: int


@dataclass(frozen=True)
class GoalEvaluation:
    """How an agent did.

    Attributes:
        agent: its name.
        scenes: figures by scene name.
        perturbed: how what it saw differed from the scenes' own pictures (`Takes.made`); None: not at all.
        average: the plain mean over scenes; episodes are the sum.
    """

    agent: str
    scenes: Mapping[str, GoalFigures]
    perturbed: Mapping[str, object] | None = None

    @property
    def average(self) -> GoalFigures:
        """Means over scenes."""
        rows = [asdict(figures) for figures in self.scenes.values()]
        means = {field.name: float(np.mean([row[field.name] for row in rows])) for field in fields(GoalFigures)}
        return GoalFigures(**{**means, "episodes": sum(row["episodes"] for row in rows)})

    def to_json(self) -> dict[str, object]:
        """As JSON values: `scenes` a list, `average`, `perturbed`."""
        scenes = [{"scene": name, **asdict(figures)} for name, figures in self.scenes.items()]
        perturbed = None if self.perturbed is None else dict(self.perturbed)
        return {"agent": self.agent, "scenes": scenes, "average": asdict(self.average), "perturbed": perturbed}


def evaluate_goals(
    agents: Mapping[str, Callable[[World], Agent]],
    scenes: Sequence[Scene],
    *,
    goals: int = GOALS,
    step_limit: int = GOAL_STEPS,
    seed: int = 0,
    takes: Takes | None = None,
) -> list[GoalEvaluation]:
    """Walk to goals drawn in some scenes; every agent, then a random walk and shortest paths.

    Args:
        agents: what makes an agent for a world, by name.
        scenes: distinct names; with what the agents see.
        goals: of each scene.
        step_limit: steps after which an episode has failed.
        seed: of goals, starts and chances.
        takes: what is seen on the way instead of the scenes' own pictures; goals are seen as they are.

    Raises:
        SceneError: a scene has fewer poses than goals.
        AgentError: an agent cannot walk here; it is named.
    """
    world = make_world(scenes, {scene.name: drawn_goals(scene, goals, seed) for scene in scenes})
    makers = {**agents, RANDOM: lambda _: RandomWalk(), SHORTEST_PATH: shortest_paths}
    found = []
    for name, make in makers.items():
        try:
            table = run_episodes(
                world, make(world), scenes=scenes, takes=takes, episodes_per_target=1, step_limit=step_limit, seed=seed
            )
        except AgentError as fault:
            raise AgentError(f"{name}: {fault}") from fault
        found.append(replace(_summary(world, table, name), perturbed=None if takes is None else takes.made))
    return found


def drawn_goals(scene: Scene, count: int, seed: int) -> list[int]:
    """So many distinct poses of a scene's largest part, ascending, in its own numbering.

    Raises:
        SceneError: it has no more poses than that.
    """
    states = np.flatnonzero(scene.components == 0)
    if count >= len(states):
        problem = f"{count} goals asked for, the largest part has {len(states)} poses"
        raise SceneError(scene.name, problem, f"Ask for 1 to {len(states) - 1} goals")
    rng = np.random.default_rng([seed, zlib.crc32(scene.name.encode())])
    return sorted(rng.choice(states, count, replace=False).tolist())


def _summary(world: World, table: EpisodeTable, agent: str) -> GoalEvaluation:
    scene = world.target_scene.cpu().numpy()[table.target]
    columns = {
        "success": metrics.success(table),
        "success_4x": metrics.sc_4x(table),
        "spl": metrics.spl(table),
        "collisions": table.collisions,
        "steps": table.steps,
    }
    figures = {}
    for number, name in enumerate(world.scene_names):
        here = scene == number
        means = {key: float(column[here].mean()) for key, column in columns.items()}
        figures[name] = GoalFigures(**means, episodes=int(here.sum()))
    return GoalEvaluation(agent, figures)
