"""What is named as package.module:name is found in the current folder, by the program as it is installed."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

import clearway
from clearway.scenes.thor_v1 import write_scene
from helpers.documents import ROOT
from helpers.made import corridor_scene

MINE = """
import numpy as np
import clearway
from clearway.reward import Arrival, Reward, Time

dear = Reward("dear", (Time(-0.5), Arrival()))


class Still:
    sees = ()

    def __init__(self, world):
        pass

    def reset(self, target, seed):
        return {"count": np.zeros(len(seed), int)}

    def act(self, observation, state):
        return clearway.Decisions(np.ones_like(state["count"])), state
"""


def answer(folder: Path, *words: object) -> object:
    """What the installed program prints as JSON, run in a folder."""
    done = subprocess.run(
        [str(Path(sys.executable).with_name("clearway")), *map(str, words), "--json"],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(ROOT / "src")},
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with a scene and a module of one's own."""
    (tmp_path / "mine.py").write_text(MINE)
    write_scene(corridor_scene(), tmp_path / "corridor.h5")
    return tmp_path


@pytest.mark.slow
def test_a_reward_of_the_current_folder(folder: Path) -> None:
    (first, *_) = answer(folder, "oracle", "corridor.h5", "--targets", 16, "--reward", "mine:dear")
    assert first["target"] == 16


@pytest.mark.slow
def test_an_agent_of_the_current_folder(folder: Path) -> None:
    path = folder / "corridor.h5"
    clearway.train(path, targets=[16], frames=80, envs=10, rollout_steps=8, width=16, out=folder / "run")
    words = ("--beside", "mine:Still", "--episodes", 2, "--step-limit", 5)
    found = answer(folder, "evaluate", "run", *words)
    assert "mine:Still" in [other["agent"] for other in found["others"]]
