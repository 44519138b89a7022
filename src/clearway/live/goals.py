"""Walks off the grid to goals drawn anew in any rooms, by an agent that is bound to none.

Goals and starts are those of `evaluation.goals`, an episode to each; a goal is reached as any live target is.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np

from clearway.agents.agent import Agent, State
from clearway.agents.named import AgentMaker
from clearway.errors import AgentError
from clearway.evaluation.goals import GoalEvaluation, GoalFigures, arrivals, drawn_goals
from clearway.evaluation.metrics import SC_DETOUR
from clearway.live.conditions import Condition
from clearway.live.episodes import LiveProtocol, LiveTable, check_sight, run_live_episodes
from clearway.live.live_room import MODEL_SOURCE, LiveRoom, check_is_room, check_movable, live_room
from clearway.live.tours import walk_live_tour
from clearway.rooms.detail import taken_fast
from clearway.rooms.render import Camera, studio
from clearway.scenes.scene import Scene
from clearway.scenes.sensors import RGB
from clearway.world.world import World, check_distinct, make_world


@dataclass(frozen=True)
class LiveTouring:
    """How an agent is made by a tour.

    Attributes:
        explorer: who walks the tour, by colour pictures.
        after: makes the agent, by the explorer's state at the end of a tour.
        steps: of the tour.
    """

    explorer: Agent
    after: Callable[[State], Agent]
    steps: int


def walk_to_goals(
    name: str,
    agent: Agent | AgentMaker | LiveTouring,
    scenes: Sequence[Scene],
    settings: Sequence[Condition],
    *,
    goals: int,
    step_limit: int,
    seed: int,
    show: Callable[[str], None] = lambda text: None,
) -> list[GoalEvaluation]:
    """How an agent does under each setting; collisions are contacts.

    Args:
        name: of the agent.
        agent: who walks, by colour pictures; or what makes one for the world of each scene; or how it is made in each
            scene and setting, by a tour of its own.
        scenes: with colour pictures, of rooms that can be built again; distinct names.
        settings: what is changed.
        goals: of each scene.
        step_limit: steps after which an episode has failed.
        seed: of goals, starts and chances.
        show: is told what goes on.

    Raises:
        SceneError: two scenes have one name; one has no pictures, fewer poses than goals, or no room that can be built
            again; or nothing can be moved in it.
        AgentError: the agent, which is named, sees something else than colour pictures, or answers what no agent may.
    """
    wanted = {}
    check_distinct([scene.name for scene in scenes])
    for scene in scenes:  # before what takes long
        check_is_room(scene)
        for setting in settings:
            check_movable(scene.name, setting.perturbations, fixed=scene.made_by.source == MODEL_SOURCE)
        scene.seen_by(RGB)
        wanted[scene.name] = drawn_goals(scene, goals, seed)
    figures: list[dict[str, GoalFigures]] = [{} for _ in settings]
    tours: list[list[int]] = [[] for _ in settings]
    protocol = LiveProtocol(1, step_limit, seed, "sampled")
    for scene in scenes:
        world = make_world([replace(scene, features=None, encoder=None)], {scene.name: wanted[scene.name]})
        with _naming(name):
            here = _made(agent, world)
        show(f"building {scene.name}")
        live = live_room(scene)
        height_px, width_px = scene.seen_by(RGB).shape[1:3]
        lens = live.lens(height_px, width_px, fast=taken_fast(scene.made_by.notes))
        with studio(live.model, lens) as camera, _naming(name):
            for number, setting in enumerate(settings):
                told = f"{setting.label}: {name} in {scene.name}"
                show(told)
                walker = here
                if isinstance(walker, LiveTouring):
                    walker, contacts = _toured(walker, live, camera, setting, seed)
                    tours[number].append(contacts)

                def walking(count: int, told: str = told) -> None:
                    show(f"{told}, {count} episodes walking")

                table = run_live_episodes(live, world, walker, camera, setting.perturbations, protocol, walking)
                figures[number][scene.name] = _figures(table)
    return [
        GoalEvaluation(
            name,
            figures[number],
            perturbed={"label": setting.label, "perturbations": setting.perturbations.to_json()},
            tour=_told(agent, tours[number]) if isinstance(agent, LiveTouring) else None,
        )
        for number, setting in enumerate(settings)
    ]


def _made(agent: Agent | AgentMaker | LiveTouring, world: World) -> Agent | LiveTouring:
    """Who walks in a world, or how it is made by a tour. Raises AgentError where it sees more than a camera does."""
    if isinstance(agent, LiveTouring):
        return agent
    walker = agent if isinstance(agent, Agent) else agent(world)
    check_sight(walker)
    return walker


@contextmanager
def _naming(name: str) -> Iterator[None]:
    """Say of what an agent does wrong that it was this one."""
    try:
        yield
    except AgentError as fault:
        raise AgentError(f"{name}: {fault}") from fault


def _toured(touring: LiveTouring, live: LiveRoom, camera: Camera, setting: Condition, seed: int) -> tuple[Agent, int]:
    """The agent that knows a room, and contacts of its tour."""
    tour = walk_live_tour(live, touring.explorer, camera, setting.perturbations, steps=touring.steps, seed=seed)
    return touring.after(tour.state), tour.contacts


def _told(touring: LiveTouring, contacts: Sequence[int]) -> dict[str, float]:
    """What tours of so many contacts each came to."""
    return {"steps": touring.steps, "collisions": float(np.mean(contacts))}


def _figures(table: LiveTable) -> GoalFigures:
    """Means over episodes."""
    success_4x = table.reached & (table.steps <= SC_DETOUR * table.shortest_path_steps)
    spl = table.reached * table.shortest_path_steps / np.maximum(table.steps, table.shortest_path_steps)
    return GoalFigures(
        success=float(table.reached.mean()),
        success_4x=float(success_4x.mean()),
        spl=float(spl.mean()),
        collisions=float(table.contacts.mean()),
        steps=float(table.steps.mean()),
        episodes=len(table),
        **arrivals(table.reached, table.false_arrivals, table.told_arrival),
    )
