"""Agents that learn nothing but where random walkers were led, on the trials of other experiments' agents."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from clearway.agents.on_learnt_map import (
    MOST_A_POSE,
    WALKERS,
    MapPlanner,
    frames_of,
    nearest_pictures,
    seen_by_walkers,
)
from clearway.evaluation.episodes import run_episodes
from clearway.evaluation.metrics import by_target
from clearway.experiments.groups import Scores
from clearway.experiments.kept import keep, kept
from clearway.experiments.plan import NEAREST, Trial
from clearway.experiments.setting import Setting
from clearway.world.world import World

FILE = "memory.json"
PLANNER = "planner on a learnt map"
FRAMES_A_POSE = (1, 2, 4, 8, 16, 32, MOST_A_POSE)
"""Frames that the walkers take, for every pose of the scenes."""
ABOUT_MAPS = (
    f"Maps hold where the actions of {WALKERS} random walkers led, in so many frames of all together. The {PLANNER} "
    f"takes shortest ways over them and is told its pose; '{NEAREST}' is told its picture, and holds that it stands "
    "where the most similar one was taken. Where no way is known both act at random. Their seeds are the walkers'."
)


@dataclass(frozen=True)
class Mapped:
    """Agents of one kind on maps of so many frames.

    Attributes:
        agent: its kind.
        frames: of all walkers together.
        scores: on a trial's targets, a seed of walkers each.
        exact: for each seed, the share of starts from which the way to a target, of those known, is a shortest one.
    """

    agent: str
    frames: int
    scores: Scores
    exact: tuple[float, ...]

    @property
    def called(self) -> tuple[str, str]:
        """What stands for a learner and its agent in a table."""
        return self.agent, f"{self.frames:,} frames"


def on_maps(setting: Setting, trial: Trial, frames_a_pose: Sequence[int] = FRAMES_A_POSE[-1:]) -> Iterator[Mapped]:
    """Both agents on maps, of every number of frames; what was found before is read from its file.

    Args:
        setting: gives the scenes, and the walkers' seeds.
        trial: what the agents are tried on.
        frames_a_pose: some of `FRAMES_A_POSE`.
    """
    path = setting.out / FILE
    question = {"scenes": {file.name: file.digest for file in setting.files}}
    known: dict[str, dict] = kept(path, question, "found") or {}
    world = setting.world(trial.targets)
    for factor in frames_a_pose:
        frames = frames_of(world, factor)
        for kind in (PLANNER, NEAREST):
            found = []
            for seed in setting.seeds:
                key = json.dumps([trial.name, kind, frames, seed])
                if key not in known:
                    known = {**known, key: _tried(world, trial, kind, frames, seed)}
                    known |= kept(path, question, "found") or {}  # a report may be written beside a reproduction
                    keep(path, question, {"found": known})
                found.append(known[key])
            yield _mapped(kind, frames, setting.seeds, found)


def on_maps_of_room(room: Setting) -> Iterator[Mapped]:
    """Both agents on a map of a setting's only scene, with as many frames a pose as `on_maps`; nothing is kept."""
    world, trial = room.world(), room.trial()
    frames = frames_of(world, MOST_A_POSE)
    for kind in (PLANNER, NEAREST):
        yield _mapped(kind, frames, room.seeds, [_tried(world, trial, kind, frames, seed) for seed in room.seeds])


def _mapped(kind: str, frames: int, seeds: tuple[int, ...], found: Sequence[dict]) -> Mapped:
    """Of each seed what `_tried` found."""
    scores = Scores(seeds, np.array([each["scores"] for each in found]))
    return Mapped(kind, frames, scores, tuple(each["exact"] for each in found))


def _tried(world: World, trial: Trial, kind: str, frames: int, seed: int) -> dict:
    """Figures of one agent on targets, and the share of exactly shortest ways."""
    seen = seen_by_walkers(world, frames, seed)
    if kind == PLANNER:
        planner = MapPlanner(seen)
    else:
        assert world.features is not None, "scenes of an experiment have features"
        planner = MapPlanner(seen, nearest_pictures(seen, world.features.float().cpu().numpy()))
    table = run_episodes(
        world,
        planner,
        episodes_per_target=trial.episodes_per_target,
        step_limit=trial.step_limit,
        seed=trial.seed,
    )
    target = np.repeat(world.target_state.cpu().numpy(), world.start_count.cpu().numpy())
    held = planner.steps_to_go[world.start_state.cpu().numpy(), target]
    return {
        "scores": by_target(table, world.target_count).tolist(),
        "exact": float((held == world.start_steps.cpu().numpy()).mean()),
    }
