"""Make the shipped example: render and encode the bathroom, train both agents, write all that `shipped` reads.

The agents have the published settings, in which the two rewards differ most (docs/results.md), and a small network
on the leading directions of the features. Pictures go through JPEG first: features, agents and page have the same ones.
"""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from torch import Tensor

from clearway.errors import ClearwayError
from clearway.evaluation.runs import evaluate_runs
from clearway.evaluation.summary import Evaluation
from clearway.examples.shipped import (
    CARD_FILE,
    FORMAT_VERSION,
    PICTURES_FILE,
    RUNS,
    SCENE_FILE,
    decoded,
    file_sum,
    write_pictures,
)
from clearway.files import folder_written_whole, json_text
from clearway.learn.checkpoint import newest_checkpoint, read_network, read_progress, write_checkpoint
from clearway.learn.learner import Learner
from clearway.learn.load import load_agent
from clearway.learn.presets import PAPER_A2C
from clearway.learn.run_folder import METRICS_FILE, RunFolder
from clearway.learn.train import RunRequest, train
from clearway.perception import encode_scenes
from clearway.perception.eyes import NAME as EYES
from clearway.reward import COLLISION_AWARE, SHORTEST, Reward
from clearway.rooms.library import cached_room_scene
from clearway.scenes.scene import Scene
from clearway.scenes.targets import default_targets
from clearway.scenes.thor_v1 import write_scene
from clearway.view.content import jpeg
from clearway.view.episode import Episode
from clearway.view.stage import run_stage
from clearway.view.viewing import Viewing

ROOM, SEED = "bathroom", 0
REWARDS = (SHORTEST, COLLISION_AWARE)
LEARNER = replace(PAPER_A2C, frames=2_000_000, width=128, feature_basis=64)
QUALITY = 82  # of the pictures' JPEG files
SOUGHT = 200  # starts, among which is one where the agents differ


@dataclass(frozen=True)
class Recipe:
    """What an example is made from.

    Attributes:
        scene: with pictures, without features.
        learner: of all agents.
        encoder: by name.
    """

    scene: Scene
    learner: Learner = LEARNER
    encoder: str = EYES


def shipped_recipe(show_progress: bool = False) -> Recipe:
    """Of the example that comes along."""
    return Recipe(cached_room_scene(ROOM, progress=show_progress))


def make_example(recipe: Recipe, out: Path, show_progress: bool = False) -> None:
    """Write the folder that `load_example` reads, whole or not at all.

    Raises:
        ClearwayError: the folder exists and is not empty, or a part cannot be made here.
    """
    with folder_written_whole(out) as folder:
        scene, jpegs = _through_jpeg(recipe.scene)
        (scene,) = encode_scenes([scene], recipe.encoder, progress=show_progress)
        write_scene(replace(scene, observations=None), folder / SCENE_FILE)
        write_pictures(folder / PICTURES_FILE, jpegs)
        for reward in REWARDS:
            _train(scene, recipe.learner, reward, folder / RUNS / reward.name, show_progress)
        runs = [folder / RUNS / reward.name for reward in REWARDS]
        card = {
            "format_version": FORMAT_VERSION,
            "name": scene.name,
            "made_by": [*_commands(scene.name, recipe), "clearway examples --remake DIR does all of it"],
            "agents": _figures(runs, scene),
            "episode": _episode(runs, scene).query(),
            "episode_chosen": "the first by seed in which one agent bumps and the other does not, both arrive",
            "pictures": f"JPEG, quality {QUALITY}",
            "sha256": {
                str(path.relative_to(folder).as_posix()): file_sum(path)
                for path in sorted(folder.rglob("*"))
                if path.is_file()
            },
        }
        (folder / CARD_FILE).write_text(json_text(card))


def _through_jpeg(scene: Scene) -> tuple[Scene, list[bytes]]:
    """The scene with pictures as JPEG leaves them, and the JPEG files."""
    if scene.observations is None:
        raise ClearwayError(f"scene {scene.name}: has no pictures. Give one that has")
    jpegs = [jpeg(scene.observations[state], QUALITY) for state in range(scene.state_count)]
    return replace(scene, observations=np.stack([decoded(one) for one in jpegs]), features=None, encoder=None), jpegs


def _train(scene: Scene, learner: Learner, reward: Reward, out: Path, show_progress: bool) -> None:
    """Train an agent, and keep what it acts by."""
    request = RunRequest([scene], {scene.name: default_targets(scene)}, learner, reward, SEED)
    with tempfile.TemporaryDirectory() as place:
        run = train(request, Path(place) / reward.name, show_progress=show_progress)
        newest, kept = newest_checkpoint(run.checkpoints), RunFolder(out)
        nothing: Mapping[str, Tensor] = {}
        write_checkpoint(kept.checkpoints, read_network(newest), nothing, read_progress(newest))
        kept.write_record(replace(run.read_record(), command=tuple(_training(scene.name, learner, reward).split())))
        shutil.copy(run.metrics_path, out / METRICS_FILE)


def _training(scene: str, learner: Learner, reward: Reward) -> str:
    """The command that trains one of the agents."""
    settings = f"--frames {learner.frames} --set width={getattr(learner, 'width', None)}"
    basis = getattr(learner, "feature_basis", 0)
    return f"clearway train {scene}.h5 --preset paper --reward {reward.name} {settings} --feature-basis {basis}"


def _commands(scene: str, recipe: Recipe) -> list[str]:
    build = f"clearway scenes build --room {scene} --encoder {recipe.encoder} --out {scene}.h5"
    return [f"{build}, its pictures as JPEG", *(_training(scene, recipe.learner, reward) for reward in REWARDS)]


def _figures(runs: list[Path], scene: Scene) -> dict[str, Any]:
    """Steps and collisions of the agents with sampled actions, with intervals, and how many targets are solved."""
    found = evaluate_runs({run.name: load_agent(run) for run in runs}, [scene], seed=SEED)
    return {
        evaluation.agent: _row(evaluation)
        for evaluation in found
        if evaluation.trained is not None and evaluation.protocol.action_selection == "sampled"
    }


def _row(evaluation: Evaluation) -> dict[str, Any]:
    average = evaluation.average
    names = ("steps", "collisions", "spl")
    row: dict[str, Any] = {
        name: [round(float(figure), 4) for figure in (average.values[name], *average.intervals[name])] for name in names
    }
    return {**row, "targets": average.target_count, "failed_targets": len(average.failed_targets), "seed": SEED}


def _episode(runs: list[Path], scene: Scene) -> Episode:
    """Where both arrive, and the first agent bumps and the last does not; any, where there is none."""
    session = Viewing(run_stage(runs, [scene]))
    for seed in range(SOUGHT):
        session.begin(Episode(seed=seed))
        for walker in session.walkers:
            while walker.step() is not None:
                pass
        first, *_, last = (walker.steps[-1] for walker in session.walkers)
        if first.reached and last.reached and first.collisions > last.collisions == 0:
            return replace(session.episode, walks=())
    session.begin(Episode())
    return replace(session.episode, walks=())
