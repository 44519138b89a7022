"""A small package that offers one of each kind, as it lies in site-packages once installed."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from helpers.documents import ROOT

MODULE = '''
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np

from clearway.agents.agent import Decisions
from clearway.experiments.experiment import Experiment
from clearway.experiments.groups import all_jobs, compared
from clearway.experiments.section import ReportTable, Section
from clearway.learn.q_learning import QLearning
from clearway.reward import SHORTEST, Arrival, Reward, Time
from clearway.scenes.thor_v1 import read_scene


class MeanColour:
    """Mean colour of the picture's quarters."""

    identity = "mean-colour-1"
    feature_count = 12

    def encode(self, pictures):
        height, width = pictures.shape[1] // 2, pictures.shape[2] // 2
        quarters = [pictures[:, y : y + height, x : x + width] for y in (0, height) for x in (0, width)]
        return np.concatenate([quarter.mean((1, 2)) for quarter in quarters], axis=1) / 255


def read_pair(path: Path):
    """Two scenes of a text file that names a scene file."""
    file = path.parent / path.read_text().strip()
    for name in ("left", "right"):
        scene = read_scene(file, name=name)
        yield type(scene)(**{**vars_of(scene), "features": None, "encoder": None})


def vars_of(scene):
    return {field: getattr(scene, field) for field in scene.__dataclass_fields__}


DEAR = Reward("dear", (Time(-0.5), Arrival()))


class Still:
    """Turns on the spot."""

    sees = ()

    def __init__(self, world):
        pass

    def reset(self, target, seed):
        return {"row": seed}

    def act(self, observation, state):
        return Decisions(np.full(len(state["row"]), 1)), state


@dataclass(frozen=True)
class Hasty(QLearning):
    """Q-learning that explores for ever."""

    algorithm: ClassVar[str] = "hasty"
    explore_end: float = 0.5


def of_shortest(setting):
    return compared(setting, (SHORTEST,))


def section(setting):
    table = ReportTable("twice_seeds", "Seeds", ("seed",), tuple((seed,) for seed in setting.seeds))
    return Section("twice", "Twice", "One reward.", (table,))


TWICE = Experiment(lambda setting: all_jobs(of_shortest(setting)), section)
'''

ENTRY_POINTS = """
[clearway.encoders]
mean-colour = tiny_plugins:MeanColour

[clearway.rewards]
dear = tiny_plugins:DEAR

[clearway.agents]
still = tiny_plugins:Still

[clearway.importers]
pair = tiny_plugins:read_pair

[clearway.algorithms]
hasty = tiny_plugins:Hasty

[clearway.experiments]
twice = tiny_plugins:TWICE
"""


def write_package(
    folder: Path,
    *,
    package: str = "tiny-plugins",
    version: str = "1.2",
    module: str = MODULE,
    entry_points: str = ENTRY_POINTS,
) -> Path:
    """Write the package and its metadata into a folder for the path."""
    name = package.replace("-", "_")
    metadata = folder / f"{name}-{version}.dist-info"
    metadata.mkdir(parents=True)
    (metadata / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: {version}\n")
    (metadata / "entry_points.txt").write_text(entry_points)
    (folder / f"{name}.py").write_text(module)
    return folder


def clearway_with(*packages: Path, words: tuple[object, ...], cache: Path) -> subprocess.CompletedProcess[str]:
    """Run the command line in a process that has these folders of packages on its path."""
    places = os.pathsep.join(map(str, (ROOT / "src", *packages)))
    return subprocess.run(
        [sys.executable, "-m", "clearway", *map(str, words)],
        env={**os.environ, "PYTHONPATH": places, "CLEARWAY_CACHE": str(cache), "COLUMNS": "200"},
        capture_output=True,
        text=True,
        timeout=120,
    )
