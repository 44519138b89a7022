"""Names that a user chooses from, in a module with few imports so that the command line reads them cheaply."""

import os
from typing import Literal

ZoneLevel = Literal["pose", "cell"]
"""See `clearway.zones`."""

RoomName = Literal["bathroom", "bedroom", "living_room", "kitchen"]
"""See `clearway.rooms`."""

SensorName = Literal["rgb", "depth"]
"""See `clearway.scenes.sensors`."""

BudgetName = Literal["smoke", "paper"]
"""See `clearway.experiments.budget`."""

LearnerName = Literal["paper", "paper-a3c", "default", "own-goals"]
"""See `clearway.experiments.setting`."""

PresetName = Literal["default", "paper", "paper-a3c"]
"""See `clearway.learn.presets`."""

FeatureStore = Literal["memory", "float16", "mapped"]
"""See `clearway.world.feature_store`."""

Goals = Literal["given", "seen"]
"""See `clearway.learn.own_goals`."""

EpisodeTargets = Literal["drawn", "kept"]
"""Whether every episode has a target drawn for it, or an environment keeps that of its first."""

TrackerName = Literal["tensorboard", "wandb"]
"""See `clearway.learn.tracking`."""

MatmulPrecision = Literal["highest", "medium"]
"""See `clearway.model.precision`."""

PlanKind = Literal["room", "flat"]
"""See `clearway.generation`."""

HELD_OUT = "held-out"
"""In place of targets: some that are held out, see `clearway.scenes.targets`."""

MODEL_SUFFIXES = (".xml", ".urdf")
"""Of MuJoCo models' files."""

SplitName = Literal["train", "validation", "test"]
"""See `clearway.generation.split`."""

GENERALIST = "generalist"
"""In place of a run folder: the agent that comes with clearway, see `clearway.agents.generalist`."""


def is_generalist(source: str | os.PathLike[str]) -> bool:
    """Whether the agent that comes with clearway is meant, not a file or folder of this name."""
    return os.fspath(source) == GENERALIST and not os.path.exists(source)


GOALS, GOAL_STEPS = 20, 500  # of evaluations at goals drawn anew: goals of a scene, steps of an episode
