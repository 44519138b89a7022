"""Agents in the rooms themselves, setting after setting; what came of every episode is kept in a file.

Axis letters: K settings, M targets, E episodes a target, J figures (`FIGURES`).
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from clearway.agents.agent import Agent
from clearway.agents.by_pose import RandomWalk
from clearway.agents.on_learnt_map import nearest_picture
from clearway.experiments.plan import NEAREST, RANDOM_WALK, LiveTrial, PlannedRun, targets_by_scene, told_of
from clearway.files import read_kept, written_whole
from clearway.learn.load import load_network
from clearway.learn.network_agent import NetworkAgent
from clearway.live.conditions import Condition
from clearway.live.episodes import STEP_S, LiveProtocol, LiveTable, run_live_episodes
from clearway.live.walks import LiveScene, stages
from clearway.scenes.scene import Scene
from clearway.zones import Zone, scene_zones

FORMAT_VERSION = 1
COLUMNS = ("steps", "reached", "contacts", "least_gap_m", "close_s", "near_s", "collision_zone_steps")
"""What a file keeps of an episode; those of `LiveTable`, and the steps that end in the collision zone."""
FIGURES = ("success", "contacts", "least clearance", "within 10 cm", "within 30 cm", "in the collision zone")
"""Of a target under a setting. Means of its episodes, clearance in metres; the last three are shares of the time."""
DIGITS = 6


def walk_live(path: Path, folder: Path, scenes: Sequence[Scene], run: PlannedRun, trial: LiveTrial) -> None:
    """Walk a run's agent, or another to the run's targets, and write what came of it.

    Args:
        path: the file to write.
        folder: of the run.
        scenes: of the run.
        run, trial: see there.

    Raises:
        ClearwayError: the agent has no network, a scene is none of our rooms, or its encoder cannot be had again.
    """
    targets = targets_by_scene(run.scenes, run.targets)
    protocol = LiveProtocol(trial.episodes_per_target, trial.step_limit, trial.seed, "sampled")
    zones = [scene_zones(scene, run.zone_level) for scene in scenes]
    found: dict[str, list[dict[str, list]]] = {}
    with stages(scenes, targets, run.zone_level) as places:
        agents = _walkers(places, folder, trial)
        for setting in trial.settings:
            tables = [
                run_live_episodes(place.live, place.world, agent, place.camera, setting.perturbations, protocol)
                for place, agent in zip(places, agents, strict=True)
            ]
            found[setting.label] = [
                _columns(table, place.live.scene, own) for table, place, own in zip(tables, places, zones, strict=True)
            ]
    about = told_of(run, trial)
    content = {"format_version": FORMAT_VERSION, "about": about, "settings": found}
    with written_whole(path) as part:
        part.write_text(json.dumps(content, separators=(",", ":")) + "\n", encoding="utf-8")


def _walkers(places: Sequence[LiveScene], folder: Path, trial: LiveTrial) -> list[Agent]:
    """Who walks in each scene."""
    if trial.walker == RANDOM_WALK:
        return [RandomWalk() for _ in places]
    if trial.walker == NEAREST:
        return [nearest_picture(place.world, trial.seed, place.encoder) for place in places]
    network = load_network(folder)
    return [NetworkAgent(network, index, place.encoder) for index, place in enumerate(places)]


def read_live(path: Path, settings: Iterable[Condition], episodes_per_target: int) -> np.ndarray:
    """(K, M, J) what a file says of each setting and target, the targets scene after scene.

    Raises:
        RunError: the file is missing, damaged or of a newer version.
    """
    return read_kept(
        path,
        FORMAT_VERSION,
        lambda content: np.stack([_figures(content["settings"][one.label], episodes_per_target) for one in settings]),
    )


def nearest_poses(scene: Scene, walk: np.ndarray) -> np.ndarray:
    """(T,) int64, the states that places and headings (T, 3) are nearest to: first the place, then the heading.

    Args:
        scene: in the room's coordinates, as the walk is; those of a floor plan's file begin elsewhere.
        walk: metres, metres, degrees.
    """
    away_m2 = ((walk[:, None, :2] - scene.locations_m) ** 2).sum(-1)
    turned_deg = np.abs((walk[:, None, 2] - scene.headings_deg + 180) % 360 - 180)
    return np.lexsort((turned_deg, away_m2.round(DIGITS)), axis=-1)[:, 0]


def _columns(table: LiveTable, scene: Scene, zones: np.ndarray) -> dict[str, list]:
    """What is kept of a scene's episodes, target after target."""
    in_zone = [(zones[nearest_poses(scene, walk[1:])] == Zone.COLLISION).sum() for walk in table.walks]
    columns = {name: getattr(table, name) for name in COLUMNS if hasattr(table, name)}
    columns["collision_zone_steps"] = np.array(in_zone)
    return {name: np.round(columns[name].astype(np.float64), DIGITS).tolist() for name in COLUMNS}


def _figures(scenes: Sequence[Mapping[str, Any]], episodes: int) -> np.ndarray:
    """(M, J) of all scenes under one setting."""
    kept = np.array([np.concatenate([scene[name] for scene in scenes]) for name in COLUMNS], np.float64)
    steps, reached, contacts, least_m, close_s, near_s, zone_steps = kept.reshape(len(COLUMNS), -1, episodes)
    time_s = steps.sum(-1) * STEP_S
    means = [each.mean(-1) for each in (reached, contacts, least_m)]
    return np.stack([*means, close_s.sum(-1) / time_s, near_s.sum(-1) / time_s, zone_steps.sum(-1) / steps.sum(-1)], -1)
