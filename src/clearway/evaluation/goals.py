"""Evaluation of agents that are bound to no room: goals drawn anew in any scenes, an episode to each.

Goals are poses of a scene's largest part, without repeats; every episode begins in a random pose. All agents face the
same goals and starts.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from typing import Any

import numpy as np

from clearway.agents.agent import Agent
from clearway.agents.by_pose import RandomWalk, shortest_paths
from clearway.choices import GOAL_STEPS, GOALS
from clearway.errors import AgentError, SceneError
from clearway.evaluation import metrics
from clearway.evaluation.episodes import EpisodeTable, run_episodes
from clearway.evaluation.protocol import RANDOM, SHORTEST_PATH, check_names
from clearway.evaluation.takes import Takes
from clearway.evaluation.tours import Touring, walk_tour
from clearway.scenes.scene import Scene
from clearway.world.world import World, make_world


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
        false_arrivals: share in which the agent held elsewhere that it was at the goal; None where it says nothing.
        missed_arrivals: share of those that reached the goal in which it did not hold so there; None likewise, and
            where none reached it.
        success_stopped: share that would have succeeded had the episode ended where the agent first held that it was at
            the goal: it reached it, held so there, and nowhere before. None where it says nothing.
    """

    success: float
    success_4x: float
    spl: float
    collisions: float
    steps: float
    episodes: int
    false_arrivals: float | None = None
    missed_arrivals: float | None = None
    success_stopped: float | None = None


FIGURES = fields(GoalFigures)


@dataclass(frozen=True)
class GoalEvaluation:
    """How an agent did.

    Attributes:
        agent: its name.
        scenes: figures by scene name.
        perturbed: how what it saw differed from the scenes' own pictures (`Takes.made`; None: not at all); off the grid
            the setting's `label` and `perturbations`.
        tour: of the tours of the scenes before the episodes their `steps`, and means of their `collisions` and, on the
            grid, of the share of `poses` come to; None where there were none.
        average: the plain mean over scenes; episodes are the sum.
    """

    agent: str
    scenes: Mapping[str, GoalFigures]
    perturbed: Mapping[str, object] | None = None
    tour: Mapping[str, float] | None = None

    @property
    def average(self) -> GoalFigures:
        """Means over scenes; of missed arrivals over those in which a goal was reached."""
        rows = [asdict(figures) for figures in self.scenes.values()]
        found = {field.name: [row[field.name] for row in rows if row[field.name] is not None] for field in FIGURES}
        means = {name: float(np.mean(values)) if values else None for name, values in found.items()}
        return GoalFigures(**{**means, "episodes": sum(row["episodes"] for row in rows)})

    def to_json(self) -> dict[str, object]:
        """As JSON values: `scenes` a list, `average`, `perturbed`, `tour`. Not what an agent does not tell."""
        scenes = [{"scene": name, **_told(figures)} for name, figures in self.scenes.items()]
        perturbed, tour = (None if part is None else dict(part) for part in (self.perturbed, self.tour))
        average = _told(self.average)
        return {"agent": self.agent, "scenes": scenes, "average": average, "perturbed": perturbed, "tour": tour}


def _told(figures: GoalFigures) -> dict[str, float]:
    return {name: value for name, value in asdict(figures).items() if value is not None}


def evaluate_goals(
    agents: Mapping[str, Callable[[World], Agent] | Touring],
    scenes: Sequence[Scene],
    *,
    goals: int = GOALS,
    step_limit: int = GOAL_STEPS,
    seed: int = 0,
    takes: Takes | None = None,
    among: Mapping[str, np.ndarray] | None = None,
) -> list[GoalEvaluation]:
    """Walk to goals drawn in some scenes; every agent, then a random walk and shortest paths.

    Args:
        agents: what makes an agent for a world, by name; or for every scene one of its own, by a tour of it.
        scenes: distinct names; with what the agents see.
        goals: of each scene.
        step_limit: steps after which an episode has failed.
        seed: of goals, starts and chances.
        takes: what is seen on the way instead of the scenes' own pictures; goals are seen as they are.
        among: by scene, states of its largest part from which goals are drawn; of others from all.

    Raises:
        SceneError: a scene has fewer such poses than goals.
        AgentError: an agent cannot walk here; it is named. It has the name of a yardstick.
    """
    check_names(list(agents))
    places = among or {}
    wanted = {scene.name: drawn_goals(scene, goals, seed, places.get(scene.name)) for scene in scenes}
    world = make_world(scenes, wanted)
    makers = {**agents, RANDOM: lambda _: RandomWalk(), SHORTEST_PATH: shortest_paths}
    perturbed = None if takes is None else takes.made
    found = []
    for name, make in makers.items():
        try:
            if isinstance(make, Touring):
                figures, tour = _after_tours(make, scenes, wanted, takes, step_limit, seed)
            else:
                table = _walked(world, make(world), scenes, takes, step_limit, seed)
                figures, tour = _figures(world, table), None
        except AgentError as fault:
            raise AgentError(f"{name}: {fault}") from fault
        found.append(GoalEvaluation(name, figures, perturbed, tour))
    return found


def _after_tours(
    touring: Touring,
    scenes: Sequence[Scene],
    wanted: Mapping[str, list[int]],
    takes: Takes | None,
    step_limit: int,
    seed: int,
) -> tuple[dict[str, GoalFigures], dict[str, float]]:
    """Figures by scene of agents that toured it, and what the tours came to."""
    figures: dict[str, GoalFigures] = {}
    tours = []
    for number, scene in enumerate(scenes):
        world = make_world([scene], {scene.name: wanted[scene.name]})
        here = None if takes is None else takes.of_scene(number)
        tours.append(walk_tour(world, touring, scene, seed, here))
        agent = touring.after(tours[-1].state)
        figures |= _figures(world, _walked(world, agent, [scene], here, step_limit, seed))
    collisions, poses = (float(np.mean([getattr(tour, name) for tour in tours])) for name in ("collisions", "poses"))
    return figures, {"steps": touring.steps, "collisions": collisions, "poses": poses}


def _walked(
    world: World, agent: Agent, scenes: Sequence[Scene], takes: Takes | None, step_limit: int, seed: int
) -> EpisodeTable:
    """An episode to each goal."""
    return run_episodes(
        world, agent, scenes=scenes, takes=takes, episodes_per_target=1, step_limit=step_limit, seed=seed
    )


def drawn_goals(scene: Scene, count: int, seed: int, among: np.ndarray | None = None) -> list[int]:
    """So many distinct poses of a scene's largest part, or `among` some of it, ascending, in its own numbering.

    Raises:
        SceneError: its largest part has no more poses than that, or there are fewer among which they are drawn.
    """
    states = np.flatnonzero(scene.components == 0) if among is None else among
    most = len(states) - (among is None)  # one is left to begin in
    if count > most:
        problem = f"{count} goals asked for, the largest part has {len(states)} poses"
        raise SceneError(scene.name, problem if among is None else f"{problem} for them", f"Ask for {most} at most")
    rng = np.random.default_rng([seed, zlib.crc32(scene.name.encode())])
    return sorted(rng.choice(states, count, replace=False).tolist())


def _figures(world: World, table: EpisodeTable) -> dict[str, GoalFigures]:
    """By scene name."""
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
        told = (None if each is None else each[here] for each in (table.false_arrivals, table.told_arrival))
        figures[name] = GoalFigures(**means, episodes=int(here.sum()), **arrivals(table.reached[here], *told))
    return figures


def arrivals(reached: np.ndarray, false: np.ndarray | None, told: np.ndarray | None) -> dict[str, Any]:
    """Figures of what an agent says of having arrived, none where it says nothing.

    Args:
        reached: (N,) bool, the goal was.
        false: (N,) int, steps elsewhere at which it held that it was there.
        told: (N,) bool, it held so at the goal.
    """
    if false is None or told is None:
        return {}
    return {
        "false_arrivals": float((false > 0).mean()),
        "missed_arrivals": float(1 - told[reached].mean()) if reached.any() else None,
        "success_stopped": float((reached & told & (false == 0)).mean()),
    }
